"""How many units of an item an order comes to: dozens, packs, weights and percentages."""

from __future__ import annotations

import math
import re
from dataclasses import replace

from goalscope.base.nouns import singular, singulars, words
from goalscope.base.text import plain
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.search import WORDS
from goalscope.language.amounts import figures, is_currency, word_value
from goalscope.language.orders import Order

_SIZES = {
    name: (measure, float(size))
    for measure, sizes in WORDS["measures"].items()
    for size, names in sizes.items()
    for name in names.split()
}
"""The measure of each unit, and its size in grams or millilitres."""

PACKAGES = frozenset(WORDS["packages"].split())
_PIECES = frozenset(WORDS["pieces"].split())
_DOZENS = dict.fromkeys(("dozen", "doz", "dz"), 12.0) | {"gross": 144.0}
_NUMBERS = {**_DOZENS, "score": 20.0, "pair": 2.0, "half": 0.5, "quarter": 0.25}
_THIRTEEN = re.compile(r"\bbaker'?s? (?:dozen|doz|dz)\b")
_FLUID = re.compile(r"\bfl(?:uid)?\.? ?(?:oz|ounce)(?:es|s)?\b", re.IGNORECASE)
_SIZE = re.compile(rf"(?:(\d+)\s*x\s*)?(\d+(?:\.\d+)?)\s*({'|'.join(_SIZES)})s?\b")
_HOLDS = re.compile(
    r"(\d+)(?:\s*x\s*\d|[\s-]*(?:ct|count|pack|pk|pcs|pieces)\b)|(?:pack|box|bag) of (\d+)"
    r"|.*, about (\d+)$"
)
_PERCENT = r"(?:%|per ?cent|pct\.?)(?!\w)"
_PERCENTAGE = re.compile(rf"(?<![\w.])(\d+(?:\.\d+)?|[a-z]+)[ -]?{_PERCENT}", re.IGNORECASE)
_BEFORE_PERCENTAGE = re.compile(r"([0-9]{1,6}|[a-z]+) ([a-z]+) of ((?:[a-z]+ ){0,2}[\d.]+% .+)")


def without_percentage(order: Order) -> Order:
    """An order whose percentage is part of a name, and no quantity: 2% milk, 70% chocolate.

    Of "3 cartons of 2% milk", the three are the quantity.
    """

    def written(found: re.Match[str]) -> str:
        number = found[1] if found[1][0].isdigit() else word_value(found[1])
        return found[0] if number is None else f"{number}%"

    what, for_ = (_PERCENTAGE.sub(written, each) for each in (order.what, order.for_))
    if order.quantity is None and (found := _BEFORE_PERCENTAGE.fullmatch(what)):
        number = float(found[1]) if found[1].isdecimal() else word_value(found[1])
        if number:
            quantity, unit = float(number), singular(found[2])
            return replace(order, what=found[3], for_=for_, quantity=quantity, unit=unit)
    if re.match(_PERCENT, order.unit, re.IGNORECASE):
        what = f"{order.quantity:g}% {what}"
        return replace(order, what=what, for_=for_, quantity=None, unit="")
    return replace(order, what=what, for_=for_)


def packages(order: Order, item: Item) -> tuple[int, str]:
    """How many units of `item` an order comes to, at least 1 where it is not for none.

    Two dozen eggs are two of a unit "12 ct", six bagels one of "6 ct", ten bananas two of "1 kg,
    about 7", and 1.5 kg two of "1 kg". Where the unit does not say how many pieces it holds, a
    piece is taken for one unit, and so is a dozen of an item without a unit, or any weight or
    volume that the unit cannot be compared with. A bottle or a roll is a piece, a pack or a box a
    unit of the item, and a pack of six is six pieces. What a unit of no known name is, is told.

    Returns:
        The number, and a note where that is more than was ordered or nobody can tell; "" where it
        is what was ordered. No units come to a sum of money.
    """
    number, measure = _measured(order, item)
    unit, one, slack = _FLUID.sub("floz", figures(plain(item.unit)).lower()), 1.0, 0.0
    ordered = f"{1 if order.quantity is None else order.quantity:g} {order.unit}".strip()
    if measure == "money":
        return 0, f'I cannot tell how much {item.name} is "{ordered}". Please say how many.'
    if measure in ("grams", "millilitres"):
        size, slack = _SIZE.match(unit), 0.01
        same = size and _SIZES[size[3]][0] == measure
        one = int(size[1] or 1) * float(size[2]) * _SIZES[size[3]][1] if size and same else 0.0
    elif measure in ("pieces", "dozens") and (found := _HOLDS.match(unit)):
        one = float(next(filter(None, found.groups())))
    elif measure == "dozens" and not unit:
        one = 12.0
    units = max(math.ceil(number / one - slack) if one else 1, int(order.quantity != 0))
    name = f"{item.name} ({item.unit})" if unit not in ("", "each") else item.name
    if not one or measure == "unknown":
        return units, f'I cannot tell how many {name} are "{ordered}", so I take {units}.'
    if order.quantity is None or units * one <= number * (1 + slack):
        return units, ""
    return units, f'{units} x {name} is more than the "{ordered}" that you asked for.'


def _measured(order: Order, item: Item) -> tuple[float, str]:
    """The number, and what it counts or measures: packages, pieces, dozens, grams, millilitres.

    It may measure money or something unknown, too.
    """
    said = _THIRTEEN.sub("13", _FLUID.sub("floz", plain(order.unit).casefold()))
    size, unit = _sized(singular(said.strip(".")))
    number = size * (1.0 if order.quantity is None else order.quantity)
    measure, one = _SIZES.get(unit, ("unknown", 1.0))
    if is_currency(order.unit) and measure != "grams":  # a pound is a weight here
        return number, "money"
    if measure != "unknown":
        return number * one, measure
    if not _DOZENS.keys().isdisjoint(map(singular, words(order.unit))):
        return number, "dozens"
    if size == 1 and PACKAGES.intersection(unit.split()):
        return number, "packages"
    known = {*PACKAGES, *_PIECES, *singulars(item.name), *singulars(item.unit)}
    is_known = size != 1 or not unit or unit.split()[-1] in known
    return number, "pieces" if is_known else "unknown"


def _sized(unit: str) -> tuple[float, str]:
    """What one of a unit holds, and of what: 6 of "pack" in "six pack", 500 "g" in "500 g bag"."""
    parts = re.findall(r"[0-9]{1,6}(?:\.[0-9]{1,3})?|[^\W\d_]+", unit)
    sizes = [
        float(part) if part[0].isdigit() else _NUMBERS.get(part) or word_value(part)
        for part in parts
    ]
    after = max((place + 1 for place, each in enumerate(sizes) if each), default=0)
    unit = "".join(parts[after : after + 1]) if after else " ".join(parts)
    unit = unit.removesuffix("s") if unit.removesuffix("s") in _SIZES else singular(unit)
    if not after:
        return 1.0, unit
    size = min(math.prod(each for each in sizes if each), 1e6)
    return size, unit if unit in _SIZES else "pack"
