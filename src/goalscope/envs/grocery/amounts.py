"""How much a person asks for, in packages of an item."""

from __future__ import annotations

import math
import re
from typing import Literal

from goalscope.envs.grocery.catalogue import Item
from goalscope.orders import Order
from goalscope.words import singular

__all__ = ["MOST", "packages"]

MOST = 99
"""Units of one item that a basket holds at most."""

_GRAMS = {
    **dict.fromkeys(("kg", "kilo", "kilogram", "kilogramme"), 1000.0),
    **dict.fromkeys(("g", "gram", "gramme", "gr"), 1.0),
    **dict.fromkeys(("lb", "pound"), 454.0),
    **dict.fromkeys(("oz", "ounce"), 28.35),
}
_MILLILITRES = {
    **dict.fromkeys(("l", "litre", "liter"), 1000.0),
    **dict.fromkeys(("ml", "millilitre", "milliliter"), 1.0),
    **dict.fromkeys(("cl", "centilitre", "centiliter"), 10.0),
    **dict.fromkeys(("pint",), 473.0),
    **dict.fromkeys(("quart",), 946.0),
    **dict.fromkeys(("gal", "gallon"), 3785.0),
}
_PACKAGES = frozenset(
    ("pack", "packet", "package", "pkg", "box", "bag", "carton", "case", "crate", "sixpack", "tray")
)
_SIZE = re.compile(rf"(\d+(?:\.\d+)?)\s*({'|'.join([*_GRAMS, *_MILLILITRES])})\b")
_PIECES = re.compile(r"(\d+)\s*(?:ct|count|pack|pk|pcs|pieces)\b|.*, about (\d+)$")

_Counted = Literal["packages", "pieces", "dozens", "grams", "millilitres"]


def packages(order: Order, item: Item) -> int:
    """How many units of `item` an order comes to, at least 1 where it is not for none.

    Two dozen eggs are two of a unit "12 ct", six bagels one of "6 ct", ten bananas two of "1 kg,
    about 7", and 1.5 kg two of "1 kg". Where the unit does not say how many pieces it holds, a
    piece and a dozen are taken for one unit; so is any weight or volume that the unit cannot be
    compared with. A bottle or a roll is a piece, and a pack or a box a unit of the item.
    """
    number, counted = _counted(order)
    unit = item.unit.lower()
    if counted in ("grams", "millilitres"):
        size = _SIZE.match(unit)
        measures = _GRAMS if counted == "grams" else _MILLILITRES
        one = float(size[1]) * measures.get(size[2], 0) if size else 0
        number = math.ceil(number / one - 0.01) if one else 1
    elif counted in ("pieces", "dozens"):
        found = _PIECES.match(unit)
        pieces = int(found[1] or found[2]) if found else 0
        if pieces:
            number = math.ceil(number / pieces)
        elif counted == "dozens" and unit != "each":
            number = math.ceil(number / 12)
    return max(math.ceil(number), order.quantity != 0)


def _counted(order: Order) -> tuple[float, _Counted]:
    """The number, and what it counts."""
    number = 1.0 if order.quantity is None else order.quantity
    unit = singular(order.unit.casefold().strip(".").replace("-", " "))
    if unit in _GRAMS:
        return number * _GRAMS[unit], "grams"
    if unit in _MILLILITRES:
        return number * _MILLILITRES[unit], "millilitres"
    if unit == "dozen":
        return number * 12, "dozens"
    return number, "packages" if _PACKAGES.intersection(unit.split()) else "pieces"
