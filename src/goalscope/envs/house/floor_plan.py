"""What is where in a room, seen from above, and what changed: the facts that its pictures draw."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

from goalscope.envs.house.names import names
from goalscope.envs.house.state import is_whole
from goalscope.plain import plain

__all__ = ["MARKS", "Box", "Piece", "Plan", "Point", "clean", "floor_plan"]

Point = tuple[float, float]
Box = tuple[float, float, float, float]
Kind = Literal["furniture", "fitted", "wall", "thing"]

MOST = 300
FARTHEST = 1000.0  # m; what lies farther out, or nowhere, has no place
SMALL = 0.12  # m2; what has a smaller footprint is a thing on a piece of furniture
SMALL_PLACE = 0.06  # m2; the same for what other things stand on
BESIDE = 1.0  # m; furniture reaches at most so far over the edge of the floor
COUNTER_DEPTH = 0.85  # m
MOVED = 0.1  # m; less is settling
FITTED = {"Cabinet", "Drawer", "Shelf", "SinkBasin", "BathtubBasin"}
FIXED = {"Cabinet", "Sink", "StoveBurner"}
WALL = {"Window", "Painting", "Mirror", "Curtains", "Blinds", "Poster", "LightSwitch", "Door",
        "Doorway", "Doorframe", "ShowerCurtain", "ShowerDoor", "ShowerGlass"}  # fmt: skip
COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
SEATS = {"Chair", "Stool", "ArmChair", "Sofa"}
MARKS: dict[str, Callable[[Mapping[str, Any]], bool]] = {
    "open": lambda thing: thing.get("isOpen") is True,
    "on": lambda thing: thing.get("isToggled") is True,
    "hot": lambda thing: thing.get("temperature") == "Hot",
    "cold": lambda thing: thing.get("temperature") == "Cold",
    "dirty": lambda thing: thing.get("isDirty") is True,
    "filled": lambda thing: thing.get("isFilledWithLiquid") is True,
    "sliced": lambda thing: thing.get("isSliced") is True,
    "cooked": lambda thing: thing.get("isCooked") is True,
    "broken": lambda thing: thing.get("isBroken") is True,
    "used up": lambda thing: thing.get("isUsedUp") is True,
}
"""The states that a picture shows, in the order of their importance."""


@dataclass(frozen=True, slots=True)
class Piece:
    """One object.

    Attributes:
        id: AI2-THOR's id.
        name: Its unique name, cleaned.
        kind: Furniture stands; fitted pieces (cabinets, drawers) are part of furniture; wall
            pieces hang; all else is a thing.
        parts: Footprint as polygons, in (x, z) metres.
        at: Its middle, or `None` where it has no place.
        height: Of its top, in m.
        marks: Names from `MARKS`; "filled" is followed by nothing, the liquid is in `liquid`.
        liquid: What it is filled with.
        parent: Id of what it is in or on, or "".
        receptacle: Whether things go in or on it.
        openable: Whether it opens.
        pickupable: Whether it can be carried.
        held: Whether the robot holds it.
        hidden: Whether it is inside something closed.
        changed: Whether it is not as it was in the previous round.
    """

    id: str
    name: str
    kind: Kind
    parts: tuple[tuple[Point, ...], ...]
    at: Point | None
    height: float
    marks: tuple[str, ...]
    liquid: str
    parent: str
    receptacle: bool
    openable: bool
    pickupable: bool
    held: bool
    hidden: bool
    changed: bool

    @property
    def box(self) -> Box:
        """The footprint's smallest and largest x and z: (x0, z0, x1, z1)."""
        return _around(point for part in self.parts for point in part)

    @property
    def is_on_map(self) -> bool:
        """Whether it is a thing in sight, or an open cabinet or drawer."""
        return (
            self.at is not None
            and not (self.hidden or self.held or self.id.startswith("StoveKnob"))
            and (self.kind == "thing" or (self.kind == "fitted" and "open" in self.marks))
        )

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
        robot: Where it is (x, z), or `None`.
        heading: Where it looks, in degrees clockwise from +z.
        changes: What changed since the previous round, in words.
        left_out: How many objects were too many to show.
    """

    name: str
    room: Box
    pieces: tuple[Piece, ...]
    robot: Point | None
    heading: float
    changes: tuple[str, ...]
    left_out: int

    @property
    def looks(self) -> str:
        """Where the robot looks, in words; north is +z."""
        return COMPASS[round(self.heading / 45) % 8]

    @property
    def held(self) -> tuple[Piece, ...]:
        """What the robot holds."""
        return tuple(piece for piece in self.pieces if piece.held)


def clean(text: object, length: int = 40) -> str:
    """One short line of text that is safe to show."""
    raw = str(text)[: length + 1] if isinstance(text, str) else ""
    shown = " ".join(plain(raw).plain.split()).replace("\ufffe", "").replace("\uffff", "")
    return shown if len(shown) <= length else shown[: length - 3] + "..."


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
    objects = every[:MOST]
    held = _held(metadata)
    by_id = {each["objectId"]: each for each in objects}
    parents = {key: _parent(each, by_id) for key, each in by_id.items()}
    called = _names(objects, named)
    changed, changes = _changes(metadata, previous, objects, parents, called)
    room = _room(metadata, objects)
    fixed = [at for each in objects if _type(each) in FIXED and (at := _xz(each.get("position")))]
    pieces: list[Piece] = []
    for key, each in by_id.items():
        if _type(each) == "Floor":
            continue
        outline = _outline(each)
        place = _xz(each.get("position"))
        middle = _middle(_around(outline)) if outline else place
        kind = _kind(each, outline)
        at = place if kind == "thing" and place else middle
        parts = _counter(outline, fixed) if _type(each) == "CounterTop" else (outline,)
        pieces.append(
            Piece(
                id=key,
                name=called[key],
                kind=kind,
                parts=parts if outline else (),
                at=at,
                height=max((corner[1] for corner in _corners(each)), default=0.0),
                marks=_marks(each),
                liquid=clean(each.get("fillLiquid")),
                parent="" if key in held or _type(by_id.get(parents[key])) == "Floor"
                else parents[key],
                receptacle=each.get("receptacle") is True,
                openable=each.get("openable") is True,
                pickupable=each.get("pickupable") is True,
                held=key in held,
                hidden=_is_hidden(key, by_id, parents),
                changed=key in changed,
            )
        )  # fmt: skip
    seats = {key for key, each in by_id.items() if _type(each) in SEATS}
    pieces.sort(key=lambda piece: (piece.id not in seats, -_area(piece.box)))
    agent = _mapping(metadata.get("agent"))
    return Plan(
        name=clean(metadata.get("sceneName")).removesuffix("_physics"),
        room=room,
        pieces=tuple(pieces),
        robot=_xz(agent.get("position")),
        heading=(_number(_mapping(agent.get("rotation")).get("y")) or 0.0) % 360,
        changes=tuple(changes),
        left_out=len(every) - len(objects),
    )


def _changes(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None,
    objects: Sequence[Mapping[str, Any]],
    parents: Mapping[str, str],
    called: Mapping[str, str],
) -> tuple[set[str], list[str]]:
    if previous is None:
        return set(), []
    earlier = _objects(previous)[:MOST]
    before = {each["objectId"]: each for each in earlier}
    called_before = {**_names(earlier, None), **called}
    now_held, then_held = _held(metadata), _held(previous)
    changed: set[str] = set()
    said: list[str] = []

    def note(key: str, name: str, what: str) -> None:
        changed.add(key)
        said.append(f"{name} {what}")

    for each in objects:
        key = each["objectId"]
        name = called[key]
        if key not in before:
            note(key, name, "is new")
            continue
        old = before[key]
        was = _parent(old, before)
        place = called.get(parents[key], "elsewhere")
        if key in now_held and key not in then_held:
            note(key, name, "is in the robot's hand")
        elif key in then_held and key not in now_held:
            note(key, name, f"went from the robot's hand to {place}")
        elif parents[key] != was and key not in now_held:
            note(key, name, f"went from {called_before.get(was, 'elsewhere')} to {place}")
        elif key not in now_held and parents[key] not in now_held and _shift(old, each) > MOVED:
            note(key, name, "was moved")
        for mark in MARKS:
            if (mark in _marks(each)) != (mark in _marks(old)):
                no_longer = "closed" if mark == "open" else "off" if mark == "on" else f"not {mark}"
                note(key, name, f"is now {mark if mark in _marks(each) else no_longer}")
    now = {each["objectId"] for each in objects}
    said += [f"{called_before[key]} is gone" for key in before if key not in now]
    agent, was_agent = _mapping(metadata.get("agent")), _mapping(previous.get("agent"))
    if _shift(was_agent, agent) > MOVED:
        said.append("the robot moved")
    return changed, said


_PLAIN = {"isSliced": False, "isBroken": False, "pickupable": False, "objectType": ""}


def _objects(metadata: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    unique: dict[str, Mapping[str, Any]] = {}
    for each in _list(metadata.get("objects")):
        one = _mapping(each)
        if isinstance(one.get("objectId"), str) and is_whole({**_PLAIN, **one}):
            unique.setdefault(one["objectId"], one)
    return list(unique.values())


def _names(objects: Sequence[Mapping[str, Any]], named: Mapping[str, str] | None) -> dict[str, str]:
    called = {**names(objects), **(named or {})}
    return {each["objectId"]: clean(called[each["objectId"]]) or "?" for each in objects}


def _held(metadata: Mapping[str, Any]) -> set[str]:
    return {
        _mapping(each)["objectId"]
        for each in _list(metadata.get("inventoryObjects"))
        if isinstance(_mapping(each).get("objectId"), str)
    }


def _parent(each: Mapping[str, Any], by_id: Mapping[str, Mapping[str, Any]]) -> str:
    """The innermost of what it is in or on: AI2-THOR lists all, chairs under a table too."""
    known = [
        parent
        for parent in _list(each.get("parentReceptacles"))
        if isinstance(parent, str) and parent in by_id and parent != each["objectId"]
    ]

    def outer(parent: str) -> tuple[bool, bool, float]:
        kind = _type(by_id[parent])
        return kind == "Floor", kind in SEATS, _volume(by_id[parent])

    return min(known, key=outer, default="")


def _is_hidden(
    key: str, by_id: Mapping[str, Mapping[str, Any]], parents: Mapping[str, str]
) -> bool:
    seen = {key}
    while (key := parents.get(key, "")) and key not in seen:
        seen.add(key)
        if by_id[key].get("openable") is True and by_id[key].get("isOpen") is not True:
            return True
    return False


def _kind(each: Mapping[str, Any], outline: tuple[Point, ...]) -> Kind:
    if _type(each) in FITTED:
        return "fitted"
    if _type(each) in WALL:
        return "wall"
    is_place = each.get("receptacle") is True and _type(each) != "StoveBurner"
    is_small = _area(_around(outline)) < (SMALL_PLACE if is_place else SMALL)
    return "thing" if each.get("pickupable") is True or is_small else "furniture"


def _marks(each: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(mark for mark, holds in MARKS.items() if holds(each))


def _room(metadata: Mapping[str, Any], objects: Sequence[Mapping[str, Any]]) -> Box:
    floors = [each for each in objects if _type(each) == "Floor"]
    corners = [(x, z) for each in floors for x, _, z in _corners(each)]
    corners = corners or _flat(_mapping(metadata.get("sceneBounds")).get("cornerPoints"))
    corners = corners or [(x, z) for each in objects for x, _, z in _corners(each)]
    corners = corners or [at for each in objects if (at := _xz(each.get("position")))]
    robot = _xz(_mapping(metadata.get("agent")).get("position"))
    x0, z0, x1, z1 = _around(corners)
    for each in objects:
        if _kind(each, _outline(each)) == "furniture":
            corners += [
                (min(max(x, x0 - BESIDE), x1 + BESIDE), min(max(z, z0 - BESIDE), z1 + BESIDE))
                for x, _, z in _corners(each)
            ]
    x0, z0, x1, z1 = _around([*corners, *([robot] if robot else [])])
    return (x0, z0, max(x1, x0 + 1.0), max(z1, z0 + 1.0))


def _counter(outline: tuple[Point, ...], fixed: Iterable[Point]) -> tuple[tuple[Point, ...], ...]:
    """A counter's parts: a deep box is that of a counter that runs around a corner.

    It has the sides that sinks, burners and cabinets stand at.
    """
    x0, z0, x1, z1 = _around(outline)
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


def _outline(each: Mapping[str, Any]) -> tuple[Point, ...]:
    turned = _mapping(each.get("objectOrientedBoundingBox")).get("cornerPoints")
    points = _flat(turned) or [(x, z) for x, _, z in _corners(each)]
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


def _corners(each: Mapping[str, Any]) -> list[tuple[float, float, float]]:
    box = _mapping(each.get("axisAlignedBoundingBox"))
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
    for point in _list(value)[:8]:
        x, y, z = [_number(each) for each in (*_list(point), None, None, None)[:3]]
        if x is not None and y is not None and z is not None:
            found.append((x, y, z))
    return found


def _flat(value: object) -> list[Point]:
    return [(x, z) for x, _, z in _points(value)]


def _volume(each: Mapping[str, Any]) -> float:
    size = _xyz(_mapping(each.get("axisAlignedBoundingBox")).get("size"))
    return math.prod(size) if size else math.inf


def _shift(old: Mapping[str, Any], new: Mapping[str, Any]) -> float:
    was, now = _xyz(old.get("position")), _xyz(new.get("position"))
    return math.dist(was, now) if was and now else 0.0


def _around(points: Iterable[Point]) -> Box:
    every = list(points) or [(0.0, 0.0)]
    xs, zs = zip(*every, strict=True)
    return min(xs), min(zs), max(xs), max(zs)


def _rectangle(box: Box) -> tuple[Point, ...]:
    x0, z0, x1, z1 = box
    return (x0, z0), (x1, z0), (x1, z1), (x0, z1)


def _area(box: Box) -> float:
    return (box[2] - box[0]) * (box[3] - box[1])


def _middle(box: Box) -> Point:
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def _type(each: Mapping[str, Any] | None) -> str:
    kind = (each or {}).get("objectType")
    return kind if isinstance(kind, str) else ""


def _xyz(value: object) -> tuple[float, float, float] | None:
    x, y, z = [_number(_mapping(value).get(axis)) for axis in "xyz"]
    return None if x is None or y is None or z is None else (x, y, z)


def _xz(value: object) -> Point | None:
    found = _xyz(value)
    return None if found is None else (found[0], found[2])


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and abs(value) < FARTHEST else None


def _mapping(value: object) -> Mapping[str, Any]:
    return cast("Mapping[str, Any]", value) if isinstance(value, Mapping) else {}


def _list(value: object) -> list[Any]:
    return cast("list[Any]", value) if isinstance(value, list) else []
