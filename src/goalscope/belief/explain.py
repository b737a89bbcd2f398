"""Why a goal is likely: the evidence of each utterance, and of each word in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    Turn,
    distinct,
    goals_of,
    pluralize,
)
from goalscope.belief.belief import Belief
from goalscope.belief.likelihood import RolePlay

_WORTH_TELLING = 0.05
"""Least probability of a goal that `in_words` names."""
_LIKELY = 0.5
"""Probability from which `in_words` says that the person wants a goal."""
_SPEAKS = math.log(3)
"""Least evidence of words that `in_words` gives as the reason, in nats; a greeting has up to 1."""
_LONGEST = 80
"""Most characters of a goal or an utterance in `in_words`."""


@dataclass(frozen=True, slots=True)
class Reason:
    """What one utterance does to the belief in a goal.

    Attributes:
        turn: 1 for the first.
        utterance: What the person said.
        evidence: For the goal against the mean of the others, nats, after the calibration; 0 for
            words that name nothing and tell no aim.
        probability: Of the goal after the turn.
        without: Of the goal at the end, had this not been said; later words keep their evidence.
        change: Chance that the person had changed their mind before these words, so that earlier
            ones count less.
    """

    turn: int
    utterance: str
    evidence: float
    probability: float
    without: float
    change: float = 0.0


def reasons(belief: Belief, turns: Sequence[Turn], goal: str | Goal) -> list[Reason]:
    """The evidence of each turn for a goal.

    Evidence is against the mean of the other goals: words that suit all alike ("Yes, it's right
    here.") have little, of either sign. Words that speak for a goal can still make it less likely,
    if they speak more for another.

    Raises:
        InvalidInputError: The belief holds no such goal, or other turns.
    """
    table, place = belief.evidence, _place(belief, goal)
    if len(turns) != len(table):
        raise InvalidInputError(
            f"The belief is over {pluralize(len(table), 'turn')}, not {len(turns)}: it does not "
            "weigh each."
        )
    gains = table[:, place] - _mean_of_others(table, place)
    after = np.exp(belief.log_posteriors[1:, place])
    changes = belief.changes
    return [
        Reason(
            number + 1,
            turn.utterance,
            float(gains[number]),
            float(after[number]),
            float(belief.without(number).probability[place]),
            float(changes[number]),
        )
        for number, turn in enumerate(turns)
    ]


def in_words(belief: Belief, turns: Sequence[Turn], *, doubted: bool = False) -> str:
    """An answer to a person who asks what they seem to want: how sure it is, why, and what else.

    Args:
        belief: Over their goals.
        turns: What was said.
        doubted: Whether it is not to be acted on, however probable it is (see
            `goalscope.belief.advice.advice`).
    """
    ranked = [(goal, p) for goal, p in belief.top() if p >= _WORTH_TELLING][:3]
    stated = [each for each in ranked if each[0] != UNSPECIFIED]
    if not stated:
        return "I do not know yet what you want."
    goal, probability = stated[0]
    told = f"{_told(goal, probability)}{_because(belief, turns, goal)}"
    rest = [_told(other, p) for other, p in ranked if other != goal]
    if ranked[0][0] == UNSPECIFIED:
        told, rest = rest[0], [told, *rest[1:]]
    if doubted or ranked[0][0] != goal or probability < _LIKELY:
        lead = "I am not sure what you want. Perhaps this"
    else:
        lead = "I think this is what you want"
    return f"{lead}: {told}." + (f" It could also be: {' or '.join(rest)}." if rest else "")


def _told(goal: Goal, probability: float) -> str:
    name = "something else" if goal == UNSPECIFIED else _cut(goal.text.rstrip(" ."))
    return f"{name} ({min(probability, 0.99):.0%})"


def _because(belief: Belief, turns: Sequence[Turn], goal: Goal) -> str:
    """What speaks most for a goal; "" if nothing says much."""
    if goal in [pinned for _, pinned in belief.pinned]:
        return ", which you confirmed"
    if len(turns) != len(belief.log_likelihood) or not turns:
        return ""
    strongest = max(reasons(belief, turns, goal), key=lambda reason: reason.evidence)
    said = _cut(strongest.utterance)
    return f', mostly because you said "{said}"' if strongest.evidence >= _SPEAKS else ""


def _cut(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 3].rstrip()}..."


def word_evidence(
    likelihood: RolePlay, task: str, belief: Belief, turns: Sequence[Turn], goal: str | Goal
) -> list[tuple[str, float]]:
    """The evidence of each word in the last turn for a goal, by role-play alone; they sum up to it.

    Returns:
        Each word with its evidence against the mean of the other goals, nats, after the
        calibration. Spaces belong to the word after them.

    Raises:
        InvalidInputError: The belief holds no such goal.
        ModelError: The model does not tell its tokens.
    """
    place = _place(belief, goal)
    pieces, table = likelihood.token_log_likelihood(task, belief.goals, turns)
    own = dict(belief.weights).get(len(turns) - 1, 1.0)
    weights = tuple((token, own) for token in range(len(table)))
    weighed = replace(belief, log_likelihood=table, pinned=(), weights=weights).evidence
    gains = weighed[:, place] - _mean_of_others(weighed, place)
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
