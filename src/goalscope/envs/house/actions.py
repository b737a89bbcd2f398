"""The robot's actions: which are possible now, which cook something, and what undoes them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from goalscope.base.types import Action
from goalscope.envs import Resolution
from goalscope.envs.house.simulator.geometry import box_of, spots
from goalscope.envs.house.simulator.object_types import ACTS, PREDICATES, SINGLE, object_type
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import View, the

FILLS = {"fill": "water", "fill with coffee": "coffee", "fill with wine": "wine"}
"""What the actions that fill something fill it with."""

NAMES = (*ACTS, *FILLS, "put", "pick up", "push", "pull", "finish")
"""The names of all actions."""

IRREVERSIBLE = ("break", "slice", "use up", "cook")
"""The actions that nobody can undo."""

_RESTORED = ("turn off", "turn on", "open", "close", "empty", "fill")

_HEATS = frozenset({"Microwave", "StoveBurner", "Toaster"})
_RUNNING = frozenset({"Faucet", "ShowerHead", "StoveKnob"})
"""What nobody leaves on unattended, besides heat: it is turned on when the person asks for it."""

_DEEP = frozenset({"Bowl", "Cup", "Mug"})
"""Vessels out of which nothing should stick."""

_ONLY_ON_REQUEST = frozenset({"break", "dirty", "use up", "open", "close", "empty"})
"""Acts that no goal is served by: they are done when the person asks for them."""

_Table = Mapping[str, Mapping[str, Any]]


def possible(view: View, own: str) -> Iterator[Action]:
    """What the object's affordances allow now, apart from what only a person asks for.

    It may be put on one receptacle of each type.
    """
    thing, name = view.table[own], view.names[own]
    if thing["pickupable"]:
        inside = set(thing["parentReceptacles"] or ())
        seen = {view.table[place]["objectType"] for place in inside if place in view.table}
        for place, other in view.table.items():
            kind = other["objectType"]
            if kind in seen or place == own:
                continue
            if accepts(other, thing) and _fits(view, thing, other):
                seen.add(kind)
                yield Action("put", name, destination=view.names[place])
    for verb, (needs, state, value) in ACTS.items():
        if verb in _ONLY_ON_REQUEST or thing[state] == value:
            continue
        if starts(view, Action(verb, name)):
            continue
        if thing[needs] or (needs == "toggleable" and thing["objectType"] == "StoveBurner"):
            yield Action(verb, name)


def starts(view: View, action: Action) -> bool:
    """Whether the action turns on what heats, or lets water run."""
    return action.name == "turn on" and view.type_of(action.target) in _HEATS | _RUNNING


def cooks(view: View, action: Action) -> list[str]:
    """Ids of what the action would cook: what is raw on a source of heat that is on, or goes on."""
    own, place = view.id(action.target), view.id(action.destination)
    if action.name == "turn on" and own:
        heated = (own, *(view.table[own]["controlledObjects"] or ()))
        return [raw for heat in heated if heat in view.table for raw in _raw(view, heat)]
    if action.name == "put" and own and _is_lit(view, place):
        return _raw(view, own)
    return []


def accepts(place: Mapping[str, Any], thing: Mapping[str, Any]) -> bool:
    """Whether things of this type belong on or in this place."""
    kind = place["objectType"]
    if not place["receptacle"]:
        return False
    if SINGLE.get(kind):
        return thing["objectType"] == SINGLE[kind]
    return kind in object_type(thing["objectType"]).places


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


def undoing(
    view: View, was: _Table, then: _Table, done: Sequence[Action], untouched: Collection[str]
) -> Resolution:
    """What brings back what some actions changed, and what of it stays.

    Args:
        view: The house now.
        was: Metadata by id, from before the actions.
        then: The same after them.
        done: The actions.
        untouched: Ids of what must not be touched.
    """
    changed = [
        own
        for own, thing in then.items()
        if own in was and any(thing[key] != was[own][key] for key in (*PREDICATES, "fillLiquid"))
    ]
    free = [own for own in changed if own not in untouched]
    plan = _restoring(view, was, free)
    kept = {act.target for act in _restoring(view, was, changed)} - {act.target for act in plan}
    told = [f"I leave {the(name)} alone, as you asked." for name in sorted(kept)]
    pushed = (view.phrase(each) for each in done if each.name in ("push", "pull"))
    lost = (each for own in changed for each in _lost(view, was, own))
    told += [f"I cannot undo that: {each}." for each in (*pushed, *lost)]
    return Resolution(tuple(plan), " ".join(told))


def _restoring(view: View, was: _Table, things: Sequence[str]) -> list[Action]:
    """What brings things back to how they were, as far as anything can."""
    plan: list[Action] = []
    for own in things:
        now, then, name = view.table[own], was[own], view.names[own]
        if not is_whole(now):
            continue
        for verb in _RESTORED:
            needs, state, value = ACTS[verb]
            able = now[needs] and now["objectType"] != "StoveBurner"
            if able and now[state] != then[state] == value:
                filled = (act for act, liquid in FILLS.items() if liquid == then["fillLiquid"])
                plan.append(Action(next(filled, verb) if verb == "fill" else verb, name))
        home = view.place(then)
        if now["pickupable"] and home and (now["isPickedUp"] or view.place(now) != home):
            plan.append(Action("put", name, destination=home))
        if then["isPickedUp"] and not now["isPickedUp"]:
            plan.append(Action("pick up", name))
    held = view.names.get(view.held, "")
    return sorted(
        plan,
        key=lambda act: (
            act.name == "pick up",
            act.name != "turn off",
            act.target != held,
            act.name != "put",
        ),
    )


def _lost(view: View, was: _Table, own: str) -> Iterator[str]:
    """What was done to a thing that nothing brings back."""
    for verb in (*IRREVERSIBLE, "clean"):
        _, state, value = ACTS[verb]
        if view.table[own][state] == value != was[own][state]:
            yield f"{verb} {the(view.names[own])}"
