"""Would goals be proposed? How often where the true goal is missing, and how often needlessly."""

from __future__ import annotations

from itertools import product

import numpy as np

from goalscope.belief import Belief
from goalscope.calibration import PAPER, USUAL, Calibration, calibration_from_json
from goalscope.experiment.summary import NO_INTERVAL, Entry, Measured, Table
from goalscope.experiment.summary_dialogues import (
    AS_IN_PAPER,
    GOALSCOPE,
    Dialogues,
    left_out,
    mean_of,
)
from goalscope.goals import UNEXPLAINED, Trigger, incomplete
from goalscope.types import UNSPECIFIED, Goal

__all__ = ["proposals_table"]

TURNS = 3
"""Turns within which a proposal counts."""

AS_AGENT = "goalscope, usual"
RULES: dict[Trigger, str] = {
    UNEXPLAINED: f"Unspecified has {100 * UNEXPLAINED:g} %",
    "paper": "Unspecified leads",
}
COLUMNS = ("belief", "goals are proposed once", "n", "absent", "present")
NOTES = (
    f"Share of dialogues in which goals would be proposed within the first {TURNS} turns: they "
    "should be if the true goal is absent, and need not be if it is present (one of the wrong "
    "goals is then left out).",
    f"{GOALSCOPE}: with the calibration known when it was measured; {AS_AGENT}: with that of an "
    f"agent; {AS_IN_PAPER}: neither evidence nor prior changed.",
    "Intervals are 95 %, by a bootstrap that resamples whole groups of dialogues that share "
    f"people. {NO_INTERVAL}",
)


def proposals_table(dialogues: Dialogues, *, command: str = "") -> Table:
    """How often each rule proposes goals; of the dialogues with more than two goals.

    Args:
        dialogues: Of one set, with one model.
        command: What makes it again.
    """
    cells = [
        (spec, result)
        for spec, result in dialogues.cells
        if result.get("role-play") and len(spec["case"]["goals"]) > 2
    ]
    groups = [spec["case"]["group"] for spec, _ in cells]
    ways = {GOALSCOPE: None, AS_AGENT: USUAL, AS_IN_PAPER: PAPER}
    rows: list[tuple[Entry, ...]] = []
    for (belief, way), (rule, words) in product(ways.items(), RULES.items() if cells else ()):
        found = [_proposed(cell, way, rule) for cell in cells]
        shares = [mean_of([float(each[i]) for each in found], groups, "leads") for i in (1, 0)]
        rows.append((belief, words, len(cells), *shares))
    title = f"Would goals be proposed? {dialogues.title}, {dialogues.n} dialogues"
    return Table(dialogues.name("proposals"), title, COLUMNS, tuple(rows), NOTES, command)


def _proposed(cell: Measured, way: Calibration | None, rule: Trigger) -> tuple[bool, bool]:
    """Whether goals are proposed with the true goal, and without it; None is the cell's own way."""
    present, absent, _ = left_out(cell)
    calibration = way or calibration_from_json(cell[1]["calibration"])
    width = int(present.shape[1])
    goals = (UNSPECIFIED, *(Goal(str(number)) for number in range(1, width)))
    with_goal, without = (
        any(
            incomplete(Belief(goals, np.zeros(width), table[:turn], calibration), rule)
            for turn in range(1, min(TURNS, len(table)) + 1)
        )
        for table in (present, absent)
    )
    return with_goal, without
