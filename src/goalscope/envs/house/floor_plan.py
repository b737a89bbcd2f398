"""Floor plans: where things are in a room, and what changed, as drawn by its picture."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from goalscope.base.text import terminal_safe
from goalscope.envs.house.simulator.geometry import box_of, vec
from goalscope.envs.house.simulator.state import by_id, is_whole
from goalscope.envs.house.view import names

__all__ = ["Box", "Piece", "Plan", "Point", "area", "floor_plan", "middle_of"]

Kind = Literal["furniture", "fitted", "wall", "thing"]

Point = tuple[float, float]
"""x and z, in m."""

Box = tuple[float, float, float, float]
"""The smallest x and z, and the largest."""

MOST = 300
LONGEST = 40  # characters of a name
SMALL = 0.12  # m2; what has a smaller footprint is a thing on a piece of furniture
SMALL_PLACE = 0.06  # m2; the same for what other things stand on
BESIDE = 1.0  # m; furniture reaches at most so far over the edge of the floor
MOVED = 0.1  # m; less is settling
COUNTER_DEPTH = 0.85  # m; from a counter's front to the wall
FITTED = {"Cabinet", "Drawer", "Shelf", "SinkBasin", "BathtubBasin"}
FIXED = {"Cabinet", "Sink", "StoveBurner"}
WALL = {"Window", "Painting", "Mirror", "Curtains", "Blinds", "Poster", "LightSwitch", "Door",
        "Doorway", "Doorframe", "ShowerCurtain", "ShowerDoor", "ShowerGlass"}  # fmt: skip
COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
SEATS = {"Chair", "Stool", "ArmChair", "Sofa"}
MARKS = {
    "open": ("isOpen", True),
    "on": ("isToggled", True),
    "hot": ("temperature", "Hot"),
    "cold": ("temperature", "Cold"),
    "dirty": ("isDirty", True),
    "filled": ("isFilledWithLiquid", True),
    "sliced": ("isSliced", True),
    "cooked": ("isCooked", True),
    "broken": ("isBroken", True),
    "used up": ("isUsedUp", True),
}
"""The states that a picture shows, in the order of their importance."""

Thing = Mapping[str, Any]
Things = Mapping[str, Thing]


@dataclass(frozen=True, slots=True)
class Piece:
    """One object.

    Attributes:
        id: AI2-THOR's id.
        name: Its unique name, cleaned.
        kind: Furniture stands; fitted pieces (cabinets, drawers) are part of furniture; wall
            pieces hang; all else is a thing.
        parts: Footprint as polygons, in (x, z) metres.
        at: Its middle.
        marks: Names from `MARKS`.
        liquid: What it is filled with.
        parent: Id of what it is in or on, or "".
        held: Whether the robot holds it.
        hidden: Whether it is inside something closed.
        changed: Whether it is not as it was in the previous round.
    """

    id: str
    name: str
    kind: Kind
    parts: tuple[tuple[Point, ...], ...]
    at: Point
    marks: tuple[str, ...]
    liquid: str
    parent: str
    held: bool
    hidden: bool
    changed: bool

    @property
    def box(self) -> Box:
        """The footprint's smallest and largest x and z: (x0, z0, x1, z1)."""
        return _box_around(point for part in self.parts for point in part)

    @property
    def is_on_map(self) -> bool:
        """Whether it is a thing in sight, or an open cabinet or drawer."""
        in_sight = not (self.hidden or self.held or self.id.startswith("StoveKnob"))
        shown = self.kind == "thing" or (self.kind == "fitted" and "open" in self.marks)
        return in_sight and shown

    @property
    def described(self) -> str:
        """Its name and its marks."""
        return self.name + (f" ({', '.join(self.shown_marks)})" if self.marks else "")

    @property
    def shown_marks(self) -> tuple[str, ...]:
        """The marks in words."""
        return tuple(
            f"filled: {self.liquid}" if mark == "filled" and self.liquid else mark
            for mark in self.marks
        )


@dataclass(frozen=True, slots=True)
class Plan:
    """A room from above.

    Attributes:
        name: The scene's.
        room: (x0, z0, x1, z1), in m.
        pieces: All but the floor, in the order to draw them: seats, which go under tables, first,
            then large ones before small ones.
        robot: Where it is (x, z).
        heading: Where it looks, in degrees clockwise from +z.
        changes: What changed since the previous round, in words.
        left_out: How many objects were too many to show.
    """

    name: str
    room: Box
    pieces: tuple[Piece, ...]
    robot: Point
    heading: float
    changes: tuple[str, ...]
    left_out: int

    @property
    def looks(self) -> str:
        """Where the robot looks, in words; north is +z."""
        return COMPASS[round(self.heading / 45) % 8]

    @property
    def held(self) -> str:
        """What the robot holds, in words."""
        return ", ".join(piece.described for piece in self.pieces if piece.held) or "nothing"


def floor_plan(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None = None,
    named: Mapping[str, str] | None = None,
) -> Plan:
    """Where everything is; what was sliced or went to pieces is left out.

    Args:
        metadata: AI2-THOR's, of this round.
        previous: The same of the round before, to tell what changed.
        named: What to call the objects, by id; None names them anew.
    """
    every = _objects(metadata)
    table = dict([*every.items()][:MOST])
    held = _held(metadata)
    parents = {key: _parent(each, table) for key, each in table.items()}
    called = _names(table, named)
    changed, changes = _changes(metadata, previous, table, parents, called)
    fixed = [_xz(each) for each in table.values() if each["objectType"] in FIXED]
    pieces: list[Piece] = []
    for key, each in table.items():
        if each["objectType"] == "Floor":
            continue
        outline = _footprint(each)
        kind = _kind(each, outline)
        is_loose = key in held or table.get(parents[key], {}).get("objectType") == "Floor"
        is_counter = each["objectType"] == "CounterTop"
        pieces.append(
            Piece(
                id=key,
                name=called[key],
                kind=kind,
                parts=_counter_parts(outline, fixed) if is_counter else (outline,),
                at=_xz(each) if kind == "thing" else middle_of(_box_around(outline)),
                marks=_marks(each),
                liquid=_clean(each["fillLiquid"]),
                parent="" if is_loose else parents[key],
                held=key in held,
                hidden=_is_hidden(key, table, parents),
                changed=key in changed,
            )
        )
    seats = {key for key, each in table.items() if each["objectType"] in SEATS}
    pieces.sort(key=lambda piece: (piece.id not in seats, -area(piece.box)))
    return Plan(
        name=_clean(metadata["sceneName"]).removesuffix("_physics"),
        room=_room(metadata, table.values()),
        pieces=tuple(pieces),
        robot=_xz(metadata["agent"]),
        heading=metadata["agent"]["rotation"]["y"] % 360,
        changes=tuple(changes),
        left_out=len(every) - len(table),
    )


def _changes(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None,
    table: Things,
    parents: Mapping[str, str],
    called: Mapping[str, str],
) -> tuple[set[str], list[str]]:
    """Ids of what changed since the previous round, and all changes in words."""
    if previous is None:
        return set(), []
    before = dict([*_objects(previous).items()][:MOST])
    called_before = {**_names(before, None), **called}
    now_held, then_held = _held(metadata), _held(previous)
    changed: set[str] = set()
    said: list[str] = []

    def note(key: str, what: str) -> None:
        changed.add(key)
        said.append(f"{called[key]} {what}")

    for key, each in table.items():
        if key not in before:
            note(key, "is new")
            continue
        old = before[key]
        was = _parent(old, before)
        place = called.get(parents[key], "elsewhere")
        if key in now_held and key not in then_held:
            note(key, "is in the robot's hand")
        elif key in then_held and key not in now_held:
            note(key, f"went from the robot's hand to {place}")
        elif parents[key] != was and key not in now_held:
            note(key, f"went from {called_before.get(was, 'elsewhere')} to {place}")
        elif not {key, parents[key]} & now_held and _moved_by(old, each) > MOVED:
            note(key, "was moved")
        for mark in MARKS:
            if (mark in _marks(each)) != (mark in _marks(old)):
                ended = {"open": "closed", "on": "off"}.get(mark, f"not {mark}")
                note(key, f"is now {mark if mark in _marks(each) else ended}")
    said += [f"{called_before[key]} is gone" for key in before if key not in table]
    if _moved_by(previous["agent"], metadata["agent"]) > MOVED:
        said.append("the robot moved")
    return changed, said


def _objects(metadata: Mapping[str, Any]) -> Things:
    """What is whole, by id."""
    return by_id(each for each in metadata["objects"] if is_whole(each))


def _clean(text: str | None) -> str:
    """One short line of text that is safe to show."""
    shown = " ".join(terminal_safe((text or "")[: LONGEST + 1]).plain.split())
    shown = shown.replace("\ufffe", "").replace("\uffff", "")
    return shown if len(shown) <= LONGEST else shown[: LONGEST - 3] + "..."


def _names(table: Things, named: Mapping[str, str] | None) -> dict[str, str]:
    called = {**names(table.values()), **(named or {})}
    return {key: _clean(called[key]) or "?" for key in table}


def _held(metadata: Mapping[str, Any]) -> set[str]:
    return {each["objectId"] for each in metadata["inventoryObjects"]}


def _parent(each: Thing, table: Things) -> str:
    """The innermost of what it is in or on: AI2-THOR lists all, chairs under a table too."""

    def outer(parent: str) -> tuple[bool, bool, float]:
        kind = table[parent]["objectType"]
        return kind == "Floor", kind in SEATS, math.prod(box_of(table[parent]).size)

    around = each["parentReceptacles"] or ()
    known = (parent for parent in around if parent in table and parent != each["objectId"])
    return min(known, key=outer, default="")


def _is_hidden(key: str, table: Things, parents: Mapping[str, str]) -> bool:
    seen = {key}
    while (key := parents.get(key, "")) and key not in seen:
        seen.add(key)
        if table[key]["openable"] and not table[key]["isOpen"]:
            return True
    return False


def _kind(each: Thing, outline: Sequence[Point]) -> Kind:
    if each["objectType"] in FITTED:
        return "fitted"
    if each["objectType"] in WALL:
        return "wall"
    is_place = each["receptacle"] and each["objectType"] != "StoveBurner"
    is_small = area(_box_around(outline)) < (SMALL_PLACE if is_place else SMALL)
    return "thing" if each["pickupable"] or is_small else "furniture"


def _marks(each: Thing) -> tuple[str, ...]:
    return tuple(mark for mark, (key, value) in MARKS.items() if each[key] == value)


def _room(metadata: Mapping[str, Any], objects: Iterable[Thing]) -> Box:
    """The floor with the furniture that reaches over its edge, and the robot."""
    floors = [each for each in objects if each["objectType"] == "Floor"]
    corners = [corner for each in floors for corner in _corners(each)]
    corners = corners or [(x, z) for x, _, z in metadata["sceneBounds"]["cornerPoints"]]
    x0, z0, x1, z1 = _box_around(corners)
    for each in objects:
        if _kind(each, _footprint(each)) == "furniture":
            corners += [
                (min(max(x, x0 - BESIDE), x1 + BESIDE), min(max(z, z0 - BESIDE), z1 + BESIDE))
                for x, z in _corners(each)
            ]
    x0, z0, x1, z1 = _box_around([*corners, _xz(metadata["agent"])])
    return (x0, z0, max(x1, x0 + 1.0), max(z1, z0 + 1.0))


def _xz(thing: Thing) -> Point:
    return thing["position"]["x"], thing["position"]["z"]


def _moved_by(old: Thing, new: Thing) -> float:
    """Metres between two places."""
    return math.dist(vec(old["position"]), vec(new["position"]))


def _corners(each: Thing) -> list[Point]:
    """The corners of an object's axis-aligned box."""
    box = box_of(each)
    return [(x, z) for x in (box.low(0), box.high(0)) for z in (box.low(2), box.high(2))]


def _footprint(each: Thing) -> tuple[Point, ...]:
    """What an object covers of the floor, as a polygon: a convex hull (Andrew's monotone chain)."""
    box: Mapping[str, Any] = each["objectOrientedBoundingBox"] or {}
    turned: list[Sequence[float]] = box.get("cornerPoints", [])
    points = [(x, z) for x, _, z in turned] or _corners(each)
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


def _counter_parts(
    outline: tuple[Point, ...], fixed: Iterable[Point]
) -> tuple[tuple[Point, ...], ...]:
    """A counter's parts: a deep box is that of a counter that runs around a corner.

    It has the sides that sinks, burners and cabinets stand at.
    """
    x0, z0, x1, z1 = _box_around(outline)
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
        a, b, c, d = best
        chosen.append(((a, b), (c, b), (c, d), (a, d)))
    return tuple(chosen) if len(chosen) > 1 else (outline,)


def _holds(box: Box, at: Point) -> bool:
    return box[0] <= at[0] <= box[2] and box[1] <= at[1] <= box[3]


def _box_around(points: Iterable[Point]) -> Box:
    xs, zs = zip(*points, strict=True)
    return min(xs), min(zs), max(xs), max(zs)


def area(box: Box) -> float:
    """Of a box in m2."""
    return (box[2] - box[0]) * (box[3] - box[1])


def middle_of(box: Box) -> Point:
    """The middle of a box."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2
