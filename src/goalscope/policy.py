"""Acting on likely goals (Sec. 3.2 and 4.2): what they call for, and whether to do it unasked."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from goalscope.envs import Environment, taken
from goalscope.occasions import Occasion
from goalscope.prompts import recent
from goalscope.standing import Standing
from goalscope.types import Action, GoalscopeError, StepResult, Turn
from goalscope.writer import LIKE, Writer

__all__ = ["Choice", "Guess", "NeedPlanner", "Outcome", "Planner", "Want"]
__all__ += ["attempted", "choose", "undo"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Want:
    """Something to act for: a goal, or "" where only the person's words are known.

    Where the probabilities of all that is wanted do not sum to 1, the rest is that of other goals,
    of which nothing is known but what the person said.
    """

    text: str
    probability: float


@dataclass(frozen=True, slots=True)
class Guess:
    """Something that was done though nobody asked for it: with what, and for which goal."""

    target: str
    goal: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of planning.

    Attributes:
        results: The actions that stand, in order.
        failed: What was tried and could not be done.
        held: What would be right for one goal and wrong for another, and waits for an answer.
        guessed: What was done.
        replans: How many plans were made anew.
    """

    results: tuple[StepResult, ...] = ()
    failed: tuple[StepResult, ...] = ()
    held: tuple[str, ...] = ()
    guessed: tuple[Guess, ...] = ()
    replans: int = 0


@dataclass(frozen=True, slots=True)
class Choice:
    """What to do about each of `n` things under the whole belief; to do nothing where neither.

    Attributes:
        act: [n] whether to act at once.
        hold: [n] whether an answer is worth a question's cost before that.
        value: [n] expected value of acting at once, from -1 to 1.
    """

    act: Flags
    hold: Flags
    value: Array


def choose(probability: Array, right: Array, cost: float) -> Choice:
    """Act, hold back for an answer, or do nothing: whichever has the greatest expected value.

    To do what is right is worth 1, what is wrong -1, and nothing 0. To ask, and then to act if that
    is right, saves the expected harm of acting now, and has its cost (value of perfect information;
    Howard, 1966).

    Args:
        probability: [G] of each goal; sums to 1.
        right: [G, n] probability that something is right under each goal.
        cost: Of a question.
    """
    value = 2 * right - 1
    now = probability @ value
    asked = probability @ np.maximum(value, 0) - cost
    act = (now > 0) & (now >= asked)
    return Choice(act=act, hold=~act & (asked > 0), value=now)


class Planner(Protocol):
    """Chooses what to do unasked, and does it."""

    @abstractmethod
    def act(
        self,
        env: Environment,
        wants: Sequence[Want],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        standing: Standing,
    ) -> Outcome:
        """Plan and act; what fails leaves nothing half done.

        What nobody could undo is never done unasked.

        Args:
            env: Where to act.
            wants: What to act for.
            turns: The conversation, the newest turn last.
            history: Every action that stands so far, for undoing.
            standing: What holds after what was said.

        Raises:
            GoalscopeError: After undoing something, the environment is not as it was before.
        """
        ...


class NeedPlanner:
    """Does what the likely goals call for, as a taught writer and occasions from life know it.

    The writer lists what the likeliest goal calls for; the occasions nearest to the person's words
    add what they call for. Then the writer judges each of these under each goal. What several
    goals share comes first.

    Args:
        writer: Lists and judges.
        limit: Most things done in one round.
        most: Most candidates that are judged.
        nice: Probability of being right of what would be nice.
        cost: Of a question before acting (see `choose`).
    """

    def __init__(
        self,
        writer: Writer,
        *,
        limit: int = 8,
        most: int = 24,
        nice: float = 0.5,
        cost: float = 0.2,
    ) -> None:
        self.writer = writer
        self.limit = limit
        self.most = most
        self.nice = nice
        self.cost = cost

    def act(
        self,
        env: Environment,
        wants: Sequence[Want],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        standing: Standing,
    ) -> Outcome:
        """See `Planner.act`."""
        needs, held, goals = self.needs(env, wants, turns, standing)
        results, failed, guessed = list[StepResult](), list[StepResult](), list[Guess]()
        used = {name for each in history for name in (each.action.target, each.action.destination)}
        for need in needs:
            actions = env.serving(need, standing)
            if any(each.target in used or env.lasting(each) for each in actions):
                continue
            done, problem = attempted(env, actions, [*history, *results])
            results += done
            failed += [problem] if problem else []
            guessed += [Guess(actions[-1].target, goals[need])] if done else []
        return Outcome(tuple(results), tuple(failed), tuple(held), tuple(guessed))

    def needs(
        self, env: Environment, wants: Sequence[Want], turns: Sequence[Turn], standing: Standing
    ) -> tuple[list[str], list[str], dict[str, str]]:
        """What to do, in order; what to hold back; and the goal that each is for."""
        said = self.said(turns)
        aims = {want.text: want.probability for want in wants}
        if not aims or sum(aims.values()) < 1 - _LITTLE:
            aims[""] = aims.get("", 0.0) + 1 - sum(aims.values())
        leading = max(aims, key=lambda aim: (aim != "", aims[aim]))
        like = env.like(f"{said} {leading}".strip(), LIKE)
        room = env.here()
        written = self.writer.needs(leading, said, like, room)
        things = _candidates(env, written, like, standing)[: self.most]
        if not things:
            return [], [], {}
        judged = self.writer.judged(things, [*aims], said, like, room)
        right = judged[:, :, 0] + self.nice * judged[:, :, 1]
        weights = np.array([*aims.values()]) / sum(aims.values())
        choice = choose(weights, right, self.cost)
        leaders: list[int] = (weights[:, None] * right).argmax(axis=0).tolist()
        best = [[*aims][leader] for leader in leaders]
        order: list[int] = np.argsort(-choice.value, kind="stable").tolist()
        act = [things[i] for i in order if choice.act[i]][: self.limit]
        steps = [thing for thing in written if thing in act]
        held = [things[i] for i in order if choice.hold[i] and env.serving(things[i], standing)]
        return (
            list(dict.fromkeys([*steps, *act])),
            held[: self.limit],
            dict(zip(things, best, strict=True)),
        )

    def said(self, turns: Sequence[Turn]) -> str:
        """The newest of the person's words, as many as a prompt can hold."""
        shown = recent(self.writer.model, [Turn("", turn.utterance) for turn in turns], 6)
        return " ".join(turn.utterance for turn in shown)


_LITTLE = 0.1
"""Probability of other goals below which what they call for is not asked."""


def _candidates(
    env: Environment, written: Sequence[str], like: Sequence[Occasion], standing: Standing
) -> list[str]:
    """Needs that may be served here, those first that most speaks for.

    What was written is kept even if it cannot be done yet: what comes before may make it possible.
    """
    votes = {thing: 2 - rank / 20 for rank, thing in enumerate(written)}
    for each in like:
        for things, weight in ((each.needed, 1.0), (each.nice, 0.5), (each.unwanted, -1.0)):
            for rank, thing in enumerate(things):
                votes[thing] = votes.get(thing, 0.0) + weight * (1 - rank / 40)
    found: list[str] = []
    seen = set[tuple[Action, ...]]()
    for thing in sorted(votes, key=lambda thing: -votes[thing]):
        actions = tuple(env.serving(thing, standing))
        if (actions or thing in written) and actions not in seen:
            found.append(thing)
        seen |= {actions} if actions else set()
    return found


def attempted(
    env: Environment, actions: Sequence[Action], history: Sequence[StepResult]
) -> tuple[list[StepResult], StepResult | None]:
    """Take actions, all or none: what came of them, and the one that was impossible, if one was.

    Args:
        env: Where to act.
        actions: In order.
        history: Every action that stands before them, for undoing.

    Raises:
        GoalscopeError: After undoing some, the environment is not as it was before.
    """
    start = env.fingerprint()
    results: list[StepResult] = []
    for action in actions:
        result = taken(env, action)
        if not result.ok:
            if results:
                undo(env, history, start)
            return [], result
        results.append(result)
    return results, None


def undo(env: Environment, history: Sequence[StepResult], expected: str | None = None) -> None:
    """Take `env` back to where `history` left it: reset, and replay what succeeded.

    Args:
        env: Where the actions were taken.
        history: What stands.
        expected: The fingerprint that the environment then must have, where it is known.

    Raises:
        GoalscopeError: An action that once succeeded now fails, or the state is another one.
    """
    env.reset()
    for result in history:
        again = taken(env, result.action)
        if not again.ok:
            raise GoalscopeError(
                f"The action {result.action} cannot be done again: {again.observation} "
                "Has the catalogue or scene changed since? Start a new episode."
            )
    if expected is not None and env.fingerprint() != expected:
        raise GoalscopeError(
            "Doing the earlier actions again led to another state than before, so that the agent "
            "stops. Look at what has changed, and start a new episode."
        )
