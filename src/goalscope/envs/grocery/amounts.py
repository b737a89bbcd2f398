"""How much a person asks for: number words, measures, and packages of an item."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.words import singulars, words

__all__ = [
    "CONTAINER",
    "COUNT",
    "GRAMS",
    "MILLILITRES",
    "MOST",
    "NUMBERS",
    "PACKS",
    "WORD",
    "Request",
    "by_weight",
    "number",
    "packages",
    "units",
]

MOST = 99
"""Units of one item that a basket holds at most."""


NUMBERS = {
    **{"a": 0, "an": 0, "of": 0, "and": 0, "half": 0.5, "hundred": 0},
    **{"couple": 2, "pair": 2, "few": 3},
    **{"one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8},
    **{"nine": 9, "ten": 10, "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14},
    **{"fifteen": 15, "sixteen": 16, "seventeen": 17, "eighteen": 18, "nineteen": 19, "several": 3},
    **{"twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "eighty": 80},
}
WORD = f"(?:{'|'.join(NUMBERS)})"
GRAMS = {
    **dict.fromkeys(("kg", "kilo", "kilos", "kilogram", "kilograms"), 1000.0),
    **dict.fromkeys(("g", "gram", "grams"), 1.0),
    **dict.fromkeys(("lb", "lbs", "pound", "pounds"), 454.0),
    **dict.fromkeys(("oz", "ounce", "ounces"), 28.35),
}
MILLILITRES = {
    **dict.fromkeys(("l", "litre", "litres", "liter", "liters"), 1000.0),
    **dict.fromkeys(("ml", "millilitre", "millilitres", "milliliter", "milliliters"), 1.0),
    **dict.fromkeys(("pint", "pints"), 473.0),
    **dict.fromkeys(("quart", "quarts"), 946.0),
    **dict.fromkeys(("gal", "gallon", "gallons"), 3785.0),
}
_MEASURE = f"(?:{'|'.join([*GRAMS, *MILLILITRES])})"
CONTAINER = (
    r"(?:packages?|packs?|packets?|bags?|boxes|box|bottles?|cans?|tins?|jars?|cartons?|loaves|loaf"
    r"|bunch(?:es)?|blocks?|bars?|tubs?|trays?|heads?|containers?|cases?|rolls?|sticks?|bulbs?"
    r"|slices?|pieces?|sets?|units?)"
)
PACKS = "(?:bags?|packs?|packets?|packages?|bottles?|cans?|tins?|boxes|box|cartons?|jars?|tubs?)"
COUNT = re.compile(
    rf"(?:(?P<number>(?P<digits>\d{{1,6}}(?:\.\d+)?(?=[ a-z]))|{WORD}(?:[ -]{WORD})*(?= ))"
    rf" ?(?:x )?(?:(?P<dozen>dozens?) |(?P<measure>{_MEASURE}) (?(digits)(?:of )?|of ))?"
    rf"|(?P<alone>dozens?) )?(?:of |more )*(?P<container>(?:(?:\w+ )?{CONTAINER} of )+)?"
)


@dataclass(frozen=True, slots=True)
class Request:
    """Something asked for, or to be taken out.

    Attributes:
        phrase: What, in the person's words and lower case, such as "brown eggs".
        quantity: How many, at least 1; for "two dozen" it is 24, for "1.5 kg" 1500.
        counted: What the quantity counts: packages ("3 bags of chips"), single pieces ("6
            bagels"), pieces by the dozen, a weight or volume, or, for a bare "make it 18", units:
            what the amount of the same thing counted before.
        change: What becomes of the basket: it holds so many at least, so many more, exactly so
            many, so many fewer, none, as many as of what is replaced, twice what it held, half, or
            the cheapest of its kind.
        outright: Whether a verb or a number asks for it, rather than its bare mention.
        replaces: What makes way for it.
        every: Whether all is meant whose name holds the phrase, as in "anything with nuts".
    """

    phrase: str
    quantity: int = 1
    counted: Literal["packages", "pieces", "dozens", "grams", "millilitres", "units"] = "pieces"
    change: Literal[
        "at least", "more", "exactly", "fewer", "none", "as many", "double", "half", "cheaper"
    ] = "at least"
    outright: bool = False
    replaces: tuple[str, ...] = ()
    every: bool = False


def packages(request: Request, item: Item) -> int:
    """How many units of `item` a basket can hold of those that the request comes to."""
    return min(units(request, item), MOST)


def units(request: Request, item: Item) -> int:
    """How many units of `item` the request comes to, at least 1.

    Two dozen eggs are two of a unit "12 ct", six bagels one of "6 ct", ten bananas two of "1 kg,
    about 7", and 1.5 kg two of "1 kg".
    Where the unit does not say how many pieces it holds, a dozen is taken for one unit, and a
    piece for one unit; so is any weight or volume that the unit cannot be compared with.
    """
    unit = item.unit.lower()
    number = request.quantity
    if request.counted in ("grams", "millilitres"):
        size = re.match(rf"(\d+(?:\.\d+)?)\s*({_MEASURE})\b", unit)
        measures = GRAMS if request.counted == "grams" else MILLILITRES
        one = float(size[1]) * measures.get(size[2], 0) if size else 0
        number = math.ceil(number / one - 0.01) if one else 1
    elif request.counted in ("pieces", "dozens"):
        if pieces := _pieces(item):
            number = math.ceil(number / pieces)
        elif request.counted == "dozens" and unit != "each":
            number = math.ceil(number / 12)
    return max(number, 1)


def by_weight(request: Request, item: Item) -> bool:
    """Whether some pieces, such as "6 apples", come to as many units of a kilogram or more."""
    size = re.match(rf"(\d+(?:\.\d+)?)\s*({_MEASURE})\b", item.unit.lower())
    heavy = bool(size and float(size[1]) * GRAMS.get(size[2], 0) >= 1000) and not _pieces(item)
    counts = request.counted == "pieces" and request.quantity > 1
    return heavy and counts and singulars(request.phrase)[-1:] != words(request.phrase)[-1:]


def _pieces(item: Item) -> int:
    """How many pieces one unit of `item` holds; 0 where it does not say that."""
    found = re.match(r"(\d+)\s*(?:ct|count|pack|pk|pcs|pieces)\b", item.unit.lower())
    found = found or re.search(r", about (\d+)$", item.unit.lower())
    return int(found[1]) if found else 0


def number(said: str) -> float:
    """The value of digits or of number words: "a" is 1, "twenty-four" 24, "half a" 0.5."""
    if said[0].isdigit():
        return float(said)
    value = sum(NUMBERS[word] for word in re.split(r"[ -]", said)) or 1
    return value * 100 if "hundred" in said else value
