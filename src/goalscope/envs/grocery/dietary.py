"""Diets and allergies: which items a person's limits rule out."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from importlib.resources import files

from goalscope.envs.grocery.catalogue import Item
from goalscope.orders import Order
from goalscope.standing import GRAVE, Standing
from goalscope.words import names, singulars

__all__ = ["DIETS", "Bounds", "Diet", "bounds_of", "diets_of", "refusal", "violates"]

_GOODS = frozenset(("food", "product", "thing", "stuff", "diet", "item", "option", "meal"))
"""Words that do not identify a diet: "vegan food"."""


@dataclass(frozen=True, slots=True)
class Diet:
    """One restriction; its phrases are in the singular, with commas between.

    Attributes:
        harmless: Phrases in an item's name that make it fit.
        violating: Phrases that make an item violate it; every other item does where this is empty.
        refused: What a person who follows it refuses, as in "no wheat".
        allergens: What else an allergy names it by, as in "allergic to almonds".
        named: Other names of the diet, and of those who follow it.
        saving: Phrases to pass over before looking for violating ones.
        guessed: The stricter restriction that guesses keep to.
    """

    harmless: str
    violating: str = ""
    refused: str = ""
    allergens: str = ""
    named: str = ""
    saving: str = ""
    guessed: str = ""


def _read_diets() -> Mapping[str, Diet]:
    source = files("goalscope.envs.grocery") / "data" / "diets.toml"
    tables = tomllib.loads(source.read_text(encoding="utf-8"))
    lists: dict[str, str] = {}
    for name, phrases in tables["lists"].items():
        lists[name] = phrases.format(**lists)
    return {
        name: Diet(**{key: phrases.format(**lists) for key, phrases in table.items()})
        for name, table in tables["diets"].items()
    }


DIETS = _read_diets()
"""The restrictions by name; an item that carries the name as a tag fits."""


def violates(item: Item, restriction: str) -> bool:
    """Whether `item` violates `restriction`, a name in `DIETS`.

    Its tags decide where they can; otherwise the words of its name do.

    Raises:
        KeyError: `DIETS` has no such restriction.
    """
    diet = DIETS[restriction]
    if restriction in item.tags:
        return False
    name = " ".join(singulars(item.name))
    if _finder(diet.harmless).search(name):
        return False
    if not diet.violating:
        return True
    return bool(_finder(diet.violating).search(_finder(diet.saving).sub("|", name)))


@cache
def _finder(listed: str) -> re.Pattern[str]:
    """Finds any of the listed phrases as adjacent words, the longest first; none in ""."""
    phrases = [" ".join(singulars(phrase)) for phrase in listed.split(",") if phrase.strip()]
    either = "|".join(sorted(phrases, key=len, reverse=True)) or "(?!)"
    return re.compile(rf"(?<!\S)(?:{either})(?!\S)")


@dataclass(frozen=True, slots=True)
class Bounds:
    """The bounds that rule out items.

    Attributes:
        diets: Restrictions of `DIETS` that bind the whole basket.
        some: Restrictions that only some people follow: they bind what is guessed, and among
            several things that an order may mean, those that fit are preferred.
        refused: Names that items must not have.
        budget: Maximum total, in the shop's currency; None for no budget.
    """

    diets: frozenset[str] = frozenset()
    some: frozenset[str] = frozenset()
    refused: tuple[str, ...] = ()
    budget: Decimal | None = None

    def permits(self, item: Item) -> bool:
        """Whether no bound of the whole basket rules out an item."""
        return not self.against(item)

    def suits(self, item: Item) -> bool:
        """Whether no bound at all rules out an item."""
        return self.permits(item) and not any(violates(item, diet) for diet in self.some)

    def against(self, item: Item) -> str:
        """Why an item is ruled out, as text; "" if it is not."""
        if broken := sorted(diet for diet in self.diets if violates(item, diet)):
            return f"it has to be {' and '.join(broken)}"
        ruled = next((each for each in self.refused if names(item.name, each)), "")
        return f'you want no "{ruled}"' if ruled else ""


def bounds_of(standing: Standing) -> Bounds:
    """The bounds that the limits of a dialogue come to in the shop."""
    diets, some = set[str](), set[str]()
    refused: list[str] = []
    for limit in standing.limits:
        found = diets_of(limit)
        (some if limit.for_ and limit.why != "allergy" else diets).update(found)
        some.update(filter(None, (DIETS[name].guessed for name in found)))
        if limit.do == "avoid" and not found:
            refused.append(refusal(limit))
    budget = standing.budget
    most = None if budget is None or budget.quantity is None else Decimal(str(budget.quantity))
    return Bounds(frozenset(diets), frozenset(some - diets), tuple(refused), most)


def refusal(limit: Order) -> str:
    """What a thing must not be called; of an allergy the head noun alone, since kinds do not count.

    "Fresh strawberries" rule out strawberry jam.
    """
    return (singulars(limit.what) or [""])[-1] if limit.why == "allergy" else limit.what


def diets_of(limit: Order) -> frozenset[str]:
    """The restrictions of `DIETS` that a limit names: by what must be, or by what must not come.

    An allergy names each of which it holds a word, and so does what all must be for more than
    taste: "brazil nuts" rule out all nuts, and "halal meat" asks for halal.
    """
    said = [word for word in singulars(limit.what) if word not in _GOODS]
    if limit.do == "only":
        names = {name: f"{name}, {diet.named}" for name, diet in DIETS.items()}
    elif limit.why == "allergy":
        names = {name: f"{diet.refused}, {diet.allergens}" for name, diet in DIETS.items()}
    else:
        names = {name: diet.refused for name, diet in DIETS.items()}
    if limit.why == "allergy" or (limit.do == "only" and limit.why in GRAVE):
        return frozenset(n for n, listed in names.items() if _finder(listed).search(" ".join(said)))
    return frozenset(
        name for name, listed in names.items() if said and said in map(singulars, listed.split(","))
    )
