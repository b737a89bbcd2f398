"""The calibrations of models: those that ship with goalscope, and the user's own."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, cast

from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.base.user_dirs import user_data
from goalscope.belief.calibration import (
    DEFAULT,
    LAST_TURN,
    PAPER,
    Calibration,
    calibration_from_json,
)
from goalscope.models import model_name
from goalscope.prompts import render

__all__ = [
    "NAMED",
    "SHIPPED",
    "YOURS",
    "calibration_file",
    "calibration_named",
    "keep_calibration",
    "known_calibration",
    "own_calibrations",
]

NAMED = {"paper": PAPER, "default": DEFAULT, "last-turn": LAST_TURN}
"""The named calibrations."""

YOURS, SHIPPED = "yours", "shipped with goalscope"
"""The origins that `known_calibration` returns."""


def calibration_named(name: str) -> Calibration:
    """The calibration with a name ("paper", "default", "last-turn"), or from a file.

    Raises:
        InvalidInputError: There is no such name or file, or the file is not a calibration.
    """
    if name in NAMED:
        return NAMED[name]
    file = Path(name)
    if not file.is_file():
        raise InvalidInputError(
            f"There is no calibration {name!r}. Name {', '.join(NAMED)}, or a file written by "
            "`goalscope calibrate`."
        )
    return _read(file)


def known_calibration(scorer: Any, layout: str, *, end_of_turn: bool) -> tuple[Calibration, str]:
    """The calibration of a model, and its origin.

    The user's own comes first, then the one that ships with goalscope, then `DEFAULT`.

    Args:
        scorer: The model that scores people's words.
        layout: Where the prompt states the goal.
        end_of_turn: Whether the end of the utterance is scored.

    Raises:
        InvalidInputError: The file is broken.
    """
    own = calibration_file(scorer, layout, end_of_turn=end_of_turn)
    shipped = files(__name__) / own.name
    for place in (own, shipped):
        if place.is_file():
            return _read(place), YOURS if place is own else SHIPPED
    return DEFAULT, "not calibrated; see `goalscope calibrate`"


def calibration_file(scorer: Any, layout: str, *, end_of_turn: bool) -> Path:
    """The file of the user's calibration of a model with its adapter and prompt.

    Its name depends on the model's name (the format of the weights matters little), and on the
    contents of the prompt and the adapter.
    """
    chat = render(layout.replace("-", "_"), task="T", goal="G", query="Q")
    adapter: Path | None = getattr(scorer, "adapter", None)
    facts = [
        model_name(scorer),
        hashlib.sha256(adapter.read_bytes()).hexdigest() if adapter else None,
        [[each.role, each.content] for each in chat],
        end_of_turn,
    ]
    key = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]
    return _folder() / f"{key}.json"


def own_calibrations() -> dict[Path, dict[str, Any]]:
    """The user's own calibrations: each file with its JSON, {} if it is broken."""
    found: dict[Path, dict[str, Any]] = {}
    for file in sorted(_folder().glob("*.json")):
        try:
            about = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            about = None
        found[file] = cast("dict[str, Any]", about) if isinstance(about, dict) else {}
    return found


def _folder() -> Path:
    return user_data() / "calibrations"


def keep_calibration(file: Path, calibration: Calibration, about: Mapping[str, Any]) -> None:
    """Write a calibration, with further JSON entries.

    Raises:
        GoalscopeError: The file cannot be written.
    """
    text = json.dumps({**about, "calibration": asdict(calibration)}, indent=1)
    part = file.with_name(f".{file.name}.part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text + "\n", encoding="utf-8")
        part.replace(file)
    except OSError as error:
        raise GoalscopeError(f"Cannot write {file}: {error.strerror or error}.") from None


def _read(file: Path | Traversable) -> Calibration:
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(data, dict):
            raise TypeError("it is not a JSON object")
        return calibration_from_json(cast("dict[str, Any]", data)["calibration"])
    except (
        OSError,
        ArithmeticError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        RecursionError,
    ) as error:
        missing = isinstance(error, KeyError)
        cause = f"the key {error} is missing" if missing else str(error)
        cause = cause if cause.isprintable() else ascii(cause)
        raise InvalidInputError(
            f"{file} is not a calibration ({cause}). Delete it, name another file, or write "
            "one with `goalscope calibrate --out FILE`."
        ) from None
