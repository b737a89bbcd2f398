"""Read experiments from TOML files; errors suggest the nearest known key or value."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast, get_args

from goalscope.agent.agent import Method
from goalscope.agent.people import Habit
from goalscope.agent.settings import Domain
from goalscope.base.inputs import nearest, read_table, refuse_unknown, shown
from goalscope.base.types import InvalidInputError
from goalscope.belief.calibration import NAMED, calibration_named
from goalscope.belief.likelihood import Layout
from goalscope.experiment.plan import (
    DialoguesPart,
    EpisodesPart,
    Experiment,
    Judge,
    Model,
    QuestionsPart,
)
from goalscope.models.adapters import NO_ADAPTER
from goalscope.models.opening import MODEL_KEYS

__all__ = ["EMBEDDED", "read_experiment"]

EMBEDDED = "embedded"
"""The name of the embedded model in a file."""


def read_experiment(file: Path) -> Experiment:
    """Read an experiment from a TOML file.

    Raises:
        InvalidInputError: The file cannot be read, or has an unknown key or value; the message
            names the place and the nearest known one.
    """
    table = read_table(file)
    label = file.name
    known = ("title", "source", "models", "mcq", "dialogues", "episodes", "judge")
    refuse_unknown(table, known, label)
    models = _models(table.get("models", EMBEDDED), label, file.parent)
    parts: dict[str, tuple[Any, ...]] = {}
    for key, kind in (
        ("mcq", QuestionsPart),
        ("dialogues", DialoguesPart),
        ("episodes", EpisodesPart),
    ):
        given: object = table.get(key, [])
        if not isinstance(given, dict | list):
            raise InvalidInputError(f"{label}: '{key}' must be a table: [{key}] or [[{key}]].")
        found = cast("list[object]", given if isinstance(given, list) else [given])
        read = (_part(kind, row, f"{label}, [{key}]", file.parent) for row in found)
        parts[key] = tuple(_found(part, file.parent) for part in read)
    if not any(parts.values()):
        raise InvalidInputError(
            f"{label}: there is nothing to measure. Add a table [mcq], [dialogues] or [episodes]."
        )
    judge = Judge(trials=0)
    if "judge" in table:
        row = dict(_table(table["judge"], f"{label}, [judge]"))
        refuse_unknown(row, [each.name for each in fields(Judge)], f"{label}, [judge]")
        chosen = row.pop("model", None)
        judge = _part(Judge, row, f"{label}, [judge]", file.parent)
        if chosen is not None:
            judge = replace(judge, model=_model(chosen, f"{label}, [judge]", file.parent))
        if not parts["episodes"]:
            raise InvalidInputError(f"{label}: a [judge] scores episodes. Add [episodes].")
    return Experiment(
        file.stem,
        _text(table.get("title", file.stem), f"{label}: 'title'"),
        _text(table.get("source", ""), f"{label}: 'source'"),
        models,
        parts["mcq"],
        parts["dialogues"],
        parts["episodes"],
        judge,
    )


def _models(value: object, label: str, folder: Path) -> tuple[Model, ...]:
    values = cast("list[object]", value if isinstance(value, list) else [value])
    if not values:
        raise InvalidInputError(f"{label}: 'models' must hold at least one model.")
    return tuple(_model(each, f"{label}, models", folder) for each in values)


def _model(value: object, label: str, folder: Path) -> Model:
    row = {"model": value} if isinstance(value, str) and value else value
    if not isinstance(row, dict):
        raise InvalidInputError(
            f"{label}: a model must be a name or a table, such as {EMBEDDED!r}, not {shown(value)}."
        )
    row = cast("dict[str, Any]", row)
    refuse_unknown(row, MODEL_KEYS, label)
    named = {key: _text(each, f"{label}: {key!r}") for key, each in row.items()}
    return {
        key: name if key == "adapter" and name == NO_ADAPTER else _place(name, folder)
        for key, name in named.items()
        if name != EMBEDDED
    }


_CHOICES: Mapping[str, Sequence[str]] = {
    "methods": get_args(Method),
    "humans": ("scripted", "simulated", *get_args(Habit)),
    "layouts": get_args(Layout),
}
_LEAST = {"limit": 1, "turns": 1, "goals": 2, "change": 2, "rounds": 1, "trials": 1, "k": 1}


def _part(kind: type[Any], value: object, label: str, folder: Path) -> Any:
    """A part of the experiment from its table; values are checked by the type of their fields."""
    row = _table(value, label)
    known = {each.name: str(each.type) for each in fields(kind) if each.name != "model"}
    refuse_unknown(row, tuple(known), label)
    read = {
        key: _models(each, label, folder)
        if key == "models"
        else _value(key, each, known[key], f"{label}: {key!r}")
        for key, each in row.items()
    }
    try:
        return kind(**read)
    except TypeError:
        needed = next(name for name in known if name not in read)
        raise InvalidInputError(f"{label}: the key {needed!r} is missing.") from None


def _value(key: str, value: object, kind: str, label: str) -> Any:
    if kind.startswith("tuple"):
        entries = cast("list[object]", value) if isinstance(value, list) else [value]
        if not entries:
            raise InvalidInputError(f"{label} must not be empty.")
        one = "int" if "int" in kind else "str"
        return tuple(_value(key, entry, one, label) for entry in entries)
    if kind == "bool":
        if not isinstance(value, bool):
            raise InvalidInputError(f"{label} must be true or false, not {shown(value)}.")
        return value
    if kind.startswith("int"):
        if isinstance(value, bool) or not isinstance(value, int):
            raise InvalidInputError(f"{label} must be a whole number, not {shown(value)}.")
        least = _LEAST.get(key, 0)
        if not least <= value < 1e9:
            raise InvalidInputError(
                f"{label} must be at least {least}, and below a billion, not {shown(value)}."
            )
        return value
    if kind == "float":
        if type(value) not in (int, float) or not 0 <= cast("float", value) <= 2:
            raise InvalidInputError(f"{label} must be a number from 0 to 2, not {shown(value)}.")
        return float(cast("float", value))
    if kind.startswith("Trigger"):
        if value != "paper" and not (type(value) in (int, float) and 0 <= cast("float", value) < 1):
            raise InvalidInputError(
                f'{label} must be a probability below 1, or "paper", not {shown(value)}.'
            )
        return value
    text = _text(value, label)
    if key in _CHOICES and text not in _CHOICES[key]:
        raise InvalidInputError(
            f"{label}: {shown(text)} is unknown; {nearest(text, _CHOICES[key])}"
        )
    return text


def _text(value: object, label: str) -> str:
    if not isinstance(value, str):
        raise InvalidInputError(f"{label} must be a text, not {shown(value)}.")
    return value


def _table(value: object, label: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise InvalidInputError(f"{label} must be a table, not {shown(value)}.")
    return cast("dict[str, Any]", value)


def _found(part: Any, folder: Path) -> Any:
    """A part with full paths, so that its files are found from any folder."""
    names = {key: getattr(part, key, None) for key in ("people", "catalogue", "scene")}
    found: dict[str, Any] = {key: _place(name, folder) for key, name in names.items() if name}
    if own := getattr(part, "likelihood", None):
        file, _, function = str(own).rpartition(":")
        found["likelihood"] = f"{_place(file, folder)}:{function}"
    if isinstance(part, EpisodesPart):
        if part.domain not in get_args(Domain):
            found["domain"] = _place(part.domain, folder)
            if not found["domain"].endswith(".py"):
                raise InvalidInputError(
                    f"'domain': {shown(part.domain)} is unknown; "
                    f"{nearest(part.domain, get_args(Domain))} Or name a Python file."
                )
        found["calibrations"] = tuple(
            name if name in NAMED else _place(name, folder) for name in part.calibrations
        )
        for name in found["calibrations"]:
            calibration_named(name)  # an unknown one is refused now
    return replace(part, **found)


def _place(name: str, folder: Path) -> str:
    """The full path of a file or folder next to the TOML file, or here; other names unchanged."""
    name = os.path.expanduser(name)
    return next(
        (str(each.absolute()) for each in (folder / name, Path(name)) if os.path.exists(each)), name
    )
