"""Answers to a person's questions about stock, prices and the basket."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Protocol

from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.words import contains, singulars
from goalscope.envs.speech import LEAD, evened

__all__ = ["Stock", "answered"]

_NAMED = 5
"""Items that an answer names at most."""

_THE = r"(?:the |a |an |any |some |one |your |that |this )?"
_IN_BASKET = r"(?:in|into) (?:the|my|our) (?:basket|cart)"

_BASKET = re.compile(
    rf"{LEAD}(?:what(?:'s| is| do (?:i|we) have| have (?:i|we) got| have you added| did you add)"
    rf"(?: now| currently| so far)? {_IN_BASKET}.*"
    r"|(?:can|could|may) (?:i|we|you) (?:see|show(?: me)?|read(?: me)?|list) (?:the|my) "
    r"(?:basket|cart).*|is (?:the|my) (?:basket|cart) empty)"
)
_TOTAL = re.compile(
    rf"{LEAD}(?:(?:what(?:'s| is)|how much is|how much are) (?:the|my) (?:grand )?"
    r"(?:total|sum|bill|basket|cart|order)(?: (?:price|cost|so far|now|total))*"
    r"|how much (?:is|does|do|will|would|are) (?:it|this|that|everything|all of (?:it|this|that)|i)"
    r"(?: all)?(?: together)?(?: (?:cost|come to|be|owe))?"
    r"(?: (?:in total|altogether|so far|now|me|all))*)"
)
_PRICE = re.compile(
    rf"{LEAD}(?:how much (?:is|are|does|do|would|will|for) {_THE}(.+?)(?: cost| be)?"
    rf"|what (?:does|do) {_THE}(.+?) cost|what(?:'s| is) the (?:price|cost) (?:of|for) {_THE}(.+?))"
)
_HELD = re.compile(rf"{LEAD}(?:is|are) (?:there )?{_THE}(.+?) (?:already )?{_IN_BASKET}")
_STOCK = re.compile(
    rf"{LEAD}(?:(?:what|which)(?: (?:kinds?|sorts?|types?|brands?|varieties) of)? (.+?) "
    r"(?:do|have|can|are) (?:you|there)(?: (?:have|got|sell|offer|carry|stock|recommend"
    r"|guys have))*"
    rf"|(?:do|can) you (?:(?:also |even |still )?(?:have|sell|carry|stock|offer)) {_THE}(.+?)"
    rf"|have you(?: got)? {_THE}(.+?)|(?:is|are) there {_THE}(.+?)"
    r"|what do you have (?:in|for|by way of|in the way of) (.+?))"
    r"(?: in stock| available| here| left| there| today| on offer)*"
)


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


def answered(question: str, shop: Stock) -> str | None:
    """The answer to `question`, or None where it is no question about stock or basket."""
    text = evened(question)[:300].rstrip(" ?!.")
    if _BASKET.fullmatch(text):
        return shop.status()
    if _TOTAL.fullmatch(text):
        return f"The total is {shop.catalogue.money(shop.total)}."
    if match := _HELD.fullmatch(text):
        return _held(match[1], shop)
    if match := _PRICE.fullmatch(text):
        return _offered(next(filter(None, match.groups())), shop)
    if match := _STOCK.fullmatch(text):
        return _offered(next(filter(None, match.groups())), shop)
    return None


def _offered(term: str, shop: Stock) -> str:
    """The items that are `term`, with prices; or the nearest ones, said to be such."""
    found = shop.search(term, 2 * _NAMED)
    asked = singulars(term)
    exact = [item for item in found if contains(singulars(item.name), asked)]
    if not found:
        return "The shop has nothing of that name."
    money = shop.catalogue.money
    listed = "; ".join(f"{i.name}, {money(i.price)}" for i in (exact or found)[:_NAMED])
    if exact:
        return f"The shop has {listed}."
    return f"The shop has nothing called that. Near it: {listed}."


def _held(term: str, shop: Stock) -> str:
    asked = singulars(term)
    held = [f"{n} x {name}" for name, n in shop.basket.items() if contains(singulars(name), asked)]
    return f"Yes: {'; '.join(held)}." if held else "No, the basket holds nothing of that name."
