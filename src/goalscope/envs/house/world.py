"""The embedded house: a scene that takes AI2-THOR's actions and answers with its metadata."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from goalscope.envs.house.acts import ACTS
from goalscope.envs.house.effects import settle
from goalscope.envs.house.geometry import as_dict
from goalscope.envs.house.motion import MOTIONS
from goalscope.envs.house.scene import Scene
from goalscope.envs.house.state import GRID, REACH, Failure, State

__all__ = ["ACTIONS", "House"]

ACTIONS: Mapping[str, Callable[..., Any]] = {**ACTS, **MOTIONS}
"""Every action of the house, by AI2-THOR's name."""

SECONDS = 0.02
"""What one action takes on the simulation's clock: one step of physics."""

_FOR_THE_ENGINE = frozenset(
    {"action", "agentId", "sequenceId", "renderImage", "renderDepthImage", "renderNormalsImage",
     "renderInstanceSegmentation", "renderSemanticSegmentation", "renderFlowImage", "snapToGrid",
     "fixedDeltaTime", "autoSimulation", "simulatePhysics", "visibilityDistance", "placeStationary",
     "manualInteract", "forceVisible"}
)  # fmt: skip
"""Arguments for Unity's engine, which mean nothing here."""

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
        grid: Distance between the positions where the agent can stand, in m.
        reach: How far the agent sees and reaches, in m.
    """

    def __init__(self, scene: Scene, *, grid: float = GRID, reach: float = REACH) -> None:
        self.state = State(scene, grid=grid, reach=reach)

    def step(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """Take one action, {"action": name, ...} with AI2-THOR's arguments.

        One that fails changes nothing; `lastActionSuccess`, `errorMessage` and `errorCode` say so.

        Returns:
            AI2-THOR's metadata after it.
        """
        name = action.get("action")
        try:
            function, arguments = _call(name, action)
            returned = function(self.state, **arguments)
        except Failure as failure:
            return self.metadata(name, error=str(failure), code=failure.code)
        settle(self.state, SECONDS)
        self.state.look()
        return self.metadata(name, returned=returned)

    def advance(self, seconds: float) -> None:
        """Let time pass: what is hot or cold goes to the temperature of the room."""
        settle(self.state, seconds)

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
        floor = state.floor
        held = state.objects[state.held] if state.held else None
        return {
            "objects": [_copied(each) for each in state.objects.values()],
            "agent": {
                **state.agent,
                "position": {**state.agent["position"]},
                "rotation": {**state.agent["rotation"]},
            },
            "heldObjectPose": {"position": held["position"], "rotation": held["rotation"]}
            if held
            else None,
            "inventoryObjects": [{"objectId": held["objectId"], "objectType": held["objectType"]}]
            if held
            else [],
            "sceneName": state.scene.name,
            "lastAction": name if isinstance(name, str) else str(name),
            "lastActionSuccess": not error,
            "errorMessage": error,
            "errorCode": code,
            "actionReturn": returned,
            "screenWidth": 300,
            "screenHeight": 300,
            "agentId": 0,
            "thirdPartyCameras": [],
            "fov": 90.0,
            "isSceneAtRest": True,
            "collided": False,
            "collidedObjects": [],
            "currentTime": state.clock,
            "cameraPosition": as_dict(state.pose.position),
            "sceneBounds": {"center": as_dict(floor.center), "size": as_dict(floor.size)},
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
    odd = [key for key in odd if key not in ("forceAction", "degrees", "moveMagnitude")]
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
