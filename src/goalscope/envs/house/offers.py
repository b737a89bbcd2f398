"""What the robot may do now: what affordances allow, what was asked for, what has to go back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from goalscope.envs.house.hearing import Hearing, Request
from goalscope.envs.house.names import readable
from goalscope.envs.house.object_types import SINGLE, object_type
from goalscope.envs.house.properties import ACTS
from goalscope.envs.house.state import is_whole
from goalscope.envs.house.view import View
from goalscope.types import Action

__all__ = ["FILLS", "NAMES", "cooks", "is_refused", "meet", "possible", "returns", "settled"]

FILLS = {"fill": "water", "fill with coffee": "coffee", "fill with wine": "wine"}
"""What the actions that fill something fill it with."""

NAMES = (*ACTS, *FILLS, "put", "pick up", "push", "pull")
"""The names of all actions."""

_HEATS = frozenset({"Microwave", "StoveBurner", "Toaster"})
_RUNNING = frozenset({"Faucet", "ShowerHead", "StoveKnob"})
"""What nobody leaves on unattended, besides heat: it is turned on when the person asks for it."""

_ONLY_ON_REQUEST = frozenset({"break", "dirty", "use up", "open", "close", "empty"})
"""Acts that no goal is served by: they are done when the person asks for them."""


def possible(view: View, own: str, spoken: set[str]) -> Iterator[Action]:
    """What the object's affordances allow now, apart from what only a person asks for.

    Args:
        view: The house.
        own: Id of the object.
        spoken: Generic names of what the person spoke of: a place among them is one to put
            anything, as AI2-THOR's table is too strict (of what people put somewhere, one in
            fifteen is not in it).
    """
    thing, name = view.table[own], view.names[own]
    if thing["pickupable"]:
        inside = set(thing["parentReceptacles"] or ())
        seen = {view.table[place]["objectType"] for place in inside if place in view.table}
        for place, other in view.table.items():
            kind = other["objectType"]
            if kind not in seen and place != own and _suits(thing, other, spoken):
                seen.add(kind)
                yield Action("put", name, destination=view.names[place])
    for verb, (needs, state, value) in ACTS.items():
        if verb in _ONLY_ON_REQUEST or thing[state] == value:
            continue
        if verb == "turn on" and thing["objectType"] in _HEATS | _RUNNING:
            continue
        if thing[needs] or (needs == "toggleable" and thing["objectType"] == "StoveBurner"):
            yield Action(verb, name)


def cooks(view: View, action: Action) -> list[str]:
    """Ids of what the action would cook: what is raw on a source of heat that is on, or goes on."""
    own, place = view.id(action.target), view.id(action.destination)
    if action.name == "turn on":
        knob = view.table[own]
        return [
            raw for heat in (own, *(knob["controlledObjects"] or ())) for raw in _raw(view, heat)
        ]
    if action.name == "put" and _is_lit(view, place):
        return _raw(view, own)
    return []


def meet(
    view: View, wanted: Sequence[Request], start: Mapping[str, Mapping[str, Any]]
) -> list[Action]:
    """The actions that requests still need, each once.

    Of requests to bring things none is met if there are several, as the hand holds one thing.

    Args:
        view: The house.
        wanted: What the person asks for.
        start: Metadata by id, of the start: what stands elsewhere now has been pushed.
    """
    brought = [request for request in wanted if request.verb == "pick up"]
    met = wanted if len(brought) < 2 else [each for each in wanted if each.verb != "pick up"]
    return list(
        dict.fromkeys(action for request in met for action in _needed(view, request, start))
    )


def settled(view: View, wanted: Sequence[Request]) -> set[str]:
    """Ids of what stands where the person asked for it."""
    puts = [request for request in wanted if request.verb == "put"]
    return {own for request in puts for own in _there(view, request)}


def _needed(view: View, request: Request, start: Mapping[str, Mapping[str, Any]]) -> list[Action]:
    things = _things(view, request)
    many = len(things) if request.every else max(request.number, 1)
    if request.verb == "put":
        places, there = _places(view, request), _there(view, request)
        left = [own for own in things if own not in there and own not in places]
        return [
            Action("put", view.names[own], destination=view.names[place])
            for own in left[: max(many - len(there), 0)]
            if (place := next((each for each in places if each != own), None))
        ]
    if request.verb == "pick up":
        return [] if view.held else [Action("pick up", view.names[own]) for own in things[:1]]
    if request.verb in ("push", "pull"):
        heavy = [own for own in things if view.table[own]["moveable"]]
        moved = [own for own in heavy if view.table[own]["position"] != start[own]["position"]]
        return [Action(request.verb, view.names[own]) for own in heavy[:1] if not moved]
    needs, state, value = ACTS[request.verb]
    able = [own for own in _things(view, request, gone=True) if view.table[own][needs]]
    unmet = [own for own in able if view.table[own][state] != value]
    met = len(able) - len(unmet)
    many = len(able) if request.every else many
    name = next((n for n, what in FILLS.items() if what == request.liquid), request.verb)
    return [Action(name, view.names[own]) for own in unmet[: max(many - met, 0)]]


def returns(
    view: View, start: Mapping[str, Mapping[str, Any]], hearing: Hearing
) -> Iterator[Action]:
    """Puts of what was moved, and should not have been, to where it was at the start."""
    for own, thing in view.table.items():
        was = start.get(own)
        if was is None or not thing["pickupable"] or thing["isPickedUp"]:
            continue
        here, home = view.place(thing), view.place(was)
        if not here or not home or here == home:
            continue
        put = Action("put", view.names[own], destination=here)
        if is_refused(view, put, hearing) and not hearing.refuses("put in", "", view.type_of(home)):
            yield Action("put", view.names[own], destination=home)


def is_refused(view: View, action: Action, hearing: Hearing) -> bool:
    """Whether the person ruled the action out."""
    return hearing.refuses(
        action.name, view.type_of(action.target), view.type_of(action.destination)
    )


def _things(view: View, request: Request, *, gone: bool = False) -> list[str]:
    """Ids of what the request may mean: what is whole, and with `gone` what no longer is."""
    return [
        own
        for own in _meant(view, request.object_types, request.name, gone=gone)
        if all(view.table[own].get(key) == value for key, value in request.states)
    ]


def _places(view: View, request: Request) -> list[str]:
    """Ids of where the request may want them."""
    return _meant(view, request.destination_types, request.destination_name)


def _there(view: View, request: Request) -> list[str]:
    """Ids of what the request may mean that is in such a place already."""
    places = set(_places(view, request))
    return [
        own
        for own in _things(view, request)
        if not places.isdisjoint(view.table[own]["parentReceptacles"] or ())
    ]


def _meant(view: View, types: Sequence[str], name: str, *, gone: bool = False) -> list[str]:
    """Ids of the things of these types, in that order; or of the one of this name."""
    if name:
        return [own] if (own := view.id(name)) else []
    return [
        own
        for kind in types
        for own, thing in view.table.items()
        if thing["objectType"] == kind and (gone or is_whole(thing))
    ]


def _is_lit(view: View, place: str) -> bool:
    """Whether this is a source of heat that is on, or stands on one."""
    around = [place, *(view.table[place]["parentReceptacles"] or ())] if place else []
    lit = (view.table[own] for own in around if own in view.table)
    return any(each["objectType"] in _HEATS and each["isToggled"] for each in lit)


def _raw(view: View, own: str) -> list[str]:
    """Ids of what is raw among the thing and all that is in it."""
    found: list[str] = []
    queue, seen = [own], {own}
    while queue:
        thing = view.table[queue.pop()]
        if thing["cookable"] and not thing["isCooked"] and is_whole(thing):
            found.append(thing["objectId"])
        inside = {each for each in thing["receptacleObjectIds"] or () if each in view.table} - seen
        queue += sorted(inside)
        seen |= inside
    return found


def _suits(thing: Mapping[str, Any], place: Mapping[str, Any], spoken: set[str]) -> bool:
    kind = place["objectType"]
    if not place["receptacle"]:
        return False
    if SINGLE.get(kind):
        return thing["objectType"] == SINGLE[kind]
    return kind in object_type(thing["objectType"]).places or readable(kind) in spoken
