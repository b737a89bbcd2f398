"""Asks a model how likely goals are, in place of inference (No Inference, Sec. 4.3)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Literal

from goalscope.episode import Round
from goalscope.goals import GoalManager, incomplete
from goalscope.models import Generator
from goalscope.prompts import recent, render
from goalscope.ranking import Ranking
from goalscope.types import UNSPECIFIED, Goal, GoalChange, Turn

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
        self.task = task
        self.turns: list[Turn] = []
        self.belief = Ranking((UNSPECIFIED,))

    def observe(self, turn: Turn) -> None:
        """Rank the goals anew; on an error the ranking stays as it was.

        Raises:
            InvalidInputError: The words do not fit the model's context.
        """
        turns = [*self.turns, turn]
        self.belief = self._ranked(self.belief.goals, turns)
        self.turns = turns

    def manage(
        self,
        goals: GoalManager,
        rounds: Sequence[Round],
        corrections: Sequence[GoalChange] = (),
        *,
        propose: bool,
        anew: bool,
        stages: Sequence[Literal["propose", "remove"]] = ("propose", "remove"),
        unobserved: Turn | None = None,
        progress: Callable[[str], None],
    ) -> tuple[list[GoalChange], bool]:
        """Propose goals if Unspecified is the likeliest, and remove unfit ones.

        See `GoalTracker.manage` for the arguments, the value and the errors.
        """
        before = self.belief
        turns = [*self.turns, unobserved] if unobserved else self.turns
        changes: list[GoalChange] = []
        unexplained = False
        try:
            for stage in stages:
                if stage == "remove":
                    progress("checking goals")
                    earlier = rounds[:-1] if unobserved else rounds
                    rankings = [each.belief for each in earlier if isinstance(each.belief, Ranking)]
                    found = goals.removed([*rankings, self.belief], turns)
                    self.belief = self.belief.drop(change.goal for change in found)
                    changes += found
                    continue
                missing = propose and incomplete(self.belief, goals.propose)
                if missing or (propose and anew):
                    progress("proposing goals")
                    past = [change for round in rounds for change in round.changes]
                    found = goals.added(None, self.belief, turns, [*past, *corrections, *changes])
                    new = (change.goal for change in found)
                    self.belief = self._ranked([*self.belief.goals, *new], turns)
                    changes += found
                    unexplained = missing and not found
        except BaseException:
            self.belief = before
            raise
        return changes, unexplained

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
