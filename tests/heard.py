"""Scenes of things without places, and what is heard in them."""

from __future__ import annotations

from goalscope.envs.house.hearing import (
    Hearing,
    hear,
)
from goalscope.types import Turn

TYPES = [
    "Bread",
    "Vase",
    "Apple",
    "Tomato",
    "Potato",
    "Egg",
    "Mug",
    "Plate",
    "Cup",
    "Fridge",
    "Knife",
    "ButterKnife",
    "SoapBottle",
    "Pot",
    "CellPhone",
    "Window",
    "Blinds",
    "Microwave",
    "CounterTop",
    "DiningTable",
    "Safe",
    "WineBottle",
    "Television",
    "Laptop",
    "Desk",
    "Drawer",
    "Cabinet",
    "GarbageCan",
    "LightSwitch",
    "DeskLamp",
    "HousePlant",
    "Ladle",
    "Pencil",
]


def scene(*types: str) -> list[dict[str, str]]:
    return [{"objectId": f"{t}|+00.{i:02d}", "objectType": t} for i, t in enumerate(types)]


def heard(*said: str | Turn, objects: list[dict[str, str]] | None = None) -> Hearing:
    turns = [each if isinstance(each, Turn) else Turn("", each) for each in said]
    return hear(turns, scene(*TYPES) if objects is None else objects)


def put(place: str, *things: str) -> list[tuple[str, str, str]]:
    return [("put", thing, place) for thing in things]
