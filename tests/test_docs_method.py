"""docs/method.md names what exists, and its numbers are those of the code."""

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from goalscope.belief.calibration import DEFAULT, PAPER

PAGE = (Path(__file__).parents[1] / "docs" / "method.md").read_text(encoding="utf-8")
NAMES = sorted(set(re.findall(r"`(goalscope(?:\.\w+)+)`", PAGE)))


def resolved(name: str) -> Any:
    """What a dotted name means: a module, or something in one; a field counts."""
    found: Any = import_module("goalscope")
    for part in name.split(".")[1:]:
        try:
            found = getattr(found, part)
        except AttributeError:
            if part in getattr(found, "__annotations__", {}):
                return found.__annotations__[part]
            found = import_module(f"{found.__name__}.{part}")
    return found


@pytest.mark.parametrize("name", NAMES)
def test_what_the_page_names_exists(name: str) -> None:
    assert resolved(name) is not None


def test_the_numbers_are_those_of_the_code() -> None:
    def shown(row: str) -> list[str]:
        (line,) = (each for each in PAGE.splitlines() if each.startswith(f"| {row}"))
        return [cell.strip() for cell in line.strip("|").split("|")][-2:]

    said = {"½": 0.5, "⅓": 1 / 3, "as for any goal": None}
    for row in ("temperature", "reference", "prior_unspecified", "switching", "aside", "orders"):
        for text, calibration in zip(shown(row), (DEFAULT, PAPER), strict=True):
            number = said[text] if text in said else float(text)
            assert getattr(calibration, row) == number
