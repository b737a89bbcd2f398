"""Fixtures that tests share."""

from __future__ import annotations

import pytest
from hypothesis import settings

from goalscope.models.llamacpp import LlamaCpp
from servers import (  # noqa: F401
    exact_gguf,
    llama_cpp_python_address,
    llama_server,
    llama_server_address,
)

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


@pytest.fixture(scope="session")
def model() -> LlamaCpp:
    """The embedded model."""
    return LlamaCpp()
