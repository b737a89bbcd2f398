"""The room at the start of a TEACh game, as a scene of the embedded house."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from goalscope.envs.house.simulator.object_types import PREDICATES, new_object, object_type
from goalscope.envs.house.simulator.scenes import load_scene, read_scene
from goalscope.envs.house.simulator.state import Scene, moved


def worlds(scenes: Path | None) -> Callable[[str], Scene]:
    """A function that gives AI2-THOR's scene of a game's "world", and reads each once.

    Args:
        scenes: Folder of the scenes, named as the world with `.json.gz`; None looks among those
            that were imported.
    """

    @cache
    def world(name: str) -> Scene:
        return read_scene(scenes / f"{name}.json.gz") if scenes else load_scene(name)

    return world


def room_at_start(objects: Iterable[Mapping[str, Any]], scene: Scene) -> Scene:
    """The scene with the objects as a game has them.

    Args:
        objects: TEACh's record of each, a game's "initial_objects".
        scene: AI2-THOR's, in which it was played.
    """
    start = {each["objectId"]: _object(each, scene) for each in objects}
    return Scene(scene.name, _linked(start))


def predicates(given: Mapping[str, Any]) -> dict[str, Any]:
    """TEACh's record of an object, which leaves out what is false, with AI2-THOR 5's names."""
    known = {key: given.get(key, False) for key in PREDICATES}
    known["parentReceptacles"] = given.get("parentReceptacles") or []
    known["temperature"] = given.get("ObjectTemperature", "RoomTemp")
    return known


def _object(given: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Metadata of one of TEACh's objects, after the scene's object of that id or type."""
    own, kind = given["objectId"], given["objectType"]
    same = [each for each in scene.objects if each["objectId"] == own]
    alike = same or [each for each in scene.objects if each["objectType"] == kind]
    known = object_type(kind)
    thing = dict(alike[0]) if alike else new_object(known, (0.0, 0.0, 0.0), known.size, 0.0)
    thing |= {"objectId": own, "objectType": kind, "name": own}
    x, y, z = given["p"]
    moved(thing, (x, y, z))
    thing |= predicates(given)
    thing["openness"] = float(thing["isOpen"])
    thing["fillLiquid"] = "water" if thing["isFilledWithLiquid"] else None
    if given.get("simbotIsFilledWithCoffee"):
        thing["fillLiquid"] = "coffee"
    if not same:
        thing["controlledObjects"] = None
    return thing


def _linked(objects: dict[str, dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    """The objects with both sides of "on" and "in", and each knob with its burner."""
    for thing in objects.values():
        thing["receptacleObjectIds"] = [] if thing["receptacle"] else None
    for own, thing in objects.items():
        for parent in thing["parentReceptacles"]:
            if parent in objects:
                inside: list[str] = objects[parent]["receptacleObjectIds"] or []
                objects[parent]["receptacleObjectIds"] = sorted({*inside, own})
    for thing in objects.values():
        if thing["objectType"] == "StoveKnob":
            burners = [each for each in thing["controlledObjects"] or () if each in objects]
            thing["controlledObjects"] = burners
            for burner in burners:
                objects[burner]["isToggled"] = thing["isToggled"]
        if thing["isPickedUp"]:
            thing["isPickedUp"] = False
    return tuple(objects.values())
