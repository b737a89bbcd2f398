"""What a round did is undone when it is taken back, or it is told what cannot be."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from fakes import said
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.search import Search
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.types import Action
from talks import Talk

CATALOGUE = Catalogue(Catalogue.load().items[::40])
SEARCH = Search(CATALOGUE)
SCENES = ("Kitchen1", "LivingRoom1", "Bedroom1", "Bathroom1")
COUNTS = [60, pytest.param(600, marks=pytest.mark.slow)]
AIM = "I'm having guests"


@pytest.mark.parametrize("count", COUNTS)
def test_baskets_come_back(count: int, record_property: Callable[[str, object], None]) -> None:
    rng = random.Random(8)
    undone = 0
    while undone < count:
        shop = GroceryShop(CATALOGUE, search=SEARCH)
        talk, states = Talk(shop), [shop.basket]
        for _ in range(rng.randint(1, 6)):
            held = [Action("remove item", name) for name in shop.basket]
            added = [
                Action("add item", rng.choice(CATALOGUE.items).name, rng.randint(1, 3))
                for _ in range(rng.randint(1, 4))
            ]
            talk.say(AIM, guesses=[*added, *held[: rng.randint(0, 1)]])
            states.append(shop.basket)
        while len(states) > 1:
            states.pop()
            assert talk.say("Undo that.").takes_back
            assert shop.basket == states[-1]
            undone += 1
    record_property("measured", f"{undone:,} rounds in the shop: the basket before each")


@pytest.mark.parametrize("count", COUNTS)
def test_rooms_come_back_or_what_stays_is_told(
    count: int, record_property: Callable[[str, object], None]
) -> None:
    rng = random.Random(8)
    undone = told = 0
    while undone < count:
        robot = HomeRobot(HouseController(rng.choice(SCENES)))
        talk = Talk(robot)
        for _ in range(4):
            before = robot.status()
            acts: list[Action] = []
            for _ in range(rng.randint(1, 5)):
                offers = robot.actions([rng.choice(robot.kinds("", 99))], said(AIM))
                free = [each for each in offers if not robot.permission(each, said(AIM))]
                action = rng.choice([*free, Action("open", "fridge")])
                if robot.step(action).ok:
                    acts.append(action)
            robot.reset()
            assert all(robot.step(each.action).ok for each in talk.history)
            talk.say(AIM, guesses=acts)
            back = talk.say("Undo that.")
            undone += 1
            stays = [note for note in back.notes if note.startswith("I cannot undo that: ")]
            told += bool(stays)
            assert robot.status() == before or stays, (acts, back.notes)
    record_property(
        "measured",
        f"{undone:,} rounds in four rooms: the room before each, but for {told:,} of which it is "
        "told what stays",
    )
