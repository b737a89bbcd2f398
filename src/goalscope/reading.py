"""What the words of a round are for: to ask, to order, to end, or to tell of a goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from goalscope.envs import Environment
from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import agrees, declines
from goalscope.envs.undoing import undoes
from goalscope.episode import Round
from goalscope.types import TakenBack, Turn

__all__ = ["CONFIRM", "Words", "not_done", "read", "says_yes"]

CONFIRM = "That cannot be undone. Do you confirm exactly what is shown?"
"""A round's question before an end that nobody can undo."""


@dataclass(frozen=True, slots=True)
class Words:
    """What a round's words are for.

    Attributes:
        act: They may ask for something to be done: no mere question, nothing but taking back.
        asks: They only ask what the environment can answer.
        answers: They answer the question whether to do what cannot be undone.
        wants_end: They agree to how the task is ended, which they were told just before.
        ends: They say that the task is complete, or confirm it.
        silent: They tell of no goal.
        order: They leave nothing to guess, as the environment understands them.
        exact: Nothing is guessed for them.
    """

    act: bool
    asks: bool
    answers: bool
    wants_end: bool
    ends: bool
    silent: bool
    order: bool
    exact: bool


def read(
    env: Environment,
    rounds: Sequence[Round],
    turn: Turn,
    turns: Sequence[Turn],
    *,
    confirmed: bool,
) -> Words:
    """What the newest words are for.

    Args:
        env: Where the agent acts.
        rounds: Those before.
        turn: The newest turn, as it was said.
        turns: The transcript that stands, with what of that turn asks for something.
        confirmed: Whether a state was shown that a yes would confirm.
    """
    said = turns[-1].utterance
    question = rounds[-1].question if rounds else ""
    told = rounds[-1].notes if rounds else ()
    asked = bool(question) or told[-1:] == (not_done(env),)
    agreed = says_yes(env, turn)
    wants_end = agreed and any(f'say "{env.completion_phrase}"' in note for note in told)
    only_undoes = isinstance(turns[-1], TakenBack)
    answers = question == CONFIRM
    sure = answers and agreed and confirmed
    ends = sure or (not only_undoes and env.is_completion(turns[-1]))
    asks = not only_undoes and env.answer(said, turns) is not None
    silent = only_undoes or asks or sure or is_remark(said)
    order = not silent and env.is_order(turns)
    replies = wants_end or (asked and (agreed or declines(turn.utterance)))
    undoing = undoes(turn.utterance) is not None
    return Words(
        act=not (asks or only_undoes),
        asks=asks,
        answers=answers,
        wants_end=wants_end,
        ends=ends,
        silent=silent,
        order=order,
        exact=ends or silent or order or answers or replies or undoing,
    )


def says_yes(env: Environment, turn: Turn) -> bool:
    """Whether a turn agrees to what was asked, or orders the end outright."""
    return agrees(turn.utterance) or env.is_completion(turn)


def not_done(env: Environment) -> str:
    """A round's note where what cannot be undone was not confirmed."""
    return f'Not done. If it shall be, say "{env.completion_phrase}", then "Yes".'
