"""What a cell was measured with: code, prompts, models and files, as short hashes."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any, get_args

import goalscope
from goalscope.agent.settings import Domain, Settings
from goalscope.base.types import Profile
from goalscope.models.opening import MODEL_KEYS, ModelSet, model_label, open_model

__all__ = ["hashes_of", "identity_of", "opened", "own_identity", "person_of"]

_SHOWN = (
    *("cli", "display", "report"),
    *("stats", "datasets", "experiment", "fitting", "calibrating", "why"),
)
"""Prefixes of modules that do not affect the results."""

_WORK = Path("experiment", "work.py")
"""The exception."""


_open: dict[str, ModelSet] = {}
_fingerprints: dict[str, str] = {}


def opened(model: Mapping[str, Any]) -> ModelSet:
    """The model of a cell, kept open until another one is opened."""
    key = _key(model)
    if key not in _open:
        for other in list(_open):
            _open.pop(other).close()
        names: dict[str, Any] = {name: model.get(name) for name in MODEL_KEYS}
        _open[key] = open_model(**names)
    return _open[key]


def identity_of(model: Mapping[str, Any]) -> dict[str, str]:
    """Short hashes of the version, the code, the prompts and the model, which is opened for it."""
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


def person_of(profile: Profile) -> dict[str, Any]:
    """The whole profile as JSON: part of a cell, so that editing a person makes a new cell."""
    return json.loads(json.dumps(asdict(profile)))


def hashes_of(settings: Settings) -> dict[str, str]:
    """Hashes of the files named in the settings: domain, catalogue and so on.

    Not of the file of people, of whom a cell holds its own (see `person_of`).
    """
    own = settings.likelihood.rpartition(":")[0] if settings.likelihood else None
    named = {
        "domain": None if settings.domain in get_args(Domain) else settings.domain,
        "likelihood": own,
        "catalogue": settings.catalogue,
        "scene": settings.scene,
        "calibration": settings.calibration,
    }
    return {
        key: _short(Path(file).read_bytes())
        for key, file in named.items()
        if file and os.path.isfile(file)
    }


def _key(model: Mapping[str, Any]) -> str:
    return json.dumps(dict(model), sort_keys=True)


def _short(content: str | bytes) -> str:
    data = content.encode() if isinstance(content, str) else content
    return hashlib.sha256(data).hexdigest()[:12]
