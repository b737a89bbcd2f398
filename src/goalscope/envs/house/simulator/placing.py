"""Where a thing comes to stand, and in which receptacles it then is."""

from __future__ import annotations

from statistics import median
from typing import Any

from goalscope.envs.house.simulator.geometry import Box, Vec, box_of, spots, vec
from goalscope.envs.house.simulator.object_types import SINGLE, object_type
from goalscope.envs.house.simulator.state import ENCLOSING, Failure, State

__all__ = ["check_place", "parents_at", "place", "set_down"]

_BOTTOM = ENCLOSING | {"BathtubBasin", "GarbageCan", "Sink", "SinkBasin", "Bowl", "Pot", "Pan",
                       "Mug", "Cup", "Plate", "StoveBurner"}  # fmt: skip
"""Receptacles whose contents stand near their bottom."""

_SEAT = {"ArmChair": 0.45, "Bathtub": 0.9, "Bed": 0.6, "Chair": 0.5, "CoffeeMachine": 0.2,
         "Fridge": 0.45, "Shelf": 0.5, "Sofa": 0.45}  # fmt: skip
"""Where in its height a receptacle carries things that have no others beside them."""

_ON_FLOOR = 0.33
"""Below this height, in m, what stands on a piece of furniture counts as on the floor, too."""

_FLOOR_THROUGH = frozenset({"Box", "Drawer", "DogBed", "GarbageCan", "Safe", "Shelf"})
"""Receptacles on the floor whose contents count as on the floor whatever their height."""

_NEVER_FLOOR = frozenset({"Cabinet", "Fridge", "Sink", "Bathtub", "Toilet"})


def check_place(
    state: State, thing: dict[str, Any], target: dict[str, Any], *, force: bool
) -> None:
    """Raise the Failure that AI2-THOR would, if the thing may not be put there."""
    kind, own = target["objectType"], target["objectId"]
    if not target["receptacle"]:
        raise Failure("This target object is NOT a receptacle!")
    if own == thing["objectId"] or own in {
        each["objectId"] for each in state.carried(thing["objectId"])
    }:
        raise Failure("No valid Receptacle found")
    if kind in ENCLOSING and target["openable"] and not target["isOpen"]:
        raise Failure("Target openable Receptacle is CLOSED, can't place if target is not open!")
    if kind in SINGLE:
        if SINGLE[kind] and thing["objectType"] != SINGLE[kind]:
            raise Failure(f"{thing['objectId']} is not a valid Object Type to be placed in {own}")
        if any(each["pickupable"] for each in state.contents(own)):
            raise Failure(f"{own} is full right now")
        if SINGLE[kind]:
            return
    if not force and kind not in object_type(thing["objectType"]).places:
        raise Failure(f"{thing['objectId']} cannot be placed in {own}")


def place(state: State, thing: dict[str, Any], target: dict[str, Any]) -> None:
    """Put the thing on a free spot of the target, the nearest to the agent.

    Raises:
        Failure: There is none.
    """
    box, area = box_of(thing), box_of(target)
    inside = [each for each in state.contents(target["objectId"]) if each["pickupable"]]
    taken = [box_of(each) for each in inside]
    level = _level(target, area, taken)
    agent = state.agent["position"]
    surface = Box((area.center[0], level, area.center[2]), area.size)
    if target["objectType"] in SINGLE:
        spot: Vec = surface.center
    elif found := spots(surface, box.size, taken, (agent["x"], agent["z"])):
        spot = found[0]
    else:
        raise Failure("No valid positions to place object found")
    height = level + vec(thing["position"])[1] - box.low(1)
    offset = [vec(thing["position"])[axis] - box.center[axis] for axis in (0, 2)]
    state.shift(thing, (spot[0] + offset[0], height, spot[2] + offset[1]))
    set_down(state, thing, parents_at(state, target, height))


def set_down(state: State, thing: dict[str, Any], parents: list[str]) -> None:
    """Write down that the thing, and what it carries, is in these receptacles."""
    carried = list(state.carried(thing["objectId"]))
    inner = {thing["objectId"], *(each["objectId"] for each in carried)}
    state.attach(thing, parents)
    for each in carried:
        kept = [own for own in each["parentReceptacles"] or () if own in inner]
        state.attach(each, [*kept, *parents])


def parents_at(state: State, target: dict[str, Any], height: float) -> list[str]:
    """The receptacles of what stands on the target at this height: often also what carries it."""
    found = [target["objectId"]]
    kind = target["objectType"]
    for parent in state.parents(target):
        if parent["objectType"] == "Floor":
            low = height - state.floor.center[1] < _ON_FLOOR
            through = kind in _FLOOR_THROUGH or (low and kind not in _NEVER_FLOOR)
        else:
            through = target["pickupable"] or kind in SINGLE
        if through:
            found.append(parent["objectId"])
    return found


def _level(target: dict[str, Any], area: Box, taken: list[Box]) -> float:
    """The height at which things stand on the target."""
    if taken:
        return median(box.low(1) for box in taken)
    kind = target["objectType"]
    if kind in _SEAT:
        return area.low(1) + _SEAT[kind] * area.size[1]
    return area.low(1) + 0.03 if kind in _BOTTOM else area.high(1)
