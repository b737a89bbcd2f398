"""What becomes of a basket by what a person asks for outright."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from goalscope.envs.grocery.amounts import MOST, Request, packages
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.choosing import Choice, called, taken
from goalscope.envs.grocery.heard import Hearing
from goalscope.envs.grocery.words import contains, singulars
from goalscope.types import Action

__all__ = ["changes", "dearer", "guessed"]


def changes(
    hearing: Hearing,
    contents: Sequence[tuple[Item, int]],
    choice: Choice,
    left: Sequence[Item] = (),
) -> list[Action]:
    """What the words ask for and the basket is not yet: removals and additions.

    Args:
        hearing: What was said.
        contents: What the basket holds: items, and how many of each.
        choice: Which items are meant.
        left: What was in the basket before, and is not now.
    """
    basket = {item.name: number for item, number in contents}
    held_items = [item for item, _ in contents]
    unasked = guessed(hearing, held_items, choice) if hearing.unasked else []
    plan = {
        item.name: -number
        for item, number in contents
        if hearing.empties
        or not hearing.permits(item)
        or not _stays(item, hearing)
        or item in unasked
    }
    for removal in hearing.removed:
        for item in taken(removal, held_items):
            held = basket[item.name]
            shown = removal.quantity <= held  # what a person counts is what the basket shows
            number = removal.quantity if shown else min(packages(removal, item), held)
            if removal.change == "none":
                number = held
            plan[item.name] = max(plan.get(item.name, 0) - number, -held)
            if removal.change == "fewer":
                break
    plan |= {item.name: -basket[item.name] for item in _went_by(hearing, held_items, choice)}
    gone = {item: -plan[item.name] for item, _ in contents if plan.get(item.name)}
    stays = [item for item, number in contents if number + plan.get(item.name, 0) > 0]
    out = [*left, *(item for item, number in gone.items() if number == basket[item.name])]
    dropped = [item for item in out if any(called(each, [item]) for each in hearing.dropped)]
    for request in hearing.wanted:
        if request not in hearing.newest and choice.called(request.phrase, [*stays, *dropped]):
            continue
        if request.change == "cheaper":
            old = dearer(request, contents)
            kinds = (*request.replaces, request.phrase)
            found = (choice.cheaper(old, kind, hearing) for kind in kinds)
            item = next(filter(None, found), None)
            number = basket[old.name] if old else packages(request, item) if item else 0
            plan |= {old.name: -number} if old and item else {}
            plan |= {item.name: plan.get(item.name, 0) + number} if item else {}
            continue
        again = [*filter(hearing.permits, taken(request, left))] if hearing.again else []
        item = again[0] if len(again) == 1 else choice.meant(request.phrase, hearing, basket)
        if item:
            if request.change in ("double", "half") and item.name not in basket:
                said = singulars(request.phrase)
                alike = [each for each, _ in contents if contains(singulars(each.name), said)]
                item = alike[0] if len(alike) == 1 else item
                if request.change == "half" and item.name not in basket:
                    continue
            held = basket.get(item.name, 0) + plan.get(item.name, 0)
            number = _packages(request, item, hearing, choice)
            number -= 0 if request.change == "more" else held
            if request.change in ("double", "half") and held:
                number = held if request.change == "double" else -(held // 2)
            if request.change == "as many" and not held:
                instead = {each for old in request.replaces for each in choice.called(old, [*gone])}
                number = max(number, gone[instead.pop()] if len(instead) == 1 else 0)
            if number > 0 or request.change in ("exactly", "half"):
                plan[item.name] = plan.get(item.name, 0) + min(number, MOST - held)
    return [
        Action("add item" if number > 0 else "remove item", name, abs(number))
        for name, number in plan.items()
        if number
    ]


def dearer(request: Request, contents: Sequence[tuple[Item, int]]) -> Item | None:
    """What of the basket something cheaper is to take the place of."""
    held = [item for item, _ in contents]
    return next((i for p in (*request.replaces, request.phrase) for i in called(p, held)), None)


def guessed(hearing: Hearing, held: Sequence[Item], choice: Choice) -> list[Item]:
    """What of the basket nobody asked for; of several things of one name the first was asked for.

    Args:
        hearing: What was said.
        held: What the basket holds, in the order of adding.
        choice: Which items are meant.
    """
    named = (choice.called(request.phrase, held)[:1] for request in hearing.wanted)
    asked = {item for items in named for item in items}
    asked |= {item for phrase in hearing.kept for item in choice.called(phrase, held)}
    return [item for item in held if item not in asked]


def _went_by(hearing: Hearing, held: Sequence[Item], choice: Choice) -> list[Item]:
    """What of the basket is usual for a word that was refused, and is asked for by no other."""
    refused = {item for each in hearing.refused for item in choice.usually(each, held)}
    return [
        item
        for item in held
        if item in refused and not any(choice.called(r.phrase, [item]) for r in hearing.wanted)
    ]


def _stays(item: Item, hearing: Hearing) -> bool:
    """Whether the newest words leave the item in the basket."""
    return not hearing.spared or any(called(each, [item]) for each in hearing.spared)


def _packages(request: Request, item: Item, hearing: Hearing, choice: Choice) -> int:
    """Units of `item`; pieces are counted in what it takes the place of for a diet."""
    usual = None
    if hearing.diets and request.counted in ("pieces", "dozens"):
        usual = choice.meant(request.phrase, replace(hearing, diets=frozenset()), ())
    return packages(request, usual or item)
