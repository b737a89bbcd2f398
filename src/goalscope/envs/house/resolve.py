"""What an order comes to: the actions that it still needs, or one sentence that says why not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from goalscope.envs import Resolution
from goalscope.envs.house.choosing import Chooser, Thing, WhyNotError, number_of
from goalscope.envs.house.offers import FILLS, cooks
from goalscope.envs.house.simulator.object_types import SINGLE
from goalscope.envs.house.simulator.properties import ACTS
from goalscope.envs.house.simulator.slices import slices_of
from goalscope.envs.house.simulator.state import innermost, is_at, is_whole
from goalscope.envs.house.view import View
from goalscope.orders import Order
from goalscope.types import Action
from goalscope.words import singulars

__all__ = ["Resolver"]

_PERSON = frozenset({"me", "us", "here", "hand"})
"""Places that mean the robot's hand, as there is no person in the house."""

_HOME = frozenset({"back", "its place"})
"""Places that mean where a thing was at the start."""


@dataclass(frozen=True, slots=True)
class Resolver:
    """Resolves orders in a house as it is now.

    Attributes:
        view: The house.
        start: The house at the start.
        choose: Chooses what an order is about.
        asked: What was asked for, oldest first.
    """

    view: View
    start: View
    choose: Chooser
    asked: Sequence[Order] = ()

    def resolve(self, order: Order) -> Resolution:
        """The actions that the order still needs; a limit needs none."""
        verbs: dict[str, Callable[[Order], Resolution]] = {
            **dict.fromkeys(ACTS, self._act),
            **{"put": self._put, "pick up": self._pick_up, "fill": self._fill},
            **{"cook": self._cook, "make": self._make, "push": self._push, "pull": self._push},
            "finish": lambda _: Resolution((Action("finish"),)),
        }
        try:
            return verbs[order.do](order) if order.do in verbs else Resolution()
        except WhyNotError as why:
            return Resolution(why=str(why))

    def _act(self, order: Order) -> Resolution:
        table = self.view.table
        needs, state, value = ACTS[order.do]

        def is_able(own: str) -> bool:
            burner = needs == "toggleable" and table[own]["objectType"] == "StoveBurner"
            return burner or bool(table[own][needs])

        def is_so(own: str) -> bool:
            return table[own][state] == value

        things = self.choose.meant(order, order.where, is_able, is_so)
        switched = {each for own in things for each in table[own]["controlledObjects"] or ()}
        lacking = [own for own in things if not is_so(own) and own not in switched]
        return self._or_so([self._do(order.do, own) for own in lacking], order, things)

    def _push(self, order: Order) -> Resolution:
        is_able = self.choose.has("moveable", "pickupable")
        things = self.choose.meant(order, order.where, is_able, lambda _: False)
        return self._or_so([self._do(order.do, own) for own in things], order, things)

    def _pick_up(self, order: Order) -> Resolution:
        """Into the hand, which holds one thing."""
        held = self.view.held
        where = order.where if order.do == "pick up" else ""
        is_able = self.choose.has("pickupable")
        things = self.choose.meant(order, where, is_able, lambda own: own == held)
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
        if not where and held and held in self.choose.finder.find(order.what).things:
            where = "back"
        where = where or self._last_place(order)
        if where.casefold() in _PERSON or not where:
            return self._pick_up(order)
        table, start = self.view.table, self.start.table
        places = [] if where.casefold() in _HOME else self.choose.places(where)

        def goals(own: str) -> list[str]:
            home = innermost(start[own], start) if own in start else ""
            return places or [each for each in (home,) if each in table]

        def is_able(own: str) -> bool:
            return table[own]["pickupable"] and own not in places

        def is_so(own: str) -> bool:
            return any(is_at(table[own], place, table) for place in goals(own))

        things = self.choose.meant(order, "", is_able, is_so)
        actions: list[Action] = []
        taken: list[str] = []
        for own in things:
            place = "" if is_so(own) else self.choose.best(table[own], goals(own), taken)
            taken.append(place)
            actions += self._moving(self.view.names[own], table[own], place)
        return self._or_so(actions, order, things)

    def _last_place(self, order: Order) -> str:
        """Where the put before this one went; "" if there was none."""
        asked = [*self.asked]
        before = asked[: len(asked) - 1 - asked[::-1].index(order)] if order in asked else asked
        places = [each.where for each in before if each.do == "put" and each.where]
        return places[-1] if places else ""

    def _fill(self, order: Order) -> Resolution:
        """With water, or what is said; something else in it is poured out first."""
        table, said = self.view.table, singulars(order.for_)
        liquid = next((each for each in FILLS.values() if each in said), "" if said else "water")
        if not liquid:
            raise WhyNotError(f"I cannot fill anything with {order.for_:.60}.")
        verb = next(name for name, each in FILLS.items() if each == liquid)

        def is_so(own: str) -> bool:
            return table[own]["isFilledWithLiquid"] and table[own]["fillLiquid"] in (liquid, None)

        is_able = self.choose.has("canFillWithLiquid")
        things = self.choose.meant(order, order.where, is_able, is_so)
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
        places = self.choose.places(order.where) if order.where else []

        def is_able(own: str) -> bool:
            return table[own]["cookable"] or bool(self._pieces([own]).get(own))

        def is_so(own: str) -> bool:
            return bool(table[own]["isCooked"])

        things = self.choose.meant(order, "", is_able, is_so)
        whole = [own for own in things if not table[own]["cookable"]]
        pieces = self._pieces(whole)
        actions = [self._do("slice", own) for own in whole]
        raw: list[tuple[str, Thing]] = []
        for own in things:
            if table[own]["cookable"]:
                raw += [] if is_so(own) else [(self.view.names[own], table[own])]
            else:
                raw += pieces[own][: number_of(order) if order.unit else 1]
        for number, (name, thing) in enumerate(raw):
            place = self.choose.best(thing, places)
            single = bool(place) and table[place]["objectType"] in SINGLE
            actions += self._cleared(place, thing["objectId"]) if not number else []
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
            slices = Order("cook", "bread", order.quantity or 1, "slice", where="toaster")
            return self._cook(slices, order.where)
        raise WhyNotError(f"I cannot make {order.what or 'that':.60} here.")

    def _coffee(self, order: Order) -> Resolution:
        """For each, a mug under the machine, which is turned on and off again."""
        table = self.view.table
        machines = self.choose.by_age("CoffeeMachine")
        if not machines:
            raise WhyNotError("There is no coffee machine here that I may use.")
        machine = machines[0]
        named = self.choose.finder.find(order.where).things if order.where else ()
        mugs = [own for own in self.choose.by_age("Mug") if not table[own]["isFilledWithLiquid"]]
        if not mugs:
            raise WhyNotError("There is no empty mug here that I may use.")
        mugs.sort(
            key=lambda own: (
                own not in named,
                not is_at(table[own], machine, table),
                table[own]["isDirty"],
            )
        )
        where = "" if mugs[0] in named else order.where
        mugs = mugs[: number_of(order)]
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
        others = self.choose.others(place, own)
        if held := [each for each in others if each in self.choose.bound]:
            name = self.view.names[held[0]]
            raise WhyNotError(f"I leave the {name} alone, as you asked, and it is in the way.")
        return [
            act
            for each in others
            for act in self._aside(self.view.names[each], self.view.table[each], place)
        ]

    def _aside(self, name: str, thing: Thing, place: str) -> list[Action]:
        """What makes room at a place: the thing goes back to where it is now, or elsewhere."""
        table = self.view.table
        around = (place, *(table[place]["parentReceptacles"] or ()))
        now = innermost(table.get(thing["objectId"].rpartition("|")[0], thing), table)
        homes = [each for each in (now, *self.choose.surfaces(thing)) if each not in ("", *around)]
        return [Action("put", name, destination=self.view.names[each]) for each in homes[:1]]

    def _moving(self, name: str, thing: Thing, place: str) -> list[Action]:
        """The put that brings a thing to a place, unless it is there or no place is given."""
        if not place or is_at(thing, place, self.view.table):
            return []
        return [Action("put", name, destination=self.view.names[place])]

    def _serving(self, name: str, thing: Thing, where: str) -> list[Action]:
        """What brings a thing to where it is wanted."""
        if where.casefold() in _PERSON:
            return [Action("pick up", name)]
        place = self.choose.best(thing, self.choose.places(where))
        return [Action("put", name, destination=self.view.names[place])] if place else []

    def _pieces(self, things: Sequence[str]) -> dict[str, list[tuple[str, Thing]]]:
        """What can be cooked of the pieces that things would be cut into, by their names then."""
        table = self.view.table
        whole = [own for own in things if table[own]["sliceable"] and is_whole(table[own])]
        cut = {own: slices_of(table[own]) for own in whole}
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
        short = not order.unit and len(things) < number_of(order)
        why = f"I found only {len(things)} of {number_of(order)} {order.what:.60}." if short else ""
        return Resolution(tuple(actions), why)
