"""A plan that fails leaves no trace, but for what nobody can undo, and that is told."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from fakes import Plans, WordModel, plans, said
from goalscope.agent.agent import Agent
from goalscope.base.types import Action, GoalscopeError, StepResult
from goalscope.envs import Environment
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.actions import NAMES
from goalscope.envs.house.simulator.object_types import LASTING, PREDICATES
from goalscope.language.dialogue_state import DialogueState
from shops import SMALL, SMALL_SEARCH

SCENES = ("Kitchen1", "LivingRoom1", "Bedroom1", "Bathroom1")
COUNTS = [100, pytest.param(1_000, marks=pytest.mark.slow)]
STAYS = [each for each in PREDICATES if each not in ("isPickedUp", "parentReceptacles")]
STAYS.remove("temperature")  # which returns by itself
STATES = (*STAYS, "fillLiquid")
"""What of a thing an act can change, besides where it is and how warm."""


def shopping(rng: random.Random) -> Iterator[Action]:
    while True:
        name = rng.choice(SMALL.items).name
        yield Action(rng.choice(["add item", "add item", "remove item"]), name, rng.randint(1, 3))


def housework(rng: random.Random, robot: HomeRobot) -> Iterator[Action]:
    names = robot.names
    frail = [names[each["objectId"]] for each in robot.metadata["objects"] if each["breakable"]]
    while True:
        offers = robot.actions(rng.choice(robot.offers("", 99)), DialogueState())
        yield rng.choice([*offers, Action("break", rng.choice(frail)), Action("open", "fridge")])


def state(robot: HomeRobot) -> dict[str, Any]:
    return {each["objectId"]: [each[name] for name in STATES] for each in robot.metadata["objects"]}


@pytest.mark.parametrize("count", COUNTS)
def test_a_failed_plan_leaves_the_basket_as_it_was(
    count: int, figure: Callable[[str], None]
) -> None:
    rng = random.Random(6)
    shop, history = GroceryShop(SMALL, search=SMALL_SEARCH), list[StepResult]()
    acts, failed = shopping(rng), 0
    while failed < count:
        before = shop.state().fingerprint
        plan = [next(acts) for _ in range(rng.randint(0, 6))]
        if rng.random() < 0.9:
            item = SMALL.items[0].name
            bad = [Action("remove item", item, 99), Action("add item", "none such"), Action("fly")]
            plan.insert(rng.randint(0, len(plan)), rng.choice(bad))
        outcome = Plans(plan).act(shop, [], said("hello"), history, DialogueState())
        if outcome.failed:
            failed += 1
            assert outcome.results == ()
            assert shop.state().fingerprint == before
        history = [*history, *outcome.results][-12:] if outcome.failed else []
        if not history:
            shop.reset()
    figure(f"{failed:,} failed plans in the shop: each undone to the letter")


@pytest.mark.parametrize("count", COUNTS)
def test_a_failed_plan_leaves_the_house_as_it_was(
    count: int, figure: Callable[[str], None]
) -> None:
    rng = random.Random(6)
    failed = round = 0
    while failed < count:
        robot = HomeRobot(HouseController(SCENES[round % len(SCENES)]))
        acts, round = housework(rng, robot), round + 1
        for _ in range(25):
            before = robot.state().fingerprint
            plan = [next(acts) for _ in range(rng.randint(0, 3))]
            bad = rng.choice([Action("fly"), Action("put", next(acts).target, destination="moon")])
            plan.insert(rng.randint(0, len(plan)), bad)
            outcome = Plans(plan).act(robot, [], said("hello"), [], DialogueState())
            assert outcome.failed
            failed += 1
            assert outcome.results == ()
            assert robot.state().fingerprint == before
        assert not any(each[own] for each in robot.metadata["objects"] for own in LASTING)
    figure(f"{failed:,} failed plans in the house: each undone to the letter")


class Leaking(GroceryShop):
    """A shop in which, after the second reset, something lies in the basket."""

    resets = 0

    def reset(self) -> None:
        super().reset()
        self.resets += 1
        if self.resets > 1:
            self.step(Action("add item", SMALL.items[5].name))


class Moving(HouseController):
    """A house in which things are elsewhere after the second reset."""

    resets = 0

    def reset(self) -> Any:
        event = super().reset()
        self.resets += 1
        if self.resets > 2:
            own = next(each for each in self._house.state.objects if each.startswith("Apple"))
            self._house.state.objects[own]["isDirty"] = True
            event.metadata["objects"] = self._house.metadata()["objects"]
        return event


@pytest.mark.parametrize("domain", ["shop", "house"])
def test_where_undoing_leads_elsewhere_the_agent_stops_and_says_so(domain: str) -> None:
    env: Environment
    if domain == "shop":
        env, good = Leaking(SMALL, search=SMALL_SEARCH), Action("add item", SMALL.items[0].name)
        env.reset()
    else:
        env, good = HomeRobot(Moving("Kitchen1")), Action("put", "tomato", destination="fridge")
    agent = Agent(env, WordModel(), method="no-goals")
    plans(agent, Plans([good, Action("fly")]))
    with pytest.raises(
        GoalscopeError, match=r"another state than before, so that the agent\s+stops"
    ):
        agent.step("What?", "hello there, my friend")
    assert agent.rounds == []


def restored(robot: HomeRobot, act: Action) -> bool:
    """Whether another act, on anything that `act` has changed, leads back from what it led to."""
    robot.reset()
    start = state(robot)
    assert robot.step(act).ok
    changed = [own for own, now in state(robot).items() if start.get(own) != now]
    for own in changed:
        for name in NAMES:
            if robot.step(Action(name, robot.names[own])).ok:
                if state(robot) == start:
                    return True
                robot.reset()
                robot.step(act)
    return False


@pytest.mark.parametrize(
    "scene", ["Bathroom1", *(pytest.param(each, marks=pytest.mark.slow) for each in SCENES[:3])]
)
def test_an_act_is_marked_irreversible_where_no_other_leads_back_and_nowhere_else(
    scene: str, figure: Callable[[str], None]
) -> None:
    robot = HomeRobot(HouseController(scene))
    start = state(robot)
    marked, free = list[tuple[str, str]](), 0
    for target in [*robot.names.values()]:
        for name in NAMES:
            if name in ("put", "pick up"):
                continue
            result = robot.step(Action(name, target))
            if result.ok and state(robot) != start:
                assert result.irreversible != restored(robot, result.action), result.action
                assert result.observation.endswith("cannot be undone.") == result.irreversible
                marked += [(name, target)] * result.irreversible
                free += not result.irreversible
            if result.ok:
                robot.reset()
    assert all(robot.irreversible(Action(name, robot_target)) for name, robot_target in marked)
    figure(
        f"{scene}: {len(marked)} acts that nothing leads back from, all marked; {free} others not",
    )


def test_a_purchase_alone_is_marked_in_the_shop() -> None:
    shop = GroceryShop(SMALL, search=SMALL_SEARCH)
    name = SMALL.items[0].name
    acts = [Action("search inventory", "milk"), Action("add item", name, 2)]
    acts += [Action("remove item", name), Action("buy basket")]
    assert [shop.step(each).irreversible for each in acts] == [False, False, False, True]
    tried = [
        Action(verb, each.name) for verb in ("add item", "remove item") for each in SMALL.items
    ]
    assert not any(shop.step(each).ok for each in (*tried, Action("buy basket")))
    assert shop.bought
