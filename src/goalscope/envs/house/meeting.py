"""How requests are met: which things they mean, and the actions that these still need."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from goalscope.envs.house.heard import HOME, Hearing, Request
from goalscope.envs.house.simulator.object_types import SINGLE
from goalscope.envs.house.simulator.properties import ACTS, PREDICATES, act_of
from goalscope.envs.house.simulator.state import innermost, is_at, is_whole
from goalscope.envs.house.view import View
from goalscope.types import Action

__all__ = ["FILLS", "NEEDS", "brought", "meant", "meet", "met", "serves", "settled", "spent"]
__all__ += ["stood_on"]

FILLS = {"fill": "water", "fill with coffee": "coffee", "fill with wine": "wine"}
"""What the actions that fill something fill it with."""

NEEDS = {
    **{verb: needs for verb, (needs, _, _) in ACTS.items()},
    **{"put": "pickupable", "pick up": "pickupable", "": "receptacle"},
}
"""The affordance that each verb needs; without a verb, that of a place."""

Table = Mapping[str, Mapping[str, Any]]


def meet(
    view: View, wanted: Sequence[Request], start: Table, over: Collection[Request] = ()
) -> list[Action]:
    """The actions that requests still need, in the order in which they were said.

    Each is judged by the house as it will be after those before it: what is to go to the sink and
    then back is moved twice. Words such as "the mug ... it ... the mug" mean one mug, and one for
    which there is something to do. Of requests to bring things none is met if there are several,
    as the hand holds one thing.

    Args:
        view: The house.
        wanted: What the person asks for.
        start: Metadata by id, of the start: what is otherwise now has been done.
        over: Requests that only tell what later ones speak of.
    """
    carried = brought(wanted, over, view.held_type)
    kept = carried if len(carried) < 2 else ()
    possible = [each for each in wanted if each.verb != "pick up" or each in kept]
    house = _Foreseen(view, start)
    house.bind(possible)
    plan: list[Action] = []
    for request in possible:
        for action in house.needed(request) if request not in over else ():
            if action.name == "put" or action not in plan:
                plan.append(action)
    return plan


def spent(first: View, view: View, hearing: Hearing, done: Sequence[Action]) -> Iterator[Request]:
    """The requests of earlier words that were met once, or were so from the start.

    Args:
        first: The house at the start.
        view: The house now.
        hearing: What the person said.
        done: All that was done since the start.
    """
    for request in hearing.wanted:
        if request in hearing.newest:
            continue
        served = [
            action.target
            for action in done
            if serves(view, action, request) and request.name in ("", action.target)
        ]
        times = max(hearing.asked.count(replace(request, passing=False)), 1)
        enough = len(served) >= times * max(request.number, 1)
        if request.every:
            lacking = meet(view, [request], first.table)
            enough = all(served.count(action.target) >= times for action in lacking)
        home = request.destination_types == (HOME,)
        if enough or (times < 2 and not home and met(first, request, first.table)):
            yield request


def serves(view: View, action: Action, request: Request) -> bool:
    """Whether the action is one that the request asks for, or more."""
    asked = ("put", "pick up") if request.verb == "pick up" else (request.verb,)
    name = act_of(action.name)
    places = request.destination_types if request.verb == "put" else ()
    there = not places or places == (HOME,) or view.type_of(action.destination) in places
    return name in asked and view.type_of(action.target) in request.object_types and there


def met(view: View, request: Request, start: Table) -> list[str]:
    """Ids of what is already as the request wants it; none where something is still to be done."""
    house = _Foreseen(view, start)
    house.bind([request])
    if house.needed(request):
        return []
    needs = NEEDS.get(request.verb, "")
    so = [
        own
        for own in meant(view, request, start)
        if view.table[own].get(needs) and not house.lacks(request, own)
    ]
    return so if request.every else so[: max(request.number, 1)]


def brought(
    wanted: Sequence[Request], over: Collection[Request] = (), held: str = ""
) -> list[Request]:
    """The requests to bring something that are not only for what is done with it next.

    Those that are over count only while the hand holds something of the type that they name.
    """
    wanted = [each for each in wanted if each not in over or held in each.object_types]
    return [
        request
        for thread in _threads(wanted)
        for request in thread[-1:]
        if request.verb == "pick up"
    ] + [each for each in wanted if each.verb == "pick up" and (each.every or each.number > 1)]


def settled(view: View, wanted: Sequence[Request]) -> set[str]:
    """Ids of what stands where the person asked for it."""
    return {
        own
        for request in wanted
        if request.verb == "put"
        for own in meant(view, request, {})
        if not set(_places(view, request, "", {})).isdisjoint(
            view.table[own]["parentReceptacles"] or ()
        )
    }


def meant(view: View, request: Request, start: Table) -> list[str]:
    """Ids of what the request may mean.

    Only what is in the states that were named, now or at the start; and what is or was at the
    place that was named, if anything is.
    """
    gone = request.verb in ACTS
    found = [
        own
        for own in _named(view, request.object_types, request.name, gone=gone)
        if any(
            table[own].get(key) == value
            for key, value in request.states
            for table in (view.table, start)
            if own in table
        )
        or not request.states
    ]
    if not request.at:
        return found
    tables = (start,) if request.every and start else (view.table, start)
    near = [own for own in found if any(stood_on(own, table) & {*request.at} for table in tables)]
    strict = request.verb in ("slice", "break") or (
        request.every and request.verb in ("put", "pick up")
    )
    return near or ([] if strict else found)


def stood_on(own: str, table: Table) -> set[str]:
    """The types of what the thing is in or on."""
    around = (table[own]["parentReceptacles"] or ()) if own in table else ()
    return {table[place]["objectType"] for place in around if place in table}


class _Foreseen:
    """The house as it will be after the actions that are planned so far."""

    def __init__(self, view: View, start: Table) -> None:
        self.view, self.start = view, start
        self.moved: dict[str, str] = {}
        self.changed: dict[tuple[str, str], bool] = {}
        self.bound: dict[int, str] = {}

    def bind(self, requests: Sequence[Request]) -> None:
        """Choose one thing for all requests that speak of the same one."""
        used: set[tuple[str, str]] = set()
        for thread in _threads(requests):
            may = [own for each in thread for own in meant(self.view, each, self.start)]
            if may:
                best = max(dict.fromkeys(may), key=partial(self.fit, thread, may, used))
                used |= {(request.verb, best) for request in thread}
                self.bound |= {id(request): best for request in thread}

    def fit(
        self, thread: Sequence[Request], may: Sequence[str], used: set[tuple[str, str]], own: str
    ) -> tuple[Any, ...]:
        """How well a thing fits requests: by what was done to it, and what it lacks."""
        free = not any((request.verb, own) in used for request in thread)
        apt = not any(_any_vessel(each) and self.holds_else(each, own) for each in thread)
        done = sum(self.done(request, own) for request in thread)
        was, now = self.start.get(own), self.view.table[own]
        touched = was is None or any(was[key] != now[key] for key in PREDICATES)
        needs = tuple(self.lacks(request, own) for request in thread)
        return (
            may.count(own),
            free,
            apt,
            done,
            touched and not thread[0].number,
            self.heats(own),
            needs,
        )

    def heats(self, own: str) -> bool:
        """Whether this is, or turns on, a burner under something that is not empty."""
        table = self.view.table
        burners = (own, *(table[own]["controlledObjects"] or ()))
        on_them = [each for b in burners for each in table[b]["receptacleObjectIds"] or ()]
        return table[own]["objectType"] in ("StoveKnob", "StoveBurner") and any(
            table[each]["isFilledWithLiquid"] or table[each]["receptacleObjectIds"]
            for each in on_them
        )

    def done(self, request: Request, own: str) -> bool:
        """Whether the request is met for the thing, and was not from the start.

        What was asked of any one, such as "a mug", may have been so.
        """
        if self.lacks(request, own) or self.holds_else(request, own):
            return False
        return bool(request.number) or self.lacks(request, own, self.start)

    def holds_else(self, request: Request, own: str) -> bool:
        """Whether the thing is to be filled with a liquid, and another is in it."""
        liquid = self.view.table[own]["fillLiquid"]
        return bool(request.liquid and liquid) and liquid != request.liquid

    def lacks(self, request: Request, own: str, table: Table | None = None) -> bool:
        """Whether the request is still to be met for the thing; by the `table`, if one is given."""
        thing = (table or self.view.table).get(own)
        if thing is None:
            return True
        if request.verb == "put":
            places = set(_places(self.view, request, own, self.start)) - {own}
            return bool(places) and not any(self.is_at(own, place, table) for place in places)
        if request.verb in ACTS:
            needs, state, value = ACTS[request.verb]
            now = thing[state] if table else self.changed.get((own, state), thing[state])
            return bool(thing[needs]) and now != value
        return True

    def is_at(self, own: str, place: str, table: Table | None = None) -> bool:
        """Whether a thing is in or on a place; by the `table`, if one is given."""
        known = table or self.view.table
        thing = known[own]
        if table is None and own in self.moved:
            there = self.moved[own]
            parents = (there, *(known[there]["parentReceptacles"] or ()))
            thing = {**thing, "parentReceptacles": parents}
        return is_at(thing, place, known)

    def is_free(self, place: str) -> bool:
        """Whether it is no place for one thing that has one already."""
        thing = self.view.table[place]
        held = {own for own in thing["receptacleObjectIds"] or () if own not in self.moved}
        return thing["objectType"] not in SINGLE or not (held or place in self.moved.values())

    def needed(self, request: Request) -> list[Action]:
        """The actions that the request needs, which from now on are foreseen."""
        view = self.view
        things = meant(view, request, self.start)
        if (one := self.bound.get(id(request))) is not None:
            things = [one] if one in things else []
        many = len(things) if request.every else max(request.number, 1)
        if request.verb == "pick up":
            full = view.held and view.held not in self.moved
            return [] if full else [Action("pick up", view.names[own]) for own in things[:1]]
        if request.verb in ("push", "pull"):
            heavy = [own for own in things if view.table[own]["moveable"]]
            unmoved = [
                own for own in heavy if view.table[own]["position"] == self.start[own]["position"]
            ]
            left = max((len(heavy) if request.every else many) - len(heavy) + len(unmoved), 0)
            return [Action(request.verb, view.names[own]) for own in unmoved[:left]]
        if request.verb == "put":
            places = _places(view, request, "", {})
            things = [own for own in things if own not in places or len(places) > 1]
        else:
            needs, _, _ = ACTS[request.verb]
            things = [own for own in things if view.table[own][needs]]
            many = len(things) if request.every else many
        lacking = [own for own in things if self.lacks(request, own)]
        others = () if request.every else self.bound.values()
        lacking.sort(key=lambda own: (own != view.held, own in others))
        so = len(things) - len(lacking)
        return [
            action
            for own in lacking[: max(many - so, 0)]
            if (action := self.foreseen(request, own))
        ]

    def foreseen(self, request: Request, own: str) -> Action | None:
        """What meets the request for one thing."""
        name = self.view.names[own]
        if request.verb != "put":
            _, state, value = ACTS[request.verb]
            self.changed[own, state] = value
            filled = (n for n, what in FILLS.items() if what == request.liquid)
            return Action(next(filled, request.verb), name)
        places = [each for each in _places(self.view, request, own, self.start) if each != own]
        place = next(filter(self.is_free, places), next(iter(places), None))
        if place is None:
            return None
        self.moved[own] = place
        return Action("put", name, destination=self.view.names[place])


def _threads(requests: Sequence[Request]) -> list[list[Request]]:
    """Requests for one thing each, those together that speak of the same: "the mug", "it"."""
    threads: list[list[Request]] = []
    for request in requests:
        if request.every or request.number > 1:
            continue
        same = [
            thread
            for thread in threads
            if not request.number
            and any(_speaks_of(each, request) for each in thread)
            and not any(_fills_else(each, request) for each in thread)
        ]
        if same:
            same[-1].append(request)
        else:
            threads.append([request])
    return threads


def _speaks_of(one: Request, other: Request) -> bool:
    alike = not {*one.object_types}.isdisjoint(other.object_types) and one.name == other.name
    states = not one.states or not other.states or one.states == other.states
    return alike and states and (not other.at or one.at == other.at)


def _fills_else(one: Request, other: Request) -> bool:
    vessel = _any_vessel(one) or _any_vessel(other)
    return one.verb == other.verb == "fill" and one.liquid != other.liquid and vessel


def _any_vessel(request: Request) -> bool:
    """Whether no one thing was named to be filled: "make coffee", "fill a mug"."""
    return len(request.object_types) > 1 or bool(request.number)


def _places(view: View, request: Request, own: str, start: Table) -> list[str]:
    """Ids of where the request may want the thing of the id `own`."""
    if request.destination_types == (HOME,):
        home = innermost(start[own], start) if own in start else ""
        return [home] if home in view.table else []
    return _named(view, request.destination_types, request.destination_name)


def _named(view: View, types: Sequence[str], name: str, *, gone: bool = False) -> list[str]:
    """Ids of the things of these types, in that order; or of the one of this name."""
    if name:
        return [own] if (own := view.id(name)) else []
    return [
        own
        for kind in types
        for own, thing in view.table.items()
        if thing["objectType"] == kind and (gone or is_whole(thing))
    ]
