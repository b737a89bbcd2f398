"""Where goalscope keeps what belongs to a user."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

NOWHERE = Path(os.devnull, "HOME is not set")
"""The home of a user who has none: nothing is there, and nothing can be written there."""


def user_data() -> Path:
    """For what a user made; nothing is kept that could be worked out again."""
    try:
        return platformdirs.user_data_path("goalscope", False)
    except RuntimeError:  # neither HOME nor the system's list of users has it
        return NOWHERE
