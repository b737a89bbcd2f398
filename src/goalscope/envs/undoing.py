"""Words that ask to take back what the last ones led to."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import agrees, evened, kept

__all__ = ["ALL", "END", "LEAD", "Undoing", "undoes"]

ALL = -1
"""In place of a number of rounds: every one."""

_NUMBERS = {"two": 2, "three": 3, "four": 4, "five": 5, "twice": 2}
LEAD = (
    r"(?:(?:no|oh|oops|ok(?:ay)?|wait|sorry|actually|now|please|and|then|just|yes|hey|argh?|ah+|damn"
    r"|can you|could you|would you|will you|can we|can i|let's|i want to|i'd like to"
    r"|i want you to|i need to|you can)[ ,.!]+)*+"
)
"""What leads to an order."""

END = (
    r"(?:[ ,]+(?:please|right (?:now|away)|now|for now|again|for me|thanks|sorry|too|also"
    r"|as well))*+[ .!?]*+"
)
"""What ends it."""

_KIND = (
    r"(?:ones?|things?|steps?|orders?|actions?|acts?|moves?|changes?|commands?|requests?|bit"
    r"|messages?)"
)
_SAID = (
    rf"(?:(?:the|my|your|that) )?(?:very )?(?:last|previous) {_KIND}"
    r"(?: (?:you|i)(?: just|'ve)? (?:did|done|said|asked for))?"
)
_LAST = (
    rf"(?:that(?: one)?|it|this|them|these|those|{_SAID}"
    rf"|what you(?: just|'ve)? d(?:id|one)(?: last| just now| (?:with|for|after|on) {_SAID})?"
    r"|what i(?: just|'ve)? said"
    rf"|(?:everything|all(?: of it)?) (?:from|of|in|for|since) {_SAID})"
)
_NUMBER = r"[1-9]\d{0,2}|two|three|four|five"
_SEVERAL = (
    rf"(?:(?P<both>both(?: of (?:them|those|these))?)|(?:{_LAST} )?"
    rf"(?P<times>twice|[1-9]\d{{0,2}} times)"
    rf"|(?:all )?(?:of )?(?:(?:the|my|your) )?(?:very )?(?:last|previous)"
    rf" (?P<number>{_NUMBER})(?: {_KIND})?|(?P<steps>{_NUMBER}) {_KIND})"
)
_ALL = (
    r"(?:(?:undo|revert|reverse) (?:everything|it all|them all|all (?:the |my )?changes"
    r"|all (?:of )?(?:that|it|this)|all)(?: you(?: just|'ve)? d(?:id|one))?"
    r"|put (?:everything|it all|them all|all) back (?:to )?(?:how|(?:in )?the way|as)"
    r" (?:it|everything|they|things) (?:was|were)(?: before)?)"
)
_UNDOES = re.compile(
    rf"{LEAD}(?:(?:undo|revert|reverse)(?: {_LAST})?|(?:cancel|scratch|scrap) {_LAST}"
    rf"|(?:undo|revert|reverse|cancel|take back) {_SEVERAL}|(?P<all>{_ALL})"
    r"|take that back|take back (?:that|what (?:i(?: just)? said|you did(?: last| just now)?)"
    rf"|{_SAID}"
    rf"|what you(?: just|'ve)? d(?:id|one) (?:with|for|after|on) {_SAID})|take {_SAID} back"
    r"|go back (?:one|a|one step|a step)"
    r"|put (?:it|things) back (?:to )?(?:how|the way|as) (?:it|they|things) (?:was|were)"
    rf"(?: before)?|(?P<vague>(?:undo|revert|reverse|cancel|take back) (?:the|my|your) last few"
    rf"(?: {_KIND})?|(?:undo|revert|reverse) (?:all (?:of )?)?{_LAST}(?: [\w']+){{1,8}})){END}"
)
_PARTS = re.compile(r"([.;:!?]+(?: +|$)|,+ *| (?:and|then|but|&) | (?=because\b))")
_WHEN = re.compile(r"(?:but|if|unless|until|when|once|before|after|except|only)\b")
_EXCEPT = re.compile(
    r"\b((?:undo|revert|reverse) (?:everything|it all|all(?: of (?:it|that))?|that|it)),?"
    r" (?:except(?: for)?|apart from|other than|but(?: not)?)"
    r" (?=(?:the|my|our|that|those|these|this) (?!is\b))"
)
_SPARES = re.compile(
    r"but (?:please )?(?:leave|keep|not|don't|do not)\b(?! (?:if|when|unless|until))"
)
_WHY = re.compile(
    r"(?!.*(?:allerg|intoleran|coeliac|celiac|can't|cannot|\b(?:ill|sick)\b))"
    r"(?:(?:i|we)(?:'ve| have)? changed (?:my|our) minds?"
    r"|(?:that(?:'s| is| was) )?my (?:bad|mistake|fault|error)"
    r"|(?:i|we) (?:do not|don't|did not|didn't) (?:really )?(?:like|want|mean)"
    r"(?: (?:it|that|this|them|to))?(?: there| like that| any ?more)?"
    r"|(?:it|that|this) (?:looks?|is|was|feels?)(?: [\w']+){1,4}|because\b.*)"
)
"""Why something is taken back."""


_OF_THE_LAST = re.compile(r"\b(?:last|previous)\b")
"""What does not take back what is said along with it."""

_STATES = re.compile(
    r"(?:i|we|you|he|she|it|they|that|this|nobody|(?:my|our|the) \w+)"
    r"(?:'s|'re|'m| is| are| was| were| am| has| have| had| do| does| did)(?:n't)?\b"
)
"""What is told, and orders nothing."""


@dataclass(frozen=True, slots=True)
class Undoing:
    """What is asked for by words such as "No, undo that. Add oat milk".

    Attributes:
        number: How many rounds are to be taken back, `ALL` for every one; 0 where the words take
            back themselves, as in "add milk, scratch that, add eggs"; None where it is not plain,
            as in "undo that if it is too dear".
        rest: What the words say besides, evened; "" for nothing.
        own: What of themselves the words take back.
    """

    number: int | None
    rest: str = ""
    own: str = ""


@lru_cache(maxsize=1024)
def undoes(utterance: str) -> Undoing | None:
    """What is to be taken back; None where nothing asks for it."""
    text = evened(kept(re.sub(r"\s*\n\s*", ". ", utterance.strip())))
    text = _EXCEPT.sub(r"\1, but leave ", text)
    parts = _PARTS.split(text)
    found = {i: each for i in range(0, len(parts), 2) if (each := _UNDOES.fullmatch(parts[i]))}
    if not found:
        return None
    first, last = next(iter(found)), [*found][-1]
    rest = _joined(parts, (i for i in range(0, len(parts), 2) if i not in found))
    before, after = parts[:first], parts[first + 1 :]
    if any(map(_WHEN.match, before)):
        return Undoing(None, rest)
    told = (_is_aside(s) or _STATES.match(s) or mark[:1] == "?" for s, mark in _pairs(before))
    if not all(told) and not _OF_THE_LAST.search(parts[first]):
        own = _joined(parts, (i for i in range(0, last, 2) if i not in found))
        return Undoing(0, _joined(parts, range(last + 2, len(parts), 2)), own)
    then = "".join(after).strip(" ,")
    spares = _SPARES.match(then)
    condition = _WHEN.match(then) and not spares
    if spares:
        rest = re.sub(r"^(?:please )?not\b", "leave", rest.removeprefix("but "))
    several = len(found) > 1 and (rest or any(_number(each) != 1 for each in found.values()))
    if condition or several or found[first]["vague"]:
        return Undoing(None, rest)
    return Undoing(len(found) if len(found) > 1 else _number(found[first]), rest)


def _joined(parts: Sequence[str], places: Iterable[int]) -> str:
    """What is said at these places that tells what is wanted."""
    said = ("".join(parts[i : i + 2]) for i in places if not _is_aside(parts[i]))
    return "".join(said).strip(" ,")


def _pairs(parts: Sequence[str]) -> Iterator[tuple[str, str]]:
    """What is said, and the mark behind it."""
    return zip(parts[::2], parts[1::2], strict=True)


def _is_aside(said: str) -> bool:
    """Whether a part says nothing of what is wanted."""
    lead = re.fullmatch(LEAD, f"{said} ")
    return not said or bool(lead or _WHY.fullmatch(said)) or is_remark(said) or agrees(said)


def _number(match: re.Match[str]) -> int:
    if match["all"]:
        return ALL
    if match["both"]:
        return 2
    said = (match["times"] or match["number"] or match["steps"] or "1").split()[0]
    return _NUMBERS.get(said) or int(said)
