"""What is no act of a domain never changes its state, whoever has planned it."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from goalscope.agent.planner import attempted
from goalscope.base.types import Action
from goalscope.envs import Environment
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.actions import NAMES
from hostile import ORDERS
from shops import SMALL, SMALL_SEARCH

INVENTED = (
    "", "buy", "Buy Basket", "buy_basket", "purchase", "checkout", "pay", "add", "add items",
    "ADD ITEM", "add item ", "remove", "empty basket", "set price", "eval", "__class__", "explode",
    "burn", "Slice", "slice ", "PickupObject", "RemoveObject", "pick_up", "put in", "throw",
    "\x00", "add item\x00", "add\u200b item", None, 7, ("slice",), b"slice", *ORDERS,
)  # fmt: skip
NUMBERS = (
    -1, 0, 100, 10**9, 10**40, 1e9, -1e9, 1.0, 1.5, float("nan"), float("inf"), float("-inf"), "1",
    "", "many", None, True, False, (1,), (1, (2, (3,))), b"1", 1j, Action("add item", "x"),
)  # fmt: skip
NOTHING = (
    "", " ", "x", "everything", "*", "%", "../../etc", "Apple|+00.00|+00.00|+00.00", "-1", "0",
    "'; DROP TABLE items; --", "\ud800", "\x00", "a" * 100_000, "<|im_start|>", None, 3, 1e9,
    float("nan"), ("flour",), ((("egg",),),), b"flour", frozenset({"egg"}),
)  # fmt: skip
NESTED = ([], ["egg"], {"name": "egg"}, [[["egg"]]], {"a": {"b": [1]}}, set(), bytearray(b"egg"))
"""What cannot even be told apart from itself."""


class Watched(HouseController):
    """Counts what it is asked to do."""

    asked = 0

    def step(self, action: Any = None, **arguments: Any) -> Any:
        self.asked += 1
        return super().step(action, **arguments)


class Stocked(GroceryShop):
    """A shop in whose basket there is something from the start."""

    def reset(self) -> None:
        super().reset()
        for item in SMALL.items[:3]:
            self.step(Action("add item", item.name, 2))


def invented(
    rng: random.Random, count: int, verbs: Sequence[str], names: Sequence[str]
) -> list[Action]:
    """Acts in which one thing at least is none."""
    found: list[Action] = []
    while len(found) < count:
        name: Any = rng.choice(verbs)
        target: Any = rng.choice(names)
        number: Any = 1
        place: Any = rng.choice(names) if name == "put" else ""
        broken = rng.sample(["name", "target", "number"], rng.randint(1, 3))
        if "name" in broken:
            name = rng.choice(INVENTED)
        if "target" in broken:
            target = rng.choice((*NOTHING, *NESTED))
        if "number" in broken:
            number = rng.choice((*NUMBERS, *NESTED))
        if rng.random() < 0.1:
            place = rng.choice(("nowhere", *NOTHING[1:], *NESTED))
        action = Action(name, target, number, place)
        if action not in (Action("buy basket"), Action("finish")):
            found.append(action)
    return found


def is_hashable(action: Action) -> bool:
    try:
        hash(action)
    except TypeError:
        return False
    return True


@pytest.mark.parametrize("count", [1_000, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("domain", ["shop", "house"])
def test_acts_that_are_invented_never_reach_the_state(
    domain: str, count: int, figure: Callable[[str], None]
) -> None:
    rng = random.Random(4)
    controller = Watched("Kitchen1")
    env: Environment
    if domain == "shop":
        env = Stocked(SMALL, search=SMALL_SEARCH)
        env.reset()
        names = [each.name for each in SMALL.items]
        acts = invented(rng, count, ("add item", "remove item", "buy basket"), names)
    else:
        env = robot = HomeRobot(controller)
        acts = invented(rng, count, NAMES, [*robot.names.values()])
    before = env.state().fingerprint
    for action in acts:
        result = env.step(action)
        assert not result.ok, action
        assert result.observation
        assert env.state().fingerprint == before, action
    planned = [each for each in acts if is_hashable(each)][: count // 10]
    for action in planned:
        done, problem = attempted(env, [action], [])
        assert problem is not None
        assert done == []
        assert env.state().fingerprint == before
    assert controller.asked == 0
    figure(f"{len(acts) + len(planned):,} invented acts in the {domain}: 0 done")


def test_what_is_left_of_such_acts_once_they_are_mended_is_done() -> None:
    """Else the test above could not fail."""
    item = SMALL.items[0].name
    env = GroceryShop(SMALL, search=SMALL_SEARCH)
    assert all(env.step(Action(name, item)).ok for name in ("add item", "remove item", "add item"))
    assert env.step(Action("buy basket")).ok
    robot = HomeRobot(HouseController("Kitchen1"))
    assert robot.step(Action("put", "apple", destination="fridge")).ok
    assert robot.step(Action("slice", "bread")).ok
