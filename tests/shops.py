"""The shipped shop, and what it does of what is said in it."""

from __future__ import annotations

from collections.abc import Mapping

from fakes import said
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.search import Search
from goalscope.types import Action

__all__ = ["CATALOGUE", "SEARCH", "shop", "talked"]

CATALOGUE = Catalogue.load()
SEARCH = Search(CATALOGUE)


def shop(basket: Mapping[str, int] | None = None) -> GroceryShop:
    """A shop with these things in its basket."""
    opened = GroceryShop(CATALOGUE, search=SEARCH)
    for name, number in (basket or {}).items():
        assert opened.step(Action("add item", name, number)).ok
    return opened


def talked(basket: Mapping[str, int], *utterances: str) -> tuple[GroceryShop, list[str]]:
    """The shop after these utterances, and what was told of the newest."""
    opened = shop(basket)
    told: list[str] = []
    for number in range(1, len(utterances) + 1):
        turns = said(*utterances[:number])
        asks = opened.answer(turns[-1].utterance) is not None
        results = [opened.step(action) for action in ([] if asks else opened.requests(turns))]
        assert all(result.ok for result in results)
        told = [] if asks else opened.unmet(turns, results)
    return opened, told
