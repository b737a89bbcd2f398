"""Optional packages, and the extra that installs each of them."""

from __future__ import annotations

import importlib
from typing import Any

from goalscope.base.types import GoalscopeError, ModelError

EXTRAS = {
    **dict.fromkeys(("httpx2", "huggingface-hub", "openai"), "remote"),
    **dict.fromkeys(("torch", "transformers", "peft"), "torch"),
    **dict.fromkeys(("bm25s", "matplotlib", "scikit-learn", "scipy"), "experiments"),
    **dict.fromkeys(("fastapi", "uvicorn"), "web"),
    "mcp": "mcp",
    "psycopg": "postgres",
}
"""The extra of each package, by the name under which it is installed."""


def package(
    module: str, needs: str = "This model needs", error: type[GoalscopeError] = ModelError
) -> Any:
    """A module of one of `EXTRAS`.

    Args:
        module: Its name.
        needs: How the message of the error begins.
        error: The kind of error.

    Raises:
        GoalscopeError: Its package is missing, or broken; says what to install.
    """
    try:
        return importlib.import_module(module)
    except ImportError as cause:
        name = module.partition(".")[0].replace("_", "-")
        extra = EXTRAS[{"sklearn": "scikit-learn"}.get(name, name)]
        raise error(f"{needs} more packages ({cause}). Run {remedy(extra)}.") from None


def remedy(extra: str) -> str:
    """What to run for the packages of an extra: in a clone, and with a released package."""
    return (
        f'`pip install ".[{extra}]"` in a clone of its repository, or `pip install '
        f'"goalscope[{extra}]"` if you have a released package'
    )
