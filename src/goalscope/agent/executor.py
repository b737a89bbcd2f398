"""Executes orders, undoes rounds, and holds what needs a yes (see `goalscope.agent.guards`)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from goalscope.agent.guards import (
    CONFIRM,
    HARM,
    SAY_YES,
    Awaited,
    agrees,
    begins_with_yes,
    excepts,
    is_wary,
    is_yes,
    misses_an_exception,
    reason_to_wait,
    speaks_of_harm,
)
from goalscope.agent.people import completes
from goalscope.agent.round import Guess, Round, mentions, retracted, state_after, undoable
from goalscope.base.nouns import singulars
from goalscope.base.text import is_question
from goalscope.base.types import Action, StepResult, Turn
from goalscope.belief.belief import Belief
from goalscope.envs import Environment, Pick, Resolution, execute, is_irreversible, resolve
from goalscope.language.dialogue_state import GRAVE, LIMITS, DialogueState, acting, is_grave, lifted
from goalscope.language.orders import Order, Reading, order_in_words

NOT_HERE = "I cannot undo anything here. Please say what is to change."
"""Note where the environment cannot undo."""

STAYS = "An undo leaves allergies and diets as they are:"
"""Beginning of a note on those that were said with what was taken back."""

NOTHING = "There is nothing to undo. Please say what is to change."
"""Note where nothing was done that could be undone."""

NOT_CONFIRMED = 'Not done, as {}: "{}".'
"""Note where an order that waited for a yes did not get it, and why."""

UNANSWERED = 'That is neither a clear yes nor a clear no, so this still waits: "{}".'
"""Note where the words left that open."""

KEPT_IN_FULL = 'You named an exception, but this holds without any: "{}".'
"""Note where words of exception stand beside an allergy or a diet."""

IDLE = 'Nothing was done at "{}", so there is nothing to undo.'
"""Note where the last round had orders of which nothing came."""

NOT_BACK = "Nobody can take that back."
"""Why an irreversible action is not undone."""

ENDS = "That ends the task."
"""Why the end of the task waits for a yes where its phrase was not said."""

_UNDO = Order("undo")

_LEAVING = ("yes", "ask", "none")
"""Dialogue acts that leave open what waits."""

_ALL = "everything"
"""The thing that an order to undo all names."""


@dataclass(slots=True)
class Execution:
    """The outcome of the orders of one round.

    Attributes:
        turn: What was said.
        reading: What it was read as.
        released: Orders that waited for a yes and now have it.
        shown: The actions that the person then saw listed.
        kept: The last round, where what waited there still waits.
        harm: Whether a word of harm was said that the reading lacks.
        wary: Whether one was said lately; see `is_wary`.
        retracts: Numbers of the rounds that were undone, the newest first.
        reversals: Number of results, the first ones, that undid them.
        results: Actions that succeeded.
        failed: Actions that failed.
        pending: Orders that wait for a yes.
        listed: The actions that they come to, as far as those are known.
        reasons: Why each of them waits.
        end: End of the question about them.
        notes: What to tell the person.
        missing: Whether an order named what is not here.
        given_up: Guesses that were taken back with the goals that they served.
        offer: Question whether to take back, too, what was asked for then.
        dialogue: The state of the dialogue after these words.
    """

    turn: Turn
    reading: Reading
    released: tuple[Order, ...] = ()
    shown: tuple[Action, ...] = ()
    kept: Round | None = None
    harm: bool = False
    wary: bool = False
    retracts: tuple[int, ...] = ()
    reversals: int = 0
    results: list[StepResult] = field(default_factory=list[StepResult])
    failed: list[StepResult] = field(default_factory=list[StepResult])
    pending: list[Order] = field(default_factory=list[Order])
    listed: list[Action] = field(default_factory=list[Action])
    reasons: list[str] = field(default_factory=list[str])
    end: str = "Shall I?"
    notes: list[str] = field(default_factory=list[str])
    missing: bool = False
    given_up: tuple[Guess, ...] = ()
    offer: str = ""
    dialogue: DialogueState = field(default_factory=DialogueState)

    @property
    def orders(self) -> list[Order]:
        """The released orders, then the new ones: none while the others are kept."""
        new = () if self.kept else self.reading.orders
        return [*self.released, *(each for each in new if each not in self.released)]

    def record(self, result: StepResult) -> None:
        """Record the result of an action."""
        (self.results if result.ok else self.failed).append(result)

    def hold(
        self,
        order: Order,
        reason: str,
        actions: Sequence[Action] = (),
        *,
        irreversible: bool = False,
        grave: bool = False,
    ) -> None:
        """Have an order wait for a yes: for its very words, if it is irreversible or grave."""
        self.pending.append(order)
        self.listed += actions
        self.reasons.append(reason)
        if irreversible:
            self.end = CONFIRM
        elif grave and self.end != CONFIRM:
            self.end = SAY_YES

    @property
    def question(self) -> str:
        """What has to be asked next; "" if nothing has."""
        if self.harm:
            return HARM
        if self.kept:
            return self.kept.question
        if not self.pending or self.offer:
            return self.offer
        things = [*dict.fromkeys(name for each in self.listed for name in each.things)]
        said = {phrase.casefold() for order in self.pending for phrase in order.phrases}
        very = "" if said.issuperset(map(str.casefold, things)) else f" ({', '.join(things)})"
        why = filter(None, dict.fromkeys(self.reasons))
        return " ".join([*why, f'I understood "{_told(self.pending)}"{very}.', self.end])

    @property
    def awaits(self) -> Awaited:
        """What that question waits for."""
        if self.harm:
            return "harm"
        if self.kept:
            return self.kept.awaits
        if not self.pending:
            return ""
        return "word" if self.end in (CONFIRM, SAY_YES) else "yes"

    @property
    def in_vain(self) -> bool:
        """Whether nothing came of the orders, as there are no such things."""
        return self.missing and not (self.results or self.failed or self.pending)

    @property
    def ended(self) -> bool:
        """Whether the task ended."""
        return any(result.terminated for result in self.results)


class Executor:
    """Executes what people order.

    Args:
        env: Where to act.
        pick: Finds the thing that a phrase means.
        unsure: Margin of an order, in nats, below which it waits for a yes.

    Attributes:
        dialogue_state: `state_after`, for these verbs.
    """

    def __init__(self, env: Environment, pick: Pick, unsure: float) -> None:
        self._env = env
        self._pick = pick
        self._unsure = unsure
        self._verbs = {verb.name: verb for verb in env.verbs}
        self._takes_away = {verb.name for verb in env.verbs if verb.takes_away}
        self.dialogue_state = partial(state_after, takes_away=self._takes_away)

    def execute(
        self, rounds: Sequence[Round], turn: Turn, reading: Reading, *, confirmed: bool
    ) -> Execution:
        """Undo what the words retract, then execute the orders; those that need a yes wait.

        After a word of harm that the reading lacks, no verb is executed.

        Args:
            rounds: All earlier rounds.
            turn: The newest one.
            reading: Its reading.
            confirmed: Whether the person confirmed by a click what waited.
        """
        harm = speaks_of_harm(turn.utterance, reading)
        released = () if harm else self._released(rounds, turn, reading, confirmed)
        done = Execution(
            turn,
            reading,
            released=released,
            shown=rounds[-1].listed if released else (),
            harm=harm,
            wary=is_wary(
                [
                    (turn.utterance, reading),
                    *((each.turn.utterance, each.reading) for each in rounds[::-1] if each.reading),
                ]
            ),
        )
        left = [each for each in rounds[-1].pending if each not in released] if rounds else []
        if left and released:
            done.notes.append(NOT_CONFIRMED.format("you said something else", _told(left)))
        elif left:
            self._keep_or_drop(rounds[-1], done)
        self._undo(rounds, done)
        done.dialogue = self.dialogue_state(
            rounds, reading, released=done.released, retracts=done.retracts
        )
        wanted = _asked_for(rounds)
        for order in done.orders:
            self._follow(order, done, wanted)
        return done

    def _keep_or_drop(self, last: Round, done: Execution) -> None:
        """Ask again for what waited, unless they said no, or something else that is to be done."""
        orders = [each for each in done.reading.orders if each not in last.pending]
        other = last.given_up or any(each.do not in _LEAVING for each in orders)
        why = ""
        if done.reading.tells("no"):
            why = "you said no"
        elif last.state != self._env.state().fingerprint:
            why = "things are no longer as they were shown"
        elif other or "harm" in (last.awaits, done.awaits):
            why = "you said something else"
        if why:
            done.notes.append(NOT_CONFIRMED.format(why, _told(last.pending)))
            return
        done.kept, done.pending, done.listed = last, [*last.pending], [*last.listed]
        if not done.reading.tells("ask"):
            done.notes.append(UNANSWERED.format(_told(last.pending)))

    def give_up(self, rounds: Sequence[Round], goals: Collection[str], done: Execution) -> None:
        """Take back what was guessed for goals; offer to take back what was asked for then.

        What the newest words name stays.

        Args:
            rounds: All earlier rounds.
            goals: Texts of the goals that the person no longer has.
            done: Records what is done.
        """
        said, gone = singulars(done.turn.utterance), retracted(rounds) | {*done.retracts}
        before = {guess for round in rounds for guess in round.given_up}

        for round in rounds:
            guesses = [
                guess for guess in round.guessed
                if round.number not in gone and guess.goal in goals
                and guess not in before and not mentions(said, guess.target)
            ]  # fmt: skip
            targets = {guess.target for guess in guesses}
            results = tuple(each for each in round.results if each.action.target in targets)
            if results and self._reverse(results, done.dialogue, done):
                done.given_up += tuple(guesses)
        if not done.given_up:
            return
        targets = tuple(guess.target for guess in done.given_up)
        done.dialogue = replace(done.dialogue, given_up=targets)
        done.notes.append(f"Taken back, as it was a guess for another goal: {', '.join(targets)}.")
        fell = {guess.goal for guess in done.given_up}
        asked = [
            order
            for round in rounds
            if round.number not in gone and round.reading and _leading(round.belief) in fell
            for order in acting(round.reading.orders)
            if order in done.dialogue.asked and order.do not in self._takes_away
            and not mentions(said, order.what)
        ]  # fmt: skip
        if asked and self._takes_away and not done.question:
            away = min(self._takes_away)
            done.pending = [Order(away, what) for what in dict.fromkeys(o.what for o in asked)]
            found = (resolve(self._env, o, done.dialogue, self._pick) for o in done.pending)
            done.listed = [action for each in found for action in each.actions]
            things = ", ".join(order.what for order in done.pending)
            done.offer = f"You had asked for {things}, too. Shall I {away} that?"

    def _follow(self, order: Order, done: Execution, wanted: Collection[str]) -> None:
        """Do one order, or hold it where it needs a yes; `wanted` is what `_asked_for` gives."""
        by_verb = order.do in self._verbs
        if not (by_verb or order.do in LIMITS) or (done.harm and by_verb):
            return
        new, reason, limit = order not in done.released, "", None
        said, binds = done.turn.utterance, not by_verb and order.why not in GRAVE
        brings = by_verb and order.do not in self._takes_away and not order.for_
        missed = False
        if new and (by_verb or binds):
            missed = misses_an_exception(said, order, done.reading, brings=brings)
        elif new and excepts(said, done.reading):
            done.notes.append(KEPT_IN_FULL.format(_told([order])))
        if by_verb and new:
            limit = None if order.do in self._takes_away else done.dialogue.forbids(order)
            sure = done.reading.sure(order, self._unsure) and not missed
            ends = self._ends(order)
            reason = reason_to_wait(order, limit, sure=sure, wary=done.wary and not ends)
            if ends and not completes(self._env, said):
                reason = reason or ENDS
        elif missed:
            reason = reason_to_wait(order, sure=False)
        binding = done.dialogue.beside(order, done.reading.orders)
        binding = lifted(binding, order, grave=True) if limit else binding
        found = resolve(self._env, order, binding, self._pick)
        if limit or (missed and binds) or (new and self._sweeps(order, found.actions, wanted)):
            done.hold(order, reason, found.actions, grave=True)
            return
        done.notes += [found.why] if found.why else []
        done.missing |= found.missing
        irreversible = (by_verb and self._verbs[order.do].irreversible) or any(
            is_irreversible(self._env, action) for action in found.actions
        )
        confirmed = not new and {*found.actions} <= {*done.shown}
        if found.actions and (reason or irreversible or not new) and not confirmed:
            if not done.harm:
                done.hold(order, reason, found.actions, irreversible=irreversible)
            return
        for action in found.actions:
            result = execute(self._env, action)
            done.record(result)
            if not result.ok:
                break
        done.notes += [found.warning] if found.actions and found.warning else []

    def _sweeps(self, order: Order, actions: Sequence[Action], wanted: Collection[str]) -> bool:
        """Whether an order names no thing and changes several, or takes away several wanted ones.

        An allergy or a diet takes away what it rules out without a question.
        """
        targets = {each.target for each in actions}
        if order.do in self._verbs and order.what.casefold() in ("", _ALL):
            return len(targets) > 1
        takes_away = order.do in self._takes_away or (order.do in LIMITS and order.why not in GRAVE)
        return takes_away and len(targets.intersection(wanted)) > 1

    def _ends(self, order: Order) -> bool:
        """Whether an order ends the task without a question of its own."""
        verb = self._verbs[order.do]
        return verb.ends and not verb.irreversible

    def _released(
        self, rounds: Sequence[Round], turn: Turn, reading: Reading, confirmed: bool
    ) -> tuple[Order, ...]:
        """The orders that waited for a yes to the last question, if these words are one.

        A yes stands alone, or beside the same orders. Beside others it must come first, and then
        releases what can be undone: what it names, or all if it names none. What waits for words of
        agreement needs them alone: with other orders the state would no longer be the one shown.
        """
        last = rounds[-1] if rounds else None
        if not last or last.awaits == "harm" or last.state != self._env.state().fingerprint:
            return ()
        said, waits_for_words = turn.utterance, last.awaits == "word"
        if confirmed or is_yes(said):
            return last.pending
        if {*reading.orders} <= {Order("yes"), *last.pending}:
            agreed = bool(reading.orders) and not is_question(said)
            agreed &= not waits_for_words or agrees(said, last.pending, last.listed)
            return last.pending if agreed else ()
        if waits_for_words or reading.tells("no") or not begins_with_yes(said):
            return ()
        words = singulars(said)
        return tuple(o for o in last.pending if mentions(words, o.what)) or last.pending

    def _undo(self, rounds: Sequence[Round], done: Execution) -> None:
        """Undo the last rounds, guesses included."""
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
        effective, newest = undoable(rounds), rounds[-1] if rounds else None
        named = any(order.what not in ("", _ALL) or order.but for order in orders)
        every = any(order.what == _ALL for order in orders)
        count = sum(max(1, round(order.quantity or 1)) for order in orders)
        last = [] if named else effective if every else effective[-count:]
        if orders == [_UNDO] and newest and newest not in last and _asked(newest):
            done.notes.append(IDLE.format(newest.turn.utterance))
            return
        if not last:
            done.notes.append(NOTHING)
            return
        results = (each for round in last for each in round.results[round.reversals :])
        acts = [each.action for each in results if not each.irreversible]
        if every and orders[0] not in done.released and len({each.target for each in acts}) > 1:
            done.hold(orders[0], "", acts, grave=True)
            return
        left = self.dialogue_state(rounds, retracts=[each.number for each in last])
        back: list[Round] = []
        for each in reversed(last):
            undone = self._reverse(each.results[each.reversals :], left, done)
            if undone is None:
                done.notes.append(NOT_HERE)
                return
            back += [each] if undone else []
        if back:
            quoted = "; ".join(f'"{each.turn.utterance}"' for each in reversed(back))
            done.notes.append(f"Taken back: {quoted}.")
            read = (each.reading.orders for each in back if each.reading)
            stay = [order for orders in read for order in orders if is_grave(order)]
            if stay:
                done.notes.append(f"{STAYS} {'; '.join(map(order_in_words, stay))}.")
        done.retracts = tuple(each.number for each in back)
        done.reversals = len(done.results)

    def _reverse(
        self, results: tuple[StepResult, ...], state: DialogueState, done: Execution
    ) -> bool | None:
        """Undo results; whether all of it succeeded, and None where that cannot be done here."""
        found = Resolution()
        if results:
            found = resolve(self._env, _UNDO, replace(state, to_undo=results), self._pick)
            if found == Resolution():
                return None
        done.notes += filter(None, (found.why, found.warning))
        failed = len(done.failed)
        for action in found.actions:
            final = is_irreversible(self._env, action)
            done.record(
                StepResult(action, False, NOT_BACK) if final else execute(self._env, action)
            )
        return len(done.failed) == failed


def _asked(round: Round) -> bool:
    """Whether the words of a round gave an order by a verb."""
    return bool(round.reading and acting(round.reading.orders))


def _asked_for(rounds: Sequence[Round]) -> set[str]:
    """What the person asked for themselves: the things of all actions but the guesses."""
    found: set[str] = set()
    for round in rounds:
        guesses = {guess.target for guess in round.guessed}
        found |= {result.action.target for result in round.results} - guesses
    return found


def _leading(belief: Belief) -> str:
    """The text of the likeliest goal; "" for none."""
    return belief.top(1)[0][0].text if belief.goals else ""


def _told(orders: Sequence[Order]) -> str:
    """Orders in one line: "add milk (2); remove pears"."""
    return "; ".join(map(order_in_words, orders))
