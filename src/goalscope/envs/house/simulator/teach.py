"""Replays of TEACh games: what people did in AI2-THOR 3.1, done again in the embedded house."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from goalscope.envs.house.simulator.conformance import Agreement, rows, triples
from goalscope.envs.house.simulator.geometry import moved
from goalscope.envs.house.simulator.making import new_object
from goalscope.envs.house.simulator.object_types import object_type, type_of
from goalscope.envs.house.simulator.properties import PREDICATES
from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.scenes import load_scene, read_scene
from goalscope.envs.house.simulator.state import by_id
from goalscope.envs.house.simulator.world import House
from goalscope.types import InvalidInputError

__all__ = ["replay_game", "replay_games"]

_ACTIONS = {
    "Pickup": "PickupObject",
    "Place": "PutObject",
    "Open": "OpenObject",
    "Close": "CloseObject",
    "ToggleOn": "ToggleObjectOn",
    "ToggleOff": "ToggleObjectOff",
    "Slice": "SliceObject",
}
"""TEACh's names of what AI2-THOR has an action for; "Pour" is two."""


def replay_games(
    path: Path, scenes: Path | None, agreement: Agreement, advance: Callable[[], None]
) -> None:
    """Replay every game of a file; for each, `advance` is called once.

    Args:
        path: Games, JSON Lines: "world", "interactions", "initial_objects", "final_objects".
        scenes: Folder of AI2-THOR's scenes, named as "world" names them, with `.json.gz`; None
            looks among those that were imported.
        agreement: Takes the counts.
        advance: For a progress bar.

    Raises:
        InvalidInputError: A file is missing, or is not of this form.
    """
    known: dict[str, Scene] = {}
    for number, game in enumerate(rows(path), 1):
        for key in ("world", "interactions", "initial_objects", "final_objects"):
            if key not in game:
                raise InvalidInputError(f"{path.name}, line {number}: the key {key!r} is missing.")
        world = str(game["world"])
        if world not in known:
            file = scenes / f"{world}.json.gz" if scenes else None
            known[world] = read_scene(file) if file else load_scene(world)
        try:
            replay_game(game, known[world], agreement)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InvalidInputError(
                f"{path.name}, line {number}: not a TEACh game ({type(error).__name__}: {error})."
            ) from None
        advance()


def replay_game(game: Mapping[str, Any], scene: Scene, agreement: Agreement) -> None:
    """Do again what the person who drove the robot did with success, and compare the end."""
    start = {each["objectId"]: _object(each, scene) for each in game["initial_objects"]}
    state = Scene(scene.name, _linked(start))
    house = House(state)
    began = by_id(house.metadata()["objects"])
    clock = 0.0
    for act in _acts(game["interactions"]):
        seconds = float(act["t"]) - clock
        house.advance(max(seconds, 0.0))
        clock = float(act["t"])
        agreement.steps += 1
        error = _do(house, act)
        if error is None:
            agreement.agreed += 1
        else:
            agreement.refused[str(act["action"]), _general(error)] += 1
    real = {each["objectId"]: _predicates(each) for each in game["final_objects"]}
    first = {each["objectId"]: _predicates(each) for each in game["initial_objects"]}
    agreement.count(
        "game", triples(first, real), triples(began, by_id(house.metadata()["objects"]))
    )


def _acts(interactions: Any) -> Iterator[Mapping[str, Any]]:
    for each in interactions:
        if each["agent"] == "driver" and each["success"] and "oid" in each:
            yield each


def _do(house: House, act: Mapping[str, Any]) -> str | None:
    """The house's error, or None where it accepted the act."""
    own, name = act["oid"], act["action"]
    if name != "Pour":
        step = {"action": _ACTIONS[name], "objectId": own, "forceAction": True}
        return house.step(step)["errorMessage"] or None
    held = house.state.held
    if held is None:
        return "Nothing to pour from."
    liquid = house.state.objects[held]["fillLiquid"] or "water"
    error = house.step({"action": "EmptyLiquidFromObject", "objectId": held, "forceAction": True})[
        "errorMessage"
    ]
    target = house.state.objects.get(own)
    if not error and target and target["canFillWithLiquid"] and not target["isFilledWithLiquid"]:
        fill = {"action": "FillObjectWithLiquid", "objectId": own, "fillLiquid": liquid}
        error = house.step({**fill, "forceAction": True})["errorMessage"]
    return error or None


def _general(error: str) -> str:
    """The message with types in place of ids."""
    return " ".join(type_of(word) if "|" in word else word for word in error.split())


def _predicates(given: Mapping[str, Any]) -> dict[str, Any]:
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
    thing |= _predicates(given)
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
