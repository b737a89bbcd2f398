"""Rooms that people write by hand in TOML, made into scenes with AI2-THOR's metadata."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, cast

from goalscope.base.inputs import is_list, nearest, read_table, refuse_unknown, shown
from goalscope.base.text import without_invisible
from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator.geometry import RADIUS, Box, Vec, box_of
from goalscope.envs.house.simulator.object_types import (
    SINGLE,
    STATES,
    ObjectType,
    object_types,
    unfit_state,
)
from goalscope.envs.house.simulator.objects import new_floor, new_object
from goalscope.envs.house.simulator.state import ENCLOSING, EYE_HEIGHT, Scene, State

__all__ = ["read_room"]

_PLACES = ("at", "in", "on")
_STATES = [key for key in STATES if key not in ("isFilledWithLiquid", "isSliced", "isPickedUp")]
_KEYS = ("type", "label", *_PLACES, "size", "rotation", "controls", *_STATES)

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


def read_room(source: Path | Traversable, *, label: str) -> Scene:
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

    Args:
        source: The file.
        label: What to call it in errors.

    Raises:
        InvalidInputError: The file cannot be read, or describes no possible room; the message
            names the file, the object, and the remedy.
    """
    table = read_table(source)
    refuse_unknown(table, ("name", "size", "agent", "object"), label)
    name = table.get("name")
    if not isinstance(name, str) or not re.fullmatch(r"\w{1,60}", name, re.ASCII):
        raise InvalidInputError(
            f"{label}: 'name' must be 1 to 60 letters, digits or underscores, not {shown(name)}."
        )
    width, depth = _numbers(table.get("size"), (2,), (1.0, 50.0), f"{label}: 'size'")
    rows = table.get("object")
    if not is_list(rows, dict) or not rows:
        raise InvalidInputError(f"{label}: there is no [[object]] table. Add at least one.")
    if len(rows) > MOST_OBJECTS:
        raise InvalidInputError(f"{label}: {len(rows):,} objects; a room has up to {MOST_OBJECTS}.")
    room = _Room(name, width, depth)
    for standing in (True, False):
        for number, row in enumerate(rows, 1):
            if ("at" in row) == standing:
                room.add(row, f"{label}, object {number}")
    room.connect()
    agent = _agent(table.get("agent"), f"{label}, agent")
    scene = Scene(name, tuple(room.objects.values()), agent)
    x, z = agent["position"]["x"], agent["position"]["z"]
    inside = min(x, z, width - x, depth - z) >= RADIUS
    if not inside or any(box.distance(x, z) < RADIUS for box in State(scene).solids):
        raise InvalidInputError(
            f"{label}, agent: there is no place to stand at its 'position'. Move it from "
            "furniture and walls."
        )
    return scene


class _Room:
    """A room while it is furnished; `objects` is their metadata by id."""

    def __init__(self, name: str, width: float, depth: float) -> None:
        self.name = name
        self.called: dict[str, list[str]] = {}
        self.knobs: list[tuple[str, str, str]] = []
        self.floor = new_floor(width, depth)
        self.floor["name"] = self._name(self.floor["objectId"])
        self.objects = {self.floor["objectId"]: self.floor}
        self.extent = Box((width / 2, CEILING / 2, depth / 2), (width, CEILING, depth))

    def add(self, row: Mapping[str, Any], label: str) -> None:
        """Put one object into the room."""
        kind, label = self._kind(row, label)
        size, rotation = kind.size, 0.0
        if "size" in row:
            wide, high, deep = _numbers(row["size"], (3,), (0.001, 50.0), f"{label}: 'size'")
            size = (wide, high, deep)
        if "rotation" in row:
            (rotation,) = _numbers([row["rotation"]], (1,), (-360.0, 360.0), f"{label}: 'rotation'")
        host = None
        if "at" in row:
            at = _numbers(row["at"], (2, 3), (0.0, 50.0), f"{label}: 'at'")
            position = (at[0], at[1] if len(at) == 3 else 0.0, at[-1])
            if position[1] == 0.0:
                host = self.floor
        else:
            host = self._find(row.get("in", row.get("on")), label, "the receptacle")
            outer = box_of(new_object(kind, (0.0, 0.0, 0.0), size, rotation)).size
            position = self._spot(kind, outer, host, label)
        thing = new_object(kind, position, size, rotation)
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
        self.called.setdefault(row.get("label", kind.name), []).append(thing["objectId"])
        if kind.name == "StoveKnob":
            self.knobs.append((thing["objectId"], row.get("controls", ""), label))

    def connect(self) -> None:
        """Let each knob control its burner."""
        for knob, burner, label in self.knobs:
            target = self._find(burner, label, "controls") if burner else None
            if target is None or target["objectType"] != "StoveBurner":
                raise InvalidInputError(f"{label}: 'controls' must be the label of a StoveBurner.")
            self.objects[knob]["controlledObjects"] = [target["objectId"]]

    def _kind(self, row: Mapping[str, Any], label: str) -> tuple[ObjectType, str]:
        """The object's type, and a label that names it; refuses what needs no room to be wrong."""
        name, known = row.get("type"), object_types()
        if not isinstance(name, str) or name not in known or name == "Floor":
            hint = nearest(name, known) if isinstance(name, str) else "give one of AI2-THOR's."
            hint = "the room has its floor already." if name == "Floor" else hint
            raise InvalidInputError(f"{label}: the type {shown(name)} cannot be used; {hint}")
        label = f"{label} {name}"
        own = row.get("label", name)
        if not isinstance(own, str) or without_invisible(own) != own or not 0 < len(own) <= 60:
            raise InvalidInputError(
                f"{label}: 'label' must be a text of up to 60 characters, not {shown(own)}."
            )
        if "label" in row:
            label = f"{label} {own!r}"
            if own in self.called or (own in known and own != name):
                raise InvalidInputError(f"{label}: this label is taken. Choose another.")
        refuse_unknown(row, _KEYS, label)
        if len([key for key in _PLACES if key in row]) != 1:
            raise InvalidInputError(
                f"{label}: expected exactly one of the keys {', '.join(_PLACES)}."
            )
        if name in _BASINS and "at" in row:
            raise InvalidInputError(f"{label}: it must be in a {_BASINS[name]}, not 'at' a place.")
        if "controls" in row and (name != "StoveKnob" or not isinstance(row["controls"], str)):
            raise InvalidInputError(f"{label}: 'controls' is for a StoveKnob, and names a burner.")
        return known[name], label

    def _find(self, called: object, label: str, key: str) -> dict[str, Any]:
        ids = self.called.get(called, []) if isinstance(called, str) else []
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
        row: Mapping[str, Any],
        host: Mapping[str, Any] | None,
        label: str,
    ) -> None:
        kind = thing["objectType"]
        thing["isToggled"] = kind == "LightSwitch"
        if host and host["objectType"] == "Fridge" and "Food" in (thing["salientMaterials"] or ()):
            thing["temperature"] = "Cold"
        for key in _STATES:
            if key in row:
                if told := unfit_state(key, row[key], [kind]):
                    raise InvalidInputError(f"{label}: {told}")
                thing[key] = row[key]
        thing["openness"] = float(thing["isOpen"])
        thing["isFilledWithLiquid"] = thing["fillLiquid"] is not None

    def _name(self, object_id: str) -> str:
        kind = object_id.split("|")[-1] if object_id.count("|") > 3 else object_id.split("|")[0]
        return f"{kind}_{zlib.crc32(f'{self.name} {object_id}'.encode()):08x}"


def _agent(row: object, label: str) -> dict[str, Any]:
    if not isinstance(row, dict):
        raise InvalidInputError(f"{label}: add a table [agent] with 'position = [x, z]'.")
    given = cast("dict[str, Any]", row)
    refuse_unknown(given, ("position", "rotation"), label)
    x, z = _numbers(given.get("position"), (2,), (0.0, 50.0), f"{label}: 'position'")
    turn = given.get("rotation", 0)
    (turn,) = _numbers([turn], (1,), (-360.0, 360.0), f"{label}: 'rotation'")
    return {
        "name": "agent",
        "position": {"x": x, "y": EYE_HEIGHT, "z": z},
        "rotation": {"x": 0.0, "y": turn % 360, "z": 0.0},
        "cameraHorizon": 0.0,
        "isStanding": True,
        "inHighFrictionArea": False,
    }


def _numbers(
    value: object, lengths: Sequence[int], limits: tuple[float, float], label: str
) -> list[float]:
    """A list of so many finite numbers within limits."""
    low, high = limits
    given = cast("list[object]", value) if isinstance(value, list) else []
    numbers = [each for each in given if isinstance(each, int | float)]
    good = all(type(each) is not bool and low <= each <= high for each in numbers)
    if not good or len(numbers) != len(given) or len(given) not in lengths:
        many = " or ".join(str(length) for length in lengths)
        what = f"a list of {many} numbers" if max(lengths) > 1 else "a number"
        raise InvalidInputError(f"{label} must be {what} from {low:g} to {high:g}.")
    return [float(each) for each in numbers]


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
