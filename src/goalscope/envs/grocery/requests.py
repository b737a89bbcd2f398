"""What a person's words ask for and refuse: candidates, which a language model then weighs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from goalscope.envs.grocery.catalogue import Item

__all__ = ["Request", "packages", "unwanted", "wanted"]

_NUMBERS = {
    **{
        "a couple of": 2,
        "a couple": 2,
        "couple of": 2,
        "a pair of": 2,
        "a few": 3,
        "a": 1,
        "an": 1,
    },
    **{"one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8},
    **{"nine": 9, "ten": 10, "eleven": 11, "twelve": 12},
}
_NUMBER = "|".join(sorted((re.escape(word) for word in _NUMBERS), key=len, reverse=True))
_CONTAINER = (
    r"(?:packages?|packs?|packets?|bags?|boxes|box|bottles?|cans?|tins?|jars?|cartons?|loaves|loaf"
    r"|bunch(?:es)?|kilos?|kg|kilograms?|pounds?|lbs?|lit(?:er|re)s?|l|blocks?|bars?|tubs?|trays?"
    r"|heads?|containers?|cases?|rolls?|sticks?|gallons?|bulbs?|slices?|pieces?|sets?)"
)
_COUNT = re.compile(
    rf"(?:(?P<number>\d{{1,3}}|{_NUMBER})\b\s*(?:x\b\s*)?)?(?P<more>more\s+)?"
    rf"(?P<dozen>dozens?\b\s*(?:of\s+)?)?(?P<container>(?:(?:big|small|large)\s+)?{_CONTAINER}"
    r"\s+(?:of|worth of)\s+)?"
)
_SMALL = re.compile(
    r"^(?:(?:in|on|the|some|any|my|our|your|a (?:bit|little|lot) of|lots of|plenty of|enough|also"
    r"|just"
    r"|maybe|perhaps|really|of|more|extra|too|then|please|definitely|with|only|another|good|nice"
    r"|for sure|a kind of|something like|things like|stuff like|like|such as|all the|all of the"
    r"|those|these|that|this|as well as|both|either|well|oh|yes|yeah|ok|okay|no|hi|hello)\b[\s,]*)+"
)
_TAIL = re.compile(
    r"(?:^|\s+)(?:please|too|as well|thanks|thank you|also|for (?:the|my|our) \w+ who\b.*"
    r"|for (?:me|us|him|her|them|now|today|sure|everyone|everybody|the \w+|my \w+|our \w+|it|that"
    r"|this|\w+ing\b.*)|if (?:you|possible)\b.*"
    r"|to (?:the|my) (?:basket|cart)|in (?:the|my) (?:basket|cart)|on (?:top|it)|to go with\b.*"
    r"|tonight|tomorrow|of course|obviously|maybe|perhaps|to start(?: with)?|or so|and so on|etc"
    r"|instead|so that\b.*|because\b.*|since\b.*|which\b.*"
    r"|that (?:is|are|can|will)\b.*|to (?:sell|make|bake|cook|serve|put|go|eat|drink|decorate"
    r"|share)\b.*"
    r"|in stock|available|there|at all|would be (?:nice|great|good|lovely))$"
)
_ASKING = re.compile(
    r"\b(?:(?:i|we|you|they|he|she)(?:'d| would|'ll| will| also| really| just| definitely)*"
    r" (?:need|want|like|love|take|have|prefer|require|wish for)s?(?: to (?:get|buy|have|order|add"
    r"|include|use))?|looking for|(?:can|could|may|might) (?:i|we|you)(?: also| please| just)*"
    r" (?:get|have|add|include|find|order|put in|throw in|buy|give me|get me)|add(?: in)?"
    r"|get(?: me| us)?"
    r"|buy(?: me| us)?|grab|pick up|throw in|put in|include|give me|bring(?: me)?|order"
    r"|(?:do|don't|do not) (?:you )?(?:have|forget|miss)|need|how about|what about|go for|let's"
    r" (?:have|get|add|do|take|go with)|there should be|make sure (?:there is|there are|to (?:get"
    r"|add))"
    r"|use)\b(?! to (?!get|buy|have|order|add))"
)
_SPEAKING = re.compile(
    r"\b(?:i|i'm|we|we're|you|he|she|they|it|it's|its|that's|is|are|was|were|be|been|has|have|had"
    r"|do"
    r"|does|did|will|would|should|could|can|there's|who|what|when|why|how|not|don't|doesn't"
    r"|isn't)\b"
)
_SERVINGS = re.compile(
    rf"\b(?:for|serves?|serving|feeds?|feeding)\s+(?:about |around |up to |roughly )?(?:\d+"
    rf"|{_NUMBER}"
    r"|(?:twenty|thirty|forty|fifty)(?:[- ]\w+)?|a dozen)(?: (?:\w+ )?(?:people|persons?|guests"
    r"|kids"
    r"|children|adults|friends|of us|servings|portions|customers))?\b|\b\d+ (?:people|guests"
    r"|servings"
    r"|portions|kids|adults|friends|years?(?: old)?)\b"
)
_REFUSAL = re.compile(
    r"\b(?:no(?! (?:problem|thanks|thank|need|idea|one|preference|rush|worries|matter|doubt|i\b))"
    r"|(?:can'?t|cannot|can not) (?:eat|have|stand|do|tolerate|drink|use|be around)"
    r"|(?:don'?t|doesn'?t|do not|does not|didn'?t|did not|won'?t|never|shouldn'?t|must not)"
    r" (?:(?:really|actually|even|want to|need to) )*(?:want|need|like|eat|have|add|use|include"
    r"|buy|get|put|drink|care for)"
    r"|without|instead of|rather than|other than|except(?: for)?|apart from|avoid(?:ing)?|skip"
    r"|leave out|leave off|hold|free of|free from|allerg(?:ic|y) to|intolerant (?:to|of)"
    r"|remove|take (?:out|off|away)|get rid of|drop|put back|nothing (?:with|containing)|hates?"
    r"|dislikes?|not (?:the|any)|anything (?:with|but)|cut out|lose)\s+(?P<what>[^.;!?]+)"
    r"|\b(?:take|put|leave)\s+(?P<apart>[^.;!?,]{1,60}?)\s+(?:out|back|off|away)\b"
)
_STOP = re.compile(
    r"\s(?:but|please|because|since|so|though|although|unless|if|when|for (?:me|us|him|her|them"
    r"|now)"
    r"|from|in|on|at|to|that|which|either|anymore|any more|again|with|use|and then|then|thanks"
    r"|and (?:i|we|add|get|can|could|please|he|she|they|it|also|the rest|some|a|an|lots|plenty|keep"
    r"|make|put|instead|buy|\d+))\b.*|[,\s]*(?:\u2013|\u2014|\s-\s).*"
)


@dataclass(frozen=True, slots=True)
class Request:
    """Something asked for.

    Attributes:
        phrase: What, in the person's words and lower case, such as "brown eggs".
        quantity: How many, at least 1; for "two dozen" it is 24.
        counted: What the quantity counts: packages ("3 bags of chips"), single pieces ("6
            bagels"), or pieces by the dozen.
    """

    phrase: str
    quantity: int = 1
    counted: Literal["packages", "pieces", "dozens"] = "pieces"


def packages(request: Request, item: Item) -> int:
    """How many units of `item` the request comes to, 1 to 99.

    Two dozen eggs are two of a unit "12 ct" and six bagels one of "6 ct". Where the unit does not
    say how many pieces it holds, a dozen is taken for one unit, and a piece for one unit.
    """
    pieces = re.match(r"(\d+)\s*(?:ct|count|pack|pk|pcs|pieces)\b", item.unit.lower())
    number = request.quantity
    if request.counted != "packages" and pieces and int(pieces[1]) > 0:
        number = math.ceil(number / int(pieces[1]))
    elif request.counted == "dozens":
        number = math.ceil(number / 12)
    return min(max(number, 1), 99)


def wanted(utterance: str) -> list[Request]:
    """What `utterance` may ask for, in its order; refused things are left out."""
    text = _plain(utterance)
    text = _SERVINGS.sub(" ", _REFUSAL.sub(_without_refused, text))
    found: dict[str, Request] = {}
    for sentence in re.split(r"[.;!?\n]+|\bbut\b|\s-\s|:", text):
        start = 0
        if asking := list(_ASKING.finditer(sentence)):
            start = asking[0].end()
        elif _SPEAKING.search(_TAIL.sub("", sentence)):
            continue
        for chunk in re.split(r",|\band\b|\bplus\b|\bor\b|&|\bwith\b|\balong\b", sentence[start:]):
            if (request := _request(chunk)) and request.phrase not in found:
                found[request.phrase] = request
    return list(found.values())


def unwanted(utterance: str) -> list[str]:
    """What `utterance` refuses or wants taken out, in lower case and in its order."""
    found: dict[str, None] = {}
    for match in _REFUSAL.finditer(_plain(utterance)):
        found |= dict.fromkeys(_refused(match))
    return list(found)


def _plain(utterance: str) -> str:
    text = " ".join(utterance[:2000].casefold().replace("\u2019", "'").split())
    text = re.sub(r"\b(?:don't|do not|never) (?:forget|miss)\b", "add", text)
    text = re.sub(
        r"(?:^|(?<=[.;!?,]))([^.;!?,]+?) (?:is|are) (?:a must|essential|needed)\b",
        r". need \1.",
        text,
    )
    return re.sub(
        r",? (?:so|but|and|also) (?=(?:no|without|don't|nothing|i|we|let's)\b)", ". ", text
    )


def _refused(match: re.Match[str]) -> Iterator[str]:
    """The things that one refusal names."""
    listed = match["what"] or match["apart"]
    listed = _STOP.sub("", f" {listed}").strip()
    parts = listed.split(",")
    if not re.search(r"\b(?:or|nor)\b", listed):
        parts = [p for p in parts if p is parts[0] or p.strip().startswith(("no ", "or "))]
    for part in re.split(r"\band\b|\bor\b|\bnor\b", ",".join(parts).replace(",", " or ")):
        phrase = _TAIL.sub("", _SMALL.sub("", part.strip()))
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
    chunk = chunk.strip(" ,'\"()")
    for _ in range(3):
        chunk = _ASKING.sub("", chunk, count=1).strip() if _ASKING.match(chunk) else chunk
        chunk = _TAIL.sub("", _SMALL.sub("", chunk)).strip(" ,")
    match = _COUNT.match(chunk)
    quantity, counted = 1, "pieces"
    if match:
        number = match["number"] or "1"
        quantity = int(number) if number.isdigit() else _NUMBERS[number]
        if match["dozen"]:
            quantity, counted = quantity * 12, "dozens"
        elif match["container"]:
            counted = "packages"
        chunk = _TAIL.sub("", _SMALL.sub("", chunk[match.end() :])).strip(" ,")
    is_thing = chunk and not chunk.isdigit() and len(chunk.split()) <= 5
    if not is_thing or _SPEAKING.search(chunk):
        return None
    return Request(chunk, max(1, min(quantity, 999)), counted)
