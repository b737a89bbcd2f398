"""Rooms that people write by hand in TOML, made into scenes with AI2-THOR's metadata."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from goalscope.base.inputs import nearest, read_toml, shown
from goalscope.base.text import without_invisible
from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator.geometry import RADIUS, Box, Vec, box_of
from goalscope.envs.house.simulator.object_types import (
    SINGLE,
    GivenStates,
    ObjectType,
    new_floor,
    new_object,
    object_types,
    unfit_state,
)
from goalscope.envs.house.simulator.state import ENCLOSING, EYE_HEIGHT, Scene, State

MOST_OBJECTS = 200
CEILING = 3.0
"""Limits of a room: 200 objects, 3 m high."""

_BASINS = {"SinkBasin": "Sink", "BathtubBasin": "Bathtub"}
_HOOKS = {"HandTowelHolder", "TowelHolder", "ToiletPaperHanger"}
_HOLLOW = {
    "BathtubBasin", "Bowl", "CoffeeMachine", "Cup", "DogBed", "GarbageCan", "Mug", "Pan", "Plate",
    "Pot", "Shelf", "SinkBasin", "Toaster",
}  # fmt: skip
"""Receptacles besides those that open, of which the things inside stand on the bottom."""

_SEATS = {"ArmChair": 0.48, "Bed": 0.61, "Chair": 0.5, "Sofa": 0.47}
"""Where one sits or lies, as a share of the height."""

_WALL = 0.02
"""Thickness of a receptacle's walls, in m."""


_Metres = Annotated[float, Field(ge=0, le=50)]
_Size = Annotated[float, Field(ge=0.001, le=50)]
_Degrees = Annotated[float, Field(ge=-360, le=360)]
_Text = Annotated[str, Field(min_length=1, max_length=60)]


@dataclass(frozen=True, slots=True)
class _AgentRow:
    position: tuple[_Metres, _Metres]
    rotation: _Degrees = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row(GivenStates):
    """An [[object]]; None where a key is not given."""

    type: _Text
    label: _Text | None = None
    at: Annotated[tuple[_Metres, ...], Field(min_length=2, max_length=3)] | None = None
    in_: Annotated[_Text | None, Field(alias="in")] = None
    on: _Text | None = None
    size: tuple[_Size, _Size, _Size] | None = None
    rotation: _Degrees = 0.0
    controls: _Text | None = None


@dataclass(frozen=True, slots=True)
class _Room:
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,60}$")]
    size: tuple[Annotated[float, Field(ge=1, le=50)], Annotated[float, Field(ge=1, le=50)]]
    agent: _AgentRow
    object: Annotated[tuple[_Row, ...], Field(min_length=1, max_length=MOST_OBJECTS)]


def read_room(source: Path | Traversable) -> Scene:
    """Read a room from a TOML file: `name`, `size = [x, z]` in m, `[agent]`, and `[[object]]`s.

    One corner of the room is at x = 0 and z = 0. The agent has a `position = [x, z]` and may have
    a `rotation` in degrees, clockwise from +z. Each object has a `type` of AI2-THOR and one of

    * `at = [x, z]`: its middle, standing on the floor; `at = [x, y, z]` with its underside at y;
    * `in` or `on` (they mean the same): a receptacle written further up, by its `label`, or by its
      type if there is but one. It gets a free spot there.

    It may have a `label`, `size = [width, height, depth]` in m, a `rotation`, and states by
    AI2-THOR's names, such as `isOpen = true` or `fillLiquid = "wine"`. A SinkBasin is `in` a Sink,
    a BathtubBasin `in` a Bathtub; a StoveKnob `controls` a StoveBurner. There is always a floor,
    light is switched on, and food in the fridge is cold.

    Raises:
        InvalidInputError: The file cannot be read, or describes no possible room; the message
            names the file, the object, and the remedy.
    """
    given, label = read_toml(source, _Room), source.name
    width, depth = given.size
    room = _Furnishing(given.name, width, depth)
    for standing in (True, False):
        for number, row in enumerate(given.object, 1):
            if (row.at is not None) == standing:
                room.add(row, f"{label}, object {number}")
    room.connect()
    x, z = given.agent.position
    agent = {
        "name": "agent",
        "position": {"x": x, "y": EYE_HEIGHT, "z": z},
        "rotation": {"x": 0.0, "y": given.agent.rotation % 360, "z": 0.0},
        "cameraHorizon": 0.0,
        "isStanding": True,
        "inHighFrictionArea": False,
    }
    scene = Scene(given.name, tuple(room.objects.values()), agent)
    inside = min(x, z, width - x, depth - z) >= RADIUS
    if not inside or any(box.distance(x, z) < RADIUS for box in State(scene).solids):
        raise InvalidInputError(
            f"{label}, agent: there is no place to stand at its 'position'. Move it from "
            "furniture and walls."
        )
    return scene


class _Furnishing:
    """A room while it is furnished; `objects` is their metadata by id."""

    def __init__(self, name: str, width: float, depth: float) -> None:
        self.name = name
        self.called: dict[str, list[str]] = {}
        self.knobs: list[tuple[str, str, str]] = []
        self.floor = new_floor(width, depth)
        self.floor["name"] = self._name(self.floor["objectId"])
        self.objects = {self.floor["objectId"]: self.floor}
        self.extent = Box((width / 2, CEILING / 2, depth / 2), (width, CEILING, depth))

    def add(self, row: _Row, label: str) -> None:
        """Put one object into the room."""
        kind, label = self._kind(row, label)
        size, host = row.size or kind.size, None
        if row.at is not None:
            position = (row.at[0], row.at[1] if len(row.at) == 3 else 0.0, row.at[-1])
            if position[1] == 0.0:
                host = self.floor
        else:
            host = self._find(row.in_ or row.on or "", label, "the receptacle")
            outer = box_of(new_object(kind, (0.0, 0.0, 0.0), size, row.rotation)).size
            position = self._spot(kind, outer, host, label)
        thing = new_object(kind, position, size, row.rotation)
        if kind.name in _BASINS and host is not None:
            thing["objectId"], host = f"{host['objectId']}|{kind.name}", None
        box = box_of(thing)
        if any(
            box.low(axis) < self.extent.low(axis) - 0.01
            or box.high(axis) > self.extent.high(axis) + 0.01
            for axis in range(3)
        ):
            raise InvalidInputError(
                f"{label}: it reaches outside the room, which is {self.extent.size[0]:g} m by "
                f"{self.extent.size[2]:g} m and {CEILING:g} m high. Move it, or give its 'size'."
            )
        if thing["objectId"] in self.objects:
            raise InvalidInputError(f"{label}: another one is at the same place. Move one.")
        self._set_states(thing, row, host, label)
        if host is not None:
            holders = [host["objectId"]]
            if host["pickupable"]:
                holders += host["parentReceptacles"] or ()
            thing["parentReceptacles"] = sorted(holders)
            for holder in holders:
                ids = self.objects[holder]["receptacleObjectIds"]
                self.objects[holder]["receptacleObjectIds"] = sorted([*ids, thing["objectId"]])
        thing["name"] = self._name(thing["objectId"])
        self.objects[thing["objectId"]] = thing
        self.called.setdefault(row.label or kind.name, []).append(thing["objectId"])
        if kind.name == "StoveKnob":
            self.knobs.append((thing["objectId"], row.controls or "", label))

    def connect(self) -> None:
        """Let each knob control its burner."""
        for knob, burner, label in self.knobs:
            target = self._find(burner, label, "controls") if burner else None
            if target is None or target["objectType"] != "StoveBurner":
                raise InvalidInputError(f"{label}: 'controls' must be the label of a StoveBurner.")
            self.objects[knob]["controlledObjects"] = [target["objectId"]]

    def _kind(self, row: _Row, label: str) -> tuple[ObjectType, str]:
        """The object's type, and a label that names it; refuses what needs no room to be wrong."""
        name, known = row.type, object_types()
        if name not in known or name == "Floor":
            hint = "the room has its floor already." if name == "Floor" else nearest(name, known)
            raise InvalidInputError(f"{label}: the type {shown(name)} cannot be used; {hint}")
        label = f"{label} {name}"
        if row.label is not None:
            if without_invisible(row.label) != row.label:
                raise InvalidInputError(
                    f"{label}: 'label' has invisible characters. Leave them out."
                )
            label = f"{label} {row.label!r}"
            if row.label in self.called or (row.label in known and row.label != name):
                raise InvalidInputError(f"{label}: this label is taken. Choose another.")
        if sum(each is not None for each in (row.at, row.in_, row.on)) != 1:
            raise InvalidInputError(f"{label}: expected exactly one of the keys at, in, on.")
        if name in _BASINS and row.at is not None:
            raise InvalidInputError(f"{label}: it must be in a {_BASINS[name]}, not 'at' a place.")
        if row.controls is not None and name != "StoveKnob":
            raise InvalidInputError(f"{label}: 'controls' is for a StoveKnob, and names a burner.")
        return known[name], label

    def _find(self, called: str, label: str, key: str) -> dict[str, Any]:
        ids = self.called.get(called, [])
        if len(ids) == 1:
            return self.objects[ids[0]]
        if ids:
            told = f"there are {len(ids)} of it. Give each a 'label', and name that one."
        else:
            told = f"{nearest(shown(called), self.called)} It must be written further up."
        raise InvalidInputError(f"{label}: {key} {shown(called)} is not clear; {told}")

    def _spot(self, kind: ObjectType, size: Vec, host: dict[str, Any], label: str) -> Vec:
        """A free spot in or on a receptacle: the middle of the underside."""
        name, area = host["objectType"], box_of(host)
        x, y, z = area.center[0], area.low(1), area.center[2]
        if kind.name in _BASINS:
            if name != _BASINS[kind.name]:
                raise InvalidInputError(f"{label}: it must be in a {_BASINS[kind.name]}.")
            return (x, area.high(1) - size[1] + 0.01, z)
        if not host["receptacle"]:
            raise InvalidInputError(f"{label}: {name} is not a receptacle. Choose another.")
        inside = [self.objects[each] for each in host["receptacleObjectIds"]]
        if name in SINGLE:
            if inside or SINGLE[name] not in ("", kind.name):
                what = SINGLE[name] or "object"
                raise InvalidInputError(f"{label}: a {name} holds one {what}. Choose another.")
            if name in _HOOKS:
                return (x, max(area.high(1) - size[1], 0.0), z)
            return (x, y + _WALL if name in _HOLLOW else area.high(1), z)
        if name in ENCLOSING or name in _HOLLOW:
            y, others = y + _WALL, inside
        else:
            y += area.size[1] * _SEATS.get(name, 1.0)
            others = [each for each in self.objects.values() if each is not host]
        level = area._replace(center=(x, y + size[1] / 2, z))
        if name in ENCLOSING:
            width, height, depth = area.size
            level = level._replace(size=(width - 2 * _WALL, height - _WALL, depth - 2 * _WALL))
        spot = _free_spot(level, size, [box_of(each) for each in others])
        if spot is None or (name in ENCLOSING and size[1] > level.size[1]):
            raise InvalidInputError(
                f"{label}: there is no room for it in or on the {name}. Put it elsewhere, or give "
                "a 'size' or a 'rotation' with which it fits."
            )
        return (spot[0], y, spot[1])

    def _set_states(
        self,
        thing: dict[str, Any],
        row: _Row,
        host: Mapping[str, Any] | None,
        label: str,
    ) -> None:
        kind = thing["objectType"]
        thing["isToggled"] = kind == "LightSwitch"
        if host and host["objectType"] == "Fridge" and "Food" in (thing["salientMaterials"] or ()):
            thing["temperature"] = "Cold"
        for key, value in row.states.items():
            if problem := unfit_state(key, [kind]):
                raise InvalidInputError(f"{label}: {problem}")
            thing[key] = value
        thing["openness"] = float(thing["isOpen"])
        thing["isFilledWithLiquid"] = thing["fillLiquid"] is not None

    def _name(self, object_id: str) -> str:
        kind = object_id.split("|")[-1] if object_id.count("|") > 3 else object_id.split("|")[0]
        return f"{kind}_{zlib.crc32(f'{self.name} {object_id}'.encode()):08x}"


def _free_spot(level: Box, size: Vec, others: Iterable[Box]) -> tuple[float, float] | None:
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
