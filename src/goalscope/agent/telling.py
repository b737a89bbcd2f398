"""What the agent tells of a round: what failed, what it guessed and what it holds back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from goalscope.agent.executor import Execution
from goalscope.agent.planner import Outcome
from goalscope.agent.round import Guess, Round, mentions, retracted
from goalscope.base.nouns import singulars
from goalscope.base.types import Turn
from goalscope.envs import GUESSED, MENTIONED

_FAILURES = 3
"""Most failures that a round's notes tell one by one."""


def done_in_words(rounds: Sequence[Round]) -> str:
    """What was done and not retracted."""
    gone = retracted(rounds)
    targets: dict[str, list[str]] = {}
    for round in rounds:
        for result in round.results:
            if round.number not in gone and result.ok:
                done = targets.setdefault(result.action.name, [])
                done.append(" ".join(result.action.things))
    return "; ".join(f"{name}: {', '.join(named)}" for name, named in targets.items())


def notes_of(done: Execution, outcome: Outcome, before: Sequence[Turn]) -> Iterator[str]:
    """What the person should be told of the actions of a round.

    Args:
        done: What the orders led to.
        outcome: What was done unasked.
        before: The earlier turns.
    """
    yield from dict.fromkeys(done.notes)
    for result in done.results:
        if result.irreversible:
            yield f"As you confirmed: {result.action}. {result.observation}"
    failed = [*done.failed, *outcome.failed]
    for result in failed[:_FAILURES]:
        yield f"Not done: {result.action}. {result.observation}"
    if len(failed) > _FAILURES:
        yield f"And {len(failed) - _FAILURES} more could not be done."
    said = singulars(" ".join(turn.utterance for turn in (*before, done.turn)))
    mentioned = [guess for guess in outcome.guessed if mentions(said, guess.target)]
    if guessed := [guess for guess in outcome.guessed if guess not in mentioned]:
        yield f"{GUESSED}{_by_goal(guessed)}."
    if mentioned:
        yield f"{MENTIONED}{_by_goal(mentioned)}."
    for held in outcome.held:
        yield f"Held back until it is clear what you want: {held}."


def _by_goal(guessed: Sequence[Guess]) -> str:
    """What was guessed, with the goal that it is for."""
    targets: dict[str, list[str]] = {}
    for guess in guessed:
        targets.setdefault(guess.goal, []).append(guess.target)
    return "; ".join(
        f"{', '.join(named)}{f' (to {goal})' if goal else ''}" for goal, named in targets.items()
    )
