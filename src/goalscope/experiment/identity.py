"""With what a cell was measured: code, prompts and models, as short hashes."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import goalscope
from goalscope.models import OpenModel
from goalscope.models.opening import MODEL_KEYS, model_label, open_model

__all__ = ["identity_of", "opened", "own_identity"]

_SHOWN = (
    *("cli", "display", "plain", "terminal", "report"),
    *("stats", "datasets", "experiment", "fitting", "calibrating", "why"),
)
"""Modules, by how their names begin, that do not take part in the measuring of a cell."""

_WORK = Path("experiment", "work.py")
"""The one of them that does."""


_open: dict[str, OpenModel] = {}
_fingerprints: dict[str, str] = {}


def opened(
    model: Mapping[str, Any], report: Callable[[str, float], object] | None = None
) -> OpenModel:
    """The model of a cell; it stays open until another one is asked for.

    `report` is told what a first use tries, as by `open_model`.
    """
    key = _key(model)
    if key not in _open:
        for other in list(_open):
            _open.pop(other).close()
        names = {name: model.get(name) for name in MODEL_KEYS}
        _open[key] = open_model(**names, report=report)
    return _open[key]


def identity_of(model: Mapping[str, Any]) -> dict[str, str]:
    """Short hashes of the version, the code, the prompts, and the model (opened once for it)."""
    key = _key(model)
    if key not in _fingerprints:
        _fingerprints[key] = _short(opened(model).fingerprint)
    label = f"model {model_label(model)}"
    return {**own_identity(), f"{label} #{_short(key)[:4]}" if model else label: _fingerprints[key]}


@cache
def own_identity() -> dict[str, str]:
    """The version of goalscope, and short hashes of its code and prompts."""
    root = Path(goalscope.__file__).parent
    files = sorted(each.relative_to(root) for each in root.rglob("*"))
    code = [
        file
        for file in files
        if (file.suffix in (".py", ".csv", ".toml") or file.match("calibrations/*.json"))
        and (file == _WORK or not file.parts[0].startswith(_SHOWN))
    ]
    prompts = [file for file in files if file.suffix == ".jinja"]

    def digest(own: Iterable[Path]) -> str:
        return _short("".join(f"{f.name} {_short((root / f).read_bytes())}\n" for f in own))

    version = importlib.metadata.version("goalscope")
    return {"version": version, "code": digest(code), "prompts": digest(prompts)}


def _key(model: Mapping[str, Any]) -> str:
    return json.dumps(dict(model), sort_keys=True)


def _short(content: str | bytes) -> str:
    data = content.encode() if isinstance(content, str) else content
    return hashlib.sha256(data).hexdigest()[:12]
