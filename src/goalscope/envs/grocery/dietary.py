"""Diets and allergies: which items fit a person's limits, which do not, and which nobody knows.

What is not known to fit is never said to fit. Labels decide first, then the words of the name, then
what the item is: a banana and a cake pan need no label.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import lru_cache
from typing import Literal

from goalscope.base.nouns import contains
from goalscope.base.types import shortlist
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.diets import (
    DIETS,
    Claims,
    diet_named,
    finder,
    folded,
    is_plain,
    phrases,
    read_label,
)
from goalscope.envs.grocery.natures import is_made, nature
from goalscope.language.amounts import same_currency
from goalscope.language.dialogue_state import GRAVE, DialogueState, exceptions
from goalscope.language.orders import Order

Verdict = Literal["fits", "unknown", "violates"]

_GOODS = frozenset(("food", "product", "thing", "stuff", "diet", "item", "option", "meal"))
"""Words that do not identify a diet: "vegan food"."""

_AISLES = re.compile(r"[,&/>+]|\band\b", re.IGNORECASE)

_MERE = frozenset(("fresh", "frozen", "chilled", "organic", "ice", "product", "counter", "other"))
"""Words that leave an aisle what it is: "frozen fish"."""

_NAMED = 5  # items that are named at most as not known to fit


@lru_cache(maxsize=65536)
def labelled(item: Item) -> frozenset[str]:
    """The restrictions of `DIETS` that the labels of an item or its name claim."""
    return _claims(item).fits | read_label(item.name, is_name=True).fits


@lru_cache(maxsize=65536)
def verdict(item: Item, restriction: str, *, is_labelled: bool = False) -> Verdict:
    """Whether an item fits a restriction of `DIETS`, as far as that is known.

    A label decides. Then a name fits that says so ("vegan", "sugar-free"), and one violates that
    holds a violating phrase. Things that are no food fit, and so do plain foods (see `is_plain`).
    An aisle of violating things makes the others violate. All else is unknown.

    Args:
        item: The item.
        restriction: A name in `DIETS`.
        is_labelled: Whether the catalogue labels this restriction at all: where nothing but a label
            makes an item fit, as for "organic", the others then violate it.

    Raises:
        KeyError: `DIETS` has no such restriction.
    """
    diet = DIETS[restriction]
    claims, either = _claims(item), {restriction, *diet.implied}
    if restriction in claims.violates:
        return "violates"
    if claims.fits & either:
        return "fits"
    if restriction in claims.hints:
        return "violates"
    name = finder(diet.saving).sub("|", " ".join(folded(item.name)))
    of_aisle = read_label(item.category)
    if finder(diet.harmless).search(name) or (diet_named(item.category) and of_aisle.fits & either):
        return "fits"
    if not diet.violating:
        return "violates" if is_labelled else "unknown"
    violating = finder(diet.violating)
    is_named = bool(violating.search(name))
    if not is_named and is_plain(item.name, diet.known) and not is_made(item.category):
        return "fits"
    kind = nature(item.name, item.category)
    if kind == "thing" or (kind == "mixture" and not is_named):
        return "fits"
    if is_named or restriction in of_aisle.violates:
        return "violates"
    aisles = [" ".join(folded(part)) for part in _AISLES.split(item.category) if part.strip()]
    rests = [violating.subn("", finder(diet.saving).sub("|", aisle)) for aisle in aisles]
    is_theirs = rests and all(found and _MERE.issuperset(rest.split()) for rest, found in rests)
    return "violates" if is_theirs else "unknown"


def _claims(item: Item) -> Claims:
    claims = Claims()
    for tag in item.tags:
        claims |= read_label(tag)
    return claims


@lru_cache(maxsize=65536)
def _lacks(item: Item, thing: str) -> Verdict:
    """Whether an item is free of a thing that is no restriction of `DIETS`, such as kiwi."""
    if contains(folded(item.name), folded(thing)):
        return "violates"
    is_alone = is_plain(item.name) and not is_made(item.category)
    is_clear = is_alone or nature(item.name, item.category) != "food"
    return "fits" if is_clear else "unknown"


@dataclass(frozen=True, slots=True)
class Bounds:
    """The bounds that rule out items.

    Attributes:
        diets: Restrictions of `DIETS` that bind the whole basket.
        some: Restrictions that only some people follow: they bind what is guessed, and among
            several things that an order may mean, those that fit are preferred.
        avoided: Names that items must not have.
        budget: Maximum total, in the shop's currency; None for no budget.
        grave: Those of the restrictions and avoided names that an allergy or a diet is behind: of
            these, a guess must be known to fit.
        labelled: Restrictions that the catalogue labels.
        excepted: Bounds with the names of items that they do not rule out; a grave bound rules
            out those, too.
    """

    diets: frozenset[str] = frozenset()
    some: frozenset[str] = frozenset()
    avoided: tuple[str, ...] = ()
    budget: Decimal | None = None
    grave: frozenset[str] = frozenset()
    labelled: frozenset[str] = frozenset()
    excepted: tuple[tuple[str, str], ...] = ()

    def without(self, things: Sequence[str]) -> Bounds:
        """These bounds, and none of some things."""
        return replace(self, avoided=(*self.avoided, *things))

    def suits(self, item: Item) -> bool:
        """Whether no bound at all rules out an item."""
        broken = (d for d in self.some if self._judged(item, d) == "violates")
        return not self.against(item) and not any(broken)

    def surely_suits(self, item: Item) -> bool:
        """Whether no bound at all rules out an item, and it is known to fit the grave ones."""
        bounds = (*self.diets, *self.some, *self.avoided)
        grave = (bound for bound in bounds if bound in self.grave)
        return self.suits(item) and all(self._judged(item, bound) == "fits" for bound in grave)

    def against(self, item: Item) -> str:
        """Why an item is ruled out, as text; "" if it is not."""
        if broken := sorted(d for d in self.diets if self._judged(item, d) == "violates"):
            return f"it has to be {' and '.join(broken)}"
        ruled = next((r for r in self.avoided if self._judged(item, r) == "violates"), "")
        return f'you want no "{ruled}"' if ruled else ""

    def unknown(self, items: Iterable[Item]) -> str:
        """Which of some items nobody knows to fit the bounds of the whole basket; "" for none."""
        items = list(items)
        told: list[str] = []
        for bound in (*sorted(self.diets), *(r for r in self.avoided if r in self.grave)):
            names = [item.name for item in items if self._judged(item, bound) == "unknown"]
            fit = bound if bound in self.diets else f'free of "{bound}"'
            told += [f"Not known to be {fit}: {shortlist(names, _NAMED)}."] if names else []
        return " ".join(told)

    def told(self, restriction: str, items: Iterable[Item]) -> str:
        """Which of some items are known to fit a restriction of `DIETS`, and which are not."""
        is_labelled, told = restriction in self.labelled, list[str]()
        judged = {i.name: verdict(i, restriction, is_labelled=is_labelled) for i in items}
        for way, text in (
            ("fits", "Known to be"),
            ("unknown", "Not known to be"),
            ("violates", "Not"),
        ):
            names = [name for name, fits in judged.items() if fits == way]
            told += [f"{text} {restriction}: {shortlist(names, _NAMED)}."] if names else []
        return " ".join(told)

    def _judged(self, item: Item, bound: str) -> Verdict:
        name = folded(item.name)
        spared = (folded(each) for of, each in self.excepted if of == bound)
        if bound not in self.grave and any(contains(name, each) for each in spared):
            return "fits"
        if bound in self.diets or bound in self.some:
            return verdict(item, bound, is_labelled=bound in self.labelled)
        return _lacks(item, bound)


def bounds_of(dialogue: DialogueState, catalogue: Catalogue) -> Bounds:
    """The bounds that the limits of a dialogue come to in the shop of a catalogue."""
    diets, some, grave = set[str](), set[str](), set[str]()
    avoided: list[str] = []
    excepted: list[tuple[str, str]] = []
    for limit in dialogue.limits:
        if limit.do == "have":
            continue
        found = diets_of(limit)
        bound = {*found}
        (some if limit.for_ and limit.why != "allergy" else diets).update(found)
        bound.update(filter(None, (DIETS[name].guessed for name in found)))
        some.update(bound - found)
        if limit.do == "avoid" and not found:
            avoided.append(avoided_name(limit))
            bound.add(avoided[-1])
        grave.update(bound if limit.why in GRAVE else ())
        excepted += [(of, each) for of in sorted(bound) for each in exceptions(limit)]
    labels = [read_label(tag).fits for tag in catalogue.tags if dialogue.limits]
    budget = dialogue.budget
    binds = budget and not unset_budget(budget, catalogue.currency)
    return Bounds(
        frozenset(diets),
        frozenset(some - diets),
        tuple(filter(None, avoided)),
        Decimal(str(budget.quantity)) if budget and binds else None,
        frozenset(grave),
        frozenset[str]().union(*labels),
        tuple(excepted),
    )


def unset_budget(budget: Order, currency: str) -> str:
    """Why a budget sets no limit to prices in a currency; "" if it does."""
    if budget.quantity is None:
        return "I did not understand how much it may cost. Please say the sum in figures."
    if not budget.unit or same_currency(budget.unit, currency):
        return ""
    return (
        f'The prices here are in {currency}, so "{budget.quantity:g} {budget.unit}" sets no '
        f"limit. Please say the most that it may cost in {currency}."
    )


def avoided_name(limit: Order) -> str:
    """What a thing must not be called; of an allergy the head noun alone, since kinds do not count.

    "Fresh strawberries" rule out strawberry jam.
    """
    return (folded(limit.what) or [""])[-1] if limit.why == "allergy" else limit.what


def diets_of(limit: Order) -> frozenset[str]:
    """The restrictions of `DIETS` that a limit names: by what must be, or by what must not come.

    An allergy names each of which it holds a word, and so does what all must be for more than
    taste: "brazil nuts" rule out all nuts, and "halal meat" asks for halal.
    """
    said = [word for word in folded(limit.what) if word not in _GOODS]
    if limit.do == "only":
        names = {name: f"{name}, {diet.named}" for name, diet in DIETS.items()}
    elif limit.why == "allergy":
        names = {n: f"{diet.avoided}, {diet.allergens}, {diet.named}" for n, diet in DIETS.items()}
    else:
        names = {name: diet.avoided for name, diet in DIETS.items()}
    if limit.why == "allergy" or (limit.do == "only" and limit.why in GRAVE):
        return frozenset(n for n, listed in names.items() if finder(listed).search(" ".join(said)))
    return frozenset(
        name for name, listed in names.items() if said and " ".join(said) in phrases(listed)
    )
