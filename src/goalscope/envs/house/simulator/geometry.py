"""Positions, boxes and sight lines in a room, as far as a house without rendering needs them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

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
