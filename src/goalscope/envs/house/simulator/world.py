"""The embedded house with AI2-THOR's actions and metadata, and the controllers that drive one."""

from __future__ import annotations

import importlib
import inspect
import math
import os
import shlex
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from goalscope.base.optional_packages import remedy
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.envs.house.simulator.acts import ACTS, MOTIONS, QUERIES
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.state import Failure, Scene, State, vec

ACTIONS: Mapping[str, Callable[..., Any]] = {**ACTS, **MOTIONS, **QUERIES}
"""Every action of the house, by AI2-THOR's name."""

SECONDS = 0.02
"""One step of physics: what one action takes; fixed, so that the same actions lead to the same."""

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
        held = state.objects[state.held] if state.held else None
        return {
            "objects": [_copied(each) for each in state.objects.values()],
            "agent": {
                **state.agent,
                "position": {**state.agent["position"]},
                "rotation": {**state.agent["rotation"]},
            },
            "inventoryObjects": [{"objectId": held["objectId"], "objectType": held["objectType"]}]
            if held
            else [],
            "sceneName": state.scene.name,
            "lastAction": name if isinstance(name, str) else str(name),
            "lastActionSuccess": not error,
            "errorMessage": error,
            "errorCode": code,
            "actionReturn": returned,
            "agentId": 0,
            "thirdPartyCameras": [],
            "currentTime": state.clock,
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


RAISED = ("InvalidAction", "MissingArguments", "InvalidArgument")
"""Error codes that AI2-THOR's Controller raises a ValueError for."""


PATIENCE = 60.0
"""Seconds that Unity may take for one step."""


class Controller(Protocol):
    """What the robot needs of a controller: AI2-THOR's own has it, and `HouseController`."""

    @property
    def last_event(self) -> Any:
        """The event of the last step, with `.metadata`."""
        ...

    def step(self, action: str, **arguments: Any) -> Any:
        """Take one action."""
        ...

    def reset(self) -> Any:
        """Go back to the start of the scene."""
        ...

    def stop(self) -> Any:
        """Let go of whatever runs behind it."""
        ...


@dataclass(frozen=True, slots=True)
class Event:
    """What a step led to; true if the action succeeded.

    Attributes:
        metadata: AI2-THOR's metadata after the step.
    """

    metadata: dict[str, Any]

    def __bool__(self) -> bool:
        return bool(self.metadata["lastActionSuccess"])


class HouseController:
    """Drives the embedded house as `ai2thor.controller.Controller` drives Unity.

    Examples:
        >>> controller = HouseController("Kitchen1")   # doctest: +SKIP
        >>> controller.step("PickupObject", objectId=egg, forceAction=True)   # doctest: +SKIP

    Args:
        scene: A scene, its name, or its file; see `load_scene`.

    Attributes:
        last_event: What the last step led to.
    """

    def __init__(self, scene: str | Scene = "Kitchen1") -> None:
        self._scene = scene if isinstance(scene, Scene) else load_scene(scene)
        self.last_event: Event
        self.reset()

    def reset(self) -> Event:
        """Go back to the start of the scene."""
        self._house = House(self._scene)
        self.last_event = Event(self._house.metadata())
        return self.last_event

    def step(self, action: str, **arguments: Any) -> Event:
        """Take one action.

        Raises:
            ValueError: There is no such action, or its arguments are wrong.
        """
        self.last_event = Event(self._house.step({"action": action, **arguments}))
        metadata = self.last_event.metadata
        if metadata["errorCode"] in RAISED:
            raise ValueError(metadata["errorMessage"])
        return self.last_event

    def stop(self) -> None:
        """Nothing runs behind it."""


def start_thor(scene: str, unity: str | None = None) -> Controller:
    """Start AI2-THOR.

    Args:
        scene: Name of the scene, as the build knows it.
        unity: Path of a Unity build; None takes AI2-THOR's own, which it fetches at the first
            use. Without a display that one renders unseen.

    Raises:
        InvalidInputError: AI2-THOR is not installed, or there is no such program.
        GoalscopeError: It does not start; the message says why.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            thor: Any = importlib.import_module("ai2thor.controller")
    except ImportError as error:
        raise InvalidInputError(
            f"AI2-THOR is not installed ({error}). Run {remedy('thor')}; or leave out `--simulator "
            "thor` for the embedded house."
        ) from None
    options: dict[str, Any] = {}
    if unity is not None:
        if not os.access(unity, os.X_OK) or Path(unity).is_dir():
            raise InvalidInputError(f"{unity} is not an executable program. Name a Unity build.")
        options = {
            "local_executable_path": shlex.quote(unity),
            "x_display": os.environ.get("DISPLAY", ":0"),
            "headless": True,
        }
    elif "DISPLAY" not in os.environ:
        options = {"platform": importlib.import_module("ai2thor.platform").CloudRendering}
    try:
        return thor.Controller(
            scene=scene,
            server_timeout=PATIENCE,
            fixedDeltaTime=SECONDS,
            snapToGrid=False,
            **options,
        )
    except Exception as error:
        reason = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
        raise GoalscopeError(
            f"AI2-THOR does not start ({reason}). Its log is ~/.ai2thor/log/unity.log. "
            "Without a build, `--simulator embedded` needs none."
        ) from error
