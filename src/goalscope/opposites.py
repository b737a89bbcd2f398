"""Words that ask for the opposite of a goal, which role-play hardly tells from the goal itself."""

from __future__ import annotations

import re

from goalscope.speech import normalize
from goalscope.types import Goal

__all__ = ["opposes"]

_SMALLER = "decrease lower reduce shrink downgrade cut less fewer smaller shorter slower quieter"
_BIGGER = "increase raise extend upgrade more bigger larger higher longer faster louder"
_PAIRS = [
    (frozenset(one.split()), frozenset(other.split()), frozenset(where.split()))
    for one, other, where in (
        (f"{_BIGGER} brighter warmer", f"{_SMALLER} dimmer cooler colder", ""),
        ("block freeze lock suspend disable deactivate", "activate reactivate enable reopen", ""),
        ("open", "close shut lock block", ""),
        ("start begin launch", "stop end finish shut", ""),
        ("slow", "hurry accelerate quicken", ""),
        ("merge join", "split separate", ""),
        ("delete erase close end terminate cancel", "restore recover reopen renew keep extend", ""),
        ("add insert include put register", "remove delete exclude off out", ""),
        ("buy purchase order book rent", "sell", ""),
        ("approve accept allow permit", "reject decline refuse forbid", ""),
        ("deposit", "withdraw", ""),
        ("lend", "borrow", ""),
        ("join", "leave", ""),
        ("push", "pull", ""),
        ("fill", "empty", ""),
        ("heat warm", "cool chill", ""),
        ("show", "hide", ""),
        ("earlier", "later", ""),
        ("on", "off", "turn switch light power"),
        ("up", "down", "turn volume heat roll"),
    )
]
"""Words, each side the opposite of the other, in goals that have one of the third, if there is."""

_REVERSES = re.compile(
    r"\b(?:revers|revert|undo|undid|reject|restor|withdr[ae]w)\w*"
    r"|\breturn (?:it|them|this|that|the|my)\b"
    r"|\b(?:bring|change|get|give|go|hand|have|move|pull|put|send|switch|take)\b"
    r"(?! you\b)(?:\s[\w'-]+){0,5} back\b"
)
"""Takes back what was done, whatever that was."""

_TOO = [
    (re.compile(rf"\b(?:too (?:{much})|{other})\b"), plainer)
    for much, other, plainer in (
        ("big|large|high|much|many|long|fast|loud|bright|warm|hot", "(?!)", "smaller"),
        ("small|little|low|few|short|slow|quiet|dark|dim|cold|cool", "not enough", "bigger"),
    )
]
"""What is too big is to be smaller."""

_PREFIXES = ("un", "dis")
_WAY = re.compile(r"\b(to|from) (?:(?:the|my|our|your|his|her|their|an?) )?([\w'-]+)")
_CLAUSES = re.compile(r"[.,;:!?]+(?: |$)|\b(?:and|but|then)\b")


def opposes(utterance: str, goal: Goal) -> bool:
    """Whether English words seem to ask for the opposite of a goal.

    The last clause that has a word of a pair of which the goal has one has the other ("smaller", of
    a bigger plan; "unblock", of blocking); or one takes back what was done, or turns the direction
    round ("from Anna", of a transfer to Anna). Too many are found rather than too few.
    """
    aim = normalize(goal.text)
    words, ways = _bases(aim), {*_WAY.findall(aim)}
    pairs = [
        (own, other)
        for one, two, where in _PAIRS
        if not where or where & words
        for own, other in ((one, two), (two, one))
        if own & words and not other & words
    ]
    pairs += [(frozenset({word}), _negated(word)) for word in words if len(word) > 3]
    turned = {("from" if way == "to" else "to", where) for way, where in ways} - ways
    text = normalize(utterance)
    for said, plainer in _TOO:
        text = said.sub(plainer, text)
    clauses = _CLAUSES.split(text)
    back = not _REVERSES.search(aim) and any(map(_REVERSES.search, clauses))
    if back or any(turned.intersection(_WAY.findall(clause)) for clause in clauses):
        return True
    heard = [_bases(clause) for clause in clauses]
    sides = ([own & each for each in heard if (own | other) & each][-1:] for own, other in pairs)
    return any(side and not side[0] for side in sides)


def _bases(text: str) -> frozenset[str]:
    """The words of a text, and what they may be forms of."""
    found: set[str] = set()
    for word in re.findall(r"[a-z]+", text):
        stems = {word, *(word.removesuffix(end) for end in ("s", "es", "d", "ed", "ing"))}
        stems |= {stem[:-1] for stem in stems if stem[-2:-1] == stem[-1:]}
        found |= stems | {f"{stem}e" for stem in stems}
    return frozenset(found)


def _negated(word: str) -> frozenset[str]:
    """A word with a prefix that turns its meaning round, or without the one that it has."""
    bare = {word.removeprefix(each) for each in _PREFIXES} - {word}
    return frozenset({f"{each}{word}" for each in _PREFIXES} | {b for b in bare if len(b) > 3})
