"""What the shop answers about its items and the basket."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal

from goalscope.base.nouns import names, singulars
from goalscope.base.types import shortlist
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.choosing import Chooser
from goalscope.envs.grocery.dietary import Bounds, diets_of, verdict
from goalscope.envs.grocery.diets import DIETS, diet_named, finder, folded
from goalscope.language.orders import Order

_SHOWN = 10
"""Most items that an answer lists."""

_MENTIONS = 4
"""Most things that a question is answered for besides the one that was read."""

_WHOLE = frozenset({
    "basket", "cart", "total", "budget", "order", "price", "cost", "bill", "money", "everything",
    "it", "all",
})  # fmt: skip
"""Words for the basket as a whole."""

_CLAIMED = finder(",".join(diet.labels for diet in DIETS.values()))
_AVOIDED = finder(",".join(diet.avoided for diet in DIETS.values()))
_SERVES = re.compile(r"\bserves (\d{1,3})\b|\b(\d{1,3}) servings?\b", re.IGNORECASE)
"""The number of people in the size or on a label of an item."""


@dataclass(frozen=True, slots=True)
class ShopAnswers:
    """Answers by a basket.

    Attributes:
        catalogue: What the shop sells.
        chooser: Finds the items that are meant.
        basket: Number of units of each item in it.
        total: Its price.
        bounds: What its items must be.
    """

    catalogue: Catalogue
    chooser: Chooser
    basket: Mapping[Item, int]
    total: Decimal
    bounds: Bounds

    def to(self, question: Order, said: str) -> str:
        """The facts about a thing, such as its price and labels; by default, about the basket."""
        about = " ".join(word for word in singulars(question.what) if word not in _WHOLE)
        mentioned = self.chooser.mentions(said)[:_MENTIONS]
        said = " ".join(folded(said))
        claimed = None if about else _CLAIMED.search(said)
        if self.basket and (diet := diet_named(claimed[0] if claimed else about)):
            return self.bounds.told(diet, self.basket)
        if question.about in ("any", "count", "enough"):
            avoided = _AVOIDED.search(said)
            about = about or (avoided[0] if avoided else " ".join(mentioned[:1]))
            if about or question.about != "any":
                facts = self._facts(about) if about else ""
                return self._amount(question, about) or f"{_lacking(about)} {facts}".strip()
        if about:
            asked = (question.what, *(e for e in mentioned if not names(question.what, e)))
            return "\n".join(map(self._facts, asked))
        told = self._cost()
        if question.about == "total":
            return told
        held = f"holds {self._counted(self.basket)}" if self.basket else "is empty"
        parts = (f"The basket {held}.", told, self.bounds.unknown(self.basket))
        return " ".join(filter(None, parts))

    def _facts(self, about: str) -> str:
        return self.chooser.facts(about, self.basket, self.bounds)

    def _cost(self) -> str:
        money, budget = self.catalogue.money, self.bounds.budget
        if budget is None:
            return f"It comes to {money(self.total)}."
        left = budget - self.total
        way = "above" if left < 0 else "below"
        return (
            f"It comes to {money(self.total)}, {money(abs(left))} {way} the {money(budget)} that "
            "you named."
        )

    def _amount(self, question: Order, about: str) -> str:
        """Whether there is any of a thing, how many, or for how many it will do; "" for none."""
        held = self.chooser.held(about, [*self.basket]) if about else [*self.basket]
        match question.about:
            case "enough":
                return self._servings(held)
            case "count":
                number = sum(self.basket[item] for item in held)
                return f"{number} in all: {self._counted(held)}." if held else ""
            case _:
                return self._any(about, held)

    def _servings(self, held: Iterable[Item]) -> str:
        told, unlabelled = list[str](), list[str]()
        for item in held:
            if serves := _serves(item):
                told.append(f"{item.name} serves {serves * self.basket[item]}")
            else:
                unlabelled.append(item.name)
        if unlabelled:
            told.append(f"No label tells for how many {shortlist(unlabelled, _SHOWN)} will do")
        return f"{'; '.join(told)}." if told else ""

    def _any(self, about: str, held: list[Item]) -> str:
        """Whether the basket holds any of a thing, or of what a diet of that name avoids."""
        unsure, diets = list[str](), sorted(diets_of(Order("avoid", about)))
        for diet in diets:
            verdicts = {item: verdict(item, diet) for item in self.basket if item not in held}
            held = [*held, *(item for item, found in verdicts.items() if found == "violates")]
            unsure += [item.name for item, found in verdicts.items() if found == "unknown"]
        told = f"Yes: {self._counted(held)}." if held else _lacking(about) if diets else ""
        return f"{told} Not known: {shortlist(unsure, _SHOWN)}." if unsure else told

    def _counted(self, items: Iterable[Item]) -> str:
        return shortlist([f"{self.basket[item]} x {item.name}" for item in items], _SHOWN)


def _lacking(about: str) -> str:
    none = f'There is no "{about}" in the basket, as far as names and labels tell.'
    return none if about else "The basket is empty."


def _serves(item: Item) -> int:
    """For how many people one unit is, as its size or labels say; 0 where they do not."""
    found = _SERVES.search("; ".join((item.unit, *sorted(item.tags))))
    return int(found[1] or found[2]) if found else 0
