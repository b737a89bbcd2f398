"""What the agent does to objects: AI2-THOR's actions, with their conditions and messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from goalscope.envs.house.simulator.geometry import box_of, vec
from goalscope.envs.house.simulator.placing import check_place, parents_at, place, set_down
from goalscope.envs.house.simulator.scene import LIQUIDS
from goalscope.envs.house.simulator.slices import slices_of
from goalscope.envs.house.simulator.state import ENCLOSING, Failure, State, is_whole, number

__all__ = ["ACTS"]

_ONLY_WATER = frozenset({"HousePlant", "Kettle", "Pot", "WateringCan"})
_ONLY_WINE_AND_WATER = frozenset({"WineBottle"})
_WORKS_NO_MORE = frozenset({"CellPhone", "Laptop", "Television"})
"""What cannot be turned on again once it is broken."""

MOST_PUSH = 200.0
"""Largest moveMagnitude, in newtons."""


def open_object(
    state: State, objectId: str, openness: float = 1.0, forceAction: bool = False
) -> None:
    if not 0 <= number(openness, "openness") <= 1:
        raise Failure("Please give an open percentage between 0.0f and 1.0f")
    thing = state.target(objectId, force=forceAction)
    if not thing["openable"]:
        raise Failure(f"{objectId} is not an Openable object")
    if thing["objectType"] == "Microwave" and thing["isToggled"]:
        raise Failure("Target must be OFF to open!")
    if thing["isOpen"] and thing["openness"] == openness:
        raise Failure("Object already open")
    thing["isOpen"], thing["openness"] = openness > 0, float(openness)


def close_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = state.target(objectId, force=forceAction)
    if not thing["openable"]:
        raise Failure(f"{objectId} is not an Openable object")
    if not thing["isOpen"]:
        raise Failure("object already closed")
    thing["isOpen"], thing["openness"] = False, 0.0


def pickup_object(state: State, objectId: str, forceAction: bool = False) -> str:
    if state.held:
        raise Failure("Agent hand has something in it already! Can't pick up anything else")
    thing = state.objects.get(objectId)
    if thing is None:
        raise Failure("Object ID appears to be invalid.")
    if not thing["pickupable"]:
        raise Failure(f"{objectId} must have the property CanPickup to be picked up.")
    if not is_whole(thing) or not (forceAction or thing["visible"]):
        raise Failure(f"{objectId} is not visible and can't be picked up.")
    set_down(state, thing, [])
    thing["isPickedUp"] = True
    state.held = objectId
    return objectId


def put_object(state: State, objectId: str, forceAction: bool = False) -> None:
    if state.held is None:
        raise Failure("Can't place an object if Agent isn't holding anything")
    if objectId not in state.objects:
        raise Failure("No valid Receptacle found")
    target = state.target(objectId, force=forceAction)
    thing = state.objects[state.held]
    check_place(state, thing, target, force=forceAction)
    place(state, thing, target)
    _let_go(state, thing)


def drop_hand_object(state: State, forceAction: bool = False) -> dict[str, float]:
    """Drop what the hand holds onto what is below it."""
    if state.held is None:
        raise Failure("Nothing in hand to drop!")
    thing = state.objects[state.held]
    box = box_of(thing)
    x, y, z = vec(thing["position"])
    below = [
        each
        for each in state.objects.values()
        if each["receptacle"]
        and each is not thing
        and each["objectType"] not in ENCLOSING | {"Floor"}
        and not each["pickupable"]
        and box_of(each).distance(x, z) == 0
        and box_of(each).high(1) <= box.low(1)
    ]
    top = max(below, key=lambda each: box_of(each).high(1), default=None)
    level = box_of(top).high(1) if top else state.floor.center[1]
    height = level + y - box.low(1)
    state.shift(thing, (x, height, z))
    floors = [own for own, each in state.objects.items() if each["objectType"] == "Floor"][:1]
    parents = parents_at(state, top, height) if top else floors
    set_down(state, thing, parents)
    _let_go(state, thing)
    return dict(thing["position"])


def push_object(
    state: State, objectId: str, moveMagnitude: str | float = "50", forceAction: bool = False
) -> None:
    _slide(state, objectId, moveMagnitude, forceAction, 1)


def pull_object(
    state: State, objectId: str, moveMagnitude: str | float = "50", forceAction: bool = False
) -> None:
    _slide(state, objectId, moveMagnitude, forceAction, -1)


def toggle_object_on(state: State, objectId: str, forceAction: bool = False) -> None:
    _toggle(state, objectId, forceAction, on=True)


def toggle_object_off(state: State, objectId: str, forceAction: bool = False) -> None:
    _toggle(state, objectId, forceAction, on=False)


def slice_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = state.target(objectId, force=forceAction)
    if not thing["sliceable"]:
        raise Failure(f"{objectId} Does not have the CanBeSliced property!")
    if objectId == state.held:
        raise Failure("target object cannot be sliced if it is in the agent's hand")
    thing["isSliced"] = True
    _replace(state, thing)


def break_object(state: State, objectId: str, forceAction: bool = False) -> None:
    if state.objects.get(objectId, {}).get("isBroken"):
        raise Failure(f"{objectId} is already broken!")
    thing = state.target(objectId, force=forceAction)
    if not thing["breakable"]:
        raise Failure(f"{objectId} does not have the CanBreak property!!")
    if thing["toggleable"]:
        thing["isToggled"] = False
    if thing["isFilledWithLiquid"]:
        thing["isFilledWithLiquid"], thing["fillLiquid"] = False, None
    if objectId == state.held:
        drop_hand_object(state)
    thing["isBroken"] = True
    for each in state.contents(objectId):
        others = [own for own in each["parentReceptacles"] or () if own != objectId]
        state.attach(each, others or thing["parentReceptacles"])
    if not is_whole(thing):
        _replace(state, thing)


def cook_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = state.target(objectId, force=forceAction)
    if not thing["cookable"]:
        raise Failure(f"{objectId} does not have the CanBeCooked property!")
    if thing["isCooked"]:
        raise Failure(f"{objectId} is already Toasted!")
    thing["isCooked"] = True


def dirty_object(state: State, objectId: str, forceAction: bool = False) -> None:
    _soil(state, objectId, forceAction, dirty=True)


def clean_object(state: State, objectId: str, forceAction: bool = False) -> None:
    _soil(state, objectId, forceAction, dirty=False)


def fill_object(state: State, objectId: str, fillLiquid: str, forceAction: bool = False) -> None:
    thing = state.target(objectId, force=forceAction)
    if not thing["canFillWithLiquid"]:
        raise Failure(f"{objectId} does not have CanBeFilled property!")
    if fillLiquid not in LIQUIDS:
        raise Failure(f"{fillLiquid} is not a valid Liquid Type")
    kind = thing["objectType"]
    if (kind in _ONLY_WATER and fillLiquid != "water") or (
        kind in _ONLY_WINE_AND_WATER and fillLiquid == "coffee"
    ):
        raise Failure(f"{objectId} cannot be filled with {fillLiquid}")
    if thing["isFilledWithLiquid"]:
        raise Failure(f"{objectId} is already Filled!")
    thing["isFilledWithLiquid"], thing["fillLiquid"] = True, fillLiquid
    if fillLiquid == "coffee":
        thing["temperature"] = "Hot"


def empty_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = state.target(objectId, force=forceAction)
    if not thing["canFillWithLiquid"]:
        raise Failure(f"{objectId} does not have CanBeFilled property!")
    if not thing["isFilledWithLiquid"]:
        raise Failure("object already empty")
    thing["isFilledWithLiquid"], thing["fillLiquid"] = False, None


def use_up_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = state.target(objectId, force=forceAction)
    if not thing["canBeUsedUp"]:
        raise Failure(f"{objectId} does not have CanBeUsedUp property!")
    if thing["isUsedUp"]:
        raise Failure("object already used up!")
    thing["isUsedUp"] = True


ACTS: Mapping[str, Callable[..., Any]] = {
    "OpenObject": open_object,
    "CloseObject": close_object,
    "PickupObject": pickup_object,
    "PutObject": put_object,
    "DropHandObject": drop_hand_object,
    "PushObject": push_object,
    "PullObject": pull_object,
    "ToggleObjectOn": toggle_object_on,
    "ToggleObjectOff": toggle_object_off,
    "FillObjectWithLiquid": fill_object,
    "EmptyLiquidFromObject": empty_object,
    "SliceObject": slice_object,
    "CookObject": cook_object,
    "BreakObject": break_object,
    "DirtyObject": dirty_object,
    "CleanObject": clean_object,
    "UseUpObject": use_up_object,
}
"""AI2-THOR's name of each act; the arguments after the state are AI2-THOR's, too."""


def _let_go(state: State, thing: dict[str, Any]) -> None:
    thing["isPickedUp"] = False
    state.held = None


def _toggle(state: State, object_id: str, force: bool, *, on: bool) -> None:
    thing = state.target(object_id, force=force)
    if thing["objectType"] == "StoveBurner":
        raise Failure(
            "target object is controlled by another sim object. "
            "target object cannot be turned on/off directly"
        )
    if not thing["toggleable"]:
        raise Failure("object is not toggleable.")
    if thing["isToggled"] == on:
        word = "on" if on else "off"
        raise Failure(f"can't toggle object {word} if it's already {word}!")
    if on and thing["isBroken"] and thing["objectType"] in _WORKS_NO_MORE:
        raise Failure("Target is broken and cannot be Toggled On!")
    if on and thing["objectType"] == "Microwave" and thing["isOpen"]:
        raise Failure("Target must be closed to Toggle On!")
    for own in (object_id, *(thing["controlledObjects"] or ())):
        if own in state.objects:
            state.objects[own]["isToggled"] = on


def _soil(state: State, object_id: str, force: bool, *, dirty: bool) -> None:
    thing = state.target(object_id, force=force)
    if not thing["dirtyable"]:
        raise Failure(f"{object_id} does not have dirtyable property!")
    if thing["isDirty"] == dirty:
        raise Failure(f"{object_id} is already {'dirty' if dirty else 'Clean'}!")
    thing["isDirty"] = dirty


def _slide(state: State, object_id: str, magnitude: str | float, force: bool, sign: int) -> None:
    """Push or pull along the agent's gaze: a heavy thing moves less, and none leaves the room."""
    thing = state.target(object_id, force=force)
    if not (thing["moveable"] or thing["pickupable"]):
        raise Failure(
            f"Target object {object_id} is not Moveable or Pickupable, "
            "it can't be pushed or pulled."
        )
    if object_id == state.held:
        raise Failure("Target object is in the agent's hand, it can't be pushed or pulled.")
    try:
        newtons = float(magnitude)
    except (TypeError, ValueError, OverflowError):
        newtons = math.nan
    if not 0 <= newtons <= MOST_PUSH:
        raise Failure("Please give a moveMagnitude between 0 and 200", "InvalidArgument")
    way = min(newtons / (50 * max(thing["mass"], 0.5)), 1.0) * sign
    yaw = math.radians(state.pose.yaw)
    x, y, z = vec(thing["position"])
    place = [x + way * math.sin(yaw), z + way * math.cos(yaw)]
    held_in = [each for each in state.parents(thing) if each["objectType"] != "Floor"]
    area = box_of(held_in[0]) if held_in else state.floor
    box = box_of(thing)
    for i, axis in ((0, 0), (1, 2)):
        middle = box.center[axis] - (x, y, z)[axis]
        room = max((area.size[axis] - box.size[axis]) / 2, 0.0)
        low, high = area.center[axis] - room - middle, area.center[axis] + room - middle
        place[i] = min(max(place[i], low), high)
    state.shift(thing, (place[0], y, place[1]))
    if not thing["pickupable"]:
        state.survey()


def _replace(state: State, thing: dict[str, Any]) -> None:
    """Set the slices, or what is in an egg, where the thing was."""
    parents = thing["parentReceptacles"]
    for each in slices_of(thing):
        state.objects[each["objectId"]] = each
        state.attach(each, parents)
    state.attach(thing, None)
