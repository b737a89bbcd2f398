"""Conversations in which no model takes part: what is asked for is done, and what is given."""

from __future__ import annotations

from collections.abc import Sequence

from fakes import WordModel
from goalscope.acting import ActionPlanner
from goalscope.envs import Environment
from goalscope.episode import Round
from goalscope.taking_back import heard, take_back
from goalscope.types import Action, StepResult, TakenBack, Turn

__all__ = ["Talk"]


class Talk:
    """A conversation with an environment that stands as it is.

    Attributes:
        rounds: What was said and done so far.
    """

    def __init__(self, env: Environment, query: str = "") -> None:
        self.env = env
        self.query = query
        self.rounds: list[Round] = []

    @property
    def told(self) -> list[str]:
        """The newest notes, but for the words that were taken back."""
        newest = (note for round in self.rounds[-1:] for note in round.notes)
        return [note for note in newest if not note.startswith("Taken back: ")]

    @property
    def history(self) -> list[StepResult]:
        return [result for round in self.rounds for result in round.results]

    def say(self, utterance: str, guesses: Sequence[Action] = ()) -> Round:
        """One round: what is asked for outright is done, and then `guesses`."""
        turn = Turn(self.query, utterance)
        back = take_back(self.env, self.rounds, turn)
        turns = heard(self.rounds, turn, away=back.rounds)
        results, notes, question = [*back.results], [*back.notes], ""
        answer = self.env.answer(turns[-1].utterance, turns)
        quiet = isinstance(turns[-1], TakenBack) or answer is not None
        if not quiet:
            past = [*self.history, *results]
            outcome = ActionPlanner(WordModel()).act(self.env, [], turns, past)
            done = [*outcome.results, *(self.env.step(each) for each in guesses)]
            assert all(each.ok for each in done)
            results += done
            notes += self.env.unmet(turns, done)
            question = outcome.question
        round = Round(
            number=len(self.rounds) + 1,
            turn=turn,
            belief=None,
            changes=(),
            results=tuple(results),
            replans=0,
            status=self.env.status(),
            notes=tuple(notes),
            terminated=False,
            question=question,
            takes_back=back.rounds,
            reversals=len(back.results),
        )
        self.rounds.append(round)
        return round
