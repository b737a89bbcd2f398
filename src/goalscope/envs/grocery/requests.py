"""What a person's words ask for and refuse: candidates, which a language model then weighs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.words import asks, contains, sentences, singulars

__all__ = ["Refusal", "Request", "amount", "clears", "packages", "unwanted", "wanted"]

_NUMBERS = {
    **{
        "a": 0,
        "an": 0,
        "of": 0,
        "and": 0,
        "half": 0.5,
        "hundred": 0,
        "couple": 2,
        "pair": 2,
        "few": 3,
    },
    **{"one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8},
    **{"nine": 9, "ten": 10, "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14},
    **{"fifteen": 15, "sixteen": 16, "seventeen": 17, "eighteen": 18, "nineteen": 19, "several": 3},
    **{"twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "eighty": 80},
}
_WORD = f"(?:{'|'.join(_NUMBERS)})"
_GRAMS = {
    **dict.fromkeys(("kg", "kilo", "kilos", "kilogram", "kilograms"), 1000.0),
    **dict.fromkeys(("g", "gram", "grams"), 1.0),
    **dict.fromkeys(("lb", "lbs", "pound", "pounds"), 454.0),
    **dict.fromkeys(("oz", "ounce", "ounces"), 28.35),
}
_MILLILITRES = {
    **dict.fromkeys(("l", "litre", "litres", "liter", "liters"), 1000.0),
    **dict.fromkeys(("ml", "millilitre", "millilitres", "milliliter", "milliliters"), 1.0),
    **dict.fromkeys(("pint", "pints"), 473.0),
    **dict.fromkeys(("quart", "quarts"), 946.0),
    **dict.fromkeys(("gal", "gallon", "gallons"), 3785.0),
}
_MEASURE = f"(?:{'|'.join([*_GRAMS, *_MILLILITRES])})"
_CONTAINER = (
    r"(?:packages?|packs?|packets?|bags?|boxes|box|bottles?|cans?|tins?|jars?|cartons?|loaves|loaf"
    r"|bunch(?:es)?|blocks?|bars?|tubs?|trays?|heads?|containers?|cases?|rolls?|sticks?|bulbs?"
    r"|slices?|pieces?|sets?)"
)
_COUNT = re.compile(
    rf"(?:(?P<number>(?P<digits>\d{{1,6}}(?:\.\d+)?(?=[ a-z]))|{_WORD}(?:[ -]{_WORD})*(?= ))"
    rf" ?(?:x )?(?:(?P<dozen>dozens?) |(?P<measure>{_MEASURE}) (?(digits)(?:of )?|of ))?"
    rf"|(?P<alone>dozens?) )?(?:of |more )*(?P<container>(?:\w+ )?{_CONTAINER} of )?"
)
_SMALL = re.compile(
    r"^(?:(?:in|on|the|some|any(?: kinds? of)?|my|our|your|a (?:bit|little|lot) of|lots of"
    r"|plenty of|enough|also|just|maybe|perhaps|really|of|more|extra|too|much|many|then|please"
    r"|definitely|with|only|another|good|nice|like|such as|all(?: kinds)? of|all|those|these|that"
    r"|this|as well as|both|either|well|oh|yes|yeah|ok|okay|no|hi|hello|so|about"
    r"|actually|take)\b[\s,]*)+"
)
_TAIL = re.compile(
    r"(?:^|\s+)(?:please|too|as well|thanks|thank you|also|for\b.*|if (?:you|possible)\b.*"
    r"|to \w+\b.*|in (?:the|my) (?:basket|cart)|on top|would be \w+|tonight|tomorrow|today|now"
    r"|of course|maybe|perhaps|or so|etc|instead|so that\b.*|because\b.*|since\b.*|which\b.*"
    r"|that (?:is|are|can|will)\b.*|left|at home|on hand|in the (?:house|fridge|pantry|cupboard)"
    r"|in stock|available|there|at all|after all|anymore|any more|of any kind)$"
)
_ASKING = re.compile(
    r"\b(?:(?:i|we|you|they|he|she)(?:'d| would|'ll| will| also| really| just| definitely)*"
    r" (?:need|want|like|love|take|prefer|require|fancy|crave|wish for)s?(?: to (?:get|buy|have"
    r"|order|add|include|use))?|(?:i|we|you|he|she)(?:'d| would|'ll| will)(?: also| just)* have"
    r"|looking for|(?:i'm|we're) after|could (?:do with|use)|in the mood for"
    r"|(?:can|could|may|might) (?:i|we|you)(?: also| please| just)*"
    r" (?:get|have|add|include|find|order|put in|throw in|buy|give me|get me)"
    r"|add(?: in)?|get(?: me| us)?|buy(?: me| us)?|grab|pick up|throw in|put in|include"
    r"|give (?:me|us)|bring(?: me| us)?|order|need|how about|what about|go for"
    r"|let's (?:have|get|add|do|take|go with)|there should be"
    r"|make sure (?:there is|there are|(?:we|i) have|to (?:get|add))|use)\b"
    r"(?: (?:is|are)\b)?(?! to (?!get|buy|have|order|add))"
)
_SPEAKING = re.compile(
    r"\b(?:i|i'm|we|we're|you|he|she|they|it|it's|its|that's|is|are|was|were|be|been|has|have|had"
    r"|do|does|did|will|would|should|could|can(?= \w)|there's|who|what|when|why|how|not|don't"
    r"|doesn't|isn't|let's)\b"
)
_SERVINGS = re.compile(
    rf"\b(?:for|serves?|serving|feeds?|feeding)\s+(?:about |around |up to |roughly )?"
    rf"(?:\d+|(?!an?\b){_WORD}(?:[ -]{_WORD})*|a dozen)\b(?: (?:\w+ )?(?:people|guests|kids"
    r"|children|adults|friends|of us|servings|portions))?|\b\d+ (?:people|guests|servings|portions"
    r"|kids|adults|friends|years?(?: old)?)\b"
)
_HARMS = (
    r"(?:(?<!not )(?<!n't )(?:allerg(?:ic|y|ies) to|(?:intolerant|sensitive) (?:to|of))"
    r"|reacts? (?:\w+ )?to"
    r"|(?:can'?t|cannot|can not|mustn't|must not) (?:eat|have|tolerate|digest|be around))"
)
_NEVER = r"(?:don'?t|doesn'?t|do not|does not|didn'?t|did not|won'?t|never|shouldn'?t)"
_SHUNS = (
    r"(?:no(?! (?:problem|thanks|thank|need|idea|one|preference|rush|worries|matter|doubt|i\b"
    r"|\w* ?allerg))|(?:can'?t|cannot|can not) (?:stand|do|drink|use)"
    rf"|{_NEVER} (?:(?:really|actually|even|ever|want to) )*"
    r"(?:like|eat|have|do|touch|tolerate|drink|care for)s?"
    r"|without|avoid(?:ing)?|free of|free from|nothing (?:with|containing)|hates?|dislikes?)"
)
_DROPS = (
    rf"(?:{_NEVER} (?:(?:really|actually|even|need to) )*"
    r"(?:want|need|add|use|include|buy|get|put)s?|instead of|rather than|other than"
    r"|except(?: for)?|apart from|skip|leave (?:out|off)|hold|remove|take (?:out|off|away)"
    r"|get rid of|drop|omit|put back|not (?:the|any)|anything (?:with|but)|cut out|lose|ditch"
    r"|scratch|never mind|(?<!i )(?<!we )(?<!you )(?<!to )forget(?: about)?)"
)
_REFUSAL = re.compile(
    rf"\b(?:(?P<harms>{_HARMS})|(?P<shuns>{_SHUNS})|{_DROPS})\s+"
    r"(?P<what>[^;!?]+?)(?=\.(?:\s|$)|[;!?]|$)"
    r"|(?<!no )(?<!not )\b(?P<allergen>(?!(?:an?|any|food|known|severe|bad|my|his|her|the|of)\b)"
    r"[\w-]+) (?:allergy|allergies)\b"
    r"|\b(?:take|put|leave)\s+(?P<apart>[^.;!?,]{1,60}?)\s+(?:out|back|off|away)\b"
)
_CART = "(?:basket|cart)"
_STOP = re.compile(
    r"\s(?:but|please|because|since|so|though|although|unless|if|when|for"
    r"|from|in|on|at|to|that|which|either|anymore|any more|again|with|use|and then|then|thanks"
    r"|and (?:i|we|add|get|can|could|please|he|she|they|it|also|the rest|some|a|an|lots|plenty|keep"
    r"|make|put|instead|buy|\d+))\b.*|[,\s]*(?:\u2013|\u2014|\s-\s).*"
)
_ALL = "(?:everything|it all|all of it|them all|all items)"
_CLEARS = re.compile(
    rf"(?<!not )(?<!n't )\b(?:(?:empty|clear) (?:out )?(?:the|my|this) (?:whole |entire )?{_CART}"
    rf"|(?:take|throw|put) {_ALL} (?:out|back|away)|(?:remove|delete|drop) {_ALL}"
    r"|start (?:all )?over)\b(?! (?:but|except))"
)
_REWORDED = [
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r"\ballerg(?:y|ies|ens?)\s?:", "allergic to"),
        (r"(?<=\d),(?=\d{3}\b)", ""),
        (
            r"\b(?:\w+n't|not|never)(?: let (?:me|us))?(?: ever)? (?:forget|miss|skip|omit|drop"
            r"|leave out)\b(?: (?:about|to (?:add|get|buy|include))\b)?",
            "add",
        ),
        (r"\bi (?:almost |nearly )?forgot\b(?: (?:about|to (?:add|get|buy|mention))\b)?", "add"),
        (r"\b(?:an? )?half(?: an?)? dozen\b", "6"),
        (rf"\b({_WORD}) and a half\b", r"\1 half"),
        (r"\b(\d+) (?:and a half|1/2)\b", r"\1.5"),
        (r"\b(?:nobody|no one|none)\b[^.;!?,]{0,40} allergic\b[^.;!?]*", ""),
        (r"\b(?:don't|do not|doesn't|does not) (?:need|want)(?: any)? more [^.;!?,]+", ""),
        (
            r"\b(?:(?:i|we)(?: do not| don't|(?:'ve| have) not) (?:have|got)|haven't got"
            r"|(?:do not|don't|does not|doesn't) have (?:any|enough))\b"
            r"(?! (?:any )?(?:dairy|gluten|lactose|meat|alcohol)\b)",
            ". need",
        ),
        (
            r"\b(?:i|we|i've|we've)(?: have)?(?: got)? (?:no|hardly any)(?= (?!.{0,20}allerg))",
            ". need",
        ),
        (
            r"\bthere(?:'s| is| are) no(?= [^.;!?,]{1,40} (?:at home|in the))"
            r"|\b(?:(?:there(?:'s| is| are)|has|have) )?no(?= [^.;!?,]{1,40} left\b)",
            ". need",
        ),
        (
            r"\b(?:(?:i|we)(?:'m|'re| am| are)|ran|run|running)"
            r"(?: (?:all|just|nearly|almost|completely))? (?:out of|low on|short (?:of|on))\b"
            r"|\b(?:i|we) lack\b",
            ". need",
        ),
        (
            r"(?<!can )(?<!could )(?<!may )(?<!might )(?<!do )(?<!sure )"
            r"\b(?:i|we)(?:'ve| have| already have| still have)\b(?! to\b)(?: got\b)?",
            ". there is",
        ),
        (
            r", so |,? (?:so|but|and|also) (?=(?:no|without|don't|nothing|i|we|let's|i'm|we're)\b)"
            r"|, (?=(?:i|we|i'm|we're|i'd|i'll|we'd|we'll|can you|could you|please)\b)",
            ". ",
        ),
    )
]
"""Patterns, and the plainer words that stand for what they match: lacking a thing is needing it."""


class Refusal(IntEnum):
    """How a thing is refused: left out of the basket, not eaten, or not tolerated."""

    DROPPED = 1
    SHUNNED = 2
    HARMED = 3


@dataclass(frozen=True, slots=True)
class Request:
    """Something asked for.

    Attributes:
        phrase: What, in the person's words and lower case, such as "brown eggs".
        quantity: How many, at least 1; for "two dozen" it is 24, for "1.5 kg" 1500.
        counted: What the quantity counts: packages ("3 bags of chips"), single pieces ("6
            bagels"), pieces by the dozen, or a weight or volume.
    """

    phrase: str
    quantity: int = 1
    counted: Literal["packages", "pieces", "dozens", "grams", "millilitres"] = "pieces"


def packages(request: Request, item: Item) -> int:
    """How many units of `item` the request comes to, 1 to 99.

    Two dozen eggs are two of a unit "12 ct", six bagels one of "6 ct", and 1.5 kg two of "1 kg".
    Where the unit does not say how many pieces it holds, a dozen is taken for one unit, and a
    piece for one unit; so is any weight or volume that the unit cannot be compared with.
    """
    unit = item.unit.lower()
    number = request.quantity
    if request.counted in ("grams", "millilitres"):
        size = re.match(rf"(\d+(?:\.\d+)?)\s*({_MEASURE})\b", unit)
        measures = _GRAMS if request.counted == "grams" else _MILLILITRES
        one = float(size[1]) * measures.get(size[2], 0) if size else 0
        number = math.ceil(number / one - 0.01) if one else 1
    elif request.counted != "packages":
        pieces = re.match(r"(\d+)\s*(?:ct|count|pack|pk|pcs|pieces)\b", unit)
        if pieces and int(pieces[1]) > 0:
            number = math.ceil(number / int(pieces[1]))
        elif request.counted == "dozens" and unit != "each":
            number = math.ceil(number / 12)
    return min(max(number, 1), 99)


def wanted(utterance: str) -> list[Request]:
    """What `utterance` may ask for, in its order; refused things and questions are left out."""
    text = _REFUSAL.sub(_without_refused, _plain(utterance))
    found: dict[str, Request] = {}
    for sentence in sentences(_SERVINGS.sub(" ", text)):
        for part in re.split(r"\bbut\b|\s-\s", sentence.strip(" .;!?")):
            start = 0
            if asks(sentence):
                continue
            if asking := _ASKING.search(part):
                start = asking.end()
            elif _SPEAKING.search(_TAIL.sub("", part)):
                continue
            for chunk in re.split(r",|\band\b|\bplus\b|\bor\b|&|\bwith\b|\balong\b", part[start:]):
                if (request := _request(chunk)) and request.phrase not in found:
                    found[request.phrase] = request
    return list(found.values())


def amount(thing: str, said: str) -> Request:
    """How much of `thing` a person last spoke of, in whatever sentence; else one piece of it."""
    asked = singulars(thing)
    for clause in reversed(re.split(r"[.;:!?,]\s|\band\b", _SERVINGS.sub(" ", said.casefold()))):
        spoken = clause.split()
        for start in range(len(spoken)):
            rest = " ".join(spoken[start:])
            if (match := _COUNT.match(rest)) and (match["number"] or match["alone"]):
                request = _request(rest)
                if request and contains(singulars(request.phrase), asked):
                    return request
    return Request(thing)


def unwanted(utterance: str) -> dict[str, Refusal]:
    """What `utterance` refuses or wants taken out, in lower case and in its order, and how."""
    found: dict[str, Refusal] = {}
    for match in _REFUSAL.finditer(_plain(utterance)):
        ill = match["harms"] or match["allergen"]
        how = Refusal.HARMED if ill else Refusal.SHUNNED if match["shuns"] else Refusal.DROPPED
        for thing in _refused(match):
            found[thing] = max(how, found.get(thing, how))
    return found


def clears(utterance: str) -> bool:
    """Whether the person wants the whole basket emptied."""
    return bool(_CLEARS.search(_plain(utterance)))


def _plain(utterance: str) -> str:
    text = re.sub(r"\s*\n\s*", ". ", utterance[:2000].casefold().replace("\u2019", "'").strip())
    text = " ".join(text.split())
    text = re.sub(
        r"(?:^|(?<=[.;!?,]))([^.;!?,]+?) (?:is|are) (?:a must|essential|needed)\b",
        r". need \1.",
        text,
    )
    for pattern, plain in _REWORDED:
        text = pattern.sub(plain, text)
    return text


def _refused(match: re.Match[str]) -> Iterator[str]:
    """The things that one refusal names."""
    listed = match["what"] or match["apart"] or match["allergen"]
    listed = _STOP.sub("", f" {listed}").strip()
    parts = listed.split(",")
    if not match["harms"] and not re.search(r"\b(?:or|nor)\b", listed):
        parts = [p for p in parts if p is parts[0] or p.strip().startswith(("no ", "or "))]
    for part in re.split(r"\band\b|\bor\b|\bnor\b|[,/]", ",".join(parts)):
        if _ASKING.search(part):
            return
        phrase = re.sub(rf"^(?:{_SHUNS}|{_DROPS}) ", "", part.strip())
        phrase = _TAIL.sub("", _SMALL.sub("", phrase))
        if phrase and len(phrase.split()) <= 4 and not _SPEAKING.search(phrase):
            yield phrase


def _without_refused(match: re.Match[str]) -> str:
    """The rest of a refusal, after the things that it names."""
    listed = match["what"]
    if listed is None:
        return " "
    end = max((listed.find(phrase) + len(phrase) for phrase in _refused(match)), default=0)
    return f" . {listed[end:]}"


def _request(chunk: str) -> Request | None:
    chunk = chunk.strip(" ,-'\"()")
    for _ in range(3):
        chunk = _ASKING.sub("", chunk, count=1).strip() if _ASKING.match(chunk) else chunk
        chunk = _TAIL.sub("", _SMALL.sub("", chunk)).strip(" ,")
    quantity, counted = 1.0, "pieces"
    if match := _COUNT.match(chunk):
        quantity = _number(match["number"] or "1")
        if match["measure"] in _GRAMS:
            quantity, counted = quantity * _GRAMS[match["measure"]], "grams"
        elif match["measure"]:
            quantity, counted = quantity * _MILLILITRES[match["measure"]], "millilitres"
        elif match["dozen"] or match["alone"]:
            quantity, counted = quantity * 12, "dozens"
        elif match["container"]:
            counted = "packages"
        chunk = _TAIL.sub("", _SMALL.sub("", chunk[match.end() :])).strip(" ,")
    is_thing = chunk and not chunk.isdigit() and chunk not in _NUMBERS and len(chunk.split()) <= 5
    if not is_thing or _SPEAKING.search(chunk):
        return None
    return Request(chunk, max(1, min(math.ceil(quantity), 99_999)), counted)


def _number(said: str) -> float:
    """The value of digits or of number words: "a" is 1, "twenty-four" 24, "half a" 0.5."""
    if said[0].isdigit():
        return float(said)
    value = sum(_NUMBERS[word] for word in re.split(r"[ -]", said)) or 1
    return value * 100 if "hundred" in said else value
