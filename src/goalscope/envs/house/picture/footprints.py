"""Shapes seen from above, read from metadata that may hold anything."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, cast

__all__ = ["Box", "Point", "area", "box_around", "corners_of", "counter_parts", "finite"]
__all__ += ["footprint", "listed", "mapping", "middle_of", "moved_by", "seen_from_above"]
__all__ += ["volume", "xz"]

Point = tuple[float, float]
"""x and z, in m."""

Box = tuple[float, float, float, float]
"""The smallest x and z, and the largest."""

FARTHEST = 1000.0
"""Metres; what lies farther out, or nowhere, has no place."""

COUNTER_DEPTH = 0.85
"""Metres from a counter's front to the wall."""


def counter_parts(
    outline: tuple[Point, ...], fixed: Iterable[Point]
) -> tuple[tuple[Point, ...], ...]:
    """A counter's parts: a deep box is that of a counter that runs around a corner.

    It has the sides that sinks, burners and cabinets stand at.
    """
    x0, z0, x1, z1 = box_around(outline)
    if min(x1 - x0, z1 - z0) < 1.4 * COUNTER_DEPTH:
        return (outline,)
    strips = [
        (x0, z0, x0 + COUNTER_DEPTH, z1),
        (x0, z0, x1, z0 + COUNTER_DEPTH),
        (x1 - COUNTER_DEPTH, z0, x1, z1),
        (x0, z1 - COUNTER_DEPTH, x1, z1),
    ]
    rest = [at for at in fixed if _holds((x0, z0, x1, z1), at)]
    chosen: list[tuple[Point, ...]] = []
    while rest:
        best = max(strips, key=lambda strip: sum(_holds(strip, at) for at in rest))
        left = [at for at in rest if not _holds(best, at)]
        if len(left) == len(rest):
            break
        rest = left
        chosen.append(_rectangle(best))
    return tuple(chosen) if len(chosen) > 1 else (outline,)


def _holds(box: Box, at: Point) -> bool:
    return box[0] <= at[0] <= box[2] and box[1] <= at[1] <= box[3]


def footprint(each: Mapping[str, Any]) -> tuple[Point, ...]:
    """What an object covers of the floor, as a polygon."""
    turned = mapping(each.get("objectOrientedBoundingBox")).get("cornerPoints")
    points = seen_from_above(turned) or [(x, z) for x, _, z in corners_of(each)]
    return _hull(points)


def _hull(points: Iterable[Point]) -> tuple[Point, ...]:
    """The convex hull (Andrew's monotone chain)."""
    ordered = sorted({(round(x, 4), round(z, 4)) for x, z in points})

    def half(way: Iterable[Point]) -> list[Point]:
        chain: list[Point] = []
        for x, z in way:
            while len(chain) > 1:
                (ax, az), (bx, bz) = chain[-2:]
                if (bx - ax) * (z - az) - (bz - az) * (x - ax) > 0:
                    break
                chain.pop()
            chain.append((x, z))
        return chain[:-1]

    return tuple(half(ordered) + half(reversed(ordered))) or tuple(ordered)


def corners_of(each: Mapping[str, Any]) -> list[tuple[float, float, float]]:
    """The corners of an object's axis-aligned box; none where it has no box."""
    box = mapping(each.get("axisAlignedBoundingBox"))
    middle, size = _xyz(box.get("center")), _xyz(box.get("size"))
    if middle is None or size is None:
        return _points(box.get("cornerPoints"))
    return [
        (middle[0] + a * size[0] / 2, middle[1] + b * size[1] / 2, middle[2] + c * size[2] / 2)
        for a in (-1, 1)
        for b in (-1, 1)
        for c in (-1, 1)
    ]


def _points(value: object) -> list[tuple[float, float, float]]:
    found: list[tuple[float, float, float]] = []
    for point in listed(value)[:8]:
        x, y, z = [finite(each) for each in (*listed(point), None, None, None)[:3]]
        if x is not None and y is not None and z is not None:
            found.append((x, y, z))
    return found


def seen_from_above(value: object) -> list[Point]:
    """The corners in `value` as (x, z)."""
    return [(x, z) for x, _, z in _points(value)]


def volume(each: Mapping[str, Any]) -> float:
    """Of an object's box in m3; infinite where it has none."""
    size = _xyz(mapping(each.get("axisAlignedBoundingBox")).get("size"))
    return math.prod(size) if size else math.inf


def moved_by(old: Mapping[str, Any], new: Mapping[str, Any]) -> float:
    """Metres between two places; 0 where one is unknown."""
    was, now = _xyz(old.get("position")), _xyz(new.get("position"))
    return math.dist(was, now) if was and now else 0.0


def box_around(points: Iterable[Point]) -> Box:
    """The smallest box around points."""
    every = list(points) or [(0.0, 0.0)]
    xs, zs = zip(*every, strict=True)
    return min(xs), min(zs), max(xs), max(zs)


def _rectangle(box: Box) -> tuple[Point, ...]:
    x0, z0, x1, z1 = box
    return (x0, z0), (x1, z0), (x1, z1), (x0, z1)


def area(box: Box) -> float:
    """Of a box in m2."""
    return (box[2] - box[0]) * (box[3] - box[1])


def middle_of(box: Box) -> Point:
    """The middle of a box."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def _xyz(value: object) -> tuple[float, float, float] | None:
    x, y, z = [finite(mapping(value).get(axis)) for axis in "xyz"]
    return None if x is None or y is None or z is None else (x, y, z)


def xz(value: object) -> Point | None:
    """The place {x, y, z} seen from above, or `None` where it is none."""
    found = _xyz(value)
    return None if found is None else (found[0], found[2])


def finite(value: object) -> float | None:
    """A number that is no farther than a room goes, or `None`."""
    return float(value) if isinstance(value, int | float) and abs(value) < FARTHEST else None


def mapping(value: object) -> Mapping[str, Any]:
    """`value` if it is a mapping, else an empty one."""
    return cast("Mapping[str, Any]", value) if isinstance(value, Mapping) else {}


def listed(value: object) -> list[Any]:
    """`value` if it is a list, else an empty one."""
    return cast("list[Any]", value) if isinstance(value, list) else []
