"""Taskmaster-4: coffee orders. One writer wrote both sides of each dialogue."""

from __future__ import annotations

import difflib
import json
import random
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import cast

from goalscope.base.inputs import is_list, shown
from goalscope.base.types import InvalidInputError
from goalscope.datasets.case import Case, turns_of
from goalscope.datasets.files import Row, line_rows
from goalscope.datasets.goal_sets import chance, draw

__all__ = ["TASK", "taskmaster"]

TASK = "Take the human's order at a coffee bar."
"""What the assistant is to do, in a sentence."""

_CHANGED = ("temperature", "caffeine", "shots", "drink", "milk")
_ATTRIBUTES = (*_CHANGED, "extras", "note")
_WORDS = {
    "temperature": {"iced", "cold", "hot", "warm", "extra hot"},
    "caffeine": {"decaf", "half-caf", "half caf", "caffeinated"},
    "shots": {"single", "double", "triple", "quadruple"},
}
_USUAL = 3  # a spelling that occurs so often is no slip

_Item = tuple[str, ...]  # a value for each attribute, "" for none
_Order = tuple[_Item, ...]


def taskmaster(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Dialogues in the order of the file; instead of one that is left out, the reason.

    The goal is the final order in a sentence of ours, in the usual spelling of each name. "random"
    draws from other people's orders. "hard" changes exactly one attribute of one item (drink, milk,
    temperature, caffeine, shots) to another value of the file or to none, each attribute as
    often as the others. It leaves out orders with a note or another extra, which can say the same
    as an attribute ("double shot") or be no wish at all (a name), so that a changed order could be
    as true; and it adds none, as orders leave out most of the syrups that people ask for.

    Raises:
        InvalidInputError: The file is broken.
    """
    rows = list(line_rows(file))
    whole = [row for row in rows if "var_" not in json.dumps(row.values)]
    yield from ["a blank in the template was never filled (var_)"] * (len(rows) - len(whole))
    orders = _orders(whole)
    every = sorted({_sentence(order) for order in orders})
    values = {
        name: sorted({item[at] for order in orders for item in order} - {""})
        for at, name in enumerate(_CHANGED)
    }
    for row, order in zip(whole, orders, strict=True):
        id, turns = row.text("id"), turns_of(_said(row))
        if not turns or not order:
            yield "no order, or no words of the customer"
            continue
        if goal_set == "hard" and any(item[len(_CHANGED) :] != ("", "") for item in order):
            yield "a note or an extra, which other attributes could contradict or repeat"
            continue
        rng = chance(seed, id)
        tiers = [every] if goal_set == "random" else _one_change(rng, order, values)
        drawn = draw(rng, _sentence(order), tiers, goals)
        if drawn is None:
            yield f"fewer than {goals} orders to choose from"
            continue
        yield Case(id, id, TASK, turns, *drawn)


def _said(row: Row) -> Iterator[tuple[bool, str]]:
    for number, turn in enumerate(row.entries("turns"), 1):
        label = f"{row.label}, turn {number}"
        parts = cast("list[str]", turn) if is_list(turn, str) else []
        if len(parts) != 2 or parts[0] not in ("user", "assistant"):
            raise InvalidInputError(
                f'{label}: expected ["user" or "assistant", text], got {shown(turn)}.'
            )
        yield parts[0] == "user", Row(label, {"text": parts[1]}).text("text", empty=True)


def _orders(rows: Sequence[Row]) -> list[_Order]:
    read = [
        [
            (
                _plain(item.text("drink")),
                [_plain(option) for option in item.texts("options")],
                _plain(item.text("notes", empty=True)) if item.values.get("notes") else "",
            )
            for item in row.rows("order_items")
        ]
        for row in rows
    ]
    items = [item for order in read for item in order]
    drinks = _usual(drink for drink, _, _ in items)
    options = _usual(option for _, options, _ in items for option in options)
    notes = _usual(note for _, _, note in items if note)
    return [
        tuple(
            _item(drinks[drink], [options[option] for option in given], notes.get(note, ""))
            for drink, given, note in order
        )
        for order in read
    ]


def _item(drink: str, options: Iterable[str], note: str) -> _Item:
    values = dict.fromkeys(_ATTRIBUTES, "") | {"drink": drink, "note": note}
    for option in sorted(set(options)):
        of = [name for name, words in _WORDS.items() if option in words]
        name = of[0] if of else "milk" if option.endswith("milk") else "extras"
        values[name] = f"{values[name]} and {option}" if values[name] else option
    return tuple(values.values())


def _plain(text: str) -> str:
    """Lower case, without what stands in brackets and marks around it."""
    words = " ".join(text.casefold().split())
    return re.sub(r"\s*\([^)]*(\)|$)", "", words).strip(" -.?!") or words


def _usual(names: Iterable[str]) -> dict[str, str]:
    """The usual spelling of each name: the nearest one, or the longest that it contains."""
    counts = Counter(names)
    usual = sorted(name for name, count in counts.items() if count >= _USUAL)

    def known(name: str) -> str:
        if name in usual:
            return name
        if near := difflib.get_close_matches(name, usual, 1, 0.8):
            return near[0]
        within = [each for each in usual if re.search(rf"(?<!\w){re.escape(each)}(?!\w)", name)]
        return max(within, key=len, default=name)

    return {name: known(name) for name in counts}


def _one_change(
    rng: random.Random, order: _Order, values: Mapping[str, Sequence[str]]
) -> Iterator[list[str]]:
    """Sentences for other orders, one by one, with a different attribute each time around."""
    changes: dict[str, list[str]] = {}
    seen = {tuple(sorted(order))}
    for at, name in enumerate(_CHANGED):
        found = changes.setdefault(name, [])
        for place, item in enumerate(order):
            others = [*values[name], *([""] if name != "drink" else [])]
            for value in others:
                changed = (*item[:at], value, *item[at + 1 :])
                other = (*order[:place], changed, *order[place + 1 :])
                if (key := tuple(sorted(other))) not in seen:
                    seen.add(key)
                    found.append(_sentence(other))
        rng.shuffle(found)
    while left := [found for found in changes.values() if found]:
        rng.shuffle(left)
        yield from ([found.pop()] for found in left)


def _sentence(order: _Order) -> str:
    """Such as "Order iced decaf mocha with oat milk (note: extra foam), and latte."."""
    told: list[str] = []
    for item in order:
        temperature, caffeine, shots, drink, milk, extras, note = item
        words = " ".join(word for word in (temperature, caffeine, shots, drink) if word)
        words += f" with {milk}" if milk else ""
        words += f", {extras}" if extras else ""
        told.append(words + (f" (note: {note})" if note else ""))
    return f"Order {', and '.join(told)}."
