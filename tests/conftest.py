"""Fixtures that tests share."""

from __future__ import annotations

import pytest

from goalscope.models.llamacpp import LlamaCpp
from servers import (  # noqa: F401
    exact_gguf,
    llama_cpp_python_address,
    llama_server,
    llama_server_address,
)


@pytest.fixture(scope="session")
def model() -> LlamaCpp:
    """The embedded model."""
    return LlamaCpp()
