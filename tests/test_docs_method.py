"""docs/method.md names what exists, and its formulas are those of the code."""

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalscope.base.types import UNSPECIFIED, Goal
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT, PAPER, Calibration

PAGE = (Path(__file__).parents[1] / "docs" / "method.md").read_text(encoding="utf-8")
NAMES = sorted(set(re.findall(r"`(goalscope(?:\.\w+)+)`", PAGE)))
GOALS = (UNSPECIFIED, Goal("tea"), Goal("cake"), Goal("soup"))


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


def belief_by_the_page(table: np.ndarray, c: Calibration) -> np.ndarray:
    """The posterior after all turns, in the words of the page."""
    e = table / c.temperature
    share = c.reference * (1 - 1 / 3)
    e[:, 0] = (1 - share) * e[:, 0] + share * e[:, 1:].mean(axis=1)
    prior = (
        np.full(4, 1 / 4)
        if c.prior_unspecified is None
        else np.array([c.prior_unspecified, *[(1 - c.prior_unspecified) / 3] * 3])
    )
    p = prior
    for turn, row in enumerate(e):
        words = np.exp(row - row.max())
        if turn:
            speaks = 1 - (p @ words) / (prior @ words)
            speaks *= speaks >= 0.01
            chance = c.switching * speaks**4
            p = (1 - chance) * p + chance * prior
        p = p * words
        p = p / p.sum()
    return p


@pytest.mark.parametrize("calibration", [PAPER, DEFAULT, Calibration(3.0, 0.5, 0.2, 0.9)])
def test_the_belief_is_what_the_page_says(calibration: Calibration) -> None:
    table = np.random.default_rng(0).normal(-20, 4, (5, 4))
    belief = Belief.uniform(GOALS, calibration)
    for row in table:
        belief = belief.observe(row)
    assert belief.probability == pytest.approx(belief_by_the_page(table, calibration))
