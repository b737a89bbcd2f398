"""What of the basket or the shop suits a diet, as far as names and labels tell."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Protocol

from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.choosing import called
from goalscope.envs.grocery.hearing.diets import diet, hinted, implied, undieted
from goalscope.envs.grocery.hearing.requests import Refusal
from goalscope.envs.grocery.restrictions import violates
from goalscope.envs.grocery.synonyms import usual
from goalscope.envs.speech import LEAD

__all__ = ["DEPTH", "IN_BASKET", "IN_THIS", "THE", "Bounds", "Stock", "names", "suits"]

_LISTED = 8
"""Items of one kind that an answer about labels names at most."""

_BY_LABEL = ("halal", "organic")
"""What only a label tells: without one, a thing may be so or not."""

DEPTH = 100
"""Items among which a thing, or the cheapest, is looked for."""


THE = r"(?:the |a |an |any |some |one |your |that |this )?"
IN_BASKET = r"(?:in|into) (?:the|my|our) (?:basket|cart)"
IN_THIS = r"(?:in |of )?(?:the|my|our|this|that|there|here|it)(?: (?:basket|cart|order))?"

_SAFE = re.compile(
    rf"{LEAD}(?:is|are|would)(?! there\b) {THE}(.+?)(?: be)?"
    r" (?:safe|ok(?:ay)?|suitable|fine|good|alright) (?:for|with) (.+)"
)
_WHO = (
    r"(?:(?:me|us|him|her|them|you|i|we|he|she|they|everyone|everybody|all of us"
    r"|the (?:guests?|kids?|child|children|boy|girl)|(?:some|any)(?:one|body)"
    r"|(?:my|our) [\w-]+(?: [\w-]+)?)(?: with (?:the|an|that|his|her) (?:[\w-]+ )?allergy)?)"
)
_FOR_WHOM = re.compile(
    rf"{LEAD}(?:is|are|would)(?! there\b) {THE}(?P<term>.+?)(?: be)?"
    rf" (?:safe|ok(?:ay)?|suitable|fine|alright)(?: to eat)? for {_WHO}"
    rf"|{LEAD}(?:can|could|may) {_WHO} eat {THE}(?P<eaten>.+)"
)
"""Whether a thing is for somebody whose diet was told."""
_NOT_FOR = re.compile(
    rf"{LEAD}(?:what|which (?:things?|items?|products?))(?: is| are)?(?: there)?"
    rf"(?: {IN_THIS})?(?: that)? (?:{_WHO} (?:can't|cannot|mustn't|shouldn't|can not)"
    rf"|(?:can't|cannot|mustn't|shouldn't) {_WHO}|(?:can|may|must|should) {_WHO} not)"
    rf" (?:eat|have)(?: {IN_THIS})?"
)
"""What of the basket somebody must not eat."""
_APART = re.compile(r",? (?:apart from|except(?: for)?|besides|other than|but) (?:the |my )?(.+)$")
_FREE = re.compile(
    rf"{LEAD}(?:is|are|would)(?! there\b) {THE}(.+?)(?: be)? (?:free (?:of|from)|without) (.+)"
    rf"|{LEAD}(?:does|do) {THE}(.+?) (?:contain|have|include) (?:any |some )?(.+?)"
    r"(?: in (?:it|them))?"
    rf"|{LEAD}(?:has|have) (?!(?:i|we|you)\b){THE}(.+?) got"
    r" (?!cheaper|dearer|more|less)(?:any |some )?(.+?)"
    r"(?: in (?:it|them))?"
)
_HAS = re.compile(
    rf"{LEAD}(?:(?:is|are) there (?:any |some )?|any )(.+?) in {THE}"
    r"(?!(?:basket|cart|shop|store|it|them|here|there)\b)(.+)"
)
_WITH = (
    r"(?:with|containing|(?:that|which) (?:(?:could|may|might|can|would) )?(?:contains?|has|have))"
    r" (?:any |some )?"
)
_ANY_WITH = re.compile(
    rf"{LEAD}(?:is|are) there (?:anything|something|any (?:things|items|products)) {_WITH}(.+?)"
    rf" {IN_THIS}|{LEAD}what(?:'s| is)(?: there)? {IN_BASKET} {_WITH}(.+)"
)
_WHICH = re.compile(
    rf"{LEAD}(?:which|what)(?: of)? {THE}(?P<term>(?:one|thing|item|product)?s?\b.*?)"
    r"(?: do you (?:have|sell) that)? (?:(?:is|are|would be)"
    r"(?P<how> (?:suitable|safe|ok(?:ay)?|good) for| free (?:of|from))? "
    r"|(?:(?:does|do)(?:n't| not) )?(?:contains?|has|have) )(?:any |some |no )?(?P<what>.+)"
)
_HELD_ALL = re.compile(
    r"(?:(?:any|every)(?:thing)?|all|it all|which|these|those|them|ones?|things?|items?|products?"
    r"|basket|cart)?"
    rf"(?: ?(?:of )?(?:it|this|that|these|those|them)\b)?(?: ?{IN_THIS})?"
)
"""Stands for all that the basket holds."""
_SUITS = re.compile(rf"{LEAD}(?:is|are)(?! there\b) {THE}(.+)")


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

    @property
    def completion_phrase(self) -> str:
        """What a person says to have the basket bought."""
        ...

    def nearness(self, text: str) -> float:
        """Cosine of `text` and the item nearest to it in meaning."""
        ...

    def status(self) -> str:
        """The basket, for people."""
        ...

    def search(self, text: str, limit: int) -> list[Item]:
        """The items nearest in meaning to `text`."""
        ...


@dataclass(frozen=True, slots=True)
class Bounds:
    """What a person said that their basket has to be.

    Attributes:
        diets: Restrictions that bind all of it.
        some: Restrictions that only some people follow.
        budget: What it may cost, in the shop's currency; None for any sum.
        refused: Things that are not wanted.
        harmful: Things that harm somebody.
    """

    diets: frozenset[str] = frozenset()
    some: frozenset[str] = frozenset()
    budget: Decimal | None = None
    refused: tuple[str, ...] = ()
    harmful: tuple[str, ...] = ()


def suits(text: str, shop: Stock, bounds: Bounds) -> str | None:
    """Whether a thing suits a diet, as far as names and tags tell; None where nobody asks it."""
    if re.search(r"[.?!;] ", text):  # more is said than that
        return None
    several = bool(re.match(rf"{LEAD}(?:(?:is|are|do|does) (?:there )?any|which|what)", text))
    diets = sorted(bounds.diets | bounds.some)
    if diets and ((match := _FOR_WHOM.fullmatch(text)) or _NOT_FOR.fullmatch(text)):
        term, what = (match["term"] or match["eaten"]) if match else "everything", ""
    elif (match := _SAFE.fullmatch(text)) and hinted(text) | diet(text):
        term, what = match.groups()
    elif match := _FREE.fullmatch(text):
        term, what = (each for each in match.groups() if each)
    elif match := _ANY_WITH.fullmatch(text):
        term, what = "anything", match[1] or match[2]
    elif match := _HAS.fullmatch(text):
        what, term = match.groups()
        if _HELD_ALL.fullmatch(term) and not implied(what, Refusal.DROPPED):
            return None
    elif match := _WHICH.fullmatch(text):
        term, what = match["term"], match["what"]
        if (match["how"] or "").endswith("for") and not hinted(text) | diet(text):
            return None
    elif (match := _SUITS.fullmatch(text)) and hinted(text):
        term, what = undieted(match[1]), match[1]
    else:
        return None
    if what:
        diets = sorted(hinted(what) | diet(what) | implied(what, Refusal.HARMED))
    held = [item for name in shop.basket if (item := shop.catalogue.get(name))]
    if found := _APART.search(term):
        spared = called(found[1], held)
        held, term = [item for item in held if item not in spared], term[: found.start()]
    term = re.sub(r"^of (?:the |your |my )?", "", term)
    if _HELD_ALL.fullmatch(term):
        items, several = held, True
    else:
        near = shop.search(term, DEPTH)
        items = (
            _all_called(term, near) if several else (called(term, held) or called(term, near))[:1]
        )
    return _labelled(items, diets, every=several) if items and (diets or not several) else None


def _all_called(term: str, items: Sequence[Item]) -> list[Item]:
    """What of `items` a term names; none where it may mean others, too, as chocolate does bars."""
    found = called(term, items)
    others = (item for name in usual(term) for item in called(name, items))
    return found if set(found).issuperset(others) else []


def _labelled(items: Sequence[Item], diets: Iterable[str], *, every: bool) -> str:
    """Which of the items are labelled for diets; of one alone, or where not of `every`, the worst.

    Nothing is said to be safe: names and labels do not tell it.
    """
    told: list[str] = []
    for name in diets:
        against = [item for item in items if violates(item, name)]
        unsure = [item for item in items if name not in item.tags and item not in against]
        listed = [item for item in items if name in item.tags]
        groups = {
            f"Listed as {name}": listed,
            f"I cannot tell whether {'these are' if unsure[1:] else 'this is'} {name}": unsure,
            f"Not {'labelled as ' if every and name in _BY_LABEL else ''}{name}": against,
        }
        found = [(how, group) for how, group in groups.items() if group]
        told += [f"{how}: {names(group)}." for how, group in (found if every else found[-1:])]
    return " ".join([*told, "I know only names and categories, so please read the label."])


def names(items: Sequence[Item]) -> str:
    """The names of items, for people: the first ones, and how many more there are."""
    more = f", and {len(items) - _LISTED} more" if len(items) > _LISTED else ""
    return f"{', '.join(item.name for item in items[:_LISTED])}{more}"
