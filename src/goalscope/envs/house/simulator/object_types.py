"""What is known of AI2-THOR's object types: affordances, sizes, and what may stand where."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

__all__ = ["FLAGS", "SINGLE", "ObjectType", "object_type", "object_types"]

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
    """

    name: str
    flags: frozenset[str]
    materials: tuple[str, ...]
    mass: float
    size: tuple[float, float, float]
    places: frozenset[str]


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
        )
    return types


def object_type(name: str) -> ObjectType:
    """The object type of this name; one without affordances where it is unknown."""
    known = object_types().get(name)
    return known or ObjectType(name, frozenset(), (), 0.0, (0.3, 0.3, 0.3), frozenset())
