"""Acting on likely goals (Sec. 3.2 and 4.2): what they call for, and whether to do it unasked."""

from __future__ import annotations

from abc import abstractmethod
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from goalscope.envs import Environment, execute
from goalscope.occasions import Occasion
from goalscope.prompts import recent
from goalscope.standing import Standing
from goalscope.types import Action, GoalscopeError, StepResult, Turn
from goalscope.writer import Writer

__all__ = ["Choice", "Guess", "NeedPlanner", "Outcome", "Planner", "Want"]
__all__ += ["attempted", "called_for", "choose", "undo"]

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


def choose(probability: Array, value: Array, cost: float) -> Choice:
    """Act, hold back for an answer, or do nothing: whichever has the greatest expected value.

    To do nothing is worth 0. To ask, and then to act if that is right, saves the expected harm of
    acting now, and has its cost (value of perfect information; Howard, 1966).

    Args:
        probability: [G] of each goal; sums to 1.
        value: [G, n] what it is worth to do something under each goal, from -1 to 1.
        cost: Of a question.
    """
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
    """Does what the likely goals call for, as occasions from life know it.

    What those like the person's words and a goal call for is worth doing under that goal, as far
    as more of them call for it than must (`Environment.agreed`). So what several goals share comes
    first. Where there are no occasions, the writer lists needs and judges them, beside what is
    here.

    Args:
        writer: Lists and judges where nothing is known from life.
        limit: Most things done in one round.
        cost: Of a question before acting (see `choose`).
    """

    def __init__(self, writer: Writer, *, limit: int = 8, cost: float = 0.2) -> None:
        self.writer = writer
        self.limit = limit
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
        said = self.said(turns)
        aims = {want.text: want.probability for want in wants}
        if not aims or sum(aims.values()) < 1 - _LITTLE:
            aims[""] = aims.get("", 0.0) + 1 - sum(aims.values())
        weights = np.array([*aims.values()]) / sum(aims.values())
        served = _Served(env, standing)
        known = [
            called_for(env.like(f"{said} {aim}".strip(), _LIKE), served, served.kind)
            for aim in aims
        ]
        worth = [{way: share - env.agreed for way, share in each.items()} for each in known]
        if not any(known):
            worth = self._judged(env, [*aims], int(weights.argmax()), said, served)
        ways = [*dict.fromkeys(way for each in worth for way in each)]
        if not ways:
            return Outcome()
        missing = -env.agreed if any(known) else -1.0
        value = np.array([[each.get(way, missing) for way in ways] for each in worth])
        choice = choose(weights, value, self.cost)
        order: list[int] = np.argsort(-choice.value, kind="stable").tolist()
        held = [served.names[ways[i]] for i in order if choice.hold[i]][: self.limit]
        leaders: list[int] = (weights[:, None] * value).argmax(axis=0).tolist()
        chosen = sorted(i for i in [i for i in order if choice.act[i]][: self.limit])
        results, failed, guessed = list[StepResult](), list[StepResult](), list[Guess]()
        used = {name for each in history for name in (each.action.target, each.action.destination)}
        done_before = {env.kind(each.action) for each in history}
        for i in chosen:
            if any(
                each.target in used or env.kind(each) in done_before or env.lasting(each)
                for each in ways[i]
            ):
                continue
            done_before |= {env.kind(each) for each in ways[i]}
            done, problem = attempted(env, ways[i], [*history, *results])
            results += done
            failed += [problem] if problem else []
            targets = dict.fromkeys(result.action.target for result in done)
            guessed += [Guess(target, [*aims][leaders[i]]) for target in targets]
        return Outcome(tuple(results), tuple(failed), tuple(held), tuple(guessed))

    def said(self, turns: Sequence[Turn]) -> str:
        """The newest of the person's words, as many as a prompt can hold."""
        shown = recent(self.writer.model, [Turn("", turn.utterance) for turn in turns], 6)
        return " ".join(turn.utterance for turn in shown)

    def _judged(
        self, env: Environment, aims: Sequence[str], leading: int, said: str, served: _Served
    ) -> list[dict[Way, float]]:
        """What is worth doing under each aim, from -1 to 1, of what the writer lists for one."""
        room = env.here()
        written = self.writer.needs(aims[leading], said, (), room)
        listed = [*written, *env.offers(f"{said} {aims[leading]}".strip(), _OFFERS)]
        ways = {way: thing for thing in reversed(listed) if (way := served(thing))}
        if not ways:
            return []
        judged = self.writer.judged([*ways.values()], aims, said, (), room)
        value = 2 * judged[:, :, 0] + judged[:, :, 1] - 1
        return [dict(zip(ways, row, strict=True)) for row in value.tolist()]


_LIKE = 8
"""Occasions that are asked what an aim calls for."""
_OFFERS = 16
"""Things that are here and are judged, where nothing is known from life."""
_LITTLE = 0.1
"""Probability of other goals below which what they call for is not asked."""
_FALL = 0.3  # by which each next occasion counts less, in nats
_RANKS = 30  # things after which one more counts for nothing

Way = tuple[Action, ...]
"""What is done for one need."""


class _Served:
    """What serves a need here, in what way; each is looked up once."""

    def __init__(self, env: Environment, standing: Standing) -> None:
        self._env, self._standing = env, standing
        self._ways: dict[str, Way] = {}
        self._kinds: dict[Way, str] = {}
        self.names: dict[Way, str] = {}

    def __call__(self, need: str) -> Way:
        """The actions; none where nothing serves it."""
        if need not in self._ways:
            self._ways[need] = tuple(self._env.serving(need, self._standing))
            self.names.setdefault(self._ways[need], need)
        return self._ways[need]

    def kind(self, way: Way) -> str:
        """The kinds of its actions."""
        if way not in self._kinds:
            self._kinds[way] = "; ".join(map(self._env.kind, way))
        return self._kinds[way]


def called_for(
    like: Sequence[Occasion],
    served: Callable[[str], Way],
    kind: Callable[[Way], str] = str,
) -> dict[Way, float]:
    """How much occasions call for each thing to be done, up to 1 where all need it first of all.

    Nearer ones count more, and what nobody wants there counts against a thing. Needs that are
    served in the same way are one. Of a kind, one has the votes of all, so that a flour has those
    of people who want another: the plain one if enough want it, or else the most wanted. They
    are in the order in which occasions have them, as one may build on another.

    Args:
        like: The occasions, nearest first.
        served: Finds what serves a need.
        kind: See `Environment.kind`.
    """
    weights = np.exp(-_FALL * np.arange(len(like)))
    found: dict[Way, float] = defaultdict(float)
    places: dict[Way, int] = {}
    ballots: list[dict[Way, float]] = []
    for weight, each in zip((weights / weights.sum()).tolist(), like, strict=True):
        votes: dict[Way, float] = {}
        for things, worth in ((each.needed, 1.0), (each.nice, 0.5), (each.unwanted, -1.0)):
            for rank, thing in enumerate(things):
                if way := served(thing):
                    votes.setdefault(way, weight * worth * (1 - rank / _RANKS))
        for place, (way, vote) in enumerate(votes.items()):
            found[way] += vote
            if vote > 0:
                places.setdefault(way, place)
        ballots.append(votes)
    speakers: dict[str, Way] = {}
    for way in sorted(places, key=lambda way: -found[way]):
        speakers.setdefault(kind(way), way)
    for name, way in speakers.items():
        plain = served(name)
        speaker = plain if plain in places and found[plain] > found[way] / 2 else way
        for votes in ballots:
            if speaker not in votes:
                found[speaker] += max((v for w, v in votes.items() if kind(w) == name), default=0)
    return {way: found[way] for way in sorted(places, key=lambda way: places[way])}


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
        result = execute(env, action)
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
        again = execute(env, result.action)
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
