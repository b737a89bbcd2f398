"""What is heard in scenes of things without places, and what is done in the shipped rooms."""

from __future__ import annotations

from functools import cache

from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.hearing.hear import Hearing, hear
from goalscope.types import Action, Turn
from talks import Talk

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
    robot = robot_in(scene)
    robot.reset()
    talk = Talk(robot, "What would you like me to do?")
    for each in said:
        talk.say(each)
    status = robot.status().splitlines()
    changes = {line.removeprefix("- ") for line in status if line.startswith("- ")}
    return changes, talk.told, "".join(round.question for round in talk.rounds[-1:])


def turns(*said: str) -> list[Turn]:
    return [Turn("What would you like?", each) for each in said]


def follow(scene: str, *said: str) -> list[str]:
    """What is done, with all leave, for the last words, after what was done for those before."""
    robot = robot_in(scene)
    robot.reset()
    done: list[Action] = []
    for n in range(len(said)):
        done = robot.requests(turns(*said[: n + 1]))
        for action in done:
            robot.step(action)
    return [f"{a.name}: {a.target}{f' -> {a.destination}' if a.destination else ''}" for a in done]
