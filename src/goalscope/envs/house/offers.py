"""What the robot may do now: what affordances allow, and what has to go back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from goalscope.envs.house.heard import Hearing
from goalscope.envs.house.meeting import FILLS
from goalscope.envs.house.names import readable
from goalscope.envs.house.simulator.geometry import box_of, spots
from goalscope.envs.house.simulator.object_types import SINGLE, object_type
from goalscope.envs.house.simulator.properties import ACTS
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import View
from goalscope.types import Action

__all__ = ["NAMES", "cooks", "is_refused", "possible", "returns"]

NAMES = (*ACTS, *FILLS, "put", "pick up", "push", "pull")
"""The names of all actions."""

_HEATS = frozenset({"Microwave", "StoveBurner", "Toaster"})
_RUNNING = frozenset({"Faucet", "ShowerHead", "StoveKnob"})
"""What nobody leaves on unattended, besides heat: it is turned on when the person asks for it."""

_DEEP = frozenset({"Bowl", "Cup", "Mug"})
"""Vessels out of which nothing should stick."""

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
            if kind in seen or place == own:
                continue
            if _suits(thing, other, spoken) and _fits(view, thing, other):
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


def returns(
    view: View, start: Mapping[str, Mapping[str, Any]], hearing: Hearing
) -> Iterator[Action]:
    """Puts of what was moved, and should not have been, to where it was at the start."""
    for own, thing in view.table.items():
        was = start.get(own)
        if was is None or not thing["pickupable"] or thing["isPickedUp"]:
            continue
        if thing["objectType"] in hearing.staying:
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


def _fits(view: View, thing: Mapping[str, Any], place: Mapping[str, Any]) -> bool:
    """Whether there is room for the thing in a vessel, or on a plate; elsewhere there is."""
    if not place["pickupable"]:
        return True
    size, room = box_of(thing).size, box_of(place)
    if place["objectType"] in _DEEP and max(size[0], size[2]) > max(room.size[0], room.size[2]):
        return False
    inside = (view.table.get(own) for own in place["receptacleObjectIds"] or ())
    taken = [box_of(each) for each in inside if each and each["pickupable"]]
    return bool(spots(room, size, taken, (0.0, 0.0)))


def _suits(thing: Mapping[str, Any], place: Mapping[str, Any], spoken: set[str]) -> bool:
    kind = place["objectType"]
    if not place["receptacle"]:
        return False
    if SINGLE.get(kind):
        return thing["objectType"] == SINGLE[kind]
    return kind in object_type(thing["objectType"]).places or readable(kind) in spoken
