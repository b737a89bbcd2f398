"""The embedded house: a simulator with AI2-THOR's actions and metadata."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from typing import Any

from goalscope.envs.house.simulator.acts import ACTS
from goalscope.envs.house.simulator.geometry import STANDING_CAMERA, as_dict, box_of, vec
from goalscope.envs.house.simulator.motion import MOTIONS, QUERIES
from goalscope.envs.house.simulator.state import HAND, Failure, Scene, State

ACTIONS: Mapping[str, Callable[..., Any]] = {**ACTS, **MOTIONS, **QUERIES}
"""Every action of the house, by AI2-THOR's name."""

SECONDS = 0.02
"""What one action takes on the simulation's clock: one step of physics."""

_FOR_THE_ENGINE = frozenset(
    {"action", "agentId", "sequenceId", "forceAction",
     "renderImage", "renderDepthImage", "renderNormalsImage", "renderFlowImage",
     "renderInstanceSegmentation", "renderSemanticSegmentation", "renderClassImage",
     "renderObjectImage", "renderImageSynthesis", "disableRendering",
     "fixedDeltaTime", "autoSimulation", "simulatePhysics", "physicsSimulationParams",
     "physicsInterval", "waitForFixedUpdate", "simplifyPhysics", "ignoreAgentInTransition",
     "stopAtNonStaticCol", "allowAgentsToIntersect", "speed", "returnToStart", "continuous",
     "snapToGrid", "visibilityDistance", "maxStepCount", "moveMagnitude", "degrees",
     "placeStationary", "putNearXY", "randomSeed", "randomizeOpen", "manualInteract",
     "forceVisible", "useGripper", "x", "y"}
)  # fmt: skip
"""Arguments for Unity's engine; where an action has none of this name, it means nothing here.

x and y are a place on the screen then: what an action is for is told by `objectId`.
"""

CEILING = 2.6
"""Least height of a room, in m."""

ROOM_TEMPERATURE_AFTER = 10.0
"""Seconds after which what is away from heat and cold has the temperature of the room."""

_BASINS = ("SinkBasin", "BathtubBasin")
_SINKS = ("Sink", "Bathtub")

_PARAMETERS = {
    name: {
        key: parameter.default is inspect.Parameter.empty
        for key, parameter in list(inspect.signature(function).parameters.items())[1:]
    }
    for name, function in ACTIONS.items()
}
"""For each action its arguments, and whether they must be given."""


class House:
    """A house without rendering or physics: deterministic, and fast.

    Contextual effects are immediate: a fridge cools in the same step, a lit burner cooks. What
    lies in the hand, in a drawer or on a plate moves with it.

    Args:
        scene: What stands where at the start.
    """

    def __init__(self, scene: Scene) -> None:
        self.state = State(scene)
        self._bounds = _extent(self.state)

    def step(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """Take one action, {"action": name, ...} with AI2-THOR's arguments.

        One that fails changes nothing; `lastActionSuccess`, `errorMessage` and `errorCode` say so.
        One that only asks changes nothing either, and takes no time.

        Returns:
            AI2-THOR's metadata after it.
        """
        name = action.get("action")
        try:
            function, arguments = _call(name, action)
            returned = function(self.state, **arguments)
        except Failure as failure:
            return self.metadata(name, error=str(failure), code=failure.code)
        if name not in QUERIES:
            _settle(self.state, SECONDS)
            self.state.look()
        return self.metadata(name, returned=returned)

    def advance(self, seconds: float) -> None:
        """Let time pass: what is hot or cold goes to the temperature of the room."""
        _settle(self.state, seconds)

    def metadata(
        self,
        name: Any = "Initialize",
        *,
        returned: Any = None,
        error: str = "",
        code: str | None = None,
    ) -> dict[str, Any]:
        """AI2-THOR's metadata now, as after the action `name`.

        It is the caller's own, but for the bounding boxes: these are shared, and not to be altered.
        """
        state = self.state
        pose = state.pose
        x, y, z = pose.position
        held = state.objects[state.held] if state.held else None
        return {
            "objects": [_copied(each) for each in state.objects.values()],
            "agent": {
                **state.agent,
                "position": {**state.agent["position"]},
                "rotation": {**state.agent["rotation"]},
            },
            "heldObjectPose": _hand(state),
            "inventoryObjects": [{"objectId": held["objectId"], "objectType": held["objectType"]}]
            if held
            else [],
            "sceneName": state.scene.name,
            "lastAction": name if isinstance(name, str) else str(name),
            "lastActionSuccess": not error,
            "errorMessage": error,
            "errorCode": code,
            "actionReturn": returned,
            "actionIntReturn": 0,
            "actionFloatReturn": 0.0,
            "actionStringsReturn": [],
            "actionFloatsReturn": [],
            "actionVector3sReturn": [],
            "screenWidth": 300,
            "screenHeight": 300,
            "agentId": 0,
            "thirdPartyCameras": [],
            "arm": None,
            "fov": 90.0,
            "cameraOrthSize": -1.0,
            "depthFormat": "Meters",
            "colors": None,
            "visibleRange": None,
            "flatSurfacesOnGrid": [],
            "distances": [],
            "normals": [],
            "isOpenableGrid": [],
            "segmentedObjectIds": [],
            "objectIdsInBox": [],
            "isSceneAtRest": True,
            "collided": False,
            "collidedObjects": [],
            "currentTime": state.clock,
            "cameraPosition": as_dict((x, y + STANDING_CAMERA * pose.standing, z)),
            "sceneBounds": self._bounds,
        }


def _hand(state: State) -> dict[str, Any]:
    """Where the hand is, in the room and as the camera has it."""
    ahead, up = HAND
    return {
        "position": as_dict(state.hand),
        "rotation": as_dict((0.0, state.pose.yaw, 0.0)),
        "localPosition": as_dict((0.0, up - STANDING_CAMERA, ahead)),
        "localRotation": as_dict((0.0, 0.0, 0.0)),
    }


def _extent(state: State) -> dict[str, Any]:
    """The box around the floor and all that is in the room, up to the ceiling."""
    boxes = [state.floor, *map(box_of, state.objects.values())]
    low = [min(box.low(axis) for box in boxes) for axis in range(3)]
    high = [max(box.high(axis) for box in boxes) for axis in range(3)]
    high[1] = max(high[1], state.floor.center[1] + CEILING)
    (x0, y0, z0), (x1, y1, z1) = low, high
    return {
        "cornerPoints": [[x, y, z] for x in (x1, x0) for y in (y1, y0) for z in (z1, z0)],
        "center": as_dict(((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)),
        "size": as_dict((x1 - x0, y1 - y0, z1 - z0)),
    }


def _copied(thing: Mapping[str, Any]) -> dict[str, Any]:
    parents, inside = thing["parentReceptacles"], thing["receptacleObjectIds"]
    return {
        **thing,
        "position": {**thing["position"]},
        "rotation": {**thing["rotation"]},
        "parentReceptacles": parents and [*parents],
        "receptacleObjectIds": inside if inside is None else [*inside],
    }


def _call(name: Any, action: Mapping[str, Any]) -> tuple[Callable[..., Any], dict[str, Any]]:
    """The function of an action, and its arguments."""
    function = ACTIONS.get(name) if isinstance(name, str) else None
    if function is None:
        raise Failure(f"{str(name)[:60]} is not an action.", "InvalidAction")
    known = _PARAMETERS[str(name)]
    given = {key: value for key, value in action.items() if key in known}
    odd = [key for key in action if key not in known and key not in _FOR_THE_ENGINE]
    if odd:
        raise Failure(
            f"{name} has no argument {str(odd[0])[:40]!r}; it has {', '.join(known) or 'none'}.",
            "InvalidArgument",
        )
    missing = [key for key, needed in known.items() if needed and key not in given]
    if missing:
        raise Failure(f"{name} needs the argument {missing[0]!r}.", "MissingArguments")
    for key, value in given.items():
        if key.startswith("objectId") and not isinstance(value, str):
            raise Failure("Object ID appears to be invalid.", "InvalidArgument")
        if key in ("forceAction", "standing") and value is not None and type(value) is not bool:
            raise Failure(f"{key} must be true or false, not {value!r:.40}", "InvalidArgument")
    return function, given


def _settle(state: State, seconds: float) -> None:
    """Let `seconds` pass, and every fridge, fire and tap do its work."""
    state.clock += seconds
    kept: set[str] = set()
    for thing in list(state.objects.values()):
        match thing["objectType"]:
            case "Fridge":
                _reach(state, thing, "Cold", kept)
            case "StoveBurner" | "Microwave" | "Toaster" if thing["isToggled"]:
                _reach(state, thing, "Hot", kept)
                for each in state.carried(thing["objectId"]):
                    if each["cookable"]:
                        each["isCooked"] = True
            case "StoveBurner":
                kept.update(each["objectId"] for each in state.carried(thing["objectId"]))
            case "CoffeeMachine" if thing["isToggled"]:
                _brew(state, thing, kept)
            case "Faucet" | "ShowerHead" if thing["isToggled"]:
                _rinse(state, thing)
            case _:
                pass
    _cool(state, kept)


def _reach(state: State, source: dict[str, Any], temperature: str, kept: set[str]) -> None:
    for each in state.carried(source["objectId"]):
        each["temperature"] = temperature
        kept.add(each["objectId"])


def _brew(state: State, machine: dict[str, Any], kept: set[str]) -> None:
    for each in state.contents(machine["objectId"]):
        if each["objectType"] == "Mug":
            kept.add(each["objectId"])
            if not each["isFilledWithLiquid"]:
                each["isFilledWithLiquid"], each["fillLiquid"] = True, "coffee"
                each["temperature"] = "Hot"


def _rinse(state: State, tap: dict[str, Any]) -> None:
    """Clean and fill what stands in the basin under the tap."""
    here = vec(tap["position"])
    basins = [each for each in state.objects.values() if each["objectType"] in _BASINS]
    if not basins:
        return
    nearest = min(basins, key=lambda each: math.dist(vec(each["position"]), here))
    sinks = [each for each in state.parents(nearest) if each["objectType"] in _SINKS]
    sink = state.objects.get(nearest["objectId"].rpartition("|")[0], *sinks[:1])
    for basin in filter(None, (nearest, sink)):
        for each in state.contents(basin["objectId"]):
            if each["dirtyable"]:
                each["isDirty"] = False
            if each["canFillWithLiquid"] and not each["isFilledWithLiquid"]:
                if each["openable"] and not each["isOpen"]:
                    continue
                each["isFilledWithLiquid"], each["fillLiquid"] = True, "water"


def _cool(state: State, kept: set[str]) -> None:
    """Take what has been away from heat and cold for long enough to the room's temperature."""
    for own, thing in state.objects.items():
        if thing["temperature"] == "RoomTemp" or own in kept or not thing["pickupable"]:
            state.cooling.pop(own, None)
        elif state.clock - state.cooling.setdefault(own, state.clock) >= ROOM_TEMPERATURE_AFTER:
            thing["temperature"] = "RoomTemp"
            del state.cooling[own]
