"""Goals in the order that a model names, in place of inference (No Inference, Sec. 4.3)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np

from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, Turn
from goalscope.belief.belief import Belief
from goalscope.belief.tracker import Correction, GoalTracker
from goalscope.models import Generator
from goalscope.models.trace import during
from goalscope.prompts import recent, render

_TURNS = 20  # that the model is shown, as many as an episode of the paper has


class GoalOrder:
    """Asks a model which goal is the likeliest, and which the least likely, after each turn.

    It takes the place of a `GoalTracker` where nothing is inferred. Its belief holds no evidence;
    see `in_order`. Over no goals it asks nothing, which is the No Goals method.

    Args:
        model: Names the goals.
        task: The agent and its task.
        goals: Goals to start with.
    """

    likelihood = None
    notes: tuple[str, ...] = ()

    def __init__(self, model: Generator, task: str, goals: Sequence[Goal] = (UNSPECIFIED,)) -> None:
        self.model = model
        self.task = task
        self.turns: list[Turn] = []
        self.belief = in_order(goals, goals)

    def observe(self, query: str, utterance: str, *, weight: float = 1.0) -> Belief:
        """Order the goals anew; no turn has a `weight` here. On an error the order stays.

        Raises:
            InvalidInputError: The words do not fit the model's context.
        """
        turns = [*self.turns, Turn(query, utterance)]
        self.belief = self._asked(self.belief.goals, turns)
        self.turns = turns
        return self.belief

    def add(self, goals: Iterable[Goal]) -> Belief:
        """Add goals; all are ordered anew, together."""
        self.belief = self._asked([*self.belief.goals, *goals], self.turns)
        return self.belief

    def drop(self, goals: Iterable[Goal]) -> Belief:
        """Remove goals; the others keep their order."""
        gone = {*goals}
        left = [goal for goal in self.belief.goals if goal not in gone]
        ranked = [goal for goal, _ in self.belief.top() if goal not in gone]
        self.belief = in_order(left, ranked)
        return self.belief

    def correct(self, correction: Correction, goal: str | Goal, text: str = "") -> NoReturn:
        """Refuse to correct an order, which the model would name again after the next turn.

        Raises:
            InvalidInputError: Always.
        """
        raise InvalidInputError("This method has no belief that could be corrected.")

    def restore(self, belief: Belief, turns: Sequence[Turn]) -> None:
        """Go back to an earlier state."""
        self.belief, self.turns = belief, [*turns]

    @during(module="infer")
    def _asked(self, goals: Sequence[Goal], turns: Sequence[Turn]) -> Belief:
        if len(goals) < 2:
            return in_order(goals, goals)
        least = self._named("least", goals, turns)
        most = self._named("most", goals, turns)
        ends = {least: 1, most: -1}  # one that is named as both is the likeliest
        return in_order(goals, sorted(goals, key=lambda goal: ends.get(goal, 0)))

    def _named(self, which: str, goals: Sequence[Goal], turns: Sequence[Turn]) -> Goal:
        past = recent(self.model, turns, _TURNS)
        prompt = render("rank", task=self.task, goals=goals, turns=past, which=which)
        numbers = [str(number) for number in range(1, len(goals) + 1)]
        reply = self.model.generate(prompt, max_tokens=8, schema={"enum": numbers})
        return goals[numbers.index(reply.text.strip().strip('"'))]


Tracker = GoalTracker | GoalOrder
"""A belief that follows a conversation."""


def in_order(goals: Sequence[Goal], ranked: Sequence[Goal]) -> Belief:
    """A belief without evidence, whose probabilities are in the ratio of the reciprocal ranks.

    Args:
        goals: The goals in the order in which they came.
        ranked: The same goals, likeliest first.
    """
    rank = {goal: number for number, goal in enumerate(ranked, 1)}
    prior = np.array([-math.log(rank[goal]) for goal in goals])
    return replace(Belief.uniform(goals), log_prior=prior, inferred=False)
