"""The shipped shop, and what it does of what is said in it."""

from __future__ import annotations

from collections.abc import Mapping

from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.search import Search
from goalscope.types import Action
from talks import Talk

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
    talk = Talk(opened)
    for each in utterances:
        talk.say(each)
    return opened, talk.told
