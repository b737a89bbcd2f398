"""What an order comes to: the things that it is about, and the actions that they still need."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from goalscope.base.nouns import singulars
from goalscope.base.types import Action
from goalscope.envs import Resolution
from goalscope.envs.house.actions import FILLS, IRREVERSIBLE, accepts, cooks
from goalscope.envs.house.finding import EVERYTHING, Finder, Found, remains
from goalscope.envs.house.simulator.object_types import ACTS, SINGLE, slices_of
from goalscope.envs.house.simulator.state import innermost, is_at, is_whole
from goalscope.envs.house.view import View, readable
from goalscope.language.orders import Order

_PERSON = frozenset({"me", "us", "here", "hand"})
"""Places that mean the robot's hand, as there is no person in the house."""

_FOR_ALL = frozenset({"close", "turn off", "clean", "empty"})
"""What may be done to everything at once."""

_HOME = re.compile(r"back|(?:its|their) places?|where (?:it|they|that|those) .*", re.IGNORECASE)
"""Places that mean where a thing was at the start."""

_Thing = Mapping[str, Any]
"""AI2-THOR's metadata of an object."""

_Test = Callable[[str], bool]
"""Whether something holds of the object of an id."""


class _WhyNotError(Exception):
    """An order cannot be followed; the message says why."""


@dataclass(frozen=True, slots=True)
class Resolver:
    """Resolves orders in a house as it is now.

    Attributes:
        view: The house.
        start: The house at the start.
        finder: Finds what a phrase may mean.
        done: What was done since the start, oldest first.
        bound: Ids of what must not be touched.
        asked: What was asked for, oldest first.
    """

    view: View
    start: View
    finder: Finder
    done: Sequence[Action]
    bound: set[str]
    asked: Sequence[Order] = ()

    def resolve(self, order: Order) -> Resolution:
        """The actions that the order still needs; a limit needs none."""
        try:
            match order.do:
                case "put":
                    return self._put(order)
                case "pick up":
                    return self._pick_up(order, order.where)
                case "push" | "pull":
                    return self._act(order, self._has("moveable", "pickupable"), lambda _: False)
                case "fill":
                    return self._fill(order)
                case "cook":
                    return self._cook(order)
                case "make":
                    return self._make(order)
                case "finish":
                    return Resolution((Action("finish"),))
                case verb if verb in ACTS:
                    return self._change(order)
                case _:
                    return Resolution()
        except _WhyNotError as why:
            return Resolution(why=str(why))

    def _change(self, order: Order) -> Resolution:
        """Bring things into the state that the verb names."""
        table = self.view.table
        needs, state, value = ACTS[order.do]

        def is_able(own: str) -> bool:
            burner = needs == "toggleable" and table[own]["objectType"] == "StoveBurner"
            return burner or table[own][needs]

        return self._act(order, is_able, lambda own: table[own][state] == value)

    def _act(self, order: Order, is_able: _Test, is_so: _Test) -> Resolution:
        """Do what the verb says to each thing, apart from what a switch among them turns on."""
        things = self._meant(order, order.where, is_able, is_so)
        switched = {burner for own in things for burner in self._controlled(own)}
        lacking = [own for own in things if not is_so(own) and own not in switched]
        return self._or_so([self._do(order.do, own) for own in lacking], order, things)

    def _pick_up(self, order: Order, where: str) -> Resolution:
        """Into the hand, which holds one thing."""
        held = self.view.held
        things = self._meant(order, where, self._has("pickupable"), lambda own: own == held)
        actions = [self._do("pick up", own) for own in things[:1] if own != held]
        if len(things) > 1:
            return Resolution(tuple(actions), "My hand holds one thing at a time.")
        return self._or_so(actions, Order("pick up", order.what), things)

    def _put(self, order: Order) -> Resolution:
        """To a place; to the person, or where none was said, into the hand.

        If no place is said, what the hand holds is put back where it was, and another thing goes
        where the one before it went.
        """
        where = order.where
        held = self.view.held
        if not where and held and held in self.finder.find(order.what).things:
            where = "back"
        where = where or self._last_place(order)
        if where.casefold() in _PERSON or not where:
            return self._pick_up(order, "")
        table, start = self.view.table, self.start.table
        places = [] if _HOME.fullmatch(where) else self._places(where)

        def goals(own: str) -> list[str]:
            home = innermost(start[own], start) if own in start else ""
            return places or [home] * (home in table)

        def is_able(own: str) -> bool:
            return table[own]["pickupable"] and own not in places

        def is_so(own: str) -> bool:
            return any(is_at(table[own], place, table) for place in goals(own))

        things = self._meant(order, "", is_able, is_so)
        actions: list[Action] = []
        taken: list[str] = []
        for own in things:
            place = "" if is_so(own) else self._best(table[own], goals(own), taken)
            taken.append(place)
            actions += self._moving(self.view.names[own], table[own], place)
        return self._or_so(actions, order, things)

    def _last_place(self, order: Order) -> str:
        """Where the put before this one went; "" if there was none."""
        before = [*self.asked]
        if order in before:
            del before[len(before) - 1 - before[::-1].index(order) :]
        return next((o.where for o in reversed(before) if o.do == "put" and o.where), "")

    def _fill(self, order: Order) -> Resolution:
        """With water, or what is said; something else in it is poured out first."""
        table, said = self.view.table, singulars(order.for_)
        kinds = [(verb, liquid) for verb, liquid in FILLS.items() if liquid in said or not said]
        if not kinds:
            raise _WhyNotError(f"I cannot fill anything with {order.for_:.60}.")
        verb, liquid = kinds[0]

        def is_so(own: str) -> bool:
            return table[own]["isFilledWithLiquid"] and table[own]["fillLiquid"] in (liquid, None)

        things = self._meant(order, order.where, self._has("canFillWithLiquid"), is_so)
        actions: list[Action] = []
        for own in things:
            if not is_so(own):
                actions += [self._do("empty", own)] if table[own]["isFilledWithLiquid"] else []
                actions.append(self._do(verb, own))
        return self._or_so(actions, order, things)

    def _cook(self, order: Order, served: str = "") -> Resolution:
        """On or in what is named, if anything is; of a loaf or an egg, what it is cut into.

        What was cooked goes to where it is to be served, if that is said.
        """
        table = self.view.table
        places = self._places(order.where) if order.where else []

        def is_able(own: str) -> bool:
            return table[own]["cookable"] or bool(self._pieces([own])[own])

        things = self._meant(order, "", is_able, self._has("isCooked"))
        whole = [own for own in things if not table[own]["cookable"]]
        pieces = self._pieces(whole)
        actions = [self._do("slice", own) for own in whole]
        raw: list[tuple[str, _Thing]] = []
        for own in things:
            if table[own]["cookable"]:
                raw += [(self.view.names[own], table[own])] * (not table[own]["isCooked"])
            else:
                raw += pieces[own][: _number_of(order) if order.unit else 1]
        for number, (name, thing) in enumerate(raw):
            place = self._best(thing, places)
            single = bool(place) and table[place]["objectType"] in SINGLE
            actions += [] if number else self._cleared(place, thing["objectId"])
            puts = self._moving(name, thing, place)
            cooked = any(thing["objectId"] in cooks(self.view, put) for put in puts)
            actions += puts if cooked else [*puts, Action("cook", name)]
            if served:
                actions += self._serving(name, thing, served)
            elif single and number < len(raw) - 1:
                actions += self._aside(name, thing, place)
        return self._or_so(actions, order, things)

    def _make(self, order: Order) -> Resolution:
        dish = singulars(order.what)
        if "coffee" in dish:
            return self._coffee(order)
        if "toast" in dish:
            bread = Order("cook", "bread", order.quantity or 1, "slice", where="toaster")
            return self._cook(bread, order.where)
        raise _WhyNotError(f"I cannot make {order.what or 'that':.60} here.")

    def _coffee(self, order: Order) -> Resolution:
        """For each, a mug under the machine, which is turned on and off again."""
        table = self.view.table
        machines = self._by_age("CoffeeMachine")
        if not machines:
            raise _WhyNotError("There is no coffee machine here that I may use.")
        machine = machines[0]
        named = self.finder.find(order.where).things if order.where else ()
        mugs = [own for own in self._by_age("Mug") if not table[own]["isFilledWithLiquid"]]
        if not mugs:
            raise _WhyNotError("There is no empty mug here that I may use.")
        mugs.sort(
            key=lambda m: (m not in named, not is_at(table[m], machine, table), table[m]["isDirty"])
        )
        where = "" if mugs[0] in named else order.where
        mugs = mugs[: _number_of(order)]
        actions = self._cleared(machine, mugs[0])
        actions += [self._do("turn off", machine)] if table[machine]["isToggled"] else []
        for mug in mugs:
            name = self.view.names[mug]
            actions += self._moving(name, table[mug], machine)
            actions += [self._do("turn on", machine), self._do("turn off", machine)]
            if where:
                actions += self._serving(name, table[mug], where)
            elif mug != mugs[-1]:
                actions += self._aside(name, table[mug], machine)
        return self._or_so(actions, order, mugs)

    def _cleared(self, place: str, own: str) -> list[Action]:
        """What takes other things off a place that holds but one."""
        if not place or self.view.table[place]["objectType"] not in SINGLE:
            return []
        others = self._others(place, own)
        if held := [each for each in others if each in self.bound]:
            name = self.view.names[held[0]]
            raise _WhyNotError(f"I leave the {name} alone, as you asked, and it is in the way.")
        names, table = self.view.names, self.view.table
        return [act for own in others for act in self._aside(names[own], table[own], place)]

    def _aside(self, name: str, thing: _Thing, place: str) -> list[Action]:
        """What makes room at a place: the thing goes back to where it is now, or elsewhere."""
        table = self.view.table
        around = (place, *(table[place]["parentReceptacles"] or ()))
        now = innermost(table.get(thing["objectId"].rpartition("|")[0], thing), table)
        surfaces = (
            own
            for own, other in table.items()
            if accepts(other, thing) and own not in self.bound and other["objectType"] not in SINGLE
            if not (other["pickupable"] or other["openable"])
        )
        home = next((own for own in (now, *surfaces) if own not in ("", *around)), "")
        return [Action("put", name, destination=self.view.names[home])] if home else []

    def _moving(self, name: str, thing: _Thing, place: str) -> list[Action]:
        """The put that brings a thing to a place, unless it is there or no place is given."""
        if not place or is_at(thing, place, self.view.table):
            return []
        return [Action("put", name, destination=self.view.names[place])]

    def _serving(self, name: str, thing: _Thing, where: str) -> list[Action]:
        """What brings a thing to where it is wanted."""
        if where.casefold() in _PERSON:
            return [Action("pick up", name)]
        place = self._best(thing, self._places(where))
        return [Action("put", name, destination=self.view.names[place])] if place else []

    def _pieces(self, things: Sequence[str]) -> dict[str, list[tuple[str, _Thing]]]:
        """What can be cooked of the pieces that things would be cut into, by their names then."""
        table = self.view.table
        cut = {
            own: slices_of(table[own]) if table[own]["sliceable"] and is_whole(table[own]) else []
            for own in things
        }
        objects = [*self.view.objects, *(each for pieces in cut.values() for each in pieces)]
        names = View({"objects": objects, "inventoryObjects": []}, self.view.names).names
        return {
            own: [(names[each["objectId"]], each) for each in pieces if each["cookable"]]
            for own, pieces in cut.items()
        }

    def _do(self, name: str, own: str) -> Action:
        return Action(name, self.view.names[own])

    def _or_so(self, actions: Sequence[Action], order: Order, things: Sequence[str]) -> Resolution:
        """The actions, and what they fall short of; where there are none, that it is so."""
        if not actions:
            return Resolution(why=self.view.is_so(order.do, things))
        number = _number_of(order)
        short = not order.unit and len(things) < number
        told = f"I found only {len(things)} of {number} {order.what:.60}."
        return Resolution(tuple(actions), told if short else "")

    def _meant(self, order: Order, where: str, is_able: _Test, is_so: _Test) -> list[str]:
        """What an order is about: those first for which there is something to do.

        Args:
            order: The order.
            where: The place that tells which thing is meant.
            is_able: Whether it can be done to a thing at all.
            is_so: Whether it is so already.

        Raises:
            _WhyNotError: There is nothing that it could be done to.
        """
        what, table = f"{order.what:.60}", self.view.table
        if what:
            found = self.finder.find(order.what, where)
        elif self.done and (last := self.view.id(self.done[-1].target)):
            found = Found((last,))
        else:
            raise _WhyNotError(f"Please say what I am to {order.do}.")
        if not found.things:
            raise _WhyNotError(f"There is no {what} here.")
        if order.what.casefold() == EVERYTHING and order.do not in _FOR_ALL:
            raise _WhyNotError(f"Please name the things that I am to {order.do}.")
        if not found.there and (found.every or order.do in IRREVERSIBLE):
            raise _WhyNotError(f"There is no {what} in or on the {where:.60}.")
        things = remains(self.view, found.things)
        able = [own for own in things if is_able(own)]
        gone = [own for own in found.things if not is_whole(table[own])]
        if not able and gone:
            verb = "break" if table[gone[0]]["isBroken"] else "slice"
            told = self.view.is_so(verb, gone)
            raise _WhyNotError(told if order.do == verb else told.replace(" already.", "."))
        if not able:
            raise _WhyNotError(f"I cannot {order.do} the {what or self.view.names[things[0]]}.")
        free = [own for own in self._usual(found, able) if own not in self.bound]
        if not free:
            raise _WhyNotError(f"I leave the {what or 'things'} alone, as you asked.")
        if found.there:
            free.sort(key=lambda own: (is_so(own), self._age(own), not self._heats(own)))
        cut = bool(gone) and not {*free} & {*found.things}
        if order.quantity is None and (found.every or cut):
            return free
        return free[: 1 if order.unit and not cut else _number_of(order)]

    def _places(self, where: str) -> list[str]:
        """What a phrase means that things can be put in or on; or else what it stands on.

        Raises:
            _WhyNotError: There is no such place.
        """
        table = self.view.table
        found = self.finder.find(where)
        things = [own for own in found.things if is_whole(table[own])]
        if not things:
            raise _WhyNotError(f"There is no {where:.60} here.")
        places = self._usual(found, [own for own in things if table[own]["receptacle"]])
        places = places or [*filter(None, (innermost(table[own], table) for own in things))]
        if not places:
            raise _WhyNotError(f"Nothing can be put in or on the {where:.60}.")
        free = [own for own in places if own not in self.bound]
        if not free:
            raise _WhyNotError(f"I leave the {where:.60} alone, as you asked.")
        return free

    def _best(self, thing: _Thing, places: Iterable[str], taken: Iterable[str] = ()) -> str:
        """The place that suits a thing best; "" where there is none.

        Args:
            thing: What is to be put there.
            places: Ids of places.
            taken: Ids of those that something else is about to be put on.
        """
        table, own = self.view.table, thing["objectId"]

        def is_full(place: str) -> bool:
            return table[place]["objectType"] in SINGLE and (
                place in taken or bool(self._others(place, own))
            )

        fit = (p for p in places if own not in (p, *(table[p]["parentReceptacles"] or ())))
        return min(
            fit, key=lambda p: (is_full(p), not accepts(table[p], thing), self._age(p)), default=""
        )

    def _others(self, place: str, own: str) -> list[str]:
        """Ids of what is in or on a place besides a thing."""
        held = self.view.table[place]["receptacleObjectIds"] or ()
        return [each for each in held if each != own and each in self.view.table]

    def _by_age(self, kind: str) -> list[str]:
        """The whole things of a type that may be touched, those first that were used last."""
        things = [own for own, thing in self.view.table.items() if thing["objectType"] == kind]
        free = [own for own in remains(self.view, things) if own not in self.bound]
        return sorted(free, key=self._age)

    def _has(self, *flags: str) -> _Test:
        """Whether a thing has one of these affordances."""
        return lambda own: any(self.view.table[own][flag] for flag in flags)

    def _usual(self, found: Found, things: list[str]) -> list[str]:
        """Of one thing that may be of several kinds, those that usually go by the name."""
        if found.every:
            return things
        table = self.view.table
        same = [own for own in things if readable(table[own]["objectType"]) == found.name]
        return same or things

    def _age(self, own: str) -> int:
        """How many actions ago something was done to the thing."""
        name = self.view.names[own]
        ages = (age for age, done in enumerate(reversed(self.done)) if done.target == name)
        return next(ages, len(self.done))

    def _controlled(self, own: str) -> list[str]:
        """Ids of what a switch turns on."""
        table = self.view.table
        return [each for each in table[own]["controlledObjects"] or () if each in table]

    def _heats(self, own: str) -> bool:
        """Whether it is, or turns on, a burner under something that is not empty."""
        table = self.view.table
        if table[own]["objectType"] not in ("StoveKnob", "StoveBurner"):
            return False
        burners = (own, *self._controlled(own))
        pots = [table[pot] for burner in burners for pot in self._others(burner, "")]
        return any(pot["isFilledWithLiquid"] or pot["receptacleObjectIds"] for pot in pots)


def _number_of(order: Order) -> int:
    """How many things an order names; one where it does not say."""
    return max(1, int(order.quantity or 1))
