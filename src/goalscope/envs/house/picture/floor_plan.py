"""What is where in a room, seen from above, and what changed: the facts that its picture draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from goalscope.envs.house.names import names
from goalscope.envs.house.picture.footprints import (
    Box,
    Point,
    area,
    box_around,
    corners_of,
    counter_parts,
    finite,
    footprint,
    listed,
    mapping,
    middle_of,
    moved_by,
    seen_from_above,
    volume,
    xz,
)
from goalscope.envs.house.simulator.state import is_whole
from goalscope.safe_text import terminal_safe

__all__ = ["Piece", "Plan", "floor_plan"]

Kind = Literal["furniture", "fitted", "wall", "thing"]

MOST = 300
LONGEST = 40  # characters of a name
SMALL = 0.12  # m2; what has a smaller footprint is a thing on a piece of furniture
SMALL_PLACE = 0.06  # m2; the same for what other things stand on
BESIDE = 1.0  # m; furniture reaches at most so far over the edge of the floor
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
        marks: Names from `MARKS`; "filled" is followed by nothing, the liquid is in `liquid`.
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
    at: Point | None
    marks: tuple[str, ...]
    liquid: str
    parent: str
    held: bool
    hidden: bool
    changed: bool

    @property
    def box(self) -> Box:
        """The footprint's smallest and largest x and z: (x0, z0, x1, z1)."""
        return box_around(point for part in self.parts for point in part)

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


def clean(text: object) -> str:
    """One short line of text that is safe to show."""
    raw = text[: LONGEST + 1] if isinstance(text, str) else ""
    shown = " ".join(terminal_safe(raw).plain.split()).replace("\ufffe", "").replace("\uffff", "")
    return shown if len(shown) <= LONGEST else shown[: LONGEST - 3] + "..."


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
    fixed = [at for each in objects if _type(each) in FIXED and (at := xz(each.get("position")))]
    pieces: list[Piece] = []
    for key, each in by_id.items():
        if _type(each) == "Floor":
            continue
        outline = footprint(each)
        place = xz(each.get("position"))
        middle = middle_of(box_around(outline)) if outline else place
        kind = _kind(each, outline)
        at = place if kind == "thing" and place else middle
        parts = counter_parts(outline, fixed) if _type(each) == "CounterTop" else (outline,)
        pieces.append(
            Piece(
                id=key,
                name=called[key],
                kind=kind,
                parts=parts if outline else (),
                at=at,
                marks=_marks(each),
                liquid=clean(each.get("fillLiquid")),
                parent="" if key in held or _type(by_id.get(parents[key])) == "Floor"
                else parents[key],
                held=key in held,
                hidden=_is_hidden(key, by_id, parents),
                changed=key in changed,
            )
        )  # fmt: skip
    seats = {key for key, each in by_id.items() if _type(each) in SEATS}
    pieces.sort(key=lambda piece: (piece.id not in seats, -area(piece.box)))
    agent = mapping(metadata.get("agent"))
    return Plan(
        name=clean(metadata.get("sceneName")).removesuffix("_physics"),
        room=room,
        pieces=tuple(pieces),
        robot=xz(agent.get("position")),
        heading=(finite(mapping(agent.get("rotation")).get("y")) or 0.0) % 360,
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
        elif key not in now_held and parents[key] not in now_held and moved_by(old, each) > MOVED:
            note(key, name, "was moved")
        for mark in MARKS:
            if (mark in _marks(each)) != (mark in _marks(old)):
                no_longer = "closed" if mark == "open" else "off" if mark == "on" else f"not {mark}"
                note(key, name, f"is now {mark if mark in _marks(each) else no_longer}")
    now = {each["objectId"] for each in objects}
    said += [f"{called_before[key]} is gone" for key in before if key not in now]
    agent, was_agent = mapping(metadata.get("agent")), mapping(previous.get("agent"))
    if moved_by(was_agent, agent) > MOVED:
        said.append("the robot moved")
    return changed, said


_PLAIN = {"isSliced": False, "isBroken": False, "pickupable": False, "objectType": ""}


def _objects(metadata: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    unique: dict[str, Mapping[str, Any]] = {}
    for each in listed(metadata.get("objects")):
        one = mapping(each)
        if isinstance(one.get("objectId"), str) and is_whole({**_PLAIN, **one}):
            unique.setdefault(one["objectId"], one)
    return list(unique.values())


def _names(objects: Sequence[Mapping[str, Any]], named: Mapping[str, str] | None) -> dict[str, str]:
    called = {**names(objects), **(named or {})}
    return {each["objectId"]: clean(called[each["objectId"]]) or "?" for each in objects}


def _held(metadata: Mapping[str, Any]) -> set[str]:
    return {
        mapping(each)["objectId"]
        for each in listed(metadata.get("inventoryObjects"))
        if isinstance(mapping(each).get("objectId"), str)
    }


def _parent(each: Mapping[str, Any], by_id: Mapping[str, Mapping[str, Any]]) -> str:
    """The innermost of what it is in or on: AI2-THOR lists all, chairs under a table too."""
    known = [
        parent
        for parent in listed(each.get("parentReceptacles"))
        if isinstance(parent, str) and parent in by_id and parent != each["objectId"]
    ]

    def outer(parent: str) -> tuple[bool, bool, float]:
        kind = _type(by_id[parent])
        return kind == "Floor", kind in SEATS, volume(by_id[parent])

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
    is_small = area(box_around(outline)) < (SMALL_PLACE if is_place else SMALL)
    return "thing" if each.get("pickupable") is True or is_small else "furniture"


def _marks(each: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(mark for mark, holds in MARKS.items() if holds(each))


def _room(metadata: Mapping[str, Any], objects: Sequence[Mapping[str, Any]]) -> Box:
    floors = [each for each in objects if _type(each) == "Floor"]
    corners = [(x, z) for each in floors for x, _, z in corners_of(each)]
    corners = corners or seen_from_above(mapping(metadata.get("sceneBounds")).get("cornerPoints"))
    corners = corners or [(x, z) for each in objects for x, _, z in corners_of(each)]
    corners = corners or [at for each in objects if (at := xz(each.get("position")))]
    robot = xz(mapping(metadata.get("agent")).get("position"))
    x0, z0, x1, z1 = box_around(corners)
    for each in objects:
        if _kind(each, footprint(each)) == "furniture":
            corners += [
                (min(max(x, x0 - BESIDE), x1 + BESIDE), min(max(z, z0 - BESIDE), z1 + BESIDE))
                for x, _, z in corners_of(each)
            ]
    x0, z0, x1, z1 = box_around([*corners, *([robot] if robot else [])])
    return (x0, z0, max(x1, x0 + 1.0), max(z1, z0 + 1.0))


def _type(each: Mapping[str, Any] | None) -> str:
    kind = (each or {}).get("objectType")
    return kind if isinstance(kind, str) else ""
