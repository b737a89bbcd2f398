"""The states that objects can be in, for scenes and conditions that people write."""

from __future__ import annotations

from collections.abc import Iterable

from goalscope.envs.house.simulator.object_types import object_types
from goalscope.envs.tables import shown

__all__ = ["ACTS", "LASTING", "PREDICATES", "STATES", "unfit_state"]

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

_WORDS = {
    "temperature": ("Cold", "RoomTemp", "Hot"),
    "fillLiquid": ("water", "coffee", "wine"),
}


def unfit_state(name: str, value: object, types: Iterable[str]) -> str:
    """Why none of the object `types` can be in this state of `STATES`; empty where one can."""
    words = _WORDS.get(name)
    if words and value not in words:
        return f"{name!r} must be one of {', '.join(words)}, not {shown(value)}."
    if not words and type(value) is not bool:
        return f"{name!r} must be true or false, not {shown(value)}."
    flag = STATES[name]
    types = list(types)
    if flag and not any(flag in object_types()[kind].flags for kind in types):
        return f"{name!r} does not fit {' or '.join(types[:5])}, which is not {flag}."
    return ""
