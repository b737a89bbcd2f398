"""What a round did is undone when it is taken back, or it is told what cannot be."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from fakes import Plans, WordModel, plans
from goalscope.agent.agent import Agent
from goalscope.base.types import Action
from goalscope.envs import Environment, is_irreversible
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.language.dialogue_state import DialogueState
from shops import SMALL, SMALL_SEARCH

SCENES = ("Kitchen1", "LivingRoom1", "Bedroom1", "Bathroom1")
COUNTS = [60, pytest.param(600, marks=pytest.mark.slow)]


def rounds_of(env: Environment, draw: Callable[[], list[Action]], agent: Agent) -> list[str]:
    """States before each of some rounds, in which what is drawn was done, and after them."""
    states = [env.state().fingerprint]
    for _ in range(4):
        plans(agent, Plans(draw()))
        agent.step("", "I am having guests.")
        states.append(env.state().fingerprint)
    return states


@pytest.mark.parametrize("count", COUNTS)
def test_baskets_come_back(count: int, figure: Callable[[str], None]) -> None:
    rng = random.Random(8)
    undone = 0
    while undone < count:
        shop = GroceryShop(SMALL, search=SMALL_SEARCH)
        agent = Agent(shop, WordModel(), method="no-goals")

        def draw(shop: GroceryShop = shop) -> list[Action]:
            held = [Action("remove item", name) for name in shop.basket]
            added = [
                Action("add item", rng.choice(SMALL.items).name, rng.randint(1, 3))
                for _ in range(rng.randint(1, 4))
            ]
            return [*added, *held[: rng.randint(0, 1)]]

        states = rounds_of(shop, draw, agent)
        while len(states) > 1:
            states.pop()
            assert agent.step("", "undo").retracts
            assert shop.state().fingerprint == states[-1]
            undone += 1
    figure(f"{undone:,} rounds in the shop: the basket before each")


@pytest.mark.parametrize("count", COUNTS)
def test_rooms_come_back_or_what_stays_is_told(count: int, figure: Callable[[str], None]) -> None:
    rng = random.Random(8)
    undone = told = lasted = 0
    while undone < count:
        robot = HomeRobot(HouseController(rng.choice(SCENES)))
        agent = Agent(robot, WordModel(), method="no-goals")
        for _ in range(3):
            names = rng.sample(robot.offers("", 99), 9)
            offers = [each for name in names for each in robot.actions(name, DialogueState())]
            lasts = [each for each in offers if is_irreversible(robot, each)]
            free = [Action("open", "fridge"), *(each for each in offers if each not in lasts)]
            before, is_ordered = robot.state().text, bool(lasts) and rng.random() < 0.6
            plans(agent, Plans([] if is_ordered else [rng.choice(free)]))
            act = rng.choice(lasts) if is_ordered else None
            done = agent.step("", f"{act.name} {act.target}" if act else "I am having guests.")
            if done.question:
                done = agent.step(done.question, "yes")
            if not done.results:
                continue
            back = agent.step("", "undo")
            undone += 1
            stays = [note for note in back.notes if not note.startswith("Taken back")]
            told += bool(stays)
            lasted += any(each.irreversible for each in done.results)
            assert robot.state().text == before or stays, (done.results, back.notes)
    assert lasted > count // 20, "else nothing stayed"
    figure(
        f"{undone:,} rounds in four rooms, {lasted:,} with what cannot be undone: the room before "
        f"each, but for {told:,} of which it is told what stays",
    )
