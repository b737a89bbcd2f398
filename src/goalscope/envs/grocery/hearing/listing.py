"""How lists are written: what stands above them, and their measures."""

from __future__ import annotations

import re

from goalscope.envs.grocery.amounts import PACKS
from goalscope.envs.grocery.hearing.phrases import END
from goalscope.envs.speech import evened

__all__ = ["UNIT", "chooses_size", "unlisted"]

UNIT = r"(?:k?g|kilos?|grams?|m?l|lit(?:re|er)s?|lbs?|oz)\b"
"""A measure behind a number, but for pounds, which are money, too."""

_TIMES = re.compile(
    r"(?<![\w.])(?:(?P<so>\d{1,2}) ?[x\u00d7] ?"
    rf"(?P<one>\d{{1,4}}(?:\.\d{{1,3}})?) ?(?P<of>{UNIT})"
    rf"|(?P<each>\d{{1,4}}(?:\.\d{{1,3}})?) ?(?P<in>{UNIT}) ?[x\u00d7] ?(?P<many>\d{{1,2}})(?!\w))"
)
"""So many times a measure: "2 x 500g"."""
_BEFORE_TIMES = re.compile(rf"(?<=\w) [-\u2013\u2014] (?=(?:{_TIMES.pattern}){END})")
"""Between a thing and so many times its measure: "milk - 1l x4"."""
_ABBREVIATED = re.compile(
    rf"(?:(?:^|(?<=[.,;!?] )|(?<=\band ))(?P<first>\d{{1,4}}(?:\.\d{{1,3}})? ?{UNIT})\.(?= \w)"
    rf"|(?<=\d)(?P<unit> ?{UNIT})\.(?= of\b))"
)
"""A measure with a point behind it that ends no sentence: "500g. of mince"."""
_HEADING = re.compile(
    r"^(?:(?:hi|hello|ok|so|here(?:'s| is)|this is|my|our|the|a|weekly|monthly|daily|big|quick|next"
    r"|(?:this |next )?week's|today's)[ ,]+)*+"
    r"(?:shop|shopping(?: list)?|grocery list|groceries|list)"
    r"(?: for (?:the |this )?(?:week(?:end)?|month|today|tomorrow))? ?[:\u2013-] ?(?=\w)"
)
"""What a list is, before it: "weekly shop: milk and eggs"."""

_AISLE = re.compile(
    r"^(?:(?:and|also|for|some|the|then)[ ,]+)*(?:dips?|drinks?|snacks?|nibbles|fruits?|vegetables"
    r"|veg|veggies|desserts?|sweets|spices|toppings?|sides?|starters?|breakfast|lunch|dinner|supper"
    r"|brunch|baking|bakery|frozen|dairy|meat|household|cleaning|pets?|baby|party|bbq|barbecue"
    r"|kitchen|bathroom)(?: (?:stuff|things|food|supplies|items))?(?::| [-\u2013]) "
    r"(?=\w)(?!no\b|none\b|not\b|without\b|nothing\b|any\b)"
)
"""Which part of a list comes next: "dips: hummus and guacamole"."""

_SIZE = (
    r"(?:big(?:ger|gest)?|large(?:r|st)?|small(?:er|est)?|little|tiny|huge|giant|medium|normal"
    r"|regular|family)(?:[ -]sized?)?"
)
_THERE_IS = r"(?: (?:that )?(?:you(?: have|'ve got| sell)(?: got)?|there is|is there))"
_OF_SIZE = re.compile(
    rf"(?:(?:^|,|;| -|,? but)(?: (?:and|in|please))* ?(?:the|an?) {_SIZE} (?:{PACKS}|size"
    r"|(?<!regular )(?<!normal )(?<!little )(?<!medium )ones?)"
    rf"{_THERE_IS}?(?:,? if (?:you(?: have|'ve got)(?: got)? (?:it|one|any|some|them)|possible"
    r"|available|there is (?:one|any|some)|you can))?(?:,? (?:please|thanks))*(?=[.,;!?]|$))"
)
"""An aside that chooses by size: "flour, the big bag if you have it"."""
_SIZED_PACK = re.compile(rf"\bthe {_SIZE} (?P<pack>{PACKS}) of (?P<what>[^.,;!?]+?){_THERE_IS}\b")
_COUNTED = (
    r"\d{1,2} (?!(?:for|in|on|at|to|or|and|x|get|add|buy|take|remove|free)\b)"
    r"[^\W\d][\w'-]*(?: [^\W\d][\w'-]*){0,2}?"
)
_RUN = re.compile(
    rf"(?:(?:please|add|buy|get|i need) )*{_COUNTED}(?: {_COUNTED})+(?:,? please)?[ .!]*"
)
"""Things one behind the other, each with its number: "2 milk 3 eggs"."""


def unlisted(text: str) -> str:
    """`text`, evened, without a heading and sizes, with commas, and "2 x 500g" as "1000 g"."""
    text = _SIZED_PACK.sub(r"a \g<pack> of \g<what>", _OF_SIZE.sub("", text))
    if _RUN.fullmatch(text):
        text = re.sub(r"(?<=\w) (?=\d)", ", ", text)
    text = _ABBREVIATED.sub(r"\g<first>\g<unit>", _AISLE.sub("", _HEADING.sub("", text)))
    return _TIMES.sub(_in_all, _BEFORE_TIMES.sub(" ", text))


def chooses_size(utterance: str) -> bool:
    """Whether words choose among sizes of a thing."""
    text = evened(utterance)
    return bool(_OF_SIZE.search(text) or _SIZED_PACK.search(text))


def _in_all(found: re.Match[str]) -> str:
    number = float(found["one"] or found["each"]) * int(found["so"] or found["many"])
    return f"{number:.3f}".rstrip("0").rstrip(".") + f" {found['of'] or found['in']}"
