"""How the agent moves and looks, and where it can."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from goalscope.envs.house.geometry import Pose, Vec, as_dict, box_of, sees, vec
from goalscope.envs.house.state import Failure, State

__all__ = ["MOTIONS"]

STEEPEST = (-30.0, 60.0)
"""The camera's lowest and highest horizon, in degrees down."""

HORIZONS = (-30.0, 0.0, 30.0, 60.0)
ROTATIONS = (0.0, 90.0, 180.0, 270.0)


def teleport(
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
    given = position if position is not None else {"x": x, "y": y, "z": z}
    for axis in "xyz":
        if given.get(axis) is not None:
            to[axis] = _number(given[axis], f"position.{axis}")
    yaw = agent["rotation"]["y"]
    if rotation is not None:
        turn = rotation.get("y", yaw) if isinstance(rotation, Mapping) else rotation
        yaw = _number(turn, "rotation") % 360
    down = agent["cameraHorizon"] if horizon is None else _number(horizon, "horizon")
    if not STEEPEST[0] - 1e-3 <= down <= STEEPEST[1] + 1e-3 and not forceAction:
        raise Failure(f"horizon must be between {STEEPEST[0]:.0f} and {STEEPEST[1]:.0f}")
    if not forceAction and not _is_free(state, to["x"], to["z"]):
        raise Failure(
            f"Cannot teleport to ({to['x']:.2f}, {to['y']:.2f}, {to['z']:.2f}): "
            "it is outside the room, or something stands there."
        )
    _stand(state, vec(to), yaw=yaw, horizon=down, standing=standing)


def teleport_full(
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
    """Teleport with every part of the pose given."""
    where = position if position is not None or x is None else {"x": x, "y": y, "z": z}
    pose = {"position": where, "rotation": rotation, "horizon": horizon, "standing": standing}
    missing = [name for name, value in pose.items() if value is None]
    if missing:
        raise Failure(f"TeleportFull needs {', '.join(missing)}", "MissingArguments")
    teleport(state, where, rotation, horizon, standing, forceAction)


def _walk(turn: float) -> Callable[..., None]:
    def walk(state: State, moveMagnitude: float | None = None, forceAction: bool = False) -> None:
        way = state.grid if moveMagnitude is None else _number(moveMagnitude, "moveMagnitude")
        way = way or state.grid
        pose = state.pose
        yaw = math.radians(pose.yaw + turn)
        x, y, z = pose.position
        to = (x + way * math.sin(yaw), y, z + way * math.cos(yaw))
        if not forceAction and not _is_free(state, to[0], to[2]):
            raise Failure("Something is in the way of the agent.")
        _stand(state, to)

    return walk


def _turn(sign: float) -> Callable[..., None]:
    def turn(state: State, degrees: float = 90.0, forceAction: bool = False) -> None:
        by = _number(degrees, "degrees") or 90.0
        _stand(state, state.pose.position, yaw=(state.pose.yaw + sign * by) % 360)

    return turn


def _tilt(sign: float) -> Callable[..., None]:
    def tilt(state: State, degrees: float = 30.0, forceAction: bool = False) -> None:
        down = state.pose.horizon + sign * (_number(degrees, "degrees") or 30.0)
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


def wait(state: State) -> None:
    """Do nothing."""


def get_reachable_positions(state: State, gridSize: float | None = None) -> list[dict[str, float]]:
    return [as_dict(each) for each in state.reachable()]


def get_interactable_poses(
    state: State,
    objectId: str,
    positions: Sequence[Mapping[str, float]] | None = None,
    rotations: Sequence[float] | None = None,
    horizons: Sequence[float] | None = None,
    standings: Sequence[bool] | None = None,
    maxPoses: int | None = None,
) -> list[dict[str, Any]]:
    """Poses from which the object can be seen and reached, the nearest positions first."""
    thing = state.objects.get(objectId)
    if thing is None:
        raise Failure("Object ID appears to be invalid.")
    box = box_of(thing)
    if state.is_gone(thing):
        return []
    places = state.reachable() if positions is None else [vec(each) for each in positions]
    near = [each for each in places if box.distance(each[0], each[2]) <= state.reach]
    near.sort(key=lambda each: math.dist((each[0], each[2]), (box.center[0], box.center[2])))
    found: list[dict[str, Any]] = []
    for place in near:
        for standing in (True, False) if standings is None else standings:
            for horizon in HORIZONS if horizons is None else horizons:
                for yaw in ROTATIONS if rotations is None else rotations:
                    pose = Pose(place, yaw, horizon, standing)
                    if sees(pose, box, state.reach):
                        found.append(
                            {
                                **as_dict(place),
                                "rotation": yaw,
                                "standing": standing,
                                "horizon": horizon,
                            }
                        )
                        if maxPoses is not None and len(found) >= maxPoses:
                            return found
    return found


MOTIONS: Mapping[str, Callable[..., Any]] = {
    "Teleport": teleport,
    "TeleportFull": teleport_full,
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
    "Pass": wait,
    "Done": wait,
    "GetReachablePositions": get_reachable_positions,
    "GetInteractablePoses": get_interactable_poses,
}
"""AI2-THOR's name of each motion; the arguments after the state are AI2-THOR's, too."""


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise Failure(f"{name} must be a number, not {value!r:.40}", "InvalidArgument")
    return float(value)


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
