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
from goalscope.models.opening import open_model

__all__ = ["MODEL_KEYS", "identity_of", "label_of", "opened"]

MODEL_KEYS = ("model", "generator", "scorer", "tokenizer", "calls")
"""Arguments of `open_model` that name a model."""

_SHOWN = ("cli", "display", "plain", "terminal", "report", "experiment", "stats", "datasets")
"""Modules, by how their names begin, that do not take part in the measuring of a cell."""


@cache
def _opened(names: tuple[str | None, ...]) -> OpenModel:
    return open_model(**dict(zip(MODEL_KEYS, names, strict=True)))


def opened(model: Mapping[str, Any]) -> OpenModel:
    """The model of a cell, opened once in each process."""
    return _opened(tuple(model.get(key) for key in MODEL_KEYS))


def label_of(model: Mapping[str, Any]) -> str:
    """The model's name for tables: of files and folders only the last part."""
    writer, scorer = (model.get(key) or model.get("model") for key in ("generator", "scorer"))
    names = dict.fromkeys(_short(name) for name in (writer, scorer))
    return " + ".join(names)


def identity_of(models: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Hashes of the code, of the prompts, and of each model (which is opened for it)."""
    root = Path(goalscope.__file__).parent
    code = [
        file
        for file in sorted(root.rglob("*"))
        if file.suffix in (".py", ".csv", ".toml")
        and not file.relative_to(root).parts[0].startswith(_SHOWN)
    ]
    found = {
        "version": importlib.metadata.version("goalscope"),
        "code": _digest(code),
        "prompts": _digest(sorted(root.rglob("*.jinja"))),
    }
    for model in models:
        fingerprint = opened(model).fingerprint
        found[f"model {label_of(model)}"] = hashlib.sha256(fingerprint.encode()).hexdigest()[:12]
    return found


@cache
def _digest_of(files: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


def _digest(files: Iterable[Path]) -> str:
    return _digest_of(tuple(files))


def _short(name: str | None) -> str:
    if name is None:
        return "SmolLM2-135M-Instruct"
    if name.startswith(("http://", "https://")):
        return name.partition("#")[2] or name
    return Path(name.removeprefix("hf:")).name.removesuffix(".gguf")
