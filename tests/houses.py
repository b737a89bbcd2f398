"""What the tests of the embedded house share: acting by short words, and seeing what changed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.world import House

FROM_HERE = ("visible", "isInteractable", "distance")
"""What of an object depends on where the agent stands."""

ABOUT_THE_ACTION = ("lastAction", "lastActionSuccess", "errorMessage", "errorCode", "actionReturn")
"""What of the metadata tells of the last action alone."""


def house(scene: str = "Kitchen1") -> House:
    """A new house, in which paper towels can be used up: nothing can in AI2-THOR 5's scenes."""
    home = House(load_scene(scene))
    for each in home.state.objects.values():
        each["canBeUsedUp"] = each["objectType"] == "PaperTowelRoll"
    return home


def named(home: House, words: str) -> str:
    """The id of "Egg", the first one, or of "Egg:2", the third."""
    kind, _, number = words.partition(":")
    found = [own for own, each in home.state.objects.items() if each["objectType"] == kind]
    return found[int(number or 0)]


def thing(home: House, words: str) -> dict[str, Any]:
    return home.state.objects[named(home, words)]


def act(home: House, name: str, words: str = "", **arguments: Any) -> dict[str, Any]:
    """The metadata after an action, by default a forced one."""
    target = {"objectId": named(home, words)} if words else {}
    return home.step({"action": name, "forceAction": True, **target, **arguments})


def run(home: House, step: str) -> dict[str, Any]:
    """The metadata after `Action [Object] [key=JSON...]`; it is forced unless it says otherwise."""
    name, *words = step.split()
    target = [word for word in words if "=" not in word]
    pairs = (word.split("=", 1) for word in words if "=" in word)
    return act(home, name, *target, **{key: json.loads(value) for key, value in pairs})


def do(home: House, *steps: str) -> House:
    """Take steps such as "PickupObject Egg; OpenObject Fridge", each with success."""
    for step in filter(None, "; ".join(steps).split("; ")):
        metadata = run(home, step)
        assert metadata["lastActionSuccess"], (step, metadata["errorMessage"])
    return home


def facts(home: House) -> dict[str, Any]:
    """A copy of all that is so, whatever the last action was."""
    metadata = home.metadata()
    return json.loads(json.dumps({k: metadata[k] for k in metadata if k not in ABOUT_THE_ACTION}))


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[tuple[str, str], Any]:
    """What became of what, for all that does not depend on where the agent stands."""
    old = {each["objectId"]: each for each in before["objects"]}
    return {
        (each["objectId"], key): value
        for each in after["objects"]
        for key, value in each.items()
        if key not in FROM_HERE and old.get(each["objectId"], {}).get(key) != value
    }
