"""What holds after all that was said: a pure fold over stored readings.

Nothing re-reads old words. To undo is to leave readings out; an allergy or a diet survives that.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from goalscope.orders import DIALOGUE_ACTS, Order, Reading
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
        coming = singulars(order.for_ or order.what)
        for limit in self.limits:
            thing = singulars(limit.what)
            if limit.do == "avoid" and limit.why in GRAVE and coming[-len(thing) :] == thing:
                return limit
        return None


def acting(orders: Sequence[Order]) -> tuple[Order, ...]:
    """The orders by a domain's own verbs: no dialogue acts."""
    return tuple(each for each in orders if each.do not in _ACTS)


def fold(
    readings: Sequence[Reading],
    *,
    released: Sequence[Sequence[Order]] = (),
    retracted: Collection[int] = (),
    takes_away: Collection[str] = (),
) -> Standing:
    """What holds after readings, oldest first.

    A later order lifts a dislike that rules out what it names, but no allergy or diet: those end
    where an order that names what they rule out was confirmed.

    Args:
        readings: Of all rounds.
        released: For each of them, the orders that it confirmed; () where none did.
        retracted: Places of the readings that were taken back.
        takes_away: Names of the verbs whose orders lift nothing (see `Verb`).
    """
    standing = Standing()
    for place, reading in enumerate(readings):
        gone = place in retracted
        confirmed = released[place] if place < len(released) else ()
        for order in () if gone else confirmed:
            if order.do not in takes_away:
                standing = _lifted(standing, order, grave=True)
            standing = replace(standing, asked=(*standing.asked, order))
        for order in reading.orders:
            if gone and not (order.do in ("avoid", "only") and order.why in GRAVE):
                continue
            standing = _with(standing, order, lifts=order.do not in takes_away)
    return standing


def _with(standing: Standing, order: Order, *, lifts: bool) -> Standing:
    if order.do in ("avoid", "only") and order.what:
        known = [each for each in standing.limits if (each.do, each.what) != (order.do, order.what)]
        graver = [each for each in standing.limits if each.what == order.what and each.why in GRAVE]
        kept = order if order.why in GRAVE or not graver else graver[0]
        return replace(standing, limits=(*known, kept))
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
    coming = order.for_ or order.what
    return replace(
        standing,
        limits=tuple(
            each
            for each in standing.limits
            if each.do != "avoid"
            or (each.why in GRAVE and not grave)
            or not names(coming, each.what)
        ),
        untouched=tuple(each for each in standing.untouched if not names(order.what, each.what)),
    )
