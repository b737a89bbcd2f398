"""With what a cell was measured: code, prompts and models, as short hashes."""

from __future__ import annotations

import hashlib
import importlib.metadata
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import goalscope
from goalscope.models import OpenModel
from goalscope.models.opening import MODEL_KEYS, model_label, open_model

__all__ = ["identity_of", "opened"]

_SHOWN = ("cli", "display", "plain", "terminal", "report", "stats", "datasets", "experiment")
"""Modules, by how their names begin, that do not take part in the measuring of a cell."""

_WORK = Path("experiment", "work.py")
"""The one of them that does."""


@cache
def _opened(names: tuple[str | None, ...]) -> OpenModel:
    return open_model(**dict(zip(MODEL_KEYS, names, strict=True)))


def opened(model: Mapping[str, Any]) -> OpenModel:
    """The model of a cell, opened once in each process."""
    return _opened(tuple(model.get(key) for key in MODEL_KEYS))


def identity_of(models: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Hashes of the code, of the prompts, and of each model (which is opened for it)."""
    root = Path(goalscope.__file__).parent
    code = [
        root / file
        for file in sorted(each.relative_to(root) for each in root.rglob("*"))
        if file.suffix in (".py", ".csv", ".toml")
        and (file == _WORK or not file.parts[0].startswith(_SHOWN))
    ]
    found = {
        "version": importlib.metadata.version("goalscope"),
        "code": _digest(tuple(code)),
        "prompts": _digest(tuple(sorted(root.rglob("*.jinja")))),
    }
    for model in models:
        fingerprint = opened(model).fingerprint
        name, value = f"model {model_label(model)}", _short(fingerprint)
        found[name if found.get(name, value) == value else f"{name} {value}"] = value
    return found


@cache
def _digest(files: tuple[Path, ...]) -> str:
    return _short("".join(f"{file.name} {_short(file.read_bytes())}\n" for file in files))


def _short(content: str | bytes) -> str:
    data = content.encode() if isinstance(content, str) else content
    return hashlib.sha256(data).hexdigest()[:12]
