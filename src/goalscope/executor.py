"""Carries out orders: undoes, acts, or waits for a yes (see `goalscope.guards`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from goalscope.envs import Environment, Pick, execute
from goalscope.episode import Round, retracted, standing_after
from goalscope.guards import (
    CONFIRM,
    HARM,
    SAY_YES,
    is_wary,
    is_yes,
    reason_to_wait,
    speaks_of_harm,
    whether,
)
from goalscope.orders import Order, Reading
from goalscope.standing import LIMITS, Standing
from goalscope.types import StepResult, Turn

__all__ = ["NOTHING", "NOT_CONFIRMED", "NOT_HERE", "Execution", "Executor"]

NOT_HERE = "I cannot undo anything here. Please say what is to change."
"""A round's note where the environment undoes nothing."""

NOTHING = "There is nothing to undo. Please say what is to change."
"""A round's note where nothing was done that could be undone."""

NOT_CONFIRMED = "Not done."
"""A round's note where what waited for a yes got none."""

NOT_BACK = "Nobody can take that back."
"""Why an action is not undone."""

_ALL = "everything"
"""What an order to undo names for all."""


@dataclass(slots=True)
class Execution:
    """What comes of the orders of one round.

    Attributes:
        turn: What was said.
        reading: What it was read as.
        released: Orders that waited for a yes, and have it.
        harm: Whether a word of harm was said that the reading does not hold.
        wary: Whether one was said lately; see `is_wary`.
        retracts: Numbers of the rounds that were undone, the newest first.
        reversals: How many of the results undid them.
        results: What was done.
        failed: What could not be done.
        pending: What waits for a yes.
        reasons: Why, one by one.
        end: How the question whether it shall be done ends.
        notes: What to tell the person.
        standing: What holds after these words.
    """

    turn: Turn
    reading: Reading
    released: tuple[Order, ...] = ()
    harm: bool = False
    wary: bool = False
    retracts: tuple[int, ...] = ()
    reversals: int = 0
    results: list[StepResult] = field(default_factory=list[StepResult])
    failed: list[StepResult] = field(default_factory=list[StepResult])
    pending: list[Order] = field(default_factory=list[Order])
    reasons: list[str] = field(default_factory=list[str])
    end: str = "Shall I?"
    notes: list[str] = field(default_factory=list[str])
    standing: Standing = field(default_factory=Standing)

    @property
    def orders(self) -> list[Order]:
        """What was released, and then what was said."""
        new = (each for each in self.reading.orders if each not in self.released)
        return [*self.released, *new]

    def record(self, result: StepResult) -> None:
        """Note what came of an action."""
        (self.results if result.ok else self.failed).append(result)

    def hold(
        self, order: Order, reason: str, *, lasting: bool = False, grave: bool = False
    ) -> None:
        """Have an order wait for a yes: for the very word, if it lasts or lifts an allergy."""
        self.pending.append(order)
        self.reasons.append(reason)
        if lasting:
            self.end = CONFIRM
        elif grave and self.end != CONFIRM:
            self.end = SAY_YES

    @property
    def question(self) -> str:
        """What has to be asked next; "" where nothing has."""
        return HARM if self.harm else whether(self.pending, self.reasons, self.end)

    @property
    def ended(self) -> bool:
        """Whether the task ended."""
        return any(result.terminated for result in self.results)


class Executor:
    """Does what people order.

    Args:
        env: Where.
        pick: Finds which of the things that are here is meant.
        unsure: Nats of an order's margin below which it waits for a yes.
    """

    def __init__(self, env: Environment, pick: Pick, unsure: float) -> None:
        self._env = env
        self._pick = pick
        self._unsure = unsure
        self._verbs = {verb.name for verb in env.verbs}
        self._takes_away = {verb.name for verb in env.verbs if verb.takes_away}

    def execute(
        self, rounds: Sequence[Round], turn: Turn, reading: Reading, *, confirmed: bool
    ) -> Execution:
        """Undo what the words take back, then do what was ordered; what has to wait is pending.

        Where a word of harm was said that the reading does not hold, nothing by a verb is done, and
        nothing that lasts.

        Args:
            rounds: All before.
            turn: The newest words.
            reading: What they come to.
            confirmed: Whether the person confirmed what waited, other than in words.
        """
        harm = speaks_of_harm(turn.utterance, reading)
        done = Execution(
            turn,
            reading,
            released=() if harm else self._released(rounds, turn, reading, confirmed),
            harm=harm,
            wary=is_wary([(turn.utterance, reading), *readings_of(rounds)]),
        )
        if rounds and rounds[-1].pending and not done.released:
            done.notes.append(NOT_CONFIRMED)
        self._undo(rounds, done)
        done.standing = self.standing(
            rounds, reading, released=done.released, retracts=done.retracts
        )
        for order in done.orders:
            self._follow(order, done)
        return done

    def _follow(self, order: Order, done: Execution) -> None:
        """Do one order, or hold it where it needs a yes."""
        by_verb = order.do in self._verbs
        if not (by_verb or order.do in LIMITS) or (done.harm and by_verb):
            return
        new, reason = order not in done.released, ""
        if by_verb and new:
            limit = None if order.do in self._takes_away else done.standing.forbids(order)
            sure = done.reading.sure(order, self._unsure)
            reason = reason_to_wait(order, limit, sure=sure, wary=done.wary)
            if limit:
                done.hold(order, reason, grave=True)
                return
        binding = done.standing.beside(order, done.reading.orders)
        found = self._env.resolve(order, binding, self._pick)
        done.notes += [found.why] if found.why else []
        lasting = any(map(self._env.lasting, found.actions))
        if new and found.actions and (reason or lasting):
            if not done.harm:
                done.hold(order, reason, lasting=lasting)
            return
        for action in found.actions:
            result = execute(self._env, action)
            done.record(result)
            if not result.ok:
                break

    def standing(
        self,
        rounds: Sequence[Round],
        reading: Reading | None = None,
        *,
        released: Sequence[Order] = (),
        retracts: Sequence[int] = (),
    ) -> Standing:
        """See `standing_after`."""
        return standing_after(
            rounds,
            reading,
            released=released,
            retracts=retracts,
            takes_away=self._takes_away,
        )

    def _released(
        self, rounds: Sequence[Round], turn: Turn, reading: Reading, confirmed: bool
    ) -> tuple[Order, ...]:
        """The orders that waited for a yes to the last question, if this is one.

        A yes is said by itself, or by saying the orders again: with anything else, they would be
        done in another state than the one that was shown. What nobody can undo waits for the word
        itself.
        """
        last = rounds[-1] if rounds else None
        if not last or last.question == HARM or last.state != self._env.fingerprint():
            return ()
        agreed = {*reading.orders} <= {Order("yes"), *last.pending}
        if last.question.endswith(SAY_YES):
            agreed = is_yes(turn.utterance)
        return last.pending if confirmed or agreed else ()

    def _undo(self, rounds: Sequence[Round], done: Execution) -> None:
        """Undo what the last rounds did, guesses among it."""
        orders: list[Order] = []
        for order in done.orders:
            if order.do != "undo":
                continue
            if order in done.released or done.reading.sure(order, self._unsure):
                orders.append(order)
            else:
                done.hold(order, reason_to_wait(order, sure=False))
        if not orders:
            return
        gone = retracted(rounds)
        standing = [
            each
            for each in rounds
            if each.number not in gone
            and (len(each.results) > each.reversals or (each.reading and _binds(each.reading)))
        ]
        every = any(order.what == _ALL for order in orders)
        named = any(order.what not in ("", _ALL) for order in orders)
        count = sum(max(1, round(order.quantity or 1)) for order in orders)
        last = standing if every else [] if named else standing[-count:]
        if not last:
            done.notes.append(NOTHING)
            return
        left = self.standing(rounds, retracts=[each.number for each in last])
        back: list[Round] = []
        for each in reversed(last):
            found = self._env.undo(each.results[each.reversals :], left)
            if found is None:
                done.notes.append(NOT_HERE)
                return
            done.notes += [found.why] if found.why else []
            failed = len(done.failed)
            for action in found.actions:
                lasting = self._env.lasting(action)
                done.record(
                    StepResult(action, False, NOT_BACK) if lasting else execute(self._env, action)
                )
            back += [each] if len(done.failed) == failed else []
        if back:
            quoted = "; ".join(f'"{each.turn.utterance}"' for each in reversed(back))
            done.notes.append(f"Taken back: {quoted}.")
        done.retracts = tuple(each.number for each in back)
        done.reversals = len(done.results)


def readings_of(rounds: Sequence[Round]) -> list[tuple[str, Reading]]:
    """The utterances and what they were read as, newest first."""
    return [(each.turn.utterance, each.reading) for each in reversed(rounds) if each.reading]


def _binds(reading: Reading) -> bool:
    """Whether a reading changes what holds, though nothing may have been done for it."""
    return any(order.do in LIMITS for order in reading.orders)
