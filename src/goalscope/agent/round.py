"""What one round of Algorithm 1 leaves behind; an episode is its rounds, and what comes between."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from goalscope.agent.guards import Awaited
from goalscope.base.nouns import contains, head_words, singular
from goalscope.base.types import Action, GoalChange, StepResult, Turn
from goalscope.belief.belief import Belief
from goalscope.language.dialogue_state import LIMITS, DialogueState, acting, fold
from goalscope.language.orders import Order, Reading


@dataclass(frozen=True, slots=True)
class Guess:
    """A thing that was used unasked, and the goal that it serves."""

    target: str
    goal: str


def mentions(said: Sequence[str], thing: str) -> bool:
    """Whether words, in the singular, name the kind of a thing, such as candles of any sort."""
    return contains(said, [singular(word) for word in head_words(thing)[-1:]])


@dataclass(frozen=True, eq=False)
class Round:
    """One pass of Algorithm 1: a turn, the belief after it, and what was done.

    Attributes:
        number: 1 for the first.
        turn: The agent's question and the person's reply.
        belief: After goals were added and removed; without goals for the No Goals method.
        changes: Goals that came and went, with reasons.
        results: Outcomes of the actions that stand, in order (undone plans are not in it).
        replans: How often a plan was impossible and made anew.
        status: The environment's status after the actions.
        notes: What the person should be told, such as turns dropped from a full context.
        question: What the agent has to ask next, such as leave for what cannot be undone.
        reading: What the reply was read as; it is never read again. None where another program
            reads and acts.
        pending: Orders that wait for a yes to that question.
        listed: The actions that they would come to; no other one is done that cannot be undone.
        released: Orders that waited, and that this round's words confirmed.
        state: Fingerprint of the environment after the actions.
        terminated: Whether the task is complete.
        retracts: Numbers of earlier rounds, the newest first, that this one takes back.
        reversals: Number of results, the first ones, that undid those rounds.
        awaits: What `question` waits for.
        guessed: The things that were used unasked.
        given_up: Those of earlier rounds that were taken back with the goals that they served.
    """

    number: int
    turn: Turn
    belief: Belief
    changes: tuple[GoalChange, ...]
    results: tuple[StepResult, ...] = ()
    replans: int = 0
    status: str = ""
    notes: tuple[str, ...] = ()
    terminated: bool = False
    question: str = ""
    reading: Reading | None = None
    pending: tuple[Order, ...] = ()
    listed: tuple[Action, ...] = ()
    released: tuple[Order, ...] = ()
    state: str = ""
    retracts: tuple[int, ...] = ()
    reversals: int = 0
    awaits: Awaited = ""
    guessed: tuple[Guess, ...] = ()
    given_up: tuple[Guess, ...] = ()


def retracted(rounds: Sequence[Round]) -> set[int]:
    """Numbers of the rounds that later ones take back."""
    return {number for round in rounds for number in round.retracts}


def undoable(rounds: Sequence[Round]) -> list[Round]:
    """The rounds that did something or set a limit, and were not taken back."""
    gone = retracted(rounds)
    return [
        each
        for each in rounds
        if each.number not in gone
        and (
            len(each.results) > each.reversals
            or (each.reading and any(order.do in LIMITS for order in each.reading.orders))
        )
    ]


def state_after(
    rounds: Sequence[Round],
    reading: Reading | None = None,
    *,
    released: Sequence[Order] = (),
    retracts: Sequence[int] = (),
    takes_away: Collection[str] = (),
) -> DialogueState:
    """What holds after some rounds, and a newer reading where there is one; see `fold`.

    Args:
        rounds: All so far.
        reading: Of the words after them.
        released: Orders that those confirm.
        retracts: Numbers of the rounds that those take back.
        takes_away: See `fold`.
    """
    newest = [] if reading is None else [reading]
    return fold(
        [*(round.reading or Reading(()) for round in rounds), *newest],
        released=[*(round.released for round in rounds), released],
        waiting=[_waiting(round) for round in rounds],
        retracted={number - 1 for number in retracted(rounds) | {*retracts}},
        takes_away=takes_away,
    )


def _waiting(round: Round) -> tuple[Order, ...]:
    """The orders that were not followed: all of them where a word of harm was not understood."""
    read = round.reading.orders if round.reading and round.awaits == "harm" else ()
    return (*round.pending, *acting(read))
