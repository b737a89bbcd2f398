"""Goals in the order that a model gave them, without probabilities (No Inference, Sec. 4.3)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from goalscope.base.types import Goal
from goalscope.belief.calibration import PAPER, Calibration


@dataclass(frozen=True)
class Ranking:
    """Goals of which a model named the likeliest and the least likely; immutable.

    Attributes:
        goals: All of them, in the order in which they came.
        most: The likeliest; None where nobody asked.
        least: The least likely; None where nobody asked.
    """

    goals: tuple[Goal, ...]
    most: Goal | None = None
    least: Goal | None = None

    calibration: ClassVar[Calibration] = PAPER
    pinned: ClassVar[tuple[tuple[int, Goal], ...]] = ()
    ruled_out: ClassVar[tuple[Goal, ...]] = ()
    weights: ClassVar[tuple[tuple[int, float], ...]] = ()

    def top(self, k: int | None = None) -> list[tuple[Goal, float]]:
        """The first `k` goals with the weights that a planner gives them, likeliest first.

        A ranking has no probabilities: a goal's weight is the reciprocal of its rank, and all
        weights sum to 1.
        """
        ends = {self.most: -1, self.least: 1} if self.most != self.least else {self.most: -1}
        order = sorted(self.goals, key=lambda goal: ends.get(goal, 0))
        total = sum(1 / rank for rank in range(1, len(order) + 1))
        return [(goal, 1 / rank / total) for rank, goal in enumerate(order, 1)][:k]

    def drop(self, goals: Iterable[Goal]) -> Ranking:
        """Remove goals; unknown ones are skipped."""
        gone = {*goals}
        left = tuple(goal for goal in self.goals if goal not in gone)
        most, least = (None if each in gone else each for each in (self.most, self.least))
        return Ranking(left, most, least)
