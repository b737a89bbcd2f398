"""What is heard in scenes of things without places, and what is done in the shipped rooms."""

from __future__ import annotations

from functools import cache

from fakes import WordModel
from goalscope.acting import ActionPlanner
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.hearing import Hearing, hear
from goalscope.types import StepResult, Turn

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


@cache
def robot_in(scene: str) -> HomeRobot:
    return HomeRobot(HouseController(scene))


def told(scene: str, *said: str) -> tuple[set[str], list[str], str]:
    """What has changed in the end, what was told of the newest words, and what was asked."""
    robot, turns = robot_in(scene), list[Turn]()
    robot.reset()
    history: list[StepResult] = []
    notes, question = list[str](), ""
    for each in said:
        turns.append(Turn("What would you like me to do?", each))
        outcome = ActionPlanner(WordModel()).act(robot, [], turns, history)
        history += outcome.results
        notes, question = robot.unmet(turns, outcome.results), outcome.question
    status = robot.status().splitlines()
    changes = {line.removeprefix("- ") for line in status if line.startswith("- ")}
    return changes, notes, question
