"""How the agent moves and looks, and where it can."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, cast

from goalscope.base.inputs import shown
from goalscope.envs.house.simulator.geometry import Pose, Vec, as_dict, box_of, sees, vec
from goalscope.envs.house.simulator.state import (
    EYE_HEIGHT,
    GRID,
    REACH,
    Failure,
    State,
    is_whole,
    number,
)

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
    given = {"x": x, "y": y, "z": z} if position is None else _point(position)
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


def _tilt(sign: float) -> Callable[..., None]:
    def tilt(state: State, degrees: float = 30.0) -> None:
        down = state.pose.horizon + sign * (number(degrees, "degrees") or 30.0)
        if not STEEPEST[0] - 1e-3 <= down <= STEEPEST[1] + 1e-3:
            raise Failure("Tilting further would exceed the camera's limits.")
        _stand(state, state.pose.position, horizon=down)

    return tilt


def _posture(standing: bool) -> Callable[..., None]:
    def posture(state: State) -> None:
        if state.agent["isStanding"] == standing:
            raise Failure(f"The agent is already {'standing' if standing else 'crouching'}.")
        _stand(state, state.pose.position, standing=standing)

    return posture


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
    "LookDown": _tilt(1),
    "LookUp": _tilt(-1),
    "Stand": _posture(True),
    "Crouch": _posture(False),
    "Pass": _wait,
}
"""AI2-THOR's name of each motion; the arguments after the state are AI2-THOR's, too."""

QUERIES: Mapping[str, Callable[..., Any]] = {
    "GetReachablePositions": _get_reachable_positions,
    "GetInteractablePoses": _get_interactable_poses,
}
"""Actions that only ask: the house is as before, and no time has passed."""


def _point(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise Failure(f"position must be {{x, y, z}}, not {shown(value)}", "InvalidArgument")
    return cast("Mapping[str, Any]", value)


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
