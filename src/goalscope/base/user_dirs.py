"""Where goalscope keeps what belongs to a user."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import platformdirs

NOWHERE = Path(os.devnull, "HOME is not set")
"""The home of a user who has none: nothing is there, and nothing can be written there."""


def user_cache() -> Path:
    """For what can be worked out again."""
    return _or_nowhere(lambda: platformdirs.user_cache_path("goalscope"))


def user_data() -> Path:
    """For what a user made."""
    return _or_nowhere(lambda: platformdirs.user_data_path("goalscope", False))


def _or_nowhere(found: Callable[[], Path]) -> Path:
    try:
        return found()
    except RuntimeError:  # neither HOME nor the system's list of users has it
        return NOWHERE
