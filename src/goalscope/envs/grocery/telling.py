"""What a person is told of what they asked for and did not get as they may have meant it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal

from goalscope.envs.grocery.amounts import MOST, Request, by_weight, units
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.choosing import Choice, is_vague, taken
from goalscope.envs.grocery.heard import Hearing
from goalscope.envs.grocery.hearing.diets import implied, is_diet
from goalscope.envs.grocery.hearing.orders import states_aim
from goalscope.envs.grocery.hearing.requests import Refusal
from goalscope.envs.grocery.restrictions import ALLERGIES, violates
from goalscope.envs.grocery.words import singulars, words

__all__ = [
    "for_a_diet",
    "for_some",
    "labelled_alone",
    "left_out",
    "lifted",
    "limited",
    "listed",
    "not_back",
    "not_met",
    "not_there",
    "still_bound",
    "taken_in",
    "unlabelled",
]


def not_there(removed: Sequence[Request], held: Sequence[Item], *, lessened: bool) -> Iterator[str]:
    """What was to leave a basket that did not hold it; a diet may have `lessened` that."""
    for removal in removed:
        phrase = removal.phrase
        by_diet = lessened and implied(phrase, Refusal.DROPPED)
        if not (taken(removal, held) or is_vague(phrase) or by_diet):
            phrase = f"{phrase} things" if is_diet(phrase) else phrase
            verb = "were" if singulars(phrase)[-1:] != words(phrase)[-1:] else "was"
            yield f"There {verb} no {phrase} in the basket."


def taken_in(diets: Iterable[str], harmful: Iterable[str] = ()) -> Iterator[str]:
    """Which restrictions bind from now on, and which things that are harmful stay away."""
    if names := sorted(diets):
        yield f"From now on it has to be {' and '.join(names)}."
    if things := [*harmful]:
        yield f"From now on nothing comes in that is called {' or '.join(things)}."


def left_out(refused: Iterable[str]) -> Iterator[str]:
    """Which things of the shop are not wanted from now on."""
    if things := [*refused]:
        yield f"From now on I add nothing called {' or '.join(things)}, unless you ask for it."


def limited(
    now: Decimal | None, before: Decimal | None, money: Callable[[Decimal], str]
) -> Iterator[str]:
    """What all may cost from now on, where that is new; both are sums, or None for any."""
    if now is not None and now != before:
        yield f"From now on all of it may cost {money(now)}."
    elif before is not None and now is None:
        yield "From now on it may cost any sum."


def still_bound(diets: Iterable[str]) -> Iterator[str]:
    """How restrictions are taken back that seem to be meant so, and were not."""
    for name in sorted(diets):
        yield f'It still has to be {name}. "It need not be {name}" takes that back.'


def lifted(diets: Iterable[str]) -> Iterator[str]:
    """Which restrictions bind no longer."""
    for name in sorted(diets):
        yield f"It need not be {name} any longer."


def for_some(diets: Iterable[str]) -> Iterator[str]:
    """That a diet which only some follow binds no order."""
    for name in sorted(diets):
        yield (
            f"As only some are {name}, only what I guess will be {name}; what you name is added as"
            f' you name it. For all to be so, say "everything must be {name}".'
        )


def not_met(
    request: Request, item: Item, before: Mapping[str, int], now: Mapping[str, int], price: str
) -> str:
    """Why a request for an item, at its price, changed nothing, or more than meant; "" if not so.

    Args:
        request: What was asked for.
        item: What it means.
        before: The basket, item name to quantity, before the round.
        now: The basket after it.
        price: Of the item.
    """
    was, is_now = before.get(item.name, 0), now.get(item.name, 0)
    if units(request, item) + (was if request.change == "more" else 0) > MOST:
        return f"The basket holds at most {MOST} of one item: {item.name}."
    if request.change == "cheaper":
        dearest = f"The shop has nothing of the kind that is cheaper: {item.name}, {price}."
        return dearest if 0 < was == is_now else ""
    if request.change == "half" and was == 1:
        return f"1 x {item.name} is the least that can be bought."
    if request.outright and 0 < was == is_now:
        return f"The basket holds {was} x {item.name} already."
    return f"{item.name}: {is_now} x {item.unit}." if is_now and by_weight(request, item) else ""


def for_a_diet(request: Request, item: Item, hearing: Hearing, choice: Choice) -> Iterator[str]:
    """That a diet chose another thing than is usually meant; of organic ones their names tell."""
    free = replace(hearing, diets=frozenset(), strict=frozenset())
    usual = choice.meant(request.phrase, free, ())
    diets = sorted(hearing.diets - {"organic"})
    if usual and usual != item and (against := [d for d in diets if violates(usual, d)]):
        yield f"As it has to be {' and '.join(against)}: {item.name}."


def not_back(item: Item, hearing: Hearing) -> str:
    """Why a thing that left the basket is not put back."""
    diets = [each for each in sorted(hearing.diets) if violates(item, each)]
    why = f"It has to be {' and '.join(diets)}" if diets else "You ruled that out"
    return f"{why}: {item.name}."


def labelled_alone(strict: Iterable[str]) -> Iterator[str]:
    """Allergies for which only labelled food stays."""
    if named := sorted(strict):
        yield f"From now on I add no food that is not labelled as {' and '.join(named)}."


def unlabelled(
    diets: Iterable[str], held: Sequence[Item], aisles: Collection[str]
) -> Iterator[str]:
    """What of the basket may not fit diets of allergies, as far as its labels tell.

    Args:
        diets: The restrictions.
        held: What the basket holds.
        aisles: Those where things are labelled at all: food.
    """
    for name in sorted(diets):
        unsure = [i.name for i in held if i.category in aisles and name not in i.tags]
        if name in ALLERGIES and unsure:
            yield f"Not labelled as {name}: {', '.join(unsure)}. Please read what is in it."


def listed(request: Request, *, has: bool) -> Request:
    """A short request as one that is outright, if what is listed with it is of the shop."""
    short = has and len(request.phrase.split()) <= 2 and not states_aim(request.phrase)
    return replace(request, outright=request.outright or short)
