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
from goalscope.words import singulars
from goalscope.writer import LIKE, Writer

__all__ = ["Choice", "Guess", "NeedPlanner", "Outcome", "Planner", "Want"]
__all__ += ["attempted", "choose", "shares", "undo"]

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
    """Does what the likely goals call for, as occasions from life and a taught writer know it.

    What the occasions nearest to the person's words and a goal call for is what the goal may call
    for; the writer judges each of these things under each goal. How right a thing is under a goal
    is the mean of both. So what several goals share comes first.

    Args:
        writer: Judges; and lists needs where there are no occasions, beside what is here.
        limit: Most things done in one round.
        most: Most candidates that are judged.
        cost: Of a question before acting (see `choose`).
    """

    def __init__(
        self, writer: Writer, *, limit: int = 8, most: int = 16, cost: float = 0.2
    ) -> None:
        self.writer = writer
        self.limit = limit
        self.most = most
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
            targets = dict.fromkeys(result.action.target for result in done)
            guessed += [Guess(target, goals[need]) for target in targets]
        return Outcome(tuple(results), tuple(failed), tuple(held), tuple(guessed))

    def needs(
        self, env: Environment, wants: Sequence[Want], turns: Sequence[Turn], standing: Standing
    ) -> tuple[list[str], list[str], dict[str, str]]:
        """What to do, in order; what to hold back; and the goal that each is for."""
        said = self.said(turns)
        aims = {want.text: want.probability for want in wants}
        if not aims or sum(aims.values()) < 1 - _LITTLE:
            aims[""] = aims.get("", 0.0) + 1 - sum(aims.values())
        weights = np.array([*aims.values()]) / sum(aims.values())
        leading = int(weights.argmax())
        like = [env.like(f"{said} {aim}".strip(), LIKE) for aim in aims]
        room = env.here()
        known = [shares(each) for each in like]
        listed = not any(known)
        if listed:
            written = self.writer.needs([*aims][leading], said, (), room)
            offered = env.offers(f"{said} {[*aims][leading]}".strip(), self.most)
            known = [dict.fromkeys([*written, *offered], 1.0)] * len(aims)
        mean: dict[str, float] = {}
        for weight, each in zip(weights.tolist(), known, strict=True):
            for thing, share in each.items():
                mean[thing] = mean.get(thing, 0.0) + weight * share
        ranked = sorted(mean, key=lambda thing: -mean[thing])
        things = _served(env, ranked, standing, self.most)
        if not things:
            return [], [], {}
        judged = self.writer.judged(things, [*aims], said, like[leading], room)
        share = np.array([[each.get(thing, 0.0) for thing in things] for each in known])
        right = judged[:, :, 0] + judged[:, :, 1] / 2
        right = right if listed else (share + right) / 2
        choice = choose(weights, right, self.cost)
        leaders: list[int] = (weights[:, None] * right).argmax(axis=0).tolist()
        goals = {thing: [*aims][at] for thing, at in zip(things, leaders, strict=True)}
        order: list[int] = np.argsort(-choice.value, kind="stable").tolist()
        act = [things[i] for i in order if choice.act[i]][: self.limit]
        held = [things[i] for i in order if choice.hold[i]][: self.limit]
        return _in_turn(act, like[leading]), held, goals

    def said(self, turns: Sequence[Turn]) -> str:
        """The newest of the person's words, as many as a prompt can hold."""
        shown = recent(self.writer.model, [Turn("", turn.utterance) for turn in turns], 6)
        return " ".join(turn.utterance for turn in shown)


_LITTLE = 0.1
"""Probability of other goals below which what they call for is not asked."""
_FALL = 0.3  # by which each next occasion counts less, in nats
_RANKS = 30  # things after which one more counts for nothing


def shares(like: Sequence[Occasion]) -> dict[str, float]:
    """How much occasions speak for each thing: 1 where all of them need it first of all.

    Nearer ones count more, and what nobody wants there counts against a thing. Things of the same
    words in the singular are one.
    """
    weights = np.exp(-_FALL * np.arange(len(like)))
    found: dict[str, float] = {}
    names: dict[str, str] = {}
    for weight, each in zip((weights / weights.sum()).tolist(), like, strict=True):
        for things, worth in ((each.needed, 1.0), (each.nice, 0.5), (each.unwanted, -1.0)):
            for rank, thing in enumerate(things):
                name = names.setdefault(" ".join(singulars(thing)), thing)
                found[name] = found.get(name, 0.0) + weight * worth * (1 - rank / _RANKS)
    return {thing: share for thing, share in found.items() if share > 0}


def _served(env: Environment, things: Sequence[str], standing: Standing, most: int) -> list[str]:
    """The first that something here serves, and none that is served by what serves another."""
    found: dict[tuple[Action, ...], str] = {}
    for thing in things:
        if len(found) == most:
            break
        if actions := tuple(env.serving(thing, standing)):
            found.setdefault(actions, thing)
    return [*found.values()]


def _in_turn(things: Sequence[str], like: Sequence[Occasion]) -> list[str]:
    """In the order in which occasions have them, as steps may build on one another."""
    places: dict[str, int] = {}
    for each in like:
        for place, thing in enumerate((*each.needed, *each.nice)):
            places.setdefault(thing, place)
    return sorted(things, key=lambda thing: places.get(thing, len(places)))


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
