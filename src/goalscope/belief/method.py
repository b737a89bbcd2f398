"""Methods of inference of one's own: they see the whole set of goals at once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np

from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, Turn
from goalscope.belief.calibration import PAPER, Calibration
from goalscope.belief.likelihood import Array, lacking

LEAST = 1e-12
"""What a probability of 0 counts as, so that later words can still move it."""

NEGLIGIBLE = 1e-6
"""A probability of Unspecified that no goal is ever proposed by."""

_TASK = "Help the human."
_GOALS = (UNSPECIFIED, *map(Goal, ("bake a cake", "cook tomato soup", "wash the car")))
_TURNS = (
    Turn("What can I do?", "I would like something sweet."),
    Turn("What for?", "A birthday cake, please."),
    Turn("Anything else?", "No soup today."),
)


class Method(Protocol):
    """How likely each goal is, given all that was said.

    It may score the goals jointly, ask a model about all of them, or remember what it computed for
    earlier turns. What it returns depends on its arguments alone.
    """

    def probabilities(self, task: str, goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
        """[G] probabilities of the goals after these turns; they sum to 1.

        Args:
            task: The agent and its task.
            goals: Distinct goals; `UNSPECIFIED` may be among them, for a person with none.
            turns: The transcript, at least one turn.
        """
        ...


class Implied:
    """The evidence that a method's probabilities imply, a `Likelihood` for `GoalTracker`.

    A turn's evidence for a goal is the change of its log-probability, so that by Eq. 1 from a
    uniform prior the posterior after each turn is what the method says. The whole table is made
    again where a goal comes.
    """

    calibration: Calibration = PAPER
    joint = True

    def __init__(self, method: Method) -> None:
        self.method = method
        self.model = method
        self._known: dict[tuple[str, tuple[Goal, ...], int], tuple[tuple[Turn, ...], Array]] = {}

    def log_likelihood(
        self, task: str, goals: Sequence[Goal], turns: Sequence[Turn], *, since: int = 0
    ) -> Array:
        """See `Likelihood.log_likelihood`; a row depends on all goals."""
        rows = [self._after(task, goals, turns[:t]) for t in range(since, len(turns) + 1)]
        changes = [after - before for before, after in pairwise(rows)]
        return np.array(changes, np.float64).reshape(len(turns) - since, len(goals))

    def _after(self, task: str, goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
        """[G] log-probabilities after these turns; uniform before any."""
        if not (goals and turns):
            return np.zeros(len(goals))
        key = task, (*goals,), len(turns)
        said, known = self._known.get(key, ((), np.zeros(0)))
        if said != (*turns,):
            known = np.log(np.maximum(_asked(self.method, task, goals, turns), LEAST))
            self._known[key] = (*turns,), known
        return known


def implied(method: Method) -> Implied:
    """The evidence of a method.

    Raises:
        InvalidInputError: The object is no method.
    """
    if wrong := lacking(method, "probabilities(task, goals, turns)", "method.Method"):
        raise InvalidInputError(f"{method!r} cannot be used as a method: {wrong}.")
    return Implied(method)


def _asked(method: Method, task: str, goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """The probabilities of a method.

    Raises:
        InvalidInputError: They are none.
    """
    name = f"{type(method).__name__}.probabilities"
    given = method.probabilities(task, goals, turns)
    try:
        found = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError(f"{name} must return numbers, not {given!r:.80}.") from None
    if found.shape != (len(goals),):
        raise InvalidInputError(
            f"{name} must return an array of [{len(goals)}], a probability for each goal, not of "
            f"{[*found.shape]}."
        )
    if not (found >= 0).all() or abs(found.sum() - 1) > 1e-6:
        raise InvalidInputError(
            f"{name} must return probabilities that sum to 1, not {found.tolist()!s:.80}, whose "
            f"sum is {found.sum():g}."
        )
    return found


def check_method(
    method: Method,
    *,
    task: str = _TASK,
    goals: Sequence[Goal] = _GOALS,
    turns: Sequence[Turn] = _TURNS,
) -> list[str]:
    """Check a method by the laws that every belief keeps, on some goals and turns.

    Its probabilities sum to 1, for all goals, for some and for one alone; are the same when asked
    again, whatever was asked in between; and belong to the goals, in whatever order they are given.

    Returns:
        What the method need not claim and does not: that dropping a goal leaves the ratios of the
        others (as for a likelihood of each goal), and that Unspecified is a hypothesis for it.

    Raises:
        InvalidInputError: A law is broken; the message says which, and by how much.
    """
    implied(method)
    if not (goals and turns):
        raise InvalidInputError("A method is checked on at least one goal and one turn.")
    notes: list[str] = []
    whole = np.zeros(len(goals))
    for t in range(1, len(turns) + 1):
        whole = _asked(method, task, goals, turns[:t])
        backwards = _asked(method, task, goals[::-1], turns[:t])[::-1]
        _hold(whole, backwards, "belong to the goals, in whatever order they are given")
        _hold(np.ones(1), _asked(method, task, goals[:1], turns[:t]), "be 1 for a goal alone")
        for dropped in goals if len(goals) > 1 else ():
            left = [i for i, goal in enumerate(goals) if goal != dropped]
            fewer = _asked(method, task, [goals[i] for i in left], turns[:t])
            conditioned = whole[left] / max(whole[left].sum(), LEAST)
            if np.abs(fewer - conditioned).max() > 1e-3:
                notes.append(
                    "It scores goals jointly: without one of them, the others' ratios change."
                )
        again = _asked(method, task, goals, turns[:t])
        _hold(whole, again, "be the same when it is asked again")
    if UNSPECIFIED in goals and whole[[*goals].index(UNSPECIFIED)] < NEGLIGIBLE:
        notes.append("Unspecified never has a probability, so that no goal is ever proposed.")
    return list(dict.fromkeys(notes))


def _hold(expected: Array, found: Array, law: str) -> None:
    apart = float(np.abs(expected - found).max())
    if apart > 1e-3:
        raise InvalidInputError(f"The probabilities must {law}; they are {apart:.3f} apart.")
