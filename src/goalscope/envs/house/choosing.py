"""Which things an order is about, and which place suits them: as many as it says, best first."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from goalscope.envs.house.finding import EVERYTHING, Finder, Found, remains
from goalscope.envs.house.names import readable
from goalscope.envs.house.offers import IRREVERSIBLE, accepts
from goalscope.envs.house.simulator.object_types import SINGLE
from goalscope.envs.house.simulator.state import innermost, is_whole
from goalscope.envs.house.view import View
from goalscope.orders import Order
from goalscope.types import Action

__all__ = ["Chooser", "Test", "Thing", "WhyNotError", "number_of"]

_FOR_ALL = frozenset({"close", "turn off", "clean", "empty"})
"""What may be done to everything at once."""

Thing = Mapping[str, Any]
"""AI2-THOR's metadata of an object."""

Test = Callable[[str], bool]
"""Whether something holds of the object of an id."""


class WhyNotError(Exception):
    """An order cannot be followed; the message says why."""


@dataclass(frozen=True, slots=True)
class Chooser:
    """Chooses among the things that a phrase may mean.

    Attributes:
        view: The house.
        finder: Finds what a phrase may mean.
        done: What was done since the start, oldest first.
        bound: Ids of what must not be touched.
    """

    view: View
    finder: Finder
    done: Sequence[Action]
    bound: set[str]

    def meant(self, order: Order, where: str, is_able: Test, is_so: Test) -> list[str]:
        """What an order is about: those first for which there is something to do.

        Args:
            order: The order.
            where: The place that tells which thing is meant.
            is_able: Whether it can be done to a thing at all.
            is_so: Whether it is so already.

        Raises:
            WhyNotError: There is nothing that it could be done to.
        """
        what, table = f"{order.what:.60}", self.view.table
        found = self._found(order, where)
        if not found.things:
            raise WhyNotError(f"There is no {what} here.")
        if order.what.casefold() == EVERYTHING and order.do not in _FOR_ALL:
            raise WhyNotError(f"Please name the things that I am to {order.do}.")
        if not found.there and (found.every or order.do in IRREVERSIBLE):
            raise WhyNotError(f"There is no {what} in or on the {where:.60}.")
        things = remains(self.view, found.things)
        able = [own for own in things if is_able(own)]
        gone = [own for own in found.things if not is_whole(table[own])]
        if not able and gone:
            verb = "break" if table[gone[0]]["isBroken"] else "slice"
            told = self.view.is_so(verb, gone)
            raise WhyNotError(told if order.do == verb else told.replace(" already.", "."))
        if not able:
            raise WhyNotError(f"I cannot {order.do} the {what or self.view.names[things[0]]}.")
        free = [own for own in self._usual(found, able) if own not in self.bound]
        if not free:
            raise WhyNotError(f"I leave the {what or 'things'} alone, as you asked.")
        if found.there:
            free.sort(key=lambda own: (is_so(own), self._age(own), not self._heats(own)))
        cut = bool(gone) and not {*free} & {*found.things}
        if order.quantity is None and (found.every or cut):
            return free
        return free[: 1 if order.unit and not cut else number_of(order)]

    def places(self, where: str) -> list[str]:
        """What a phrase means that things can be put in or on; or else what it stands on.

        Raises:
            WhyNotError: There is no such place.
        """
        table = self.view.table
        found = self.finder.find(where)
        things = [own for own in found.things if is_whole(table[own])]
        if not things:
            raise WhyNotError(f"There is no {where:.60} here.")
        places = self._usual(found, [own for own in things if table[own]["receptacle"]])
        places = places or [*filter(None, (innermost(table[own], table) for own in things))]
        if not places:
            raise WhyNotError(f"Nothing can be put in or on the {where:.60}.")
        free = [own for own in places if own not in self.bound]
        if not free:
            raise WhyNotError(f"I leave the {where:.60} alone, as you asked.")
        return free

    def best(self, thing: Thing, places: Iterable[str], taken: Iterable[str] = ()) -> str:
        """The place that suits a thing best; "" where there is none.

        Args:
            thing: What is to be put there.
            places: Ids of places.
            taken: Ids of those that something else is about to be put on.
        """
        table, own = self.view.table, thing["objectId"]

        def is_full(place: str) -> bool:
            return table[place]["objectType"] in SINGLE and (
                place in taken or bool(self.others(place, own))
            )

        fit = [each for each in places if own not in (each, *self._around(each))]
        fit.sort(key=lambda each: (is_full(each), not accepts(table[each], thing), self._age(each)))
        return next(iter(fit), "")

    def surfaces(self, thing: Thing) -> list[str]:
        """What a thing may be put on that stands open and holds many things."""
        return [
            own
            for own, place in self.view.table.items()
            if accepts(place, thing)
            and not (place["pickupable"] or place["openable"] or place["objectType"] in SINGLE)
            and own not in self.bound
        ]

    def others(self, place: str, own: str) -> list[str]:
        """Ids of what is in or on a place besides a thing."""
        held = self.view.table[place]["receptacleObjectIds"] or ()
        return [each for each in held if each != own and each in self.view.table]

    def by_age(self, kind: str) -> list[str]:
        """The whole things of a type that may be touched, those first that were used last."""
        things = [own for own, thing in self.view.table.items() if thing["objectType"] == kind]
        free = [own for own in remains(self.view, things) if own not in self.bound]
        return sorted(free, key=self._age)

    def has(self, *flags: str) -> Test:
        """Whether a thing has one of these affordances."""
        return lambda own: any(self.view.table[own][flag] for flag in flags)

    def _found(self, order: Order, where: str) -> Found:
        """What is named; without a name, what something was done to last."""
        if order.what:
            return self.finder.find(order.what, where)
        last = self.view.id(self.done[-1].target) if self.done else ""
        if not last:
            raise WhyNotError(f"Please say what I am to {order.do}.")
        return Found((last,))

    def _usual(self, found: Found, things: list[str]) -> list[str]:
        """Of one thing that may be of several kinds, those that usually go by the name."""
        if found.every:
            return things
        table = self.view.table
        same = [own for own in things if readable(table[own]["objectType"]) == found.name]
        return same or things

    def _around(self, own: str) -> Sequence[str]:
        return self.view.table[own]["parentReceptacles"] or ()

    def _age(self, own: str) -> int:
        """How many actions ago something was done to the thing."""
        name = self.view.names[own]
        ages = (age for age, done in enumerate(reversed(self.done)) if done.target == name)
        return next(ages, len(self.done))

    def _heats(self, own: str) -> bool:
        """Whether it is, or turns on, a burner under something that is not empty."""
        table = self.view.table
        if table[own]["objectType"] not in ("StoveKnob", "StoveBurner"):
            return False
        burners = [
            each for each in (own, *(table[own]["controlledObjects"] or ())) if each in table
        ]
        pots = [table[each] for burner in burners for each in self.others(burner, "")]
        return any(pot["isFilledWithLiquid"] or pot["receptacleObjectIds"] for pot in pots)


def number_of(order: Order) -> int:
    """How many things an order names; one where it does not say."""
    return max(1, int(order.quantity or 1))
