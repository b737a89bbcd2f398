"""What a person's words ask for and refuse: candidates, which a language model then weighs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from enum import IntEnum
from functools import lru_cache
from typing import Literal

from goalscope.envs.grocery.amounts import (
    CONTAINER,
    COUNT,
    GRAMS,
    MILLILITRES,
    NUMBERS,
    WORD,
    Request,
    number,
)
from goalscope.envs.grocery.hearing.correcting import CORRECTION
from goalscope.envs.grocery.hearing.moods import Mood
from goalscope.envs.grocery.hearing.phrases import CART, IN_PLACE, TAKES, UNASKED_FOR
from goalscope.envs.grocery.hearing.rewording import ASKING, Said, heard, plain
from goalscope.envs.grocery.words import asks, contains, sentences, singulars

__all__ = [
    "Refusal",
    "amount",
    "besides_refused",
    "clears",
    "pieces",
    "refuses",
    "removed",
    "replaced",
    "spared",
    "uncontained",
    "unrefused",
    "unwanted",
    "wanted",
]

_SMALL = re.compile(
    r"^(?:(?:in|on|the|some|any(?: kinds? of)?|my|our|your|a (?:bit|little|lot) of|lots of"
    rf"|plenty of|enough|{IN_PLACE}|also|just|maybe|perhaps|really|of|more|extra|too|much|many|then"
    r"|please"
    r"|definitely|with|only|another|good|nice|like|such as|all(?: kinds)? of|all|those|these|that"
    r"|this|as well as|both|either|well|oh|yes|yeah|ok|okay|no|hi|hello|hey|so|about"
    r"|actually|take|additional|exactly|my|same"
    r"|(?:normal|regular|ordinary|standard)(?! ones?\b)(?= \w))\b[\s,]*)+"
)
_TAIL = re.compile(
    r"(?:^|\s+)(?:please|too|as well|thanks|thank you|also|for\b.*|if (?:you|possible)\b.*"
    r"|to \w+\b.*|in (?:the|my) (?:basket|cart)|on top|would be \w+|tonight|tomorrow|today|now"
    r"|asap|of course|obviously|naturally|clearly|maybe|perhaps|or so|etc|instead|rather|anyway"
    r"|on (?:\w+ )?(?:mon|tues|wednes|thurs|fri|satur|sun)days?"
    r"|so that\b.*|because\b.*|since\b.*"
    r"|which\b.*"
    r"|that (?:is|are|can|will)\b.*|left|at home|on hand|in the (?:house|fridge|pantry|cupboard)"
    r"|in stock|available|there|though|at all|after all|in total|altogether|again|anymore"
    r"|any more|of any kind|then)$"
)
_SPEAKING = re.compile(
    r"\b(?:i|i'm|we|we're|you|he|she|they|it|it's|its|that's|is|are|was|were|be|been|has|have|had"
    r"|do|does|did|will|would|should|could|can(?= \w)|there's|who|what|when|why|how|not|don't"
    r"|doesn't|isn't|let's|must)\b"
)
_NUMBER = re.compile(rf"\d|\b(?:{WORD}|dozens?)\b")
_BARE = re.compile(r"units?\b")
_SINGLE = re.compile(r"(?:cans?|bottles?|tins?)\b")
"""Containers of which a unit of the shop may hold several, such as a pack of six cans."""
_COUNTED = 12
"""Words that a number and what it counts come to at most."""
_OCCASION = re.compile(
    r"(?:(?:nice|quick|simple|quiet|small|little|big|great|proper|romantic|family|birthday|dinner"
    r"|garden|summer|farewell|christmas|kids'?|children's) )*"
    r"(?:breakfast|brunch|lunch|dinner|supper|party|picnic|barbecue|bbq|feast|celebration)"
    r"(?: (?:on|at|in|this|next|with|outside|outdoors)\b.*)?"
)
"""What is had, and not bought: "a picnic on Sunday"."""
_SERVINGS = re.compile(
    rf"\b(?:for|serves?|serving|feeds?|feeding)\s+(?:about |around |up to |roughly )?"
    rf"(?:\d+|(?!an?\b){WORD}(?:[ -]{WORD})*|a dozen)\b(?: (?:\w+ )?(?:people|guests|kids"
    r"|children|adults|friends|of us|servings|portions))?|\b\d+ (?:people|guests|servings|portions"
    r"|kids|adults|friends|years?(?: old)?)\b"
)
_HARMS = (
    r"(?:(?:allerg(?:ic|y|ies) to|(?:intolerant|sensitive) (?:to|of))"
    r"|reacts? (?:\w+ )?to"
    r"|(?:can'?t|cannot|can not|mustn't|must not) (?:eat|have|tolerate|digest|be around))"
)
_NEVER = r"(?:don'?t|doesn'?t|do not|does not|didn'?t|did not|won'?t|never|no longer|shouldn'?t)"
_SHUNS = (
    r"(?:no(?! (?:problem|thanks|thank|need|reason|point|way|longer|circumstances"
    r"|idea|one|preference|rush|worries|matter|doubt|i\b|\w* ?allerg))"
    r"|(?:can'?t|cannot|can not) (?:stand|do(?! without)|drink|use)"
    rf"|{_NEVER} (?:(?:really|actually|even|ever|want to) )*"
    r"(?:like|eat|have(?! enough)|do(?! without)|touch|tolerate|drink|care for)s?"
    r"|without|avoid(?:ing)?|free of|free from|nothing (?:else |more )?(?:with|containing)"
    r"|hates?|dislikes?)"
)
_DROPS = (
    rf"(?:{_NEVER} (?:(?:really|actually|even|need to) )*"
    r"(?:want to (?:get|buy|have|add|order)|want|need"
    r"|ask(?:ed)? for|order(?:ed)?|mention(?:ed)?|request(?:ed)?"
    r"|(?<!did not )(?<!didn't )(?:add|use|include|buy|get|put))s?"
    r"|skip|leave (?:out|off)|hold|omit|not (?:the|any)|cut out|lose"
    r"|(?:(?<=^)|(?<=[.,;!?] )|(?<=please )|(?<=and )|(?<=let's ))scratch|never mind"
    r"|(?<!i )(?<!we )(?<!you )(?<!to )forget(?: about)?(?! to))"
)
_NOT_ASKED = re.compile(rf"{_NEVER} (?:\w+ )?(?:ask(?:ed)? for|order(?:ed)?|request(?:ed)?) ")
_BESIDE = r"(?:instead of|rather than|other than|except(?: for)?|apart from|anything (?:with|but))"
_REFUSAL = re.compile(
    rf"\b(?:(?P<harms>{_HARMS})|(?P<shuns>{_SHUNS})|(?P<takes>{TAKES})|(?P<beside>{_BESIDE})"
    rf"|{_DROPS})\s+"
    r"(?P<what>[^;!?]+?)(?=\.(?:\s|$)|[;!?]|$)"
    r"|\b(?P<allergen>(?!(?:an?|any|food|known|severe|bad|my|his|her|the|of)\b)"
    r"[\w-]+) (?:allergy|allergies)\b"
    r"|(?<!n't )(?<!not )\b(?:take|put|throw|leave)\s+"
    r"(?P<apart>(?:the|my|these|those|all|both)\b"
    r"(?:(?!\b(?:i|we|is|are|for|going|add|get|put|take|leave|throw)\b)[^.;!?]){1,200}?"
    r"|(?:(?!\b(?:i|we|is|are|for|add|get|put|take|leave|throw)\b)[^.;!?,]){1,60}?)"
    rf"\s+(?:out|back|off|away)\b(?:\s+(?:of|from|in|into) (?:the|my|our|this) {CART}\b)?"
)
_SEPARATOR = re.compile(r",|\band\b|\bplus\b|\bor\b|&|\bwith\b|\balong\b")
_NO_THING = {
    *NUMBERS, "g", "kg", "l", "ml", "lb", "lbs", "oz", "to", "the", "for", "with", "me", "'s", "s",
    "if", "at", "in", "on", "it",
}  # fmt: skip
_KEEP = re.compile(
    r"\s*(?:(?:please|you can|do|no|ok|okay|actually|but|and|wait|well|just|then|let's|i'd like to"
    r"|i want to|we can)[ ,]+)*(?:keep|leave)\b"
)
_KEPT = re.compile(
    r"(?:^|(?<=[,.;] )|(?<=\bbut )|(?<=\band )|(?<=please )"
    r"|(?<=actually ))(?:keep|leave)"
    r"(?! (?:only|out|off|away|it)\b) (?P<what>(?:(?!\b(?:out|off|away|back|i|we|for)\b)[^.;!?])+)"
    r"|\bguess(?:ed|es)?,? (?:except(?: for)?|but(?: not)?|apart from) (?P<but>[^.;!?]+)"
)
"""What is to stay, whoever asked for it."""
_ONLY = re.compile(r"\bkeep only ([^.;!?]+)")
_MORE = re.compile(rf"(?:\w+ )*?(?:(?:another|additional|more)\b|(?:\d+|{WORD}) extra\b)")
_EXACTLY = re.compile(r"(?:\w+ )*?(?:exactly|only|just) (?=\d|\w+ )")
_CONTAINED = re.compile(rf"\b(?:{CONTAINER} of|(?:half )?(?:an? )?dozens?(?: of)?)\b")
_LIST = re.compile(r"\s*(?:and |or )?(?:eachof|the|my|any|that|those|these|this|all|both)\b")
_NEW = re.compile(
    rf"\s*(?:and )?(?:\d|{WORD}\b(?! of (?:the|my|those|these)\b)"
    r"|(?:some|more|another|also|plus|then|instead|only|just|maybe|enough|plenty|lots|with|keep)\b)"
)
_AND_SO_MANY = re.compile(rf"\band(?= (?:\d+|{WORD})\b(?! more\b))")
_STOP = re.compile(
    r"\s(?:but|please|because|since|so|though|although|unless|if|when|for"
    r"|from|in|on|at|to|that|which|either|anymore|any more|again|with|use|and then|then|thanks"
    r"|and (?:i|we|add|get|can|could|please|he|she|they|it|also|the rest|some|a|an|lots|plenty|keep"
    rf"|make|put|instead|buy|(?:\d+|{WORD})(?! of (?:the|my|those|these)\b)))\b.*|"
    r"[,\s]*(?:\u2013|\u2014|\s-\s).*"
)
_ALL = (
    r"(?:(?:everything|all items)(?=\s*(?:[.,;!?]|$|\b(?:and|please|now|again|then|thanks|thank|out"
    r"|back|away|off|from|so|because|since|i|we|you|in|it|there|at|right|else|for|if|to"
    r"|that (?:is|was|i|we|you)|that's|which is|but|except|nobody|no one)\b))"
    r"|it all|all of it|them all)"
)
_SUCH = r"(?:things?|items?|products?|stuff|foods?)"
_HAVING = (
    r" (?:with|containing|having|made (?:of|with|from)"
    r"|(?:that|which) (?:has|have|contains?|is made (?:of|with|from)))"
)
_EVERY = re.compile(
    rf"\b(?:(?:anything|everything|whatever|(?:all|any)(?: of)?(?: the| my| those)? {_SUCH})"
    rf"(?:{_HAVING})?|{_SUCH}{_HAVING})(?: any| some)? (?=\w)"
    r"(?!(?:i|we|you|nobody|no|that|which|but|except|apart|other|else|from|in|on|out|off|back|away"
    r"|again|please|and|or|at|for|to|is|was|now|then|so|because)\b)"
)
_SUCH_THINGS = re.compile(
    r"^(?:all|any)(?: of)?(?: the| my| those)? (.+) (?:things?|products?|stuff)$"
)
_HOW: Mapping[str, Literal["double", "half", "cheaper"]] = {
    "twofold": "double",
    "halved": "half",
    "lowpriced": "cheaper",
}
_EVERY_SUCH = "eachof "
_CLEARS = re.compile(
    rf"\b(?:(?:empty|clear) (?:out )?(?:the|my|this) (?:whole |entire )?{CART}"
    rf"|(?:take|throw|put) {_ALL} (?:out|back|away)|(?:remove|delete|drop|clear) {_ALL}"
    rf"|start (?:all )?(?:over|again|anew|from scratch))\b(?! (?:but|except|that is not"
    rf"|which is not)|{UNASKED_FOR})"
)
_DENIED = re.compile(
    r"\b(?:not|never|nobody|cannot|no (?:one|need|reason|longer|point|way)|\w+n't|unless|in case"
    r"|if(?! (?:possible|you (?:can|could|like))\b))"
    r"(?: (?!(?:as|just|only|so|but|and|because|please|with|that)\b)[\w']+){0,4} $"
)
_NOT_ILL = re.compile(
    r"\b(?:not|never|neither|no longer|\w+n't|(?:nobody|no one|none)(?: \w+){0,2})"
    r"(?: (?:is|are|was|at all|actually|really|even|any|a|anymore|longer|seriously))* $"
)


class Refusal(IntEnum):
    """How a thing is refused: left out of the basket, not eaten, or not tolerated."""

    DROPPED = 1
    SHUNNED = 2
    HARMED = 3


@lru_cache(maxsize=512)
def wanted(said: Said) -> tuple[Request, ...]:
    """What a clause may ask for, in its order; refused things and questions are left out."""
    if said.mood is Mood.QUESTION:
        return ()
    found: dict[str, Request] = {}
    replaces = replaced(said)
    new = _new(said) if replaces else []
    for _, request, asked in pieces(said):
        if request is None:
            continue
        if replaces and (not new or request.phrase in new):
            many = not request.outright and request.change == "at least"
            change = "as many" if many else request.change
            request = replace(request, replaces=replaces, change=change)
        if asked:
            request = replace(request, outright=True)
        if request.phrase not in found or request.change == "exactly":
            found[request.phrase] = request
    return tuple(found.values())


def _new(said: Said) -> list[str]:
    """What takes the place of another: "tea" in "tea instead of coffee, and eggs"."""
    beside = (m.start() for m in _refusals(said) if m["beside"])
    before = replace(said, text=said.text[: next(beside, 0)])
    return [request.phrase for _, request, _ in pieces(before) if request]


def pieces(said: Said) -> Iterator[tuple[str, Request | None, bool]]:
    """What a clause neither refuses nor asks about, in pieces.

    With each comes the request that it may be, and whether a verb asks for it.
    """
    for sentence in sentences(_SERVINGS.sub(" ", besides_refused(said))):
        if asks(sentence):
            continue
        for part in re.split(r"\bbut\b|\s-\s", sentence.strip(" .;!?")):
            if _KEEP.match(part):
                continue
            asking = ASKING.search(part)
            if asking is None and _SPEAKING.search(_TAIL.sub("", part)):
                yield part, None, False
                continue
            if asking:
                yield part[: asking.start()], None, True
            for chunk in _SEPARATOR.split(part[asking.end() if asking else 0 :]):
                yield chunk, _request(chunk), bool(asking)


def amount(thing: str, said: str) -> Request:
    """How much of `thing` a person last spoke of, in whatever sentence; else one piece of it."""
    asked = singulars(thing)
    for spoken, meant in _spoken(said):
        if contains(meant, asked):
            for start in range(len(spoken)):
                request = _counted(" ".join(spoken[start : start + _COUNTED]))
                if request and contains(singulars(request.phrase), asked):
                    return request
    return Request(thing)


@lru_cache(maxsize=8)
def _spoken(said: str) -> list[tuple[list[str], list[str]]]:
    """The words of each clause with a number, and their singulars; the newest first."""
    text = _SERVINGS.sub(" ", said.casefold())
    parts = reversed(re.split(r"[.;:!?,]\s|\band\b", text))
    return [(part.split(), singulars(part)) for part in parts if _NUMBER.search(part)]


@lru_cache(maxsize=4096)
def _counted(said: str) -> Request | None:
    count = COUNT.match(said)
    return _request(said) if count and (count["number"] or count["alone"]) else None


@lru_cache(maxsize=512)
def unwanted(said: Said) -> Mapping[str, Refusal]:
    """What a clause refuses or wants taken out, in lower case and in its order, and how."""
    found: dict[str, Refusal] = {}
    for match in _refusals(said):
        ill = match["harms"] or match["allergen"]
        how = Refusal.HARMED if ill else Refusal.SHUNNED if match["shuns"] else Refusal.DROPPED
        for thing in _refused(match):
            if thing.change == "none":
                found[thing.phrase] = max(how, found.get(thing.phrase, how))
    return found


@lru_cache(maxsize=512)
def removed(said: Said) -> tuple[Request, ...]:
    """What a clause wants taken out of the basket, all of it or so many fewer."""
    matches = (m for m in _refusals(said) if m["takes"] or m["apart"])
    return tuple(thing for match in matches for thing in _refused(match))


def replaced(said: Said) -> tuple[str, ...]:
    """What makes way for what the clause asks for, in lower case."""
    if IN_PLACE in said.text:
        return tuple(removal.phrase for removal in removed(said))
    beside = (m for m in _refusals(said) if (m["beside"] or "").startswith(("instead", "rather")))
    return tuple(thing.phrase for match in beside for thing in _refused(match))


def spared(said: Said) -> list[str]:
    """What alone is to stay in the basket, in lower case."""
    kept = _ONLY.findall(said.text) if said.mood is Mood.ORDER else ()
    return [thing.phrase for each in kept for thing in _listed(_STOP.sub("", each))]


def kept(said: Said) -> list[str]:
    """What is to stay as it is, in lower case; other things may stay, too."""
    found = _KEPT.finditer(said.text) if said.mood is Mood.ORDER else ()
    phrases = (each["what"] or each["but"] for each in found)
    return [thing.phrase for each in phrases for thing in _listed(_STOP.sub("", each))]


def refuses(utterance: str) -> bool:
    """Whether `utterance` refuses anything, corrects itself, or counts in containers."""
    containers = _CONTAINED.search(plain(utterance))
    refusals = any(True for said in heard(utterance) for _ in _refusals(said))
    return bool(containers or CORRECTION.search(utterance) or refusals)


def unrefused(utterance: str) -> str:
    """`utterance` without what it refuses, and without containers."""
    return uncontained(" ".join(map(besides_refused, heard(utterance))))


def uncontained(text: str) -> str:
    """`text` without containers: "a bag of" says no thing."""
    return _CONTAINED.sub(" ", text)


def clears(said: Said) -> bool:
    """Whether the person wants the whole basket emptied."""
    return said.mood is Mood.ORDER and bool(_CLEARS.search(said.text))


def _refusals(said: Said) -> Iterator[re.Match[str]]:
    return (match for match in _REFUSAL.finditer(said.text) if _counts(match, said.mood))


def _counts(match: re.Match[str], mood: Mood) -> bool:
    """Whether a refusal is meant: none is in a question or after a "not", but what harms may be."""
    before = match.string[max(0, match.start() - 80) : match.start()]
    if match["harms"] or match["allergen"]:
        return not _NOT_ILL.search(before)
    if match["takes"] or match["apart"]:
        return mood is Mood.ORDER
    return mood is not Mood.QUESTION and not _DENIED.search(before)


def besides_refused(said: Said) -> str:
    """A clause without what it refuses, and without the refusals that it denies."""
    return _REFUSAL.sub(
        lambda match: (
            _without_refused(match)
            if _counts(match, said.mood)
            else f" . {match[0].partition(',')[2]}"
        ),
        _CLEARS.sub(" . ", said.text),
    )


def _refused(match: re.Match[str]) -> Iterator[Request]:
    """The things that one refusal names, each with the change "none" or "fewer"."""
    listed = match["what"] or match["apart"] or match["allergen"]
    listed = _EVERY.sub(_EVERY_SUCH, listed)
    asking = ASKING.search(listed)
    listed = f" {listed[: asking.start() if asking else None]}"
    if match["takes"] and _NEW.match(listed):  # as "one banana and one lemon"
        listed = _AND_SO_MANY.sub("&", listed)
    listed = _STOP.sub("", listed).strip(" ,")
    for part in re.split(r"\band\b|\bor\b|\bnor\b|[,/&]", _enumerated(match, listed)):
        part = re.sub(rf"^(?:{_SHUNS}|{_DROPS}|{TAKES}) ", "", part.strip())
        count = COUNT.match(re.sub(r"^(?:the|my) ", "", part))
        counted = match["takes"] or match["apart"]
        if counted and count and (count["number"] or count["alone"]):
            if thing := _request(part):
                yield replace(thing, change="fewer")
            continue
        part = _SUCH_THINGS.sub(rf"{_EVERY_SUCH}\1", part)
        every = part.startswith(_EVERY_SUCH)
        phrase = _TAIL.sub("", _SMALL.sub("", part.removeprefix(_EVERY_SUCH)))
        if phrase == "everything":
            continue
        if phrase and len(phrase.split()) <= 4 and not _SPEAKING.search(phrase):
            yield Request(phrase, change="none", every=every)


def _enumerated(match: re.Match[str], listed: str) -> str:
    """As much of a list with commas as one refusal means; requests may follow it."""
    first, *rest = listed.split(",")
    every = match["apart"] or match["harms"] or _NOT_ASKED.match(match[0])
    if every or re.search(r"\b(?:or|nor)\b", listed):
        return listed
    bare = match["takes"] and (
        re.search(r"\band\b|&", listed) or not re.search(r"\b(?:please|instead)\b", match["what"])
    )
    meant, goes_on = [first], not (match["shuns"] or match["beside"] or match[0][:3] == "not")
    for part in rest:
        goes_on = goes_on and bool(_LIST.match(part) or (bare and not _NEW.match(part)))
        if goes_on or part.strip().startswith(("no ", "or ")):
            meant.append(part)
    return ",".join(meant)


def _without_refused(match: re.Match[str]) -> str:
    """The rest of a refusal, after the things that it names."""
    listed = match["what"]
    if listed is None:
        return " "
    end = max((listed.find(r.phrase) + len(r.phrase) for r in _refused(match)), default=0)
    return f" . {listed[end:]}"


def _listed(text: str) -> Iterator[Request]:
    """The requests for what a text lists."""
    return (found for chunk in _SEPARATOR.split(text) if (found := _request(chunk)))


def _request(chunk: str) -> Request | None:
    said = chunk = chunk.strip(" ,-'\"()")[:200]
    for _ in range(3):
        chunk = ASKING.sub("", chunk, count=1).strip() if ASKING.match(chunk) else chunk
        chunk = _TAIL.sub("", _SMALL.sub("", chunk)).strip(" ,")
    quantity, counted = 1.0, "pieces"
    change = "more" if _MORE.match(said) else "at least"
    outright = False
    how, _, rest = chunk.partition(" ")
    if how in _HOW:
        thing, change = _TAIL.sub("", _SMALL.sub("", rest)), _HOW[how]
        return Request(thing, change=change, outright=True) if thing else None
    if match := COUNT.match(chunk):
        quantity = number(match["number"] or "1")
        outright = bool(match["number"] or match["alone"] or match["container"])
        if match["number"] and _EXACTLY.match(said):
            change = "exactly"
        if match["measure"] in GRAMS:
            quantity, counted = quantity * GRAMS[match["measure"]], "grams"
        elif match["measure"]:
            quantity, counted = quantity * MILLILITRES[match["measure"]], "millilitres"
        elif match["dozen"] or match["alone"]:
            quantity, counted = quantity * 12, "dozens"
        elif match["container"]:
            single, bare = map(
                bool, (_SINGLE.match(match["container"]), _BARE.match(match["container"]))
            )
            counted = "pieces" if single else "units" if bare else "packages"
        chunk = _TAIL.sub("", _SMALL.sub("", chunk[match.end() :])).strip(" ,")
    is_thing = chunk and not chunk.isdigit() and chunk not in _NO_THING and len(chunk.split()) <= 5
    if not is_thing or not quantity or _SPEAKING.search(chunk) or _OCCASION.fullmatch(chunk):
        return None
    return Request(chunk, max(1, min(math.ceil(quantity), 99_999)), counted, change, outright)
