"""Fixtures that tests share."""

from __future__ import annotations

import pytest

from goalscope.models.llamacpp import LlamaCpp


@pytest.fixture(scope="session")
def model() -> LlamaCpp:
    """The embedded model."""
    return LlamaCpp()
