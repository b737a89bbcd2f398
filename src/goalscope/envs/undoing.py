"""Words that ask to take back what the last ones led to."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import evened

__all__ = ["ALL", "END", "LEAD", "Undoing", "undoes"]

ALL = 0
"""In place of a number of rounds: every one."""

_NUMBERS = {"two": 2, "three": 3, "four": 4, "five": 5, "both": 2, "twice": 2}
LEAD = (
    r"(?:(?:no|oh|oops|ok(?:ay)?|wait|sorry|actually|now|please|and|then|can you|could you|can we"
    r"|can i|let's|i want to|i'd like to|i want you to|i need to)[ ,.!]+)*+"
)
"""What leads to an order."""

END = r"(?:[ ,]+(?:please|now|again|for me|thanks))*+[ .!?]*+"
"""What ends it."""

_KIND = (
    r"(?:ones?|things?|steps?|orders?|actions?|acts?|moves?|changes?|commands?|requests?|bit"
    r"|messages?)"
)
_LAST = (
    rf"(?:that|it|this|(?:the|my|your) (?:very )?(?:last|previous) {_KIND}"
    r"|what you(?: just|'ve)? d(?:id|one)|what i(?: just|'ve)? said)"
)
_SEVERAL = (
    rf"(?:(?:{_LAST} )?(?P<times>twice|[1-9]\d{{0,2}} times)|(?P<both>both)(?: of (?:them|those))?"
    rf"|(?:all )?(?:of )?(?:the|my|your) (?:very )?(?:last|previous)"
    rf" (?P<number>[1-9]\d{{0,2}}|two|three|four|five)(?: {_KIND})?)"
)
_ALL = (
    r"(?:(?:undo|revert|reverse) (?:everything|all (?:of )?(?:that|it|this)|all)"
    r"(?: you(?: just|'ve)? d(?:id|one))?"
    r"|put (?:everything|it all|them all|all) back (?:to )?(?:how|(?:in )?the way|as)"
    r" (?:it|everything|they|things) (?:was|were)(?: before)?)"
)
_UNDOES = re.compile(
    rf"{LEAD}(?:(?:undo|revert|reverse)(?: {_LAST})?|(?:cancel|scratch|scrap) {_LAST}"
    rf"|(?:undo|revert|reverse|cancel|take back) {_SEVERAL}|(?P<all>{_ALL})"
    r"|take that back|take back (?:that|the last (?:one|thing|step|order|change|request))"
    r"|go back (?:one|a|one step|a step)"
    r"|put (?:it|things) back (?:to )?(?:how|the way|as) (?:it|they|things) (?:was|were)"
    rf"(?: before)?){END}"
)
_PARTS = re.compile(r"([.;:!?]+(?: +|$)|,+ *| (?:and|then|but) )")
_WHEN = re.compile(r"(?:but|if|unless|until|when|once|before|after|except|only)\b")


@dataclass(frozen=True, slots=True)
class Undoing:
    """What is asked for by words such as "No, undo that. Add oat milk".

    Attributes:
        number: How many rounds are to be taken back, `ALL` for every one; None where it is not
            plain, as in "Add milk. No, undo that" or "undo that if it is too dear".
        rest: What the words say besides, evened; "" for nothing.
    """

    number: int | None
    rest: str = ""


@lru_cache(maxsize=1024)
def undoes(utterance: str) -> Undoing | None:
    """What is to be taken back; None where nothing asks for it."""
    parts = _PARTS.split(evened(re.sub(r"\s*\n\s*", ". ", utterance.strip())))
    found = {i: each for i in range(0, len(parts), 2) if (each := _UNDOES.fullmatch(parts[i]))}
    if not found:
        return None
    (first, match), *more = found.items()
    before, joint, after = parts[:first], "".join(parts[first + 1 : first + 2]), parts[first + 2 :]
    told = all(
        not each or is_remark(each) or re.fullmatch(LEAD, f"{each} ") for each in before[::2]
    )
    condition = _WHEN.match("".join(after) if joint.strip() != "but" else "but")
    if told and not more and not condition:
        rest = "".join(after).strip()
        return Undoing(_number(match), "" if is_remark(rest) else rest)
    kept = (parts[i : i + 2] for i in range(0, len(parts), 2) if i not in found)
    return Undoing(None, "".join(each for pair in kept for each in pair).strip())


def _number(match: re.Match[str]) -> int:
    if match["all"]:
        return ALL
    said = (match["times"] or match["both"] or match["number"] or "1").split()[0]
    return _NUMBERS.get(said) or int(said)
