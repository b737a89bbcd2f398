"""The Action Module (Sec. 3.2, 4.2): what likely goals call for, and whether to do it unasked."""

from __future__ import annotations

from abc import abstractmethod
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np

from goalscope.agent.round import Guess
from goalscope.agent.writer import Writer
from goalscope.base.arrays import Array, Flags
from goalscope.base.types import Action, Goal, GoalscopeError, StepResult, Turn
from goalscope.envs import Environment, Proactive, execute, is_irreversible, scenarios_like
from goalscope.envs.scenarios import Scenario
from goalscope.language.cues import opposes
from goalscope.language.dialogue_state import DialogueState
from goalscope.models.embedding import embedded


@dataclass(frozen=True, slots=True)
class Want:
    """A goal to act for, with its probability; "" stands for the person's words alone.

    If the probabilities of all wants sum to less than 1, the rest is that of unknown goals.
    """

    text: str
    probability: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of planning for goals.

    Attributes:
        results: The actions that succeeded, in order.
        failed: The actions that failed.
        held: Things that are right for one goal and wrong for another: they wait for an answer.
        guessed: The things that were used.
        replans: Number of plans after the first.
    """

    results: tuple[StepResult, ...] = ()
    failed: tuple[StepResult, ...] = ()
    held: tuple[str, ...] = ()
    guessed: tuple[Guess, ...] = ()
    replans: int = 0


@dataclass(frozen=True, slots=True)
class Choice:
    """The decision on each of `n` things under the belief: act, hold, or neither.

    Attributes:
        act: [n] whether to act at once.
        hold: [n] whether an answer first is worth a question's cost.
        value: [n] expected value of acting at once, from -1 to 1.
    """

    act: Flags
    hold: Flags
    value: Array


def choose(probability: Array, value: Array, cost: float) -> Choice:
    """Act, hold back for an answer, or do nothing: whichever has the greatest expected value.

    Doing nothing is worth 0. Asking first avoids the expected harm of acting now, at the cost of a
    question (value of perfect information; Howard, 1966).

    Args:
        probability: [G] of each goal; sums to 1.
        value: [G, n] value of each thing under each goal, from -1 to 1.
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
        dialogue: DialogueState,
    ) -> Outcome:
        """Plan and act; a plan that fails is undone.

        Irreversible actions are never taken unasked.

        Args:
            env: Where to act.
            wants: Goals to act for.
            turns: The conversation, the newest turn last.
            history: All actions so far, to replay for an undo.
            dialogue: The state of the dialogue.

        Raises:
            GoalscopeError: An undo did not restore the environment.
        """
        ...


class NeedPlanner:
    """Does what likely goals call for, by scenarios that people described.

    The scenarios most like the person's words and a goal vote on what to do under that goal; the
    share of votes beyond `Proactive.agreed` is its value. So what several goals share comes
    first. In a domain without scenarios the writer lists needs and judges them, along with what
    the environment offers.

    Args:
        writer: Lists and judges needs where there are no scenarios.
        limit: Largest number of things in one round.
        cost: Of a question before acting; see `choose`.
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
        dialogue: DialogueState,
    ) -> Outcome:
        """See `Planner.act`; nothing is done unasked in an environment that is not `Proactive`."""
        if not isinstance(env, Proactive):
            return Outcome()
        goals = {want.text: want.probability for want in wants}
        if not goals or sum(goals.values()) < 1 - _LITTLE:
            goals[""] = goals.get("", 0.0) + 1 - sum(goals.values())
        probability = np.array([*goals.values()]) / sum(goals.values())
        names: dict[ActionSequence, str] = {}

        @cache
        def served(need: str) -> ActionSequence:
            sequence = tuple(env.serving(need, dialogue))
            names.setdefault(sequence, need)
            return sequence

        leading = int(probability.argmax())
        shown = self.writer.recent([Turn("", turn.utterance) for turn in turns])
        said = " ".join(turn.utterance for turn in shown)
        sequences, value = self._values(env, [*goals], leading, said, served)
        if not sequences:
            return Outcome()
        choice = choose(probability, value, self.cost)
        best_first: list[int] = np.argsort(-choice.value, kind="stable").tolist()
        held = [names[sequences[i]] for i in best_first if choice.hold[i]]
        chosen = [i for i in best_first if choice.act[i]][: self.limit]
        served_goals: list[int] = (probability[:, None] * value).argmax(axis=0).tolist()
        # In the order of the scenarios, as one sequence may build on another.
        plan = [(sequences[i], [*goals][served_goals[i]]) for i in sorted(chosen)]
        return _carried_out(env, plan, history, tuple(held[: self.limit]), dialogue.given_up)

    def _values(
        self, env: Proactive, goals: Sequence[str], leading: int, said: str, served: Served
    ) -> tuple[list[ActionSequence], Array]:
        """What may be done, and the value [G, n] of each under each goal, from -1 to 1."""

        @cache
        def kind(sequence: ActionSequence) -> str:
            return "; ".join(map(env.kind, sequence))

        found = [
            called_for(env.like(f"{said} {goal}".strip(), _LIKE), served, kind) for goal in goals
        ]
        if any(found):
            values = [
                {each: max(share - env.agreed, -1.0) for each, share in row.items()}
                for row in found
            ]
            missing = -env.agreed
        else:
            values, missing = self._judged(env, goals, leading, said, served), -1.0
        sequences = [*dict.fromkeys(each for row in values for each in row)]
        return sequences, np.array(
            [[row.get(each, missing) for each in sequences] for row in values]
        )

    def _judged(
        self, env: Proactive, aims: Sequence[str], leading: int, said: str, served: Served
    ) -> list[dict[ActionSequence, float]]:
        """The value under each aim, from -1 to 1, of what the writer lists for the leading one."""
        room = env.room()
        written = self.writer.needs(aims[leading], said, (), room)
        listed = [*written, *env.offers(f"{said} {aims[leading]}".strip(), _OFFERS)]
        sequences = {sequence: thing for thing in reversed(listed) if (sequence := served(thing))}
        if not sequences:
            return []
        judged = self.writer.judged([*sequences.values()], aims, said, (), room)
        value = 2 * judged[:, :, 0] + judged[:, :, 1] - 1
        return [dict(zip(sequences, row, strict=True)) for row in value.tolist()]


def same_aim(env: Environment, one: str, other: str) -> bool:
    """Whether two goals say the same: their words mean nearly that, and scenarios like them agree.

    Words alone do not tell: those of "bake a chocolate cake" and "bake a gluten-free cake" are as
    close (docs/log.md). Of an environment without scenarios all goals differ.
    """
    first, second = embedded([one, other])
    if first @ second < _CLOSE or opposes(one, Goal(other)):
        return False
    near = [{each.id for each in scenarios_like(env, text, _LIKE)} for text in (one, other)]
    return len(near[0] & near[1]) >= _SHARED


_CLOSE, _SHARED = 0.75, 6
"""Least cosine of two goals that say the same, and least number of nearest scenarios they share."""
_LIKE = 8
"""Scenarios that vote."""
_OFFERS = 16
"""Things of the environment that are judged where there are no scenarios."""
_LITTLE = 0.1
"""Probability of unknown goals below which they get no vote."""
_FALL = 0.3  # nats by which each next scenario counts less
_RANKS = 30  # place in a scenario's list from which on a thing has no vote

ActionSequence = tuple[Action, ...]
"""The actions that serve one need."""

Served = Callable[[str], ActionSequence]
"""Finds the actions that serve a need; none if nothing does."""


def called_for(
    like: Sequence[Scenario],
    served: Served,
    kind: Callable[[ActionSequence], str] = str,
) -> dict[ActionSequence, float]:
    """The scenarios' votes for each sequence of actions, up to 1 if all of them need it first.

    Nearer scenarios count more, and what is unwanted in one counts against a sequence. Needs that
    the same sequence serves are one. One sequence of each kind gets the votes of the whole kind, so
    that people who want different flours vote for one: the plain one if enough want it, or else the
    one with the most votes. The sequences are in the order of the scenarios, as one may build on
    another.

    Args:
        like: The scenarios, nearest first.
        served: Finds the sequence that serves a need.
        kind: See `Proactive.kind`.
    """
    weights = np.exp(-_FALL * np.arange(len(like)))
    found: dict[ActionSequence, float] = defaultdict(float)
    places: dict[ActionSequence, int] = {}
    ballots: list[dict[ActionSequence, float]] = []
    for weight, each in zip((weights / weights.sum()).tolist(), like, strict=True):
        votes: dict[ActionSequence, float] = {}
        for things, worth in ((each.needed, 1.0), (each.nice, 0.5), (each.unwanted, -1.0)):
            for rank, thing in enumerate(things):
                if sequence := served(thing):
                    votes.setdefault(sequence, weight * worth * (1 - rank / _RANKS))
        for place, (sequence, vote) in enumerate(votes.items()):
            found[sequence] += vote
            if vote > 0:
                places.setdefault(sequence, place)
        ballots.append(votes)
    speakers: dict[str, ActionSequence] = {}
    for sequence in sorted(places, key=found.__getitem__, reverse=True):
        speakers.setdefault(kind(sequence), sequence)
    for name, sequence in speakers.items():
        plain = served(name)
        speaker = plain if plain in places and found[plain] > found[sequence] / 2 else sequence
        for votes in ballots:
            if speaker not in votes:
                found[speaker] += max((v for w, v in votes.items() if kind(w) == name), default=0)
    return {each: found[each] for each in sorted(places, key=places.__getitem__)}


def _carried_out(
    env: Proactive,
    plan: Sequence[tuple[ActionSequence, str]],
    history: Sequence[StepResult],
    held: tuple[str, ...],
    given_up: Sequence[str],
) -> Outcome:
    """Execute each sequence, for its goal, unless it repeats something or cannot be undone."""
    results, failed, guessed = list[StepResult](), list[StepResult](), list[Guess]()
    acts = [each.action for each in history if each.action.target not in given_up]
    used = {name for each in acts for name in each.things}
    kinds = {env.kind(each) for each in acts}
    for actions, goal in plan:
        if any(
            each.target in used or env.kind(each) in kinds or is_irreversible(env, each)
            for each in actions
        ):
            continue
        kinds |= {env.kind(each) for each in actions}
        done, failure = attempted(env, actions, [*history, *results])
        results += done
        failed += [failure] if failure else []
        targets = dict.fromkeys(result.action.target for result in done)
        guessed += [Guess(target, goal) for target in targets]
    return Outcome(tuple(results), tuple(failed), held, tuple(guessed))


def attempted(
    env: Environment, actions: Sequence[Action], history: Sequence[StepResult]
) -> tuple[list[StepResult], StepResult | None]:
    """Execute all of the actions or none; returns the results, and the failure if there was one.

    Args:
        env: Where to act.
        actions: In order.
        history: All actions before them, to replay for an undo.

    Raises:
        GoalscopeError: An undo did not restore the environment.
    """
    start = env.state().fingerprint
    results: list[StepResult] = []
    for action in actions:
        result = execute(env, action)
        if not result.ok:
            if results:
                replay(env, history, start)
            return [], result
        results.append(result)
    return results, None


def replay(env: Environment, history: Sequence[StepResult], expected: str | None = None) -> None:
    """Reset `env` and replay `history`.

    Args:
        env: The environment.
        history: The actions to keep.
        expected: The fingerprint that the environment must then have, if it is known.

    Raises:
        GoalscopeError: A replayed action fails, or the fingerprint differs.
    """
    env.reset()
    for result in history:
        again = execute(env, result.action)
        if not again.ok:
            raise GoalscopeError(
                f"The action {result.action} cannot be done again: {again.observation} "
                "Has the catalogue or scene changed since? Start a new episode."
            )
    if expected is not None and env.state().fingerprint != expected:
        raise GoalscopeError(
            "Doing the earlier actions again led to another state than before, so that the agent "
            "stops. Look at what has changed, and start a new episode."
        )
