"""The shipped shop, and what it does of orders in canonical English."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from goalscope.base.types import Action, StepResult
from goalscope.envs import Resolution, execute
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.search import Search
from goalscope.language.dialogue_state import DialogueState, fold
from goalscope.language.matcher import Matcher
from goalscope.language.orders import Order, Reading, orders_from_text

CATALOGUE = Catalogue.load()
SEARCH = Search(CATALOGUE)
PICK = Matcher()
SMALL = Catalogue(CATALOGUE.items[::40])
SMALL_SEARCH = Search(SMALL)


def shop(basket: Mapping[str, int] | None = None) -> GroceryShop:
    """A shop with these things in its basket."""
    opened = GroceryShop(CATALOGUE, search=SEARCH)
    for name, number in (basket or {}).items():
        assert opened.step(Action("add item", name, number)).ok
    return opened


def state_after(*said: str) -> DialogueState:
    """What holds after messages that stand in canonical English, with "; " between orders."""
    return fold([reading(each) for each in said])


def reading(said: str) -> Reading:
    """A message in canonical English."""
    return Reading(orders_from_text(said.replace("; ", "\n"), GroceryShop.verbs))


def follow(opened: GroceryShop, *said: str) -> list[str]:
    """Do what messages order, one after another; returns what was told."""
    told: list[str] = []
    readings: list[Reading] = []
    for each in said:
        readings.append(reading(each))
        warnings: list[str] = []
        for order in readings[-1].orders:
            binding = fold(readings).beside(order, readings[-1].orders)
            found = opened.resolve(order, binding, PICK)
            told += [found.why] if found.why else []
            assert all(execute(opened, action).ok for action in found.actions)
            warnings += [found.warning] if found.warning else []
        told += warnings
    return told


def undone(
    opened: GroceryShop, results: Sequence[StepResult], dialogue: DialogueState
) -> Resolution:
    """What undoes some results."""
    return opened.resolve(Order("undo"), replace(dialogue, to_undo=tuple(results)), PICK)


def ordered(said: Sequence[str], basket: Mapping[str, int] | None = None) -> dict[str, int]:
    """The basket after messages."""
    opened = shop(basket)
    follow(opened, *said)
    return opened.basket
