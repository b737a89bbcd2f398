"""New objects for a room: AI2-THOR's metadata of a type at a place, and free places for them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from goalscope.envs.house.simulator.geometry import Box, Vec, as_dict, box_metadata
from goalscope.envs.house.simulator.object_types import FLAGS, ObjectType
from goalscope.envs.house.simulator.properties import STATES

__all__ = ["free_spot", "new_floor", "new_object"]


def new_object(kind: ObjectType, position: Vec, size: Vec, rotation: float) -> dict[str, Any]:
    """AI2-THOR's metadata of an object with its underside's middle at `position`."""
    can = {flag: flag in kind.flags for flag in FLAGS}
    fixed = not (can["pickupable"] or can["moveable"])
    x, y, z = position
    turn = math.radians(rotation)
    cos, sin = math.cos(turn), math.sin(turn)
    corners = [
        [x + a * size[0] / 2 * cos + b * size[2] / 2 * sin, up,
         z - a * size[0] / 2 * sin + b * size[2] / 2 * cos]
        for up in (y, y + size[1])
        for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]  # fmt: skip
    width = abs(size[0] * cos) + abs(size[2] * sin)
    depth = abs(size[0] * sin) + abs(size[2] * cos)
    return {
        "name": "",
        "position": as_dict(position),
        "rotation": {"x": 0.0, "y": rotation % 360, "z": 0.0},
        "visible": False,
        "isInteractable": False,
        **can,
        **{state: False for state in STATES if state.startswith("is")},
        "fillLiquid": None,
        "temperature": "RoomTemp",
        "openness": 0.0,
        "mass": kind.mass,
        "salientMaterials": list(kind.materials) or None,
        "receptacleObjectIds": [] if can["receptacle"] else None,
        "distance": 0.0,
        "objectType": kind.name,
        "objectId": "|".join([kind.name, *(f"{round(v, 2) + 0.0:+06.2f}" for v in position)]),
        "assetId": "",
        "parentReceptacles": None,
        "controlledObjects": None,
        "isMoving": False,
        "axisAlignedBoundingBox": box_metadata((x, y + size[1] / 2, z), (width, size[1], depth)),
        "objectOrientedBoundingBox": None if fixed else {"cornerPoints": corners},
    }


def new_floor(width: float, depth: float) -> dict[str, Any]:
    """AI2-THOR's metadata of a floor from x = 0 and z = 0, with its top at y = 0."""
    size = (width, 0.1, depth)
    kind = ObjectType("Floor", frozenset({"receptacle"}), (), 0.0, size, frozenset())
    floor = new_object(kind, (width / 2, 0.0, depth / 2), size, 0.0)
    floor["axisAlignedBoundingBox"] = box_metadata((width / 2, -0.05, depth / 2), size)
    return floor


def free_spot(level: Box, size: Vec, others: Iterable[Box]) -> tuple[float, float] | None:
    """Where (x, z) something of this size is free of others on a level, with some air if possible.

    Args:
        level: The area, at the height of the middle of what is put there.
        size: Of what is put there.
        others: Boxes of what may be in the way.
    """
    level = level._replace(size=(level.size[0], size[1], level.size[2]))
    taken = [box for box in others if _touch(box, level, 0.1)]
    for gap in (0.1, 0.03, 0.0):
        for x in _steps(level, 0, size[0]):
            for z in _steps(level, 2, size[2]):
                spot = Box((x, level.center[1], z), size)
                if not any(_touch(spot, box, gap) for box in taken):
                    return (x, z)
    return None


def _steps(area: Box, axis: int, length: float) -> list[float]:
    """Where the middle of something of this length may be along an axis: every 5 cm or more."""
    low, high = area.low(axis) + length / 2, area.high(axis) - length / 2
    step = max(0.05, (high - low) / 60)
    return [low + step * each for each in range(math.floor((high - low) / step + 1e-6) + 1)]


def _touch(one: Box, other: Box, gap: float) -> bool:
    """Whether two boxes overlap or, seen from above, are nearer than `gap`."""
    return all(
        abs(one.center[axis] - other.center[axis])
        < (one.size[axis] + other.size[axis]) / 2 + extra - 1e-6
        for axis, extra in ((0, gap), (1, 0.01), (2, gap))
    )
