"""Answers to a person's questions: the facts of what they ask about."""

from __future__ import annotations

from decimal import Decimal
from typing import Protocol

from goalscope.envs.grocery.bounds import Bounds
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.choosing import Choice, called
from goalscope.words import singulars

__all__ = ["Stock", "told_of"]

_NAMED = 5
"""Items that an answer names at most."""

_LABELLED = 2
"""Most items of which an answer tells the labels."""

_DEPTH = 100
"""Items among which a thing is looked for."""

_WHOLE = frozenset({
    "basket", "cart", "total", "budget", "order", "price", "cost", "bill", "money", "everything",
    "it", "all",
})  # fmt: skip
"""Words for the basket as a whole."""

_CAUTION = "I know only names and labels, so please read the packet."


class Stock(Protocol):
    """What the answers are read from."""

    @property
    def catalogue(self) -> Catalogue:
        """What is sold."""
        ...

    @property
    def basket(self) -> dict[str, int]:
        """Item name to quantity."""
        ...

    @property
    def total(self) -> Decimal:
        """Price of the basket."""
        ...

    def status(self) -> str:
        """The basket, for people."""
        ...

    def search(self, text: str, limit: int) -> list[Item]:
        """The items nearest in meaning to `text`."""
        ...


def told_of(what: str, shop: Stock, choice: Choice, bounds: Bounds) -> str:
    """What there is to say of a thing of the shop or basket; of nothing, of the whole basket."""
    if _WHOLE.issuperset(singulars(what)):
        return _whole(shop, bounds)
    near = shop.search(what, _DEPTH)
    found = called(what, near)
    if not found and (item := choice.meant(what, Bounds())):
        found = [item]
    if not found:
        named = "; ".join(_line(item, shop) for item in near[:_NAMED])
        return f'The shop has nothing called "{what}".{f" Near it: {named}." if named else ""}'
    found.sort(key=lambda item: item.name not in shop.basket)
    few = len(found) <= _LABELLED
    listed = "; ".join(_line(item, shop, labels=few) for item in found[:_NAMED])
    more = f"; and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    against = [f"{item.name}: {why}." for item in found[:_NAMED] if (why := bounds.against(item))]
    told = [f"The shop has {listed}{more}.", *against, *([_CAUTION] if few else [])]
    return " ".join(told)


def _whole(shop: Stock, bounds: Bounds) -> str:
    """The basket, what is left of the budget, and what binds it."""
    told = [shop.status()]
    if bounds.budget is not None:
        named, left = shop.catalogue.money(bounds.budget), bounds.budget - shop.total
        money = shop.catalogue.money(abs(left))
        told.append(
            f"That is {money} above the {named} that you named."
            if left < 0
            else f"That leaves {money} of the {named} that you named."
        )
    if bounds.diets:
        told.append(f"All of it has to be {' and '.join(sorted(bounds.diets))}.")
    if bounds.some:
        told.append(f"For some, it has to be {' and '.join(sorted(bounds.some))}.")
    if bounds.refused:
        told.append(f"You want no {', no '.join(bounds.refused)}.")
    return "\n".join(told)


def _line(item: Item, shop: Stock, *, labels: bool = False) -> str:
    """An item with its price, perhaps its labels, and how many of it the basket holds."""
    unit = f" ({item.unit})" if item.unit not in ("", "each") else ""
    tags = f", labelled {', '.join(sorted(item.tags))}" if labels and item.tags else ""
    held = shop.basket.get(item.name, 0)
    within = f", {held} in the basket" if held else ""
    return f"{item.name}{unit}, {shop.catalogue.money(item.price)}{tags}{within}"
