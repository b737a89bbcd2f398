"""The state of the dialogue: a pure fold over the stored readings.

Old words are never read again. An undo leaves readings out; an allergy or a diet survives it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from goalscope.base.nouns import names, singulars
from goalscope.base.types import StepResult
from goalscope.language.orders import DIALOGUE_ACTS, REASONS, Order, Reading

GRAVE = ("allergy", "diet")
"""Reasons of limits that are lifted only by the person's confirmation."""

LIMITS = ("avoid", "only", "have", "budget", "leave")
"""Dialogue acts that hold from then on; environments resolve them, too."""

_ACTS = frozenset(act.name for act in DIALOGUE_ACTS)


@dataclass(frozen=True, slots=True)
class DialogueState:
    """The state of a dialogue.

    Attributes:
        limits: Things that must not come ("avoid"), properties that all must have ("only"), and
            things that the person has already ("have").
        budget: The most that everything may cost; None for no limit.
        untouched: Things to leave as they are.
        asked: Orders that were not retracted, oldest first.
        to_undo: Results that an order to undo takes back, oldest first.
        given_up: Things that were taken back with a goal, and may be guessed anew for another.
    """

    limits: tuple[Order, ...] = ()
    budget: Order | None = None
    untouched: tuple[Order, ...] = ()
    asked: tuple[Order, ...] = ()
    to_undo: tuple[StepResult, ...] = ()
    given_up: tuple[str, ...] = ()

    def forbids(self, order: Order) -> Order | None:
        """The allergy or diet that rules out the thing that an order asks for, if there is one.

        Only the name counts: what a thing contains is for the environment to say.
        """
        ruling = (each for each in self.limits if each.why in GRAVE and _rules_out(each, order))
        return next(ruling, None)

    def beside(self, order: Order, said: Collection[Order]) -> DialogueState:
        """What binds an order of an utterance whose orders are `said`.

        What the order excepts is left as it is. In "turn off the laptop, but leave it there" the
        second part does not bind the first. In "put the phone into the drawer, and leave the phone
        on the sofa" there are two phones.
        """

        def same(limit: Order) -> bool:
            two = limit.where and order.where
            return limit in said and names(order.what, limit.what) and not two

        bound = (each for each in self.untouched if not same(each))
        excepted = (Order("leave", each) for each in exceptions(order))
        return replace(self, untouched=(*bound, *excepted))


def exceptions(order: Order) -> list[str]:
    """The things that an order excepts: of "milk and eggs", two."""
    return [each.strip() for each in re.split(r",| and | or ", order.but) if each.strip()]


def is_grave(order: Order) -> bool:
    """Whether an order is an allergy or a diet, which an undo leaves."""
    return order.do in ("avoid", "only") and order.why in GRAVE


def acting(orders: Sequence[Order]) -> tuple[Order, ...]:
    """The orders by a domain's own verbs, without dialogue acts."""
    return tuple(each for each in orders if each.do not in _ACTS)


def fold(
    readings: Sequence[Reading],
    *,
    released: Sequence[Sequence[Order]] = (),
    waiting: Sequence[Sequence[Order]] = (),
    retracted: Collection[int] = (),
    takes_away: Collection[str] = (),
) -> DialogueState:
    """The state of the dialogue after readings, oldest first.

    A later order lifts a dislike of the thing that it asks for. An allergy or a diet ends only when
    such an order is confirmed. Limits for different people, or of graver reasons, hold side by
    side. An order that waits does not count.

    Args:
        readings: Of all rounds.
        released: For each reading, the orders that it confirmed; may be shorter.
        waiting: For each reading, its orders that were not executed; may be shorter.
        retracted: Indices of the retracted readings.
        takes_away: Names of the verbs whose orders lift nothing; see `Verb`.
    """
    state = DialogueState()
    for place, reading in enumerate(readings):
        gone = place in retracted
        confirmed, waits = (
            each[place] if place < len(each) else () for each in (released, waiting)
        )
        for order in () if gone else confirmed:
            if order.do not in (*takes_away, *LIMITS):
                state = lifted(state, order, grave=True)
            state = _with(state, order, lifts=order.do not in takes_away)
        for order in reading.orders:
            if not is_grave(order) and (gone or order in waits):
                continue
            state = _with(state, order, lifts=order.do not in takes_away)
    return state


def _with(state: DialogueState, order: Order, *, lifts: bool) -> DialogueState:
    if order.do in ("avoid", "only", "have") and order.what:
        same = [each for each in state.limits if _about(each) == _about(order)]
        others = [each for each in state.limits if each not in same]
        gravest = min((order, *same), key=lambda each: REASONS.index(each.why or REASONS[-1]))
        return replace(state, limits=(*others, gravest))
    if order.do == "budget":
        return replace(state, budget=order)
    if order.do == "leave":
        return replace(state, untouched=(*state.untouched, order))
    if order.do in _ACTS:
        return state
    free = lifted(state, order, grave=False)
    limits = free.limits if lifts else state.limits
    return replace(state, limits=limits, untouched=free.untouched, asked=(*state.asked, order))


def lifted(state: DialogueState, order: Order, *, grave: bool) -> DialogueState:
    """The state without the limits that an order for the same thing contradicts."""
    return replace(
        state,
        limits=tuple(
            each
            for each in state.limits
            if (each.why in GRAVE and not grave) or not _rules_out(each, order)
        ),
        untouched=tuple(each for each in state.untouched if not names(order.what, each.what)),
    )


def _rules_out(limit: Order, order: Order) -> bool:
    """Whether a limit rules out the thing that an order asks for, by the end of its name.

    Rye bread is bread; gluten-free bread is not gluten.
    """
    thing, coming = singulars(limit.what), singulars(order.for_ or order.what)
    return limit.do in ("avoid", "have") and bool(thing) and coming[-len(thing) :] == thing


def _about(limit: Order) -> tuple[str, str, str]:
    return limit.do, limit.what, limit.for_
