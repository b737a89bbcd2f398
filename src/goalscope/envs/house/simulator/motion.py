"""How the agent moves and looks, and where it can."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar, cast

from goalscope.envs.house.simulator.acts import drop_hand_object
from goalscope.envs.house.simulator.geometry import Pose, Vec, as_dict, box_of, reachable, sees, vec
from goalscope.envs.house.simulator.state import (
    EYE_HEIGHT,
    RANGES,
    Failure,
    State,
    is_whole,
    number,
)
from goalscope.envs.tables import shown

__all__ = ["MOTIONS", "QUERIES"]

STEEPEST = (-30.0, 60.0)
"""The camera's lowest and highest horizon, in degrees down."""

HORIZONS = (-30.0, 0.0, 30.0, 60.0)
ROTATIONS = (0.0, 90.0, 180.0, 270.0)

MOST_OFF = 0.1
"""How far above or below the height at which it stands the agent may be set, in m."""

_Value = TypeVar("_Value")


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
    where: Any = position if position is not None or x is None else {"x": x, "y": y, "z": z}
    pose = {"position": where, "rotation": rotation, "horizon": horizon, "standing": standing}
    missing = [name for name, value in pose.items() if value is None]
    if missing:
        raise Failure(f"TeleportFull needs {', '.join(missing)}", "MissingArguments")
    teleport(state, where, rotation, horizon, standing, forceAction)


def _walk(turn: float) -> Callable[..., None]:
    def walk(state: State, moveMagnitude: float | None = None, forceAction: bool = False) -> None:
        way = state.grid if moveMagnitude is None else number(moveMagnitude, "moveMagnitude")
        way = way or state.grid
        pose = state.pose
        yaw = math.radians(pose.yaw + turn)
        x, y, z = pose.position
        ahead, aside = way * math.cos(yaw), way * math.sin(yaw)
        steps = math.ceil(abs(way) / state.grid)
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


def wait(state: State) -> None:
    """Do nothing."""


def move_held_object(state: State, ahead: float = 0.0, right: float = 0.0, up: float = 0.0) -> None:
    _keep_in_hand(state, ahead, right, up)


def nudge_held_object(state: State, moveMagnitude: float = 0.0) -> None:
    _keep_in_hand(state, moveMagnitude)


def rotate_held_object(
    state: State,
    pitch: float = 0.0,
    yaw: float = 0.0,
    roll: float = 0.0,
    rotation: Mapping[str, float] | None = None,
) -> None:
    turn = _point(rotation or {}, "rotation")
    _keep_in_hand(state, pitch, yaw, roll, *turn.values())


def _keep_in_hand(state: State, *amounts: Any) -> None:
    """Leave the hand where it is: its place says nothing of what is so in the room."""
    for each in amounts:
        number(each, "How far the hand moves or turns")
    if state.held is None:
        raise Failure("The agent's hand is empty, there is nothing to move.")


def throw_object(state: State, moveMagnitude: float, forceAction: bool = False) -> dict[str, float]:
    """Drop what the hand holds: without physics it flies nowhere."""
    number(moveMagnitude, "moveMagnitude")
    return drop_hand_object(state, forceAction)


def advance_physics_step(
    state: State,
    timeStep: float = 0.02,
    simSeconds: float | None = None,
    allowAutoSimulation: bool = False,
) -> None:
    """Do nothing: all is at rest after every action."""


def set_hand_sphere_radius(state: State, radius: float) -> None:
    if not 0.04 <= number(radius, "radius") <= 0.5:
        raise Failure("radius must be between 0.04 and 0.5 m", "InvalidArgument")


def get_reachable_positions(state: State, gridSize: float | None = None) -> list[dict[str, float]]:
    places = state.reachable()
    if gridSize is not None and gridSize != state.grid:
        low, high = RANGES["gridSize"]
        if not low <= number(gridSize, "gridSize") <= high:
            raise Failure(f"gridSize must be between {low} and {high} m", "InvalidArgument")
        start = state.scene.agent["position"] if state.scene.agent else as_dict(places[0])
        places = reachable(state.floor, state.solids, vec(start), gridSize)
    return [as_dict(each) for each in places]


def get_interactable_poses(
    state: State,
    objectId: str,
    positions: Iterable[Mapping[str, float]] | None = None,
    rotations: Iterable[float] | None = None,
    horizons: Iterable[float] | None = None,
    standings: Iterable[bool] | None = None,
    maxPoses: int | None = None,
) -> list[dict[str, Any]]:
    """Poses from which the object can be seen and reached, the nearest positions first."""
    thing = state.objects.get(objectId)
    if thing is None:
        raise Failure("Object ID appears to be invalid.")
    places = state.reachable() if positions is None else _each(positions, "positions", _place)
    yaws = ROTATIONS if rotations is None else _each(rotations, "rotations", number)
    tilts = HORIZONS if horizons is None else _each(horizons, "horizons", number)
    postures = (True, False) if standings is None else _each(standings, "standings", _flag)
    most = math.inf if maxPoses is None else number(maxPoses, "maxPoses")
    if most < 1:
        raise Failure("maxPoses must be at least 1", "InvalidArgument")
    box = box_of(thing)
    if not is_whole(thing):
        return []
    near = [each for each in places if box.distance(each[0], each[2]) <= state.reach]
    near.sort(key=lambda each: math.dist((each[0], each[2]), (box.center[0], box.center[2])))
    found: list[dict[str, Any]] = []
    for place in near:
        for standing in postures:
            for horizon in tilts:
                for yaw in yaws:
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
                        if len(found) >= most:
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
    "MoveHeldObject": move_held_object,
    **{f"MoveHeldObject{way}": nudge_held_object
       for way in ("Ahead", "Back", "Left", "Right", "Up", "Down")},
    "RotateHeldObject": rotate_held_object,
    "ThrowObject": throw_object,
    "AdvancePhysicsStep": advance_physics_step,
    "PausePhysicsAutoSim": wait,
    "UnpausePhysicsAutoSim": wait,
    "SetHandSphereRadius": set_hand_sphere_radius,
}  # fmt: skip
"""AI2-THOR's name of each motion; the arguments after the state are AI2-THOR's, too."""

QUERIES: Mapping[str, Callable[..., Any]] = {
    "GetReachablePositions": get_reachable_positions,
    "GetInteractablePoses": get_interactable_poses,
}
"""Actions that only ask: the house is as before, and no time has passed."""


def _each(values: Any, name: str, read: Callable[[Any, str], _Value]) -> list[_Value]:
    if not isinstance(values, Iterable) or isinstance(values, str | Mapping):
        given = cast("object", values)
        raise Failure(f"{name} must be a list, not {shown(given)}", "InvalidArgument")
    return [read(each, name) for each in cast("Iterable[Any]", values)]


def _point(value: Any, name: str = "position") -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise Failure(f"{name} must be {{x, y, z}}, not {shown(value)}", "InvalidArgument")
    return cast("Mapping[str, Any]", value)


def _place(value: Any, name: str) -> Vec:
    point = _point(value, name)
    return (
        number(point.get("x"), name),
        number(point.get("y"), name),
        number(point.get("z"), name),
    )


def _flag(value: Any, name: str) -> bool:
    if not isinstance(value, bool):
        raise Failure(f"{name} must be true or false, not {shown(value)}", "InvalidArgument")
    return value


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
