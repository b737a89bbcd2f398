"""Asks a model how likely goals are, in place of inference (No Inference, Sec. 4.3)."""

from __future__ import annotations

from collections import abc
from collections.abc import Collection, Iterable, Sequence
from contextlib import contextmanager

from goalscope.base.types import UNSPECIFIED, Goal, Turn
from goalscope.belief.goal_order import Ranking
from goalscope.models import Generator
from goalscope.prompts import recent, render

__all__ = ["Ranker"]

_TURNS = 8  # that the model is shown


class Ranker:
    """Asks a model which goal is the likeliest, and which the least likely, after each turn.

    It stands in for a `GoalTracker` in the No Inference method (Sec. 4.3).

    Args:
        generator: The model.
        task: The agent and its task.
    """

    def __init__(self, generator: Generator, task: str) -> None:
        self.generator = generator
        self.likelihood = None
        self.task = task
        self.turns: list[Turn] = []
        self.belief = Ranking((UNSPECIFIED,))

    def observe(self, query: str, utterance: str, *, weight: float = 1.0) -> None:
        """Rank the goals anew; on an error the ranking stays as it was.

        Raises:
            InvalidInputError: The words do not fit the model's context.
        """
        turns = [*self.turns, Turn(query, utterance)]
        self.belief = self._ranked(self.belief.goals, turns)
        self.turns = turns

    def include(self, goals: Sequence[Goal]) -> None:
        """See `goalscope.belief.goal_manager.Tracker`; all goals are ranked anew, together."""
        self.belief = self._ranked([*self.belief.goals, *goals], self.turns)

    def drop(self, goals: Iterable[Goal]) -> None:
        """See `Ranking.drop`."""
        self.belief = self.belief.drop(goals)

    @contextmanager
    def restoring(self) -> abc.Generator[None]:
        """See `goalscope.belief.goal_manager.Tracker`."""
        before = self.belief
        try:
            yield
        except BaseException:
            self.belief = before
            raise

    def _ranked(self, goals: Collection[Goal], turns: Sequence[Turn]) -> Ranking:
        support = tuple(goals)
        if len(support) < 2:
            return Ranking(support)
        least = self._asked("least", support, turns)
        return Ranking(support, self._asked("most", support, turns), least)

    def _asked(self, which: str, goals: Sequence[Goal], turns: Sequence[Turn]) -> Goal:
        past = recent(self.generator, turns, _TURNS)
        prompt = render("rank", task=self.task, goals=goals, turns=past, which=which)
        numbers = [str(number) for number in range(1, len(goals) + 1)]
        reply = self.generator.generate(prompt, max_tokens=8, schema={"enum": numbers})
        return goals[numbers.index(reply.text.strip().strip('"'))]
