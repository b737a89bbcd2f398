"""Packages that only some models need, and the extra that brings each of them."""

from __future__ import annotations

import importlib
from typing import Any

from goalscope.types import ModelError

__all__ = ["EXTRAS", "package"]

EXTRAS = {
    **dict.fromkeys(("httpx2", "tokenizers", "huggingface-hub"), "remote"),
    **dict.fromkeys(("torch", "transformers", "llguidance"), "torch"),
}
"""The extra of each package, by the name under which it is installed."""


def package(module: str) -> Any:
    """A module of one of `EXTRAS`.

    Raises:
        ModelError: Its package is missing, or broken; says what to install.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        extra = EXTRAS[module.partition(".")[0].replace("_", "-")]
        raise ModelError(
            f'This model needs more packages ({error}). Run `pip install "goalscope[{extra}]"`.'
        ) from None
