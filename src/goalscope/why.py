"""Why is a goal likely? What each utterance, and each word of it, says for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from goalscope.belief import Belief
from goalscope.likelihood import RolePlay
from goalscope.types import UNSPECIFIED, Goal, InvalidInputError, Turn, counted, distinct, goals_of

__all__ = ["Reason", "in_words", "reasons", "word_evidence"]

_WORTH_TELLING = 0.05
"""Least probability of a goal that is told in words."""
_QUOTED = 80
"""Most characters of what is quoted."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Reason:
    """What one utterance does to the belief in a goal.

    Attributes:
        turn: 1 for the first.
        utterance: What the person said.
        evidence: For the goal against the mean of the others, nats, as it counts when it is said.
        probability: Of the goal after the turn.
        without: What it would be at the end, had this not been said; later words keep their
            evidence.
    """

    turn: int
    utterance: str
    evidence: float
    probability: float
    without: float


def reasons(belief: Belief, turns: Sequence[Turn], goal: str | Goal) -> list[Reason]:
    """What each turn says for a goal.

    Evidence is against the mean of the other goals: of words that suit all alike ("Yes, it's right
    here.") it is little, and of either sign, as the others are. Words that speak for a goal can
    still make it less likely, as another goal gains more.

    Raises:
        InvalidInputError: The belief holds no such goal, or other turns.
    """
    table, place = belief.evidence, _place(belief, goal)
    if len(turns) != len(table):
        raise InvalidInputError(
            f"The belief is over {counted(len(table), 'turn')}, not {len(turns)}: it does not "
            "weigh each."
        )
    gains = table[:, place] - _mean_of_others(table, place)
    after = np.exp(belief.log_posteriors[1:, place])
    return [
        Reason(
            number + 1,
            turn.utterance,
            float(gains[number]),
            float(after[number]),
            float(belief.without(number).probability[place]),
        )
        for number, turn in enumerate(turns)
    ]


def in_words(belief: Belief, turns: Sequence[Turn]) -> str:
    """What a person wants, how sure that is, why, and what else it could be: the answer to them.

    Args:
        belief: Over their goals.
        turns: What was said.
    """
    ranked = [(goal, p) for goal, p in belief.top() if goal != UNSPECIFIED and p >= _WORTH_TELLING]
    if not ranked:
        return "I do not know yet what you want."
    (goal, probability), *others = ranked[:3]
    told = f"{goal.text} ({probability:.0%} sure)"
    if len(turns) == len(belief.log_likelihood) > 0:
        strongest = max(reasons(belief, turns, goal), key=lambda reason: reason.evidence)
        if strongest.evidence > 0:
            words = " ".join(strongest.utterance.split())
            quoted = words if len(words) <= _QUOTED else f"{words[: _QUOTED - 3].rstrip()}..."
            told += f', mostly because you said "{quoted}"'
    lead = "I think you want to" if probability >= 0.5 else "I am not sure. You may want to"
    rest = " or ".join(f"{other.text} ({p:.0%})" for other, p in others)
    return f"{lead} {told}." + (f" It could also be: {rest}." if rest else "")


def word_evidence(
    likelihood: RolePlay, task: str, belief: Belief, turns: Sequence[Turn], goal: str | Goal
) -> list[tuple[str, float]]:
    """What each word of the last turn says for a goal; together what the turn says.

    Returns:
        Each word with its evidence against the mean of the other goals, nats, as it counts after
        the calibration. Spaces belong to the word after them.

    Raises:
        InvalidInputError: The belief holds no such goal.
        ModelError: The model does not tell its tokens.
    """
    place = _place(belief, goal)
    pieces, table = likelihood.token_log_likelihood(task, belief.goals, turns)
    counted = replace(belief, log_likelihood=table, pinned=()).evidence
    gains = counted[:, place] - _mean_of_others(counted, place)
    words: list[tuple[str, float]] = []
    for piece, gain in zip(pieces, gains.tolist(), strict=True):
        if words and not piece[:1].isspace():
            text, before = words.pop()
            words.append((text + piece, before + gain))
        else:
            words.append((piece, gain))
    return words


def _place(belief: Belief, goal: str | Goal) -> int:
    (named,) = distinct(goals_of([goal]), belief.goals)
    if named not in belief.goals:
        known = "; ".join(each.text for each in belief.goals)
        raise InvalidInputError(f"There is no goal {named.text!r} here; there are: {known}")
    return belief.goals.index(named)


def _mean_of_others(table: Array, place: int) -> Array:
    """[T]; 0 where there is no other goal."""
    others = np.delete(table, place, axis=1)
    return others.mean(1) if others.shape[1] else np.zeros(len(table))
