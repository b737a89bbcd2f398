"""Asks a model how likely goals are, in place of inference (No Inference, Sec. 4.3)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

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
        progress: Callable[[str], None],
    ) -> tuple[list[GoalChange], bool]:
        """Propose goals if Unspecified is the likeliest, and remove unfit ones.

        See `GoalTracker.manage` for the arguments, the value and the errors.
        """
        before = self.belief
        missing = propose and incomplete(before, goals.propose)
        added: list[GoalChange] = []
        try:
            if missing or (propose and anew):
                progress("proposing goals")
                past = [*(change for round in rounds for change in round.changes), *corrections]
                added = goals.added(None, before, self.turns, past)
                new = (change.goal for change in added)
                self.belief = self._ranked([*before.goals, *new], self.turns)
            progress("checking goals")
            past_rankings = [each.belief for each in rounds if isinstance(each.belief, Ranking)]
            removed = goals.removed([*past_rankings, self.belief], self.turns)
        except BaseException:
            self.belief = before
            raise
        self.belief = self.belief.drop(change.goal for change in removed)
        return [*added, *removed], missing and not added

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
