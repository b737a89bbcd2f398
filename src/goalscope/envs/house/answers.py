"""Answers to questions: where the things asked about are, and in what state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from goalscope.envs.house.finding import Finder, remains
from goalscope.envs.house.names import are, the
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import View

__all__ = ["told_of"]

_TOLD = 6
"""Things that an answer tells of at most."""

_HELD = 5
"""Things in or on one that an answer names at most."""

_STATES = (
    ("openable", "isOpen", "open", "closed"),
    ("toggleable", "isToggled", "on", "off"),
    ("dirtyable", "isDirty", "dirty", "clean"),
    ("isCooked", "isCooked", "cooked", ""),
    ("isBroken", "isBroken", "broken", ""),
    ("isUsedUp", "isUsedUp", "used up", ""),
)
"""The property that a state needs, the state, and its words."""


def told_of(finder: Finder, what: str, where: str) -> str:
    """One sentence for each thing that is meant, with its place and state; at most six."""
    found = finder.find(what or where, where if what else "")
    view = finder.view
    gone = [own for own in found.things if not is_whole(view.table[own])]
    things = [*gone, *remains(view, found.things)]
    if not things:
        return f"There is no {what or where:.60} here."
    told = [_fact(view, own) for own in things[:_TOLD]]
    if len(things) > _TOLD:
        told.append(f"There are {len(things) - _TOLD} more.")
    return " ".join(told)


def _fact(view: View, own: str) -> str:
    thing, name = view.table[own], the(view.names[own])
    if not is_whole(thing):
        fate = "sliced" if thing["isSliced"] else "broken"
        return f"{name[0].upper()}{name[1:]} {are(name)} {fate}."
    facts = [yes if thing[state] else no for needs, state, yes, no in _STATES if thing[needs]]
    if thing["canFillWithLiquid"]:
        liquid = thing["fillLiquid"] or "a liquid"
        facts.append(f"full of {liquid}" if thing["isFilledWithLiquid"] else "empty")
    facts += [thing["temperature"].lower()] if thing["temperature"] != "RoomTemp" else []
    facts += [view.where(thing)] if thing["pickupable"] else []
    held = _held(view, thing)
    text = f"{name} {are(name)} {_listed(facts or [view.where(thing)])}"
    text += f"; {view.in_or_on(view.names[own])} it: {held}" if held else ""
    return f"{text[0].upper()}{text[1:]}."


def _held(view: View, thing: Mapping[str, Any]) -> str:
    """What is in or on a thing, by name."""
    inside = [own for own in thing["receptacleObjectIds"] or () if own in view.table]
    names = sorted(view.names[own] for own in inside if is_whole(view.table[own]))
    more = [f"{len(names) - _HELD} more"] if len(names) > _HELD else []
    return _listed([*map(the, names[:_HELD]), *more]) if names else ""


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
