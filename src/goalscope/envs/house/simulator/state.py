"""What the house is at one moment: its objects, its agent, and where they are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from goalscope.base.inputs import shown
from goalscope.base.types import InvalidInputError

Vec = tuple[float, float, float]
"""x, y (up) and z, in m."""

STANDING_CAMERA = 0.675
"""Height of the camera above the agent's position, in m; crouched it is at the position."""

HALF_VIEW = 45.0
"""Half of the field of view, in degrees."""

RADIUS = 0.2
"""Radius of the agent, in m."""


class Box(NamedTuple):
    """An axis-aligned box."""

    center: Vec
    size: Vec

    def low(self, axis: int) -> float:
        """The lower end along an axis."""
        return self.center[axis] - self.size[axis] / 2

    def high(self, axis: int) -> float:
        """The upper end along an axis."""
        return self.center[axis] + self.size[axis] / 2

    def distance(self, x: float, z: float) -> float:
        """How far a point of the floor is from the box, seen from above."""
        dx = max(abs(x - self.center[0]) - self.size[0] / 2, 0.0)
        dz = max(abs(z - self.center[2]) - self.size[2] / 2, 0.0)
        return math.hypot(dx, dz)


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the agent stands and looks: yaw and horizon in degrees, a positive horizon is down."""

    position: Vec
    yaw: float = 0.0
    horizon: float = 0.0
    standing: bool = True


def vec(position: Mapping[str, float]) -> Vec:
    """The vector of {"x", "y", "z"}."""
    return (position["x"], position["y"], position["z"])


def as_dict(vector: Vec) -> dict[str, float]:
    """{"x", "y", "z"} of the vector."""
    return {"x": vector[0], "y": vector[1], "z": vector[2]}


def box_metadata(center: Vec, size: Vec) -> dict[str, Any]:
    """An axis-aligned bounding box as AI2-THOR tells it."""
    signs = [(a, b, c) for a in (1, -1) for b in (1, -1) for c in (1, -1)]
    corners = [
        [at + sign * length / 2 for at, sign, length in zip(center, each, size, strict=True)]
        for each in signs
    ]
    return {"cornerPoints": corners, "center": as_dict(center), "size": as_dict(size)}


def agent_metadata(position: Vec, yaw: float) -> dict[str, Any]:
    """An agent that stands and looks ahead, as AI2-THOR tells it."""
    return {
        "name": "agent",
        "position": as_dict(position),
        "rotation": {"x": 0.0, "y": yaw, "z": 0.0},
        "cameraHorizon": 0.0,
        "isStanding": True,
        "inHighFrictionArea": False,
    }


def box_of(metadata: Mapping[str, Any]) -> Box:
    """The axis-aligned bounding box in an object's metadata."""
    box = metadata["axisAlignedBoundingBox"]
    return Box(vec(box["center"]), vec(box["size"]))


def moved(metadata: dict[str, Any], position: Vec) -> None:
    """Set an object's position, and take its bounding box along."""
    x, y, z = (new - old for new, old in zip(position, vec(metadata["position"]), strict=True))
    center, size = box_of(metadata)
    metadata["position"] = as_dict(position)
    metadata["axisAlignedBoundingBox"] = box_metadata(
        (center[0] + x, center[1] + y, center[2] + z), size
    )


def sees(pose: Pose, box: Box, reach: float) -> bool:
    """Whether an object with this box is near enough and inside the camera's view."""
    x, y, z = pose.position
    if box.distance(x, z) > reach:
        return False
    away_x, away_z = box.center[0] - x, box.center[2] - z
    yaw = math.radians(pose.yaw)
    ahead = away_x * math.sin(yaw) + away_z * math.cos(yaw)
    aside = abs(away_x * math.cos(yaw) - away_z * math.sin(yaw))
    width = max(box.size[0], box.size[2]) / 2
    if ahead + width <= 0 or aside - width > max(ahead, 0.0) + width:
        return False
    camera = y + (STANDING_CAMERA if pose.standing else 0.0)
    far = max(box.distance(x, z), 0.1)
    top = math.degrees(math.atan2(camera - box.high(1), far)) - pose.horizon
    bottom = math.degrees(math.atan2(camera - box.low(1), far)) - pose.horizon
    return top <= HALF_VIEW and bottom >= -HALF_VIEW


def reachable(floor: Box, solids: Iterable[Box], start: Vec, grid: float) -> list[Vec]:
    """Points of the grid through `start` where the agent can stand."""
    boxes = list(solids)
    first = [math.ceil((floor.low(a) + RADIUS - start[a]) / grid) for a in (0, 2)]
    last = [math.floor((floor.high(a) - RADIUS - start[a]) / grid) for a in (0, 2)]
    free: list[Vec] = []
    for i in range(first[0], last[0] + 1):
        for k in range(first[1], last[1] + 1):
            x, z = start[0] + i * grid, start[2] + k * grid
            if all(box.distance(x, z) >= RADIUS for box in boxes):
                free.append((x, start[1], z))
    return free


def spots(area: Box, size: Vec, taken: Sequence[Box], near: tuple[float, float]) -> list[Vec]:
    """Free places for something of this `size` on an `area`, nearest to a point first.

    The height that is returned is that of the area's center.
    """
    places: list[tuple[float, Vec]] = []
    axes: list[list[float]] = []
    for axis in (0, 2):
        room = area.size[axis] - size[axis]
        steps = max(int(room / 0.1), 0)
        start = area.center[axis] - steps * 0.05
        axes.append([start + 0.1 * step for step in range(steps + 1)])
    for x in axes[0]:
        for z in axes[1]:
            if not any(_overlap(x, z, size, box) for box in taken):
                away = math.hypot(x - near[0], z - near[1])
                places.append((away, (x, area.center[1], z)))
    return [place for _, place in sorted(places)]


def _overlap(x: float, z: float, size: Vec, box: Box) -> bool:
    """Whether the middle of one lies in the other: things in a home stand close, and lean."""
    apart_x = abs(x - box.center[0])
    apart_z = abs(z - box.center[2])
    return apart_x < max(min(size[0], box.size[0]) / 2, 0.02) and apart_z < max(
        min(size[2], box.size[2]) / 2, 0.02
    )


ENCLOSING = frozenset({"Box", "Cabinet", "Drawer", "Fridge", "LaundryHamper", "Microwave", "Safe"})
"""Receptacles that hide what is in them while they are closed, and must be open for a put."""

CRACKED = frozenset({"CellPhone", "Laptop"})
"""What keeps its shape when it breaks; other things that can be carried go to pieces."""

_BELOW = frozenset({"ArmChair", "Chair", "Floor", "Stool"})
"""Receptacles that AI2-THOR names for what stands above them, too."""

REACH = 1.5
"""AI2-THOR's visibility distance, in m."""

GRID = 0.25
"""AI2-THOR's distance between positions, in m."""

EYE_HEIGHT = 0.9
"""The agent's position above the floor, in m."""

HAND = (0.38, 0.515)
"""How far ahead of the agent's position, and above it, the hand is, in m."""

MOST_FLOOR = 100.0
"""Longest side of a floor, in m."""

_WALK_UNDER = 1.6
_STEP_OVER = 0.15
_FLAT = frozenset({"Floor", "Wall", "Doorway", "Doorframe", "Painting", "Poster", "Curtains",
                   "Blinds", "Window", "LightSwitch", "Mirror", "SinkBasin", "BathtubBasin",
                   "ShowerCurtain", "RoomDecor", "StoveKnob", "StoveBurner", "Faucet"})  # fmt: skip


@dataclass(frozen=True, eq=False)
class Scene:
    """One room at its start.

    Attributes:
        name: As in AI2-THOR, such as "FloorPlan1_physics".
        objects: AI2-THOR's metadata of each object.
        agent: AI2-THOR's metadata of the agent; None lets the house choose a free place.
        notes: What a person should know about what was read, one sentence each.
    """

    name: str
    objects: tuple[Mapping[str, Any], ...]
    agent: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()


class Failure(Exception):
    """An action that fails as in AI2-THOR; the message is its `errorMessage`."""

    def __init__(self, message: str, code: str | None = None) -> None:
        super().__init__(message)
        self.code = code


def number(value: Any, name: str) -> float:
    """An argument that must be a number.

    Raises:
        Failure: It is none, or one beyond all measure.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
        raise Failure(f"{name} must be a number, not {shown(value)}", "InvalidArgument")
    return float(value)


def by_id(objects: Iterable[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Objects' metadata by their ids."""
    return {each["objectId"]: each for each in objects}


def innermost(thing: Mapping[str, Any], table: Mapping[str, Mapping[str, Any]]) -> str:
    """The id of what the thing is on or in most directly; empty where there is nothing known."""
    listed = [own for own in thing["parentReceptacles"] or () if own in table]
    listed.sort(key=lambda own: (table[own]["objectType"] in _BELOW, not table[own]["pickupable"]))
    return listed[0] if listed else ""


def is_at(thing: Mapping[str, Any], place: str, table: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether the thing is in or on the place itself.

    Not if it is in something there that can be carried, or in something above it: what is in a bin
    is not on the floor.
    """
    around = innermost(thing, table)
    if place == around or place not in (thing["parentReceptacles"] or ()):
        return place == around
    above = table[place]["objectType"] in _BELOW and table[around]["objectType"] != "Floor"
    return not (table[around]["pickupable"] or above)


def is_whole(thing: Mapping[str, Any]) -> bool:
    """Whether the thing itself is still there, and not only its slices or its pieces."""
    shattered = thing["isBroken"] and thing["pickupable"] and thing["objectType"] not in CRACKED
    return not thing["isSliced"] and not shattered


class State:
    """The objects, the agent and what it holds; changed by the actions alone.

    Attributes:
        scene: What it began as.
        objects: Metadata by object id.
        agent: Metadata of the agent.
        held: Id of what the hand holds.
        clock: Seconds of the simulation since the start.
        floor: The walkable rectangle, seen from above.
        solids: What the agent cannot walk through.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.clock = 0.0
        self.cooling: dict[str, float] = {}
        self.objects = {each["objectId"]: dict(each) for each in scene.objects}
        for each in self.objects.values():
            for key in ("parentReceptacles", "receptacleObjectIds"):
                if each[key] is not None:
                    each[key] = list(each[key])
        self.floor = _floor(self.objects)
        if max(self.floor.size) > MOST_FLOOR:
            raise InvalidInputError(
                f"{scene.name}: its floor, or what stands there, reaches over "
                f"{max(self.floor.size):,.0f} m; a scene may have {MOST_FLOOR:.0f} m. Move what is "
                "far off closer."
            )
        self.survey()
        self.agent = dict(scene.agent) if scene.agent else self._placed()
        self._start = vec(self.agent["position"])
        held = [each["objectId"] for each in self.objects.values() if each["isPickedUp"]]
        self.held: str | None = held[0] if held else None
        self.look()

    @property
    def pose(self) -> Pose:
        """Where the agent stands and looks."""
        agent = self.agent
        yaw, horizon = agent["rotation"]["y"], agent["cameraHorizon"]
        return Pose(vec(agent["position"]), yaw, horizon, agent["isStanding"])

    @property
    def hand(self) -> Vec:
        """Where the hand is."""
        (x, y, z), yaw, (ahead, up) = self.pose.position, math.radians(self.pose.yaw), HAND
        return (x + ahead * math.sin(yaw), y + up, z + ahead * math.cos(yaw))

    def survey(self) -> None:
        """Note anew where furniture stands."""
        boxes = (_solid(each, self.floor) for each in self.objects.values())
        self.solids = [box for box in boxes if box is not None]
        self._reachable: list[Vec] | None = None

    def reachable(self) -> list[Vec]:
        """Where the agent can stand: the points of a grid through its first position."""
        if self._reachable is None:
            self._reachable = reachable(self.floor, self.solids, self._start, GRID)
        return self._reachable

    def target(self, object_id: str, *, force: bool) -> dict[str, Any]:
        """The object that an action names.

        Raises:
            Failure: There is none; or, without `force`, it cannot be reached from here.
        """
        thing = self.objects.get(object_id)
        if thing is None:
            raise Failure("Object ID appears to be invalid.")
        if not is_whole(thing):
            raise Failure(f"object not found: {object_id}")
        if force or thing["visible"] or object_id == self.held:
            return thing
        x, _, z = vec(self.agent["position"])
        if box_of(thing).distance(x, z) > REACH:
            raise Failure(f"{object_id} is too far away to be interacted with")
        if self.is_enclosed(thing):
            raise Failure(
                f"{object_id} is not interactable and (perhaps it is occluded by something)."
            )
        raise Failure(f"object not found: {object_id}")

    def contents(self, object_id: str) -> list[dict[str, Any]]:
        """What stands on or in a receptacle."""
        inside = self.objects[object_id]["receptacleObjectIds"] or ()
        return [self.objects[each] for each in inside if each in self.objects]

    def carried(self, object_id: str) -> Iterator[dict[str, Any]]:
        """What stands on or in a receptacle at any depth, and can be moved."""
        seen, queue = {object_id}, [object_id]
        while queue:
            for each in self.contents(queue.pop()):
                if each["objectId"] not in seen and each["pickupable"]:
                    seen.add(each["objectId"])
                    queue.append(each["objectId"])
                    yield each

    def is_enclosed(self, thing: Mapping[str, Any]) -> bool:
        """Whether a closed receptacle hides the thing."""
        return any(
            parent["objectType"] in ENCLOSING and parent["openable"] and not parent["isOpen"]
            for parent in self.parents(thing)
        )

    def parents(self, thing: Mapping[str, Any]) -> list[dict[str, Any]]:
        """The receptacles that the thing is on or in."""
        listed = thing["parentReceptacles"] or ()
        return [self.objects[each] for each in listed if each in self.objects]

    def attach(self, thing: dict[str, Any], parents: list[str] | None) -> None:
        """Write into both sides on which receptacles the thing now is."""
        own = thing["objectId"]
        for parent in self.parents(thing):
            if own in (parent["receptacleObjectIds"] or ()):
                parent["receptacleObjectIds"] = [
                    each for each in parent["receptacleObjectIds"] if each != own
                ]
        thing["parentReceptacles"] = sorted(set(parents)) if parents else None
        for parent in self.parents(thing):
            parent["receptacleObjectIds"] = sorted({*(parent["receptacleObjectIds"] or ()), own})

    def shift(self, thing: dict[str, Any], position: Vec) -> None:
        """Move the thing, and what it carries."""
        old = vec(thing["position"])
        by = [new - before for new, before in zip(position, old, strict=True)]
        moved(thing, position)
        for each in self.carried(thing["objectId"]):
            x, y, z = vec(each["position"])
            moved(each, (x + by[0], y + by[1], z + by[2]))

    def look(self) -> None:
        """Bring up to date what is seen from here, and where the hand is."""
        pose = self.pose
        if self.held:
            self.shift(self.objects[self.held], self.hand)
        x, y, z = pose.position
        for own, each in self.objects.items():
            seen = (
                _may_reach(each["axisAlignedBoundingBox"], x, z)
                and sees(pose, box_of(each), REACH)
                and is_whole(each)
                and not self.is_enclosed(each)
            )
            each["visible"] = each["isInteractable"] = seen or own == self.held
            at = each["position"]
            each["distance"] = math.hypot(at["x"] - x, at["y"] - y, at["z"] - z)

    def _placed(self) -> dict[str, Any]:
        """An agent at the free position nearest to the middle of the room."""
        x, _, z = self.floor.center
        middle = (x, self.floor.high(1) + EYE_HEIGHT, z)
        free = reachable(self.floor, self.solids, middle, GRID)
        if not free:
            raise InvalidInputError(
                f"{self.scene.name}: there is no free floor to stand on. Give the scene an agent "
                "with a position, or move its furniture apart."
            )
        return agent_metadata(min(free, key=lambda each: math.dist(each, middle)), 0.0)


def _may_reach(bounds: Mapping[str, Any], x: float, z: float) -> bool:
    """A quick no for most of what is too far away."""
    center, size = bounds["center"], bounds["size"]
    return (
        abs(center["x"] - x) - size["x"] / 2 <= REACH
        and abs(center["z"] - z) - size["z"] / 2 <= REACH
    )


def _floor(objects: Mapping[str, Mapping[str, Any]]) -> Box:
    """The floor's box with its top at 0 or where the floor is; the room's extent without one."""
    floors = [box_of(each) for each in objects.values() if each["objectType"] == "Floor"]
    boxes = floors or [box_of(each) for each in objects.values()]
    low = [min(box.low(axis) for box in boxes) for axis in range(3)]
    high = [max(box.high(axis) for box in boxes) for axis in range(3)]
    top = max(box.high(1) for box in floors) if floors else low[1]
    return Box(
        ((low[0] + high[0]) / 2, top, (low[2] + high[2]) / 2),
        (high[0] - low[0], 0.0, high[2] - low[2]),
    )


def _solid(thing: Mapping[str, Any], floor: Box) -> Box | None:
    """The thing's box, where the agent cannot walk through it.

    A box that covers a third of the floor is that of an L-shaped counter or the like: the agent
    stands in its bend.
    """
    box = box_of(thing)
    ground = floor.center[1]
    if (
        thing["pickupable"]
        or thing["objectType"] in _FLAT
        or box.low(1) > ground + _WALK_UNDER
        or box.high(1) < ground + _STEP_OVER
        or box.size[0] * box.size[2] * 3 > floor.size[0] * floor.size[2]
    ):
        return None
    return box
