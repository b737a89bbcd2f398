"""What an assistant should do next: act on the likeliest goal, ask, or propose others."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple, Protocol

import numpy as np

from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, Turn, canonical
from goalscope.belief.belief import Belief
from goalscope.belief.goal_manager import incomplete
from goalscope.language.cues import consents, doubt, retracts

SURE = 0.8
"""Probability from which a goal is acted on: a question costs a fifth of a wrong act."""

LOST = 0.6
"""Probability of Unspecified above which goals are proposed; before any words it is a half."""

Advice = Literal["act", "ask", "propose"]
"""What an assistant should do next; see `advice`."""


class Tracking(Protocol):
    """A belief and the turns that it is over, such as a `GoalTracker`."""

    @property
    def since(self) -> int:
        """Number of turns before the newest goals came; see `incomplete`."""
        ...

    @property
    def belief(self) -> Belief:
        """Over the goals."""
        ...

    @property
    def turns(self) -> Sequence[Turn]:
        """What was said."""
        ...


class Advised(NamedTuple):
    """What to do next, and the reason in a sentence."""

    advice: Advice
    because: str


def advice(
    tracker: Tracking,
    *,
    proposed: Collection[Goal | str] = (),
    sure: float = SURE,
    lost: float = LOST,
) -> Advice:
    """What an assistant should do next.

    "act" on the likeliest goal, which has a probability of `sure` or more; "ask" the person; or
    "propose" goals, as Unspecified has more than `lost`. Before the first turn the advice is to
    ask, unless the person has confirmed a goal.

    The likelihood hardly tells "do it" from "don't". So the advice is to ask although a goal is
    sure, unless the person has confirmed it since their newest words:

    - while there is a `doubt` about the newest words;
    - if the goal is sure only by words that were doubted, or that came before the person took
      something back ("Stop!", "I changed my mind");
    - if the newest query asked whether to go ahead ("Shall I book it?") and the answer was not a
      plain yes (see `consents`), until later words speak for the goal;
    - if a model proposed the goal: only the person knows whether it makes sense.

    A person who has just taken something back is asked, too, before other goals are proposed.

    Args:
        tracker: A `GoalTracker`, or another object with a belief and its turns.
        proposed: Goals that a model proposed, or their texts.
        sure: Probability from 0 to 1; higher where a wrong act does more harm.
        lost: Probability from 0 to 1.

    Raises:
        InvalidInputError: `sure` or `lost` is not a probability.
    """
    return advised(tracker, proposed=proposed, sure=sure, lost=lost).advice


def advised(
    tracker: Tracking,
    *,
    proposed: Collection[Goal | str] = (),
    sure: float = SURE,
    lost: float = LOST,
) -> Advised:
    """The same as `advice`, with the reason."""
    belief, turns = tracker.belief, tracker.turns
    for name, number in (("sure", sure), ("lost", lost)):
        if not 0 <= number <= 1:
            raise InvalidInputError(f"{name} must be a probability from 0 to 1, not {number!r}.")
    given = [proposed] if isinstance(proposed, str) else proposed
    made = {canonical(each.text if isinstance(each, Goal) else each) for each in given}
    goal, probability = next(iter(belief.top(1)), (UNSPECIFIED, 0.0))
    if goal != UNSPECIFIED and probability >= sure:
        why_not = _why_not(belief, turns, goal, sure, made=canonical(goal.text) in made)
        told = f'"{goal.text.rstrip(".")}" has {probability:.0%}.'
        return Advised("ask", why_not) if why_not else Advised("act", told)
    if not turns or not len(belief.log_likelihood):
        return Advised("ask", "Nothing was said yet.")
    stated, likeliest = next(
        ((each, p) for each, p in belief.top() if each != UNSPECIFIED), (UNSPECIFIED, 0.0)
    )
    if (len(turns) > 1 or belief.pinned) and retracts(turns[-1].utterance, stated):
        return Advised("ask", "The newest words take something back.")
    if belief.is_degenerate:
        return Advised("propose", "No goal can have said these words.")
    if UNSPECIFIED in belief.goals and incomplete(belief, lost, since=tracker.since):
        return Advised("propose", "None of the goals explains the words well.")
    return Advised("ask", f"The likeliest goal has {likeliest:.0%}; {sure:.0%} is sure enough.")


def _why_not(belief: Belief, turns: Sequence[Turn], goal: Goal, sure: float, *, made: bool) -> str:
    """Why a sure goal is not acted on; "" if it is."""
    if (len(belief.log_likelihood), goal) in belief.pinned:
        return ""
    if not turns:
        return "Nothing was said yet."
    answers = [consents(turn, goal) for turn in turns]
    if answers[-1] is False:
        return "The answer to the question whether to go ahead is no plain yes."
    said = [turn.utterance for turn in turns]
    retracted = max((n for n, each in enumerate(said, 1) if retracts(each, goal)), default=0)
    doubts = [n <= retracted or bool(doubt(each, goal)) for n, each in enumerate(said, 1)]
    if doubts[-1]:
        return f"The newest words {doubt(said[-1], goal) or 'take something back'}."
    pinned = tuple((when, each) for when, each in belief.pinned if when >= retracted)
    plain, first = replace(belief, pinned=pinned), len(turns) - len(belief.log_likelihood)
    for number, doubted in enumerate(doubts[first:]):
        plain = plain.without(number) if doubted else plain
    left = plain.probability[belief.goals.index(goal)]
    if left < sure:
        return (
            f"Without the words that deny, ask, suppose or were taken back it has only {left:.0%}."
        )
    if made and goal not in {each for _, each in pinned}:
        return "A model proposed this goal, and the person has not confirmed it."
    refused = max((n for n, each in enumerate(answers, 1) if each is False), default=0)
    if not refused or answers[-1] or goal in {each for when, each in pinned if when >= refused}:
        return ""
    later = plain.evidence[refused:]
    against = later[:, [each == UNSPECIFIED for each in belief.goals]].sum()
    speaks = later[:, belief.goals.index(goal)].sum() > against + np.finfo(float).eps
    return "" if speaks else "Later words must speak for it first."
