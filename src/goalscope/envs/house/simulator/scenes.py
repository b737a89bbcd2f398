"""Scenes: built-in, from the user's folder, or from files of metadata or of rooms in TOML."""

from __future__ import annotations

import gzip
import json
import math
import os
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, astuple, dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import AfterValidator, Field

from goalscope.base.inputs import nearest, read_toml, shown, validated
from goalscope.base.text import without_invisible
from goalscope.base.types import InvalidInputError
from goalscope.base.user_dirs import user_data
from goalscope.envs.house.simulator.object_types import (
    FLAGS,
    LIQUIDS,
    SINGLE,
    STATES,
    GivenStates,
    ObjectType,
    new_floor,
    new_object,
    object_types,
    unfit_state,
)
from goalscope.envs.house.simulator.state import (
    ENCLOSING,
    EYE_HEIGHT,
    RADIUS,
    Box,
    Scene,
    State,
    Vec,
    agent_metadata,
    box_metadata,
    box_of,
)

MOST_BYTES = 64 * 2**20

MOST_OBJECTS = 2000
MOST_TEXT = 200
"""Limits of a scene: 2,000 objects, names of 200 characters."""

MOST_SIZE = 100.0
"""Longest side of an object, in m."""

_FLAGS = (*FLAGS, *(state for state in STATES if state.startswith("is")))


def _harmless(text: str) -> str:
    """Refuse invisible characters, and a model's control tokens."""
    if "<|" in text or without_invisible(text) != text:
        raise ValueError("it has characters that nobody sees or a model obeys. Leave them out.")
    return text


_Id = Annotated[str, Field(min_length=1, max_length=MOST_TEXT), AfterValidator(_harmless)]
_Number = Annotated[float, Field(gt=-1e6, lt=1e6)]
_Side = Annotated[float, Field(ge=0, le=MOST_SIZE)]


@dataclass(frozen=True, slots=True)
class _Vector:
    x: _Number
    y: _Number
    z: _Number


@dataclass(frozen=True, slots=True)
class _Size:
    x: _Side
    y: _Side
    z: _Side


@dataclass(frozen=True, slots=True)
class _Box:
    center: _Vector | None = None
    size: _Size = _Size(0.1, 0.1, 0.1)


@dataclass(frozen=True, slots=True)
class _Agent:
    position: _Vector
    rotation: _Vector
    cameraHorizon: _Number = 0.0
    isStanding: bool = True


@dataclass(frozen=True, slots=True)
class _Head:
    sceneName: _Id
    agent: _Agent | None


@dataclass(frozen=True, slots=True)
class _Object:
    """What the house reads of an object's metadata besides its flags; AI2-THOR writes more."""

    objectId: _Id
    objectType: _Id
    name: _Id
    position: _Vector
    rotation: _Vector = _Vector(0.0, 0.0, 0.0)
    fillLiquid: Annotated[str, Field(max_length=20), AfterValidator(_harmless)] | None = None
    temperature: Literal["RoomTemp", "Hot", "Cold"] = "RoomTemp"
    openness: Annotated[float, Field(ge=0, le=1)] | None = None
    mass: _Number = 0.0
    parentReceptacles: list[_Id] | None = None
    receptacleObjectIds: list[_Id] | None = None
    controlledObjects: list[_Id] | None = None
    axisAlignedBoundingBox: _Box | None = None


def read_scene(path: str | Path) -> Scene:
    """Read a file: AI2-THOR's metadata (.json, .json.gz), or a room in our own form (.toml).

    Raises:
        InvalidInputError: It cannot be read, or is of neither form.
    """
    path = Path(path)
    if path.suffix == ".toml":
        return read_room(path)
    return scene_from_metadata(_json(path), label=path.name, name=path.name.partition(".")[0])


def known_scenes() -> dict[str, Callable[[], Scene]]:
    """Readers of all scenes by name: built-in ones, and those in `scenes_folder()`.

    A file's scene goes by the file's name without its endings; ours go before files of their names.
    """
    found: dict[str, Callable[[], Scene]] = {
        path.name.partition(".")[0]: lambda path=path: read_scene(path) for path in _kept()
    }
    for entry in (files("goalscope.envs.house") / "data" / "scenes").iterdir():
        if entry.name.endswith(".toml"):
            found[entry.name.removesuffix(".toml")] = lambda entry=entry: read_room(entry)
    return dict(sorted(found.items()))


def _kept() -> list[Path]:
    """The scene files in the folder; none where there is no folder."""
    folder = scenes_folder()
    return [
        path
        for path in sorted(folder.iterdir() if folder.is_dir() else ())
        if path.name.endswith((".json", ".json.gz", ".toml"))
        and path.name[0] != "."
        and path.is_file()
    ]


def scenes_folder() -> Path:
    """$GOALSCOPE_SCENES, or `scenes` in the user's data folder."""
    given = os.environ.get("GOALSCOPE_SCENES")
    return Path(given) if given else user_data() / "scenes"


def load_scene(name: str) -> Scene:
    """The scene of this name ("Kitchen1"), or in this file ("scenes/FloorPlan1_physics.json.gz").

    Case is ignored if the name is unambiguous.

    Raises:
        InvalidInputError: There is no such scene, or its file cannot be used.
    """
    scenes = known_scenes()
    for known in (name, f"{name}_physics"):
        if known in scenes:
            return scenes[known]()
    alike = [each for each in scenes if each.casefold() == name.casefold()]
    if len(alike) == 1:
        return scenes[alike[0]]()
    if "." in name or "/" in name:
        return read_scene(name)
    raise InvalidInputError(
        f"There is no scene {name!r}. Choose one of {', '.join(scenes)}, or name a file. "
        f"Files in {scenes_folder()} are found by their names."
    )


def _json(path: Path) -> Any:
    opener = gzip.open if path.suffix == ".gz" else open
    try:
        with opener(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise InvalidInputError(f"{path.name}: larger than {MOST_BYTES >> 20} MiB.")
        return json.loads(data)
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInputError(
            f"Cannot read the scene {path.name}: {reason}. Name a JSON file."
        ) from None
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"The scene {path.name} is not valid JSON: {error}.") from None


def scene_from_metadata(metadata: Any, *, label: str, name: str | None = None) -> Scene:
    """A scene of what AI2-THOR's `event.metadata` holds, or of {objectId: object metadata}.

    Args:
        metadata: As parsed from JSON; nothing in it is trusted.
        label: What to call it in errors.
        name: Name of the scene, where the metadata gives none.

    Raises:
        InvalidInputError: It is no such metadata; the message names the object and the key.
    """
    if not isinstance(metadata, dict):
        raise InvalidInputError(
            f"{label}: expected a JSON object with AI2-THOR's metadata, "
            f"not {type(metadata).__name__}. Save `event.metadata` with json.dump."
        )
    table = cast("dict[str, Any]", metadata)
    listed: object = table["objects"] if "objects" in table else list(table.values())
    if not isinstance(listed, list) or not listed:
        raise InvalidInputError(f"{label}: there are no objects in it.")
    rows = cast("list[Any]", listed)
    if len(rows) > MOST_OBJECTS:
        raise InvalidInputError(
            f"{label}: {len(rows):,} objects; a scene may have {MOST_OBJECTS:,}."
        )
    objects = tuple(_object(row, f"{label}, object {n}") for n, row in enumerate(rows, 1))
    ids = [each["objectId"] for each in objects]
    for each in ids:
        if ids.count(each) > 1:
            raise InvalidInputError(f"{label}: two objects have the id {each!r}.")
    held = [each["objectId"] for each in objects if each["isPickedUp"]]
    if len(held) > 1:
        raise InvalidInputError(
            f"{label}: {held[0]!r} and {held[1]!r} are both picked up; a hand holds one thing."
        )
    given = {
        "sceneName": table.get("sceneName") or name or "Imported",
        "agent": table.get("agent"),
    }
    head = validated(given, _Head, label, ignore_extra=True)
    agent = head.agent and {"name": "agent", **asdict(head.agent), "inHighFrictionArea": False}
    liquids = {row["fillLiquid"] for row in rows if row.get("fillLiquid")}
    odd = sorted(liquids - {*LIQUIDS})
    note = f"The house knows no {' or '.join(odd[:5])}: what holds it counts as filled."
    return Scene(head.sceneName, objects, agent, (note,) if odd else ())


def _object(row: Any, label: str) -> dict[str, Any]:
    """The object's metadata with every key that the house needs, checked."""
    if not isinstance(row, dict):
        raise InvalidInputError(f"{label}: expected a JSON object, not {type(row).__name__}.")
    given = cast("dict[str, Any]", row)
    label = f"{label} {shown(given.get('objectId'))}"
    flags = validated({key: given.get(key, False) for key in _FLAGS}, dict[str, bool], label)
    named = {"name": given.get("objectId"), **given}
    thing = validated(named, _Object, label, ignore_extra=True)
    openness = float(flags["isOpen"]) if thing.openness is None else thing.openness
    box = thing.axisAlignedBoundingBox or _Box()
    return {
        "assetId": "".join(_texts([given.get("assetId")]) or ()),
        "visible": False,
        "isInteractable": False,
        "distance": 0.0,
        **flags,
        **asdict(thing),
        "receptacleObjectIds": thing.receptacleObjectIds or ([] if flags["receptacle"] else None),
        "fillLiquid": thing.fillLiquid if thing.fillLiquid in LIQUIDS else None,
        "openness": openness,
        "salientMaterials": _texts(given.get("salientMaterials")),
        "isMoving": False,
        "axisAlignedBoundingBox": box_metadata(
            astuple(box.center or thing.position), astuple(box.size)
        ),
        "objectOrientedBoundingBox": None,
    }


def _texts(value: Any) -> list[str] | None:
    """The harmless short texts of a list, which the house can do without."""
    given = cast("list[Any]", value) if isinstance(value, list) else []
    short = (text for text in given[:20] if isinstance(text, str) and len(text) <= MOST_TEXT)
    harmless = [text for text in short if "<|" not in text and without_invisible(text) == text]
    return harmless or None


MOST_ROOM_OBJECTS = 200
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
_Length = Annotated[float, Field(ge=0.001, le=50)]
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
    size: tuple[_Length, _Length, _Length] | None = None
    rotation: _Degrees = 0.0
    controls: _Text | None = None


@dataclass(frozen=True, slots=True)
class _Room:
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,60}$")]
    size: tuple[Annotated[float, Field(ge=1, le=50)], Annotated[float, Field(ge=1, le=50)]]
    agent: _AgentRow
    object: Annotated[tuple[_Row, ...], Field(min_length=1, max_length=MOST_ROOM_OBJECTS)]


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
    agent = agent_metadata((x, EYE_HEIGHT, z), given.agent.rotation % 360)
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
