"""What the agent does: AI2-THOR's actions on objects, its motions, and their messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from statistics import median
from typing import Any, cast

from goalscope.base.inputs import shown
from goalscope.envs.house.simulator.object_types import LIQUIDS, SINGLE, object_type, slices_of
from goalscope.envs.house.simulator.state import (
    ENCLOSING,
    EYE_HEIGHT,
    GRID,
    REACH,
    Box,
    Failure,
    Pose,
    State,
    Vec,
    as_dict,
    box_of,
    is_whole,
    number,
    sees,
    spots,
    vec,
)

_ONLY_WATER = frozenset({"HousePlant", "Kettle", "Pot", "WateringCan"})
_ONLY_WINE_AND_WATER = frozenset({"WineBottle"})
_WORKS_NO_MORE = frozenset({"CellPhone", "Laptop", "Television"})
"""What cannot be turned on again once it is broken."""

MOST_PUSH = 200.0
"""Largest moveMagnitude, in newtons."""


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


_NO_VESSEL = "{} does not have CanBeFilled property!"


def _able(state: State, own: str, force: bool, flag: str, lacking: str) -> dict[str, Any]:
    """The object, which must have an affordance; {} in the message is its id."""
    thing = state.target(own, force=force)
    if not thing[flag]:
        raise Failure(lacking.format(own))
    return thing


def _open_object(
    state: State, objectId: str, openness: float = 1.0, forceAction: bool = False
) -> None:
    if not 0 <= number(openness, "openness") <= 1:
        raise Failure("Please give an open percentage between 0.0f and 1.0f")
    thing = _able(state, objectId, forceAction, "openable", "{} is not an Openable object")
    if thing["objectType"] == "Microwave" and thing["isToggled"]:
        raise Failure("Target must be OFF to open!")
    if thing["isOpen"] and thing["openness"] == openness:
        raise Failure("Object already open")
    thing["isOpen"], thing["openness"] = openness > 0, float(openness)


def _close_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = _able(state, objectId, forceAction, "openable", "{} is not an Openable object")
    if not thing["isOpen"]:
        raise Failure("object already closed")
    thing["isOpen"], thing["openness"] = False, 0.0


def _pickup_object(state: State, objectId: str, forceAction: bool = False) -> str:
    if state.held:
        raise Failure("Agent hand has something in it already! Can't pick up anything else")
    thing = state.objects.get(objectId)
    if thing is None:
        raise Failure("Object ID appears to be invalid.")
    if not thing["pickupable"]:
        raise Failure(f"{objectId} must have the property CanPickup to be picked up.")
    if not is_whole(thing) or not (forceAction or thing["visible"]):
        raise Failure(f"{objectId} is not visible and can't be picked up.")
    _set_down(state, thing, [])
    thing["isPickedUp"] = True
    state.held = objectId
    return objectId


def _put_object(state: State, objectId: str, forceAction: bool = False) -> None:
    if state.held is None:
        raise Failure("Can't place an object if Agent isn't holding anything")
    if objectId not in state.objects:
        raise Failure("No valid Receptacle found")
    target = state.target(objectId, force=forceAction)
    thing = state.objects[state.held]
    _check_place(state, thing, target, force=forceAction)
    _place(state, thing, target)
    _let_go(state, thing)


def _drop_hand_object(state: State, forceAction: bool = False) -> dict[str, float]:
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
    parents = _parents_at(state, top, height) if top else floors
    _set_down(state, thing, parents)
    _let_go(state, thing)
    return dict(thing["position"])


def _slice_object(state: State, objectId: str, forceAction: bool = False) -> None:
    lacking = "{} Does not have the CanBeSliced property!"
    thing = _able(state, objectId, forceAction, "sliceable", lacking)
    if objectId == state.held:
        raise Failure("target object cannot be sliced if it is in the agent's hand")
    thing["isSliced"] = True
    _replace(state, thing)


def _break_object(state: State, objectId: str, forceAction: bool = False) -> None:
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
        _drop_hand_object(state)
    thing["isBroken"] = True
    for each in state.contents(objectId):
        others = [own for own in each["parentReceptacles"] or () if own != objectId]
        state.attach(each, others or thing["parentReceptacles"])
    if not is_whole(thing):
        _replace(state, thing)


def _fill_object(state: State, objectId: str, fillLiquid: str, forceAction: bool = False) -> None:
    thing = _able(state, objectId, forceAction, "canFillWithLiquid", _NO_VESSEL)
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


def _empty_object(state: State, objectId: str, forceAction: bool = False) -> None:
    thing = _able(state, objectId, forceAction, "canFillWithLiquid", _NO_VESSEL)
    if not thing["isFilledWithLiquid"]:
        raise Failure("object already empty")
    thing["isFilledWithLiquid"], thing["fillLiquid"] = False, None


def _setting(flag: str, key: str, value: bool, lacking: str, already: str) -> Callable[..., None]:
    """An act that sets one state of an object that has the flag; {} in messages is its id."""

    def act(state: State, objectId: str, forceAction: bool = False) -> None:
        thing = _able(state, objectId, forceAction, flag, lacking)
        if thing[key] == value:
            raise Failure(already.format(objectId))
        thing[key] = value

    return act


def _toggling(on: bool) -> Callable[..., None]:
    word = "on" if on else "off"

    def act(state: State, objectId: str, forceAction: bool = False) -> None:
        thing = state.target(objectId, force=forceAction)
        if thing["objectType"] == "StoveBurner":
            raise Failure(
                "target object is controlled by another sim object. "
                "target object cannot be turned on/off directly"
            )
        if not thing["toggleable"]:
            raise Failure("object is not toggleable.")
        if thing["isToggled"] == on:
            raise Failure(f"can't toggle object {word} if it's already {word}!")
        if on and thing["isBroken"] and thing["objectType"] in _WORKS_NO_MORE:
            raise Failure("Target is broken and cannot be Toggled On!")
        if on and thing["objectType"] == "Microwave" and thing["isOpen"]:
            raise Failure("Target must be closed to Toggle On!")
        for own in (objectId, *(thing["controlledObjects"] or ())):
            if own in state.objects:
                state.objects[own]["isToggled"] = on

    return act


def _sliding(sign: int) -> Callable[..., None]:
    """Push or pull along the agent's gaze: a heavy thing moves less, and none leaves the room."""

    def act(
        state: State, objectId: str, moveMagnitude: str | float = "50", forceAction: bool = False
    ) -> None:
        thing = state.target(objectId, force=forceAction)
        if not (thing["moveable"] or thing["pickupable"]):
            raise Failure(
                f"Target object {objectId} is not Moveable or Pickupable, "
                "it can't be pushed or pulled."
            )
        if objectId == state.held:
            raise Failure("Target object is in the agent's hand, it can't be pushed or pulled.")
        try:
            newtons = float(moveMagnitude)
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

    return act


ACTS: Mapping[str, Callable[..., Any]] = {
    "OpenObject": _open_object,
    "CloseObject": _close_object,
    "PickupObject": _pickup_object,
    "PutObject": _put_object,
    "DropHandObject": _drop_hand_object,
    "PushObject": _sliding(1),
    "PullObject": _sliding(-1),
    "ToggleObjectOn": _toggling(on=True),
    "ToggleObjectOff": _toggling(on=False),
    "FillObjectWithLiquid": _fill_object,
    "EmptyLiquidFromObject": _empty_object,
    "SliceObject": _slice_object,
    "CookObject": _setting(
        "cookable", "isCooked", True,
        "{} does not have the CanBeCooked property!", "{} is already Toasted!",
    ),
    "BreakObject": _break_object,
    "DirtyObject": _setting(
        "dirtyable", "isDirty", True,
        "{} does not have dirtyable property!", "{} is already dirty!",
    ),
    "CleanObject": _setting(
        "dirtyable", "isDirty", False,
        "{} does not have dirtyable property!", "{} is already Clean!",
    ),
    "UseUpObject": _setting(
        "canBeUsedUp", "isUsedUp", True,
        "{} does not have CanBeUsedUp property!", "object already used up!",
    ),
}  # fmt: skip
"""AI2-THOR's name of each act; the arguments after the state are AI2-THOR's, too."""


def _let_go(state: State, thing: dict[str, Any]) -> None:
    thing["isPickedUp"] = False
    state.held = None


def _replace(state: State, thing: dict[str, Any]) -> None:
    """Set the slices, or what is in an egg, where the thing was."""
    parents = thing["parentReceptacles"]
    for each in slices_of(thing):
        state.objects[each["objectId"]] = each
        state.attach(each, parents)
    state.attach(thing, None)


def _check_place(
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


def _place(state: State, thing: dict[str, Any], target: dict[str, Any]) -> None:
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
    _set_down(state, thing, _parents_at(state, target, height))


def _set_down(state: State, thing: dict[str, Any], parents: list[str]) -> None:
    """Write down that the thing, and what it carries, is in these receptacles."""
    carried = list(state.carried(thing["objectId"]))
    inner = {thing["objectId"], *(each["objectId"] for each in carried)}
    state.attach(thing, parents)
    for each in carried:
        kept = [own for own in each["parentReceptacles"] or () if own in inner]
        state.attach(each, [*kept, *parents])


def _parents_at(state: State, target: dict[str, Any], height: float) -> list[str]:
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


STEEPEST = (-30.0, 60.0)
"""The camera's lowest and highest horizon, in degrees down."""

HORIZONS = (-30.0, 0.0, 30.0, 60.0)
ROTATIONS = (0.0, 90.0, 180.0, 270.0)

MOST_OFF = 0.1
"""How far above or below the height at which it stands the agent may be set, in m."""


def _teleport(
    state: State,
    position: Mapping[str, float] | None = None,
    rotation: Mapping[str, float] | float | None = None,
    horizon: float | None = None,
    standing: bool | None = None,
    forceAction: bool = False,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
) -> None:
    agent = state.agent
    here = agent["position"]
    to = dict(here)
    given = {"x": x, "y": y, "z": z} if position is None else position
    if not isinstance(cast("object", given), Mapping):
        raise Failure(f"position must be {{x, y, z}}, not {shown(given)}", "InvalidArgument")
    for axis in "xyz":
        if given.get(axis) is not None:
            to[axis] = number(given[axis], f"position.{axis}")
    yaw = agent["rotation"]["y"]
    if rotation is not None:
        turn = rotation.get("y", yaw) if isinstance(rotation, Mapping) else rotation
        yaw = number(turn, "rotation") % 360
    down = agent["cameraHorizon"] if horizon is None else number(horizon, "horizon")
    if not STEEPEST[0] - 1e-3 <= down <= STEEPEST[1] + 1e-3 and not forceAction:
        raise Failure(f"horizon must be between {STEEPEST[0]:.0f} and {STEEPEST[1]:.0f}")
    if not forceAction and not _is_free(state, to["x"], to["z"]):
        raise Failure(
            f"Cannot teleport to ({to['x']:.2f}, {to['y']:.2f}, {to['z']:.2f}): "
            "it is outside the room, or something stands there."
        )
    heights = (here["y"], state.floor.center[1] + EYE_HEIGHT)
    if not forceAction and min(abs(to["y"] - each) for each in heights) > MOST_OFF:
        raise Failure(
            f"Cannot teleport to a height of {to['y']:.2f} m: "
            f"the agent would not stand on the floor. It stands there at {heights[1]:.2f} m."
        )
    _stand(state, vec(to), yaw=yaw, horizon=down, standing=standing)


def _walk(turn: float) -> Callable[..., None]:
    def walk(state: State, moveMagnitude: float | None = None, forceAction: bool = False) -> None:
        way = GRID if moveMagnitude is None else number(moveMagnitude, "moveMagnitude")
        way = way or GRID
        pose = state.pose
        yaw = math.radians(pose.yaw + turn)
        x, y, z = pose.position
        ahead, aside = way * math.cos(yaw), way * math.sin(yaw)
        steps = math.ceil(abs(way) / GRID)
        shares = (step / steps for step in range(1, steps + 1))
        if not forceAction and not all(
            _is_free(state, x + share * aside, z + share * ahead) for share in shares
        ):
            raise Failure("Something is in the way of the agent.")
        _stand(state, (x + aside, y, z + ahead))

    return walk


def _turn(sign: float) -> Callable[..., None]:
    def turn(state: State, degrees: float = 90.0) -> None:
        by = number(degrees, "degrees") or 90.0
        _stand(state, state.pose.position, yaw=(state.pose.yaw + sign * by) % 360)

    return turn


def _wait(state: State) -> None:
    """Do nothing."""


def _get_reachable_positions(state: State) -> list[dict[str, float]]:
    return [as_dict(each) for each in state.reachable()]


def _get_interactable_poses(state: State, objectId: str) -> list[dict[str, Any]]:
    """Poses from which the object can be seen and reached, the nearest positions first."""
    thing = state.objects.get(objectId)
    if thing is None:
        raise Failure("Object ID appears to be invalid.")
    if not is_whole(thing):
        return []
    box = box_of(thing)
    near = [each for each in state.reachable() if box.distance(each[0], each[2]) <= REACH]
    near.sort(key=lambda each: math.dist((each[0], each[2]), (box.center[0], box.center[2])))
    return [
        {**as_dict(place), "rotation": yaw, "standing": standing, "horizon": horizon}
        for place in near
        for standing in (True, False)
        for horizon in HORIZONS
        for yaw in ROTATIONS
        if sees(Pose(place, yaw, horizon, standing), box, REACH)
    ]


MOTIONS: Mapping[str, Callable[..., Any]] = {
    "Teleport": _teleport,
    "MoveAhead": _walk(0),
    "MoveRight": _walk(90),
    "MoveBack": _walk(180),
    "MoveLeft": _walk(270),
    "RotateRight": _turn(1),
    "RotateLeft": _turn(-1),
    "Pass": _wait,
}
"""AI2-THOR's name of each motion; the arguments after the state are AI2-THOR's, too."""

QUERIES: Mapping[str, Callable[..., Any]] = {
    "GetReachablePositions": _get_reachable_positions,
    "GetInteractablePoses": _get_interactable_poses,
}
"""Actions that only ask: the house is as before, and no time has passed."""


def _is_free(state: State, x: float, z: float) -> bool:
    floor = state.floor
    inside = all(
        floor.low(axis) - 0.05 <= each <= floor.high(axis) + 0.05 for axis, each in ((0, x), (2, z))
    )
    return inside and all(box.distance(x, z) > 0 for box in state.solids)


def _stand(
    state: State,
    position: Vec,
    *,
    yaw: float | None = None,
    horizon: float | None = None,
    standing: bool | None = None,
) -> None:
    agent = state.agent
    agent["position"] = as_dict(position)
    if yaw is not None:
        agent["rotation"] = {**agent["rotation"], "y": yaw}
    if horizon is not None:
        agent["cameraHorizon"] = horizon
    if standing is not None:
        agent["isStanding"] = standing
