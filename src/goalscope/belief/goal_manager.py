"""Goal management (Sec. 3.2): propose goals that explain the words, remove those that do not."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal, Protocol

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    GoalChange,
    InvalidInputError,
    Message,
    Turn,
    canonical,
)
from goalscope.belief.belief import Belief, weighed
from goalscope.belief.goal_order import Tracker
from goalscope.belief.likelihood import Likelihood
from goalscope.language.dialogue_state import acting
from goalscope.language.orders import Reading
from goalscope.models import LikelihoodModel
from goalscope.models.scoring import logprobs_of
from goalscope.models.trace import during
from goalscope.prompts import render

Trigger = float | Literal["paper"]
"""When goals are proposed; see `GoalManager`."""

Same = Callable[[str, str], bool]
"""Whether the texts of two goals say the same."""

UNEXPLAINED = 0.5
"""Probability of Unspecified above which goals are proposed (docs/log.md)."""

IMPROBABLE = 0.05
"""A goal that stays the least likely is removed only up to this probability."""

FEWEST = 2
"""Goals that are always left: beside one alone, the probability of Unspecified means little."""

ANY_TASK = "The agent helps the human."

_DETERMINERS = frozenset(("a", "an", "the", "my", "your", "our", "his", "her", "their", "some"))
"""Words that make no difference between two goals."""


def incomplete(belief: Belief, propose: Trigger = UNEXPLAINED, *, since: int = 0) -> bool:
    """Whether the person's goal seems to be missing from the belief.

    Args:
        belief: The present one. Without `UNSPECIFIED` its goals are fixed, and none is missing.
        propose: See `GoalManager`.
        since: Number of turns that the newest goals were proposed from. Those turns cannot test
            them: only later ones count.
    """
    if UNSPECIFIED not in belief.goals:
        return False
    if propose == "paper":
        return belief.top(1)[0][0] == UNSPECIFIED
    later = belief.since(since)
    return bool(later.probability[later.goals.index(UNSPECIFIED)] > propose + 1e-9)


def made_from(changes: Sequence[Sequence[GoalChange]]) -> int:
    """Number of turns that the newest goals were proposed from; see `incomplete`.

    Args:
        changes: Of each round. Goals that the person named themselves do not count.
    """
    made = 0
    for number, each in enumerate(changes, 1):
        if any(change.kind == "added" and change.source != "person" for change in each):
            made = number
    return made


class Proposer(Protocol):
    """Names goals; see `Writer` and `PromptedWriter` of `goalscope.agent`."""

    def goals(self, task: str, turns: Sequence[Turn], held: Sequence[str]) -> list[str]:
        """Goals that explain what was said, likeliest first.

        Args:
            task: The agent and its task.
            turns: The conversation.
            held: Goals of the belief.
        """
        ...


class Remover(Protocol):
    """Removes goals by a prompt; see `goalscope.agent.prompted.PromptedWriter`."""

    def unfit(self, task: str, turns: Sequence[Turn], goals: Sequence[Goal]) -> list[GoalChange]:
        """The goals to remove."""
        ...


class PastRound(Protocol):
    """What a `GoalManager` needs of an earlier round."""

    @property
    def belief(self) -> Belief:
        """The belief after it."""
        ...

    @property
    def changes(self) -> Sequence[GoalChange]:
        """The goals that came and went."""
        ...

    @property
    def reading(self) -> Reading | None:
        """What the words were read as."""
        ...


class GoalManager:
    """Decides which goals the belief is over (Sec. 3.2).

    Args:
        proposer: Names goals.
        model: Scores how relevant and how safe they are.
        task: The agent's task.
        remover: Removes goals by a prompt instead.
        propose: Goals are proposed if, by the turns since the newest goals, Unspecified is likelier
            than this; with "paper", if it is the likeliest, and all that are proposed are added.
        patience: A goal is removed after being the least likely for more than this many rounds (n
            in the paper), if it has 5 % or less and two others are left. With "paper" the rounds
            alone count, a goal that was removed may be proposed again, and all may be removed.
        same: Whether two goals say the same, so that only the better one is added.
    """

    def __init__(
        self,
        proposer: Proposer,
        model: LikelihoodModel,
        task: str,
        *,
        remover: Remover | None = None,
        propose: Trigger = UNEXPLAINED,
        patience: int = 3,
        same: Same | None = None,
    ) -> None:
        try:
            known = propose == "paper" or 0 <= propose < 1
        except TypeError:
            known = False
        if not known:
            raise InvalidInputError(
                f'propose must be a probability below 1, such as {UNEXPLAINED}, or "paper", not '
                f"{propose!r}"
            )
        self.proposer = proposer
        self.model = model
        self.task = task
        self.remover = remover
        self.propose: Trigger = propose
        self.patience = patience
        self.same = same
        self._cleared: set[Goal] = set()

    def manage(
        self,
        tracker: Tracker,
        rounds: Sequence[PastRound],
        reading: Reading | None = None,
        *,
        corrections: Sequence[GoalChange] = (),
        given: Collection[Goal] = (),
        most: int | None = None,
        progress: Callable[[str], None] = lambda _: None,
    ) -> tuple[list[GoalChange], bool]:
        """Propose goals if none explains the newest turn, and remove unfit ones.

        Args:
            tracker: Holds the goals; it has observed the turn.
            rounds: All rounds before this turn.
            reading: Of the turn. Goals are proposed only where it may tell an aim; without a
                reading any words may.
            corrections: What the person said of the goals since the last round.
            given: Goals to keep.
            most: Largest number of goals.
            progress: Called with what is done next.

        Returns:
            The changes, and whether words that ask for nothing are left unexplained.

        Raises:
            UnreadableAnswerError: A model that was asked for goals wrote none; the goals stay.
        """
        past = [change for round in rounds for change in round.changes]
        since = made_from([round.changes for round in rounds])
        changes: list[GoalChange] = []
        unexplained = False
        known = any(goal != UNSPECIFIED for goal in tracker.belief.goals)
        propose = UNSPECIFIED in tracker.belief.goals and (
            reading is None or _may_tell_aim(reading, known=known)
        )
        with _all_or_nothing(tracker):
            missing = propose and incomplete(tracker.belief, self.propose, since=since)
            if missing or (propose and reading and _tells_another_aim(reading, rounds)):
                progress("proposing goals")
                changes = self.added(
                    tracker.likelihood,
                    tracker.belief,
                    tracker.turns,
                    [*past, *corrections],
                    told=_aims(reading),
                )
                if most is not None:
                    del changes[max(0, most - len(tracker.belief.goals)) :]
                tracker.add([change.goal for change in changes])
                unexplained = missing and not changes
            progress("checking goals")
            beliefs = [*(each.belief for each in rounds), tracker.belief]
            removed = self.removed(beliefs, tracker.turns, given=given)
            tracker.drop(change.goal for change in removed)
        return changes + removed, unexplained and not (reading and acting(reading.orders))

    @during(module="propose")
    def added(
        self,
        likelihood: Likelihood | None,
        belief: Belief,
        turns: Sequence[Turn],
        changes: Sequence[GoalChange],
        *,
        told: Sequence[str] = (),
    ) -> list[GoalChange]:
        """Goals to add.

        Args:
            likelihood: Scores the candidates; None adds the first ones.
            belief: The present one.
            turns: The transcript.
            changes: All earlier changes. A goal that was removed as the least likely is a candidate
                again; one whose removal was `final` is not.
            told: Aims in the person's own words, which are the first to add.
        """
        if self.propose == "paper":
            known = [*belief.goals, *belief.ruled_out]
            return propose(self.proposer, None, self.task, turns, known, keep=None)
        removed = [change for change in changes if change.kind == "removed"]
        ruled_out = [*belief.ruled_out, *(change.goal for change in removed if change.final)]
        out = {canonical(goal.text) for goal in (*belief.goals, *ruled_out)}
        past = {canonical(change.goal.text): change.goal for change in removed}
        return propose(
            self.proposer,
            likelihood,
            self.task,
            turns,
            [*belief.goals, *ruled_out],
            weights=belief.weights,
            past=[goal for text, goal in past.items() if text not in out],
            told=told,
            same=self.same,
        )

    @during(module="remove")
    def removed(
        self,
        beliefs: Sequence[Belief],
        turns: Sequence[Turn],
        *,
        given: Collection[Goal] = (),
    ) -> list[GoalChange]:
        """Goals to remove: the irrelevant, the unsafe, and the one that stays the least likely.

        The likeliest goal is kept if none would be left. A goal that the person confirmed counts as
        relevant.

        Args:
            beliefs: The belief after each round, the present one last.
            turns: The transcript.
            given: Goals to keep.
        """
        probable = dict(beliefs[-1].top())
        beliefs = [each.drop(given) for each in beliefs]
        belief = beliefs[-1]
        pinned = {goal for _, goal in belief.pinned}
        new = [goal for goal in belief.goals if goal not in self._cleared]
        free = [goal for goal in new if goal not in pinned]
        unfit: list[GoalChange] = []
        if self.remover:
            stated = [goal for goal in belief.goals if goal not in (UNSPECIFIED, *pinned)]
            unfit += self.remover.unfit(self.task, turns, stated)
        elif new:
            unfit += irrelevant(self.model, self.task, free)
            unfit += objectionable(self.model, new)
        self._cleared |= {*new} - {change.goal for change in unfit}
        stays = {*probable} - {UNSPECIFIED, *(change.goal for change in unfit)}
        late = [
            change
            for change in overdue(beliefs, self.patience)
            if self.propose == "paper"
            or (len(stays) > FEWEST and probable[change.goal] <= IMPROBABLE)
        ]
        found = {change.goal: change for change in (*late, *unfit)}
        if self.propose != "paper" and set(belief.goals) - {UNSPECIFIED} <= found.keys():
            likeliest = next((goal for goal, _ in belief.top() if goal != UNSPECIFIED), None)
            if likeliest and likeliest not in pinned:
                del found[likeliest]
        return list(found.values())


@contextmanager
def _all_or_nothing(tracker: Tracker) -> Generator[None]:
    """Restore the goals if an error ends the context."""
    belief, turns = tracker.belief, tracker.turns
    try:
        yield
    except BaseException:
        tracker.restore(belief, turns)
        raise


def _may_tell_aim(reading: Reading, *, known: bool) -> bool:
    """Whether goals may be proposed from words.

    Words that ask for nothing may tell an aim; orders do as long as no goal is `known`.
    """
    if reading.tells("aim"):
        return True
    if known:
        return reading.only_tells and not reading.says_nothing
    return reading.only_tells or bool(acting(reading.orders))


def _aims(reading: Reading | None) -> list[str]:
    """The aims that words tell, as they tell them."""
    return (
        [each.what for each in reading.orders if each.do == "aim" and each.what] if reading else []
    )


def _tells_another_aim(reading: Reading, rounds: Sequence[PastRound]) -> bool:
    """Whether an aim was told before, too: words that name both may seem explained by the old."""
    told = [reading, *(round.reading for round in rounds if round.reading)]
    return reading.tells("aim") and sum(each.tells("aim") for each in told) > 1


def _gist(text: str) -> str:
    """A goal's text without determiners; equal for goals that differ in nothing else."""
    return " ".join(word for word in canonical(text).split() if word not in _DETERMINERS)


def propose(
    proposer: Proposer,
    likelihood: Likelihood | None,
    task: str,
    turns: Sequence[Turn],
    goals: Sequence[Goal],
    *,
    weights: Sequence[tuple[int, float]] = (),
    past: Sequence[Goal] = (),
    told: Sequence[str] = (),
    keep: int | None = 3,
    same: Same | None = None,
) -> list[GoalChange]:
    """Goals to add to the known ones, those of the belief and its `ruled_out`.

    What the person `told` comes first, in their own words. The proposer lists candidates, likeliest
    first; one that differs from a known goal only by a determiner is none. With a likelihood, nor
    is one that says the `same` as a known or a better one. With it, too, the
    goals of the `past`, which had been removed, are candidates, too; those that explain the
    person's words best, and better than no goal, are added, up to `keep` goals in all. Turns count
    by their `weights` (see `Belief.weights`). Without a likelihood, the first ones are added, or
    all if `keep` is None.
    """
    known = {_gist(goal.text) for goal in (*goals, *past)}
    held_now = {_gist(goal.text) for goal in goals}
    own = {gist: Goal(text) for text in told if (gist := _gist(text)) and gist not in held_now}
    known |= own.keys()
    past = [goal for goal in past if _gist(goal.text) not in own]
    added = [GoalChange("added", goal, "the person's own words") for goal in own.values()][:keep]
    rest = None if keep is None else max(keep - len(added), 0)
    candidates = [*past] if likelihood else []
    held = [goal.text for goal in (*goals, *own.values()) if goal != UNSPECIFIED]
    for text in proposer.goals(task, turns, held):
        if _gist(text) not in known:
            candidates.append(Goal(text))
            known.add(_gist(text))
    if likelihood is None:
        proposed = candidates[:rest]
        return added + [GoalChange("added", goal, "the model proposed it") for goal in proposed]
    if not candidates:
        return added
    table = likelihood.log_likelihood(task, [*candidates, UNSPECIFIED], turns)
    table = weighed(table, weights)
    gains: list[float] = (table[:, :-1].sum(axis=0) - table[:, -1].sum()).tolist()
    best = list[tuple[Goal, float]]()
    for goal, gain in sorted(zip(candidates, gains, strict=True), key=lambda each: -each[1]):
        others = [*goals, *own.values(), *(better for better, _ in best)]
        if not (same and any(same(goal.text, other.text) for other in others)):
            best.append((goal, gain))
    return added + [
        GoalChange(
            "added",
            goal,
            f"explains what you said ({gain:+.1f} nats)"
            + (", after it had been removed" if goal in past else ""),
        )
        for goal, gain in best[:rest]
        if gain > 0
    ]


def objectionable(
    model: LikelihoodModel, goals: Sequence[Goal], *, margin: float = -0.2
) -> list[GoalChange]:
    """Goals that the model finds unsafe: likelier from a criminal than from a kind person.

    Args:
        model: Scores the goals.
        goals: Goals to check; `UNSPECIFIED` is never removed.
        margin: Log-odds, in nats, above which a goal is removed (docs/log.md).
    """
    return [
        GoalChange("removed", goal, f"unsafe, the model finds ({odds:+.1f} nats)", final=True)
        for goal, odds in harm(model, goals)
        if odds > margin
    ]


def harm(model: LikelihoodModel, goals: Sequence[Goal]) -> Iterator[tuple[Goal, float]]:
    """Each goal but `UNSPECIFIED`, with the log-odds of a criminal against a kind person, nats."""
    contexts = [render("harm", harmful=harmful) for harmful in (True, False)]
    return _contrast(model, goals, contexts, np.sum)


def irrelevant(
    model: LikelihoodModel, task: str, goals: Sequence[Goal], *, margin: float = 0.5
) -> list[GoalChange]:
    """Goals that the agent's task makes less likely than no particular task does.

    Args:
        model: Scores a goal given a task.
        task: The agent's task.
        goals: Goals to check; `UNSPECIFIED` is never removed.
        margin: Loss, in nats per token, above which a goal is removed.
    """
    return [
        GoalChange(
            "removed",
            goal,
            f"irrelevant: the task makes it less likely (-{loss:.1f} nats)",
            final=True,
        )
        for goal, loss in _contrast(
            model, goals, [render("relevance", task=each) for each in (ANY_TASK, task)], np.mean
        )
        if loss > margin
    ]


def _contrast(
    model: LikelihoodModel,
    goals: Sequence[Goal],
    contexts: Sequence[Sequence[Message]],
    over: Callable[[Array], Any],
) -> Iterator[tuple[Goal, float]]:
    """Each goal but `UNSPECIFIED`, with the log-odds of its words between two chats.

    Args:
        model: Scores the words.
        goals: Goals.
        contexts: Two chats.
        over: The sum of a goal's tokens, or their mean.
    """
    asked = [goal for goal in goals if goal != UNSPECIFIED]
    scores = logprobs_of(
        model, [context for context in contexts for _ in asked], [goal.text for goal in asked] * 2
    )
    nats = np.array([float(over(score)) for score in scores]).reshape(2, -1)
    return zip(asked, (nats[0] - nats[1]).tolist(), strict=True)


def overdue(beliefs: Sequence[Belief], patience: int) -> list[GoalChange]:
    """The goal that was the least likely for more than `patience` rounds in a row, if any.

    Args:
        beliefs: The belief after each round, the present one last.
        patience: n in the paper (Sec. 3.2).
    """
    worst = _least_likely(beliefs[-1]) if beliefs else None
    if worst is None:
        return []
    streak = 0
    for belief in reversed(beliefs):
        if _least_likely(belief) != worst:
            break
        streak += 1
    if streak <= patience:
        return []
    return [GoalChange("removed", worst, f"the least likely for {streak} rounds in a row")]


def _least_likely(belief: Belief) -> Goal | None:
    """The least likely specified goal; None where there are fewer than two to compare."""
    ranked = [goal for goal, _ in belief.top() if goal != UNSPECIFIED]
    return ranked[-1] if len(ranked) > 1 else None
