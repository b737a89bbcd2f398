"""Profiles of people at home are understood as documented, and their goals can be told apart."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import Action, InvalidInputError, Profile
from goalscope.envs import Outcome
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.profiles import checks_met, load_profiles
from goalscope.envs.house.simulator.scenes import load_scene

GOOD = """[[profile]]
name = "a"
scene = "Kitchen1"
description = "d"
replies = ["r"]
checks = [{object = "Apple", in = "Fridge"}]
"""
CHECK = '{object = "Apple", in = "Fridge"}'
PROFILES = load_profiles()
BY_NAME = {profile.name: profile for profile in PROFILES}


def thing(own: str, *parents: str, **states: Any) -> dict[str, Any]:
    return {
        "objectId": own,
        "objectType": own.rstrip("0123456789"),
        "parentReceptacles": list(parents) or None,
        "pickupable": True,
        "isOpen": False,
        "isDirty": False,
        "isSliced": False,
        "isBroken": False,
        "isFilledWithLiquid": False,
        "fillLiquid": None,
        "temperature": "RoomTemp",
        **states,
    }


HOME = [
    thing("Floor1"),
    thing("DiningTable1", "Floor1"),
    thing("Plate1", "DiningTable1"),
    thing("Egg1", "Plate1"),
    thing("Egg2", "Fridge1", temperature="Cold"),
    thing("Egg3", isBroken=True),
    thing("Fridge1", "Floor1", isOpen=True),
    thing("Mug1", "DiningTable1", isDirty=True),
    thing("Mug2", "DiningTable1", fillLiquid="coffee", isFilledWithLiquid=True),
    thing("Bread1", "DiningTable1", isSliced=True),
    thing("BreadSliced1", "DiningTable1"),
    thing("Book1", "Box1"),
    thing("Box1", "Book1", "Nowhere1"),
    thing("Cup1"),  # in the hand
]


@pytest.mark.parametrize(
    ("check", "met"),
    [
        ({"object": "Egg", "in": "Fridge"}, True),
        ({"object": "Egg", "on": "DiningTable"}, True),
        ({"object": "Egg", "on": "Floor"}, False),
        ({"object": "DiningTable", "on": "Floor"}, True),
        ({"object": "Egg", "on": ["Bed", "Plate"]}, True),
        ({"object": "Egg", "in": ["Fridge", "Plate"], "count": 2}, True),
        ({"object": ["Egg", "Mug"], "on": "DiningTable", "count": 3}, True),
        ({"object": "Egg", "count": 2}, True),
        ({"object": "Egg", "count": 3}, False),
        ({"object": "Egg", "in": "Fridge", "temperature": "Cold"}, True),
        ({"object": "Egg", "on": "Plate", "temperature": "Cold"}, False),
        ({"object": "Mug", "isDirty": True, "fillLiquid": "coffee"}, False),
        ({"object": "Mug", "isDirty": False, "fillLiquid": "coffee"}, True),
        ({"every": "Mug", "on": "DiningTable"}, True),
        ({"every": "Mug", "isDirty": False}, False),
        ({"every": "Egg", "on": "DiningTable"}, False),
        ({"every": "Apple", "in": "Fridge"}, False),
        ({"no": "Apple", "in": "Fridge"}, True),
        ({"no": "Fridge", "isOpen": True}, False),
        ({"no": "Mug", "isDirty": True, "in": "Fridge"}, True),
        ({"no": "BreadSliced"}, False),
        ({"object": "Bread", "on": "DiningTable"}, False),
        ({"object": "Bread", "on": "DiningTable", "isSliced": True}, True),
        ({"no": "Bread", "isSliced": True}, False),
        ({"no": "Egg", "isBroken": True}, False),
        ({"object": "Book", "in": "Fridge"}, False),
        ({"object": "Cup", "on": ["DiningTable", "Floor"]}, False),
    ],
)
def test_checks_mean_what_the_documentation_says(check: dict[str, Any], *, met: bool) -> None:
    assert checks_met([check], HOME) == [met]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (GOOD.replace(CHECK, "{}"), "exactly one of the keys object, every, no"),
        (GOOD.replace("in =", 'on = "Fridge", in ='), "'in' and 'on' mean the same"),
        (GOOD.replace('"Apple"', '"Appel"'), "'Appel' in 'object' .* did you mean 'Apple'"),
        (GOOD.replace('"Fridge"', '"Apple"'), "Apple in 'in' is not a receptacle"),
        (GOOD.replace(CHECK, '{no = "Egg", count = 2}'), "'count' is for 'object'"),
        (GOOD.replace(CHECK, '{every = "Egg"}'), "'every' needs a condition"),
        (GOOD.replace("in =", "isOpen = true, in ="), "Apple, which is not openable"),
    ],
)
def test_a_wrong_file_is_refused_with_place_and_remedy(
    tmp_path: Path, text: str, told: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InvalidInputError, match=told) as refusal:
        load_profiles(path)
    assert "mine.toml" in str(refusal.value)


def test_the_five_tasks_of_the_paper_are_there() -> None:
    assert list(BY_NAME) == [
        "breakfast-sandwich",
        "put-away-food",
        "put-away-devices",
        "valuables-in-safe",
        "cleaning-supplies",
    ]
    for profile in PROFILES:
        assert 3 <= len(profile.replies) <= 5


@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.name)
def test_at_the_start_only_the_donts_are_met(profile: Profile) -> None:
    met = checks_met(profile.checks, load_scene(profile.scene).objects)
    assert met == ["no" in check for check in profile.checks]
    assert not all(met)


DONE: Mapping[str, list[tuple[str, str]]] = {
    "breakfast-sandwich": [("Bread", "DiningTable"), ("Egg", "DiningTable"),
                           ("Lettuce", "DiningTable"), ("Plate", "DiningTable"),
                           ("Knife", "DiningTable")],
    "put-away-food": [("Tomato", "Fridge"), ("Potato", "Fridge"), ("Egg", "Fridge"),
                      ("Apple", "Bowl")],
    "put-away-devices": [("CellPhone", "Drawer"), ("RemoteControl", "TVStand"),
                         ("Laptop", "Desk")],
    "valuables-in-safe": [("Watch", "Safe"), ("KeyChain", "Safe"), ("Statue", "Safe")],
    "cleaning-supplies": [("SprayBottle", "CounterTop"), ("Cloth", "CounterTop"),
                          ("DishSponge", "CounterTop"), ("SoapBottle", "CounterTop")],
}  # fmt: skip
"""What is put where when all is done: every one of a type, but the clean ones of cloths."""


@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.name)
def test_the_robot_can_reach_each_goal(profile: Profile) -> None:
    robot = HomeRobot(HouseController(profile.scene))
    objects = robot.metadata["objects"]
    acts = [
        Action(name, robot.names[each["objectId"]])
        for each in objects
        if each["objectType"] == "Laptop"
        for name in ("turn off", "close")
    ]
    for kind, place in DONE[profile.name]:
        target = next(each["objectId"] for each in objects if each["objectType"] == place)
        acts += [
            Action("put", robot.names[each["objectId"]], destination=robot.names[target])
            for each in objects
            if each["objectType"] == kind and not each["isDirty"]
        ]
    start = robot.checks_met(profile).met
    for act in acts:
        robot.step(act)
    end = robot.checks_met(profile)
    assert Outcome(start, end.met, end.unwanted).score == 1, end
