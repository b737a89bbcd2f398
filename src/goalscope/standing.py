"""What holds after all that was said: a pure fold over stored readings.

Nothing re-reads old words. To undo is to leave readings out; an allergy or a diet survives that.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from goalscope.orders import DIALOGUE_ACTS, REASONS, Order, Reading
from goalscope.words import names, singulars

__all__ = ["GRAVE", "LIMITS", "Standing", "acting", "fold"]

GRAVE = ("allergy", "diet")
"""Reasons of limits that only the person's confirmation lifts."""

LIMITS = ("avoid", "only", "budget", "leave")
"""Dialogue acts that hold from then on; an environment resolves them, too."""

_ACTS = frozenset(act.name for act in DIALOGUE_ACTS)


@dataclass(frozen=True, slots=True)
class Standing:
    """The state of a dialogue.

    Attributes:
        limits: What must not come ("avoid"), or what all must be ("only").
        budget: The most it may cost; None for any sum.
        untouched: What is to be left as it is.
        asked: What was asked for and not taken back, oldest first.
    """

    limits: tuple[Order, ...] = ()
    budget: Order | None = None
    untouched: tuple[Order, ...] = ()
    asked: tuple[Order, ...] = ()

    def forbids(self, order: Order) -> Order | None:
        """The allergy or diet that rules out the very thing that an order names to come.

        None where none does. (Gluten-free bread is no gluten: what is in a thing, the environment
        knows.)
        """
        ruling = (each for each in self.limits if each.why in GRAVE and _rules_out(each, order))
        return next(ruling, None)

    def beside(self, order: Order, said: Collection[Order]) -> Standing:
        """What binds an order, of those that were said in one breath.

        "Turn off the laptop, but leave it there" turns it off: what is to be left as it then is
        binds no order for the same thing. ("Put the phone into the drawer, and leave the phone on
        the sofa" speaks of two.)
        """

        def same(limit: Order) -> bool:
            two = limit.where and order.where
            return limit in said and names(order.what, limit.what) and not two

        return replace(self, untouched=tuple(each for each in self.untouched if not same(each)))


def acting(orders: Sequence[Order]) -> tuple[Order, ...]:
    """The orders by a domain's own verbs: no dialogue acts."""
    return tuple(each for each in orders if each.do not in _ACTS)


def fold(
    readings: Sequence[Reading],
    *,
    released: Sequence[Sequence[Order]] = (),
    waiting: Sequence[Sequence[Order]] = (),
    retracted: Collection[int] = (),
    takes_away: Collection[str] = (),
) -> Standing:
    """What holds after readings, oldest first.

    A later order lifts a dislike that rules out the very thing that it names, but no allergy or
    diet: those end where such an order was confirmed. What one person must not have, and for a
    graver reason, holds beside what another one must not. An order that waits counts for nothing.

    Args:
        readings: Of all rounds.
        released: For each of them, the orders that it confirmed; none where it is shorter.
        waiting: For each of them, those of its orders that were not followed; likewise.
        retracted: Places of the readings that were taken back.
        takes_away: Names of the verbs whose orders lift nothing (see `Verb`).
    """
    standing = Standing()
    for place, reading in enumerate(readings):
        gone = place in retracted
        confirmed, waits = (
            each[place] if place < len(each) else () for each in (released, waiting)
        )
        for order in () if gone else confirmed:
            if order.do not in takes_away:
                standing = _lifted(standing, order, grave=True)
            standing = replace(standing, asked=(*standing.asked, order))
        for order in reading.orders:
            grave = order.do in ("avoid", "only") and order.why in GRAVE
            if not grave and (gone or order in waits):
                continue
            standing = _with(standing, order, lifts=order.do not in takes_away)
    return standing


def _with(standing: Standing, order: Order, *, lifts: bool) -> Standing:
    if order.do in ("avoid", "only") and order.what:
        same = [each for each in standing.limits if _about(each) == _about(order)]
        others = [each for each in standing.limits if each not in same]
        return replace(standing, limits=(*others, min((order, *same), key=_gravity)))
    if order.do == "budget":
        return replace(standing, budget=order)
    if order.do == "leave":
        return replace(standing, untouched=(*standing.untouched, order))
    if order.do in _ACTS:
        return standing
    standing = _lifted(standing, order, grave=False) if lifts else standing
    return replace(standing, asked=(*standing.asked, order))


def _lifted(standing: Standing, order: Order, *, grave: bool) -> Standing:
    """Without the limits that an order for the very thing speaks against."""
    return replace(
        standing,
        limits=tuple(
            each
            for each in standing.limits
            if (each.why in GRAVE and not grave) or not _rules_out(each, order)
        ),
        untouched=tuple(each for each in standing.untouched if not names(order.what, each.what)),
    )


def _rules_out(limit: Order, order: Order) -> bool:
    """Whether a limit is against the very thing that an order names to come: the end of its name.

    Rye bread is bread; gluten-free bread is no gluten.
    """
    thing, coming = singulars(limit.what), singulars(order.for_ or order.what)
    return limit.do == "avoid" and bool(thing) and coming[-len(thing) :] == thing


def _about(limit: Order) -> tuple[str, str, str]:
    return limit.do, limit.what, limit.for_


def _gravity(limit: Order) -> int:
    return REASONS.index(limit.why or REASONS[-1])
