"""AI2-THOR's object types: names, affordances, sizes, places; and the states of objects."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from goalscope.base.inputs import shown

FLAGS = (
    "pickupable",
    "moveable",
    "receptacle",
    "openable",
    "toggleable",
    "breakable",
    "canFillWithLiquid",
    "dirtyable",
    "canBeUsedUp",
    "cookable",
    "sliceable",
    "isHeatSource",
    "isColdSource",
)
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
    "isToggled",
    "isOpen",
    "isPickedUp",
    "isSliced",
    "isCooked",
    "isDirty",
    "isFilledWithLiquid",
    "isBroken",
    "isUsedUp",
    "parentReceptacles",
    "temperature",
)
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

_VALUES = {"temperature": ("Cold", "RoomTemp", "Hot"), "fillLiquid": LIQUIDS}


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


def unfit_state(name: str, value: object, types: Iterable[str]) -> str:
    """Why none of the object `types` can be in this state of `STATES`; empty where one can."""
    words = _VALUES.get(name)
    if words and value not in words:
        return f"{name!r} must be one of {', '.join(words)}, not {shown(value)}."
    if not words and type(value) is not bool:
        return f"{name!r} must be true or false, not {shown(value)}."
    flag = STATES[name]
    types = list(types)
    if flag and not any(flag in object_types()[kind].flags for kind in types):
        return f"{name!r} does not fit {' or '.join(types[:5])}, which is not {flag}."
    return ""
