"""AI2-THOR's object types, the states of objects, and the metadata of new objects."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from goalscope.envs.house.simulator.state import Vec, as_dict, box_metadata, box_of, vec

FLAGS = (
    "pickupable", "moveable", "receptacle", "openable", "toggleable", "breakable", "dirtyable",
    "canFillWithLiquid", "canBeUsedUp", "cookable", "sliceable", "isHeatSource", "isColdSource",
)  # fmt: skip
"""The affordances of AI2-THOR's metadata."""

SINGLE = {
    "CoffeeMachine": "Mug",
    "Toaster": "BreadSliced",
    "HandTowelHolder": "HandTowel",
    "TowelHolder": "Towel",
    "ToiletPaperHanger": "ToiletPaper",
    "StoveBurner": "",
}
"""Receptacles that hold one object, and its type where there is but one."""


PREDICATES = (
    "isToggled", "isOpen", "isPickedUp", "isSliced", "isCooked", "isDirty", "isFilledWithLiquid",
    "isBroken", "isUsedUp", "parentReceptacles", "temperature",
)  # fmt: skip
"""What an object's state is made of, when two houses are compared."""

ACTS = {
    "open": ("openable", "isOpen", True),
    "close": ("openable", "isOpen", False),
    "turn on": ("toggleable", "isToggled", True),
    "turn off": ("toggleable", "isToggled", False),
    "fill": ("canFillWithLiquid", "isFilledWithLiquid", True),
    "empty": ("canFillWithLiquid", "isFilledWithLiquid", False),
    "slice": ("sliceable", "isSliced", True),
    "cook": ("cookable", "isCooked", True),
    "break": ("breakable", "isBroken", True),
    "dirty": ("dirtyable", "isDirty", True),
    "clean": ("dirtyable", "isDirty", False),
    "use up": ("canBeUsedUp", "isUsedUp", True),
}
"""For each act: the affordance that it needs, the state that it sets, and to what."""

LASTING = ("isBroken", "isCooked", "isSliced", "isUsedUp")
"""States that nobody can undo."""

STATES = {
    "isOpen": "openable",
    "isToggled": "toggleable",
    "isBroken": "breakable",
    "isFilledWithLiquid": "canFillWithLiquid",
    "fillLiquid": "canFillWithLiquid",
    "isDirty": "dirtyable",
    "isUsedUp": "canBeUsedUp",
    "isCooked": "cookable",
    "isSliced": "sliceable",
    "isPickedUp": "pickupable",
    "temperature": "",
}
"""The states of an object in AI2-THOR's metadata, and the affordance that each one needs."""

LIQUIDS = ("water", "coffee", "wine")
"""What a thing can be filled with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenStates:
    """States that a file gives, by AI2-THOR's names; None where one is not given."""

    isOpen: bool | None = None
    isToggled: bool | None = None
    isBroken: bool | None = None
    isDirty: bool | None = None
    isUsedUp: bool | None = None
    isCooked: bool | None = None
    fillLiquid: Literal["water", "coffee", "wine"] | None = None
    temperature: Literal["Cold", "RoomTemp", "Hot"] | None = None

    @property
    def states(self) -> dict[str, bool | str]:
        """The states that are given."""
        values = {key: getattr(self, key, None) for key in STATES}
        return {key: value for key, value in values.items() if value is not None}


@dataclass(frozen=True, slots=True)
class ObjectType:
    """One object type.

    Attributes:
        name: Such as "CounterTop".
        flags: Names from `FLAGS`.
        materials: AI2-THOR's salient materials.
        mass: In kg.
        size: Usual width, height and depth, in m.
        places: Types of receptacles that PutObject accepts without forceAction.
        names: Everyday names, the usual one first, where these are not the type's own words.
    """

    name: str
    flags: frozenset[str]
    materials: tuple[str, ...]
    mass: float
    size: tuple[float, float, float]
    places: frozenset[str]
    names: tuple[str, ...] = ()


@cache
def object_types() -> dict[str, ObjectType]:
    """All object types by name."""
    source = files("goalscope.envs.house") / "data" / "object_types.csv"
    types: dict[str, ObjectType] = {}
    for row in csv.DictReader(source.read_text(encoding="utf-8").splitlines()):
        types[row["object_type"]] = ObjectType(
            row["object_type"],
            frozenset(row["flags"].split()),
            tuple(row["materials"].split()),
            float(row["mass"]),
            (float(row["width"]), float(row["height"]), float(row["depth"])),
            frozenset(row["places"].split()),
            tuple(filter(None, row["names"].split("; "))),
        )
    return types


def object_type(name: str) -> ObjectType:
    """The object type of this name; one without affordances where it is unknown."""
    known = object_types().get(name)
    return known or ObjectType(name, frozenset(), (), 0.0, (0.3, 0.3, 0.3), frozenset())


def unfit_state(name: str, types: Iterable[str]) -> str:
    """Why none of the object `types` can be in this state of `STATES`; empty where one can."""
    flag = STATES[name]
    types = list(types)
    if flag and not any(flag in object_types()[kind].flags for kind in types):
        return f"{name!r} does not fit {' or '.join(types[:5])}, which is not {flag}."
    return ""


_USUAL = {"Apple": 3, "Bread": 7, "Egg": 1, "Lettuce": 7, "Potato": 8, "Tomato": 7}
_BY_ASSET = {
    "Bread": {5: (6, 7, 11, 12), 6: (4, 5, 13, 14, 15, 22, 23, 24), 8: (28, 29, 30),
              9: (1, 2, 3, 16, 17, 18)},
    "Lettuce": {8: (1, 2, 3, 4, 5, 6, 7, 8, 9, 10)},
    "Potato": {6: tuple(range(21, 31)), 9: tuple(range(11, 21))},
}  # fmt: skip
"""Usual numbers of pieces, and those of AI2-THOR's assets that differ, by the assets' numbers."""


def new_object(kind: ObjectType, position: Vec, size: Vec, rotation: float) -> dict[str, Any]:
    """AI2-THOR's metadata of an object with its underside's middle at `position`."""
    can = {flag: flag in kind.flags for flag in FLAGS}
    x, y, z = position
    turn = math.radians(rotation)
    cos, sin = math.cos(turn), math.sin(turn)
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
        "objectOrientedBoundingBox": None,
    }


def new_floor(width: float, depth: float) -> dict[str, Any]:
    """AI2-THOR's metadata of a floor from x = 0 and z = 0, with its top at y = 0."""
    size = (width, 0.1, depth)
    kind = ObjectType("Floor", frozenset({"receptacle"}), (), 0.0, size, frozenset())
    floor = new_object(kind, (width / 2, 0.0, depth / 2), size, 0.0)
    floor["axisAlignedBoundingBox"] = box_metadata((width / 2, -0.05, depth / 2), size)
    return floor


def slices_of(thing: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Metadata of the pieces; the first one of a loaf is its end, a Bread."""
    kind = thing["objectType"]
    if kind not in _USUAL:
        return []
    digits = re.search(r"_(\d{1,4})$", thing["assetId"])
    asset = int(digits[1]) if digits else -1
    counts = _BY_ASSET.get(kind, {}).items()
    count = next((number for number, assets in counts if asset in assets), _USUAL[kind])
    width = max((0, 2), key=lambda axis: box_of(thing).size[axis])
    pieces: list[dict[str, Any]] = []
    for number in range(count):
        name = "EggCracked" if kind == "Egg" else f"{kind}Sliced"
        name = "Bread" if kind == "Bread" and number == 0 else name
        position = list(vec(thing["position"]))
        position[width] += box_of(thing).size[width] * ((number + 0.5) / count - 0.5)
        own = f"{thing['objectId']}|{name}_{number}"
        piece = _piece(thing, object_type(name), own, (position[0], position[1], position[2]))
        pieces.append(piece)
    return pieces


def _piece(thing: Mapping[str, Any], kind: ObjectType, own: str, position: Vec) -> dict[str, Any]:
    flags = {flag: flag in kind.flags for flag in FLAGS}
    size = kind.size
    if kind.name == "Bread":
        flags["sliceable"] = False
        size = (0.05, size[1], 0.05)
    return {
        **thing,
        **flags,
        "name": own,
        "objectId": own,
        "objectType": kind.name,
        "assetId": "",
        "position": as_dict(position),
        "isSliced": False,
        "isBroken": False,
        "isPickedUp": False,
        "isCooked": thing["isCooked"] and flags["cookable"],
        "mass": kind.mass,
        "parentReceptacles": None,
        "receptacleObjectIds": None,
        "axisAlignedBoundingBox": box_metadata(position, size),
    }
