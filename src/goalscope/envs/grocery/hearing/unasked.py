"""Whether a person wants to be rid of what they never asked for."""

from __future__ import annotations

import re
from collections.abc import Sequence

from goalscope.envs.grocery.amounts import Request
from goalscope.envs.grocery.hearing.moods import Mood
from goalscope.envs.grocery.hearing.phrases import (
    ASKED_NOT,
    SAME,
    SAME_ALL,
    SAME_TWO,
    TAKES,
    UNASKED_FOR,
)
from goalscope.envs.grocery.hearing.requests import removed
from goalscope.envs.grocery.hearing.rewording import Said

__all__ = ["unasked"]

_GUESSES = (
    r"(?:(?:all|of|the|your|those|these|any|other|every) )*"
    r"(?:guess(?:es)?\b|guessed (?:things?|items?|stuff|ones?|products?)\b|guesswork\b)"
)
_UNASKED = re.compile(
    rf"\b(?:i|we|nobody|no one) {ASKED_NOT} (?:(?:any of |most of |half of |all |all of )"
    r"(?:it|this|that|these|those|them)|(?P<those>it|this|that|these|those|them))"
    r"(?: things?| stuff| items?)?(?=[.,;!?]|$)"
    r"|\b(?:i|we) (?:only|just) (?:asked for|ordered|requested)\b"
    rf"|\b(?:take|throw|put) (?:everything|anything|whatever|what|all|(?:all )?(?:the|those|these)"
    rf" (?:things|items|stuff|rest))(?: (?:out|away|back|off){UNASKED_FOR}"
    rf"|(?: (?:that|which))? (?:(?:i|we) {ASKED_NOT}|you(?: just| only)?(?: have|'ve)? guessed)"
    r" (?:out|away|back|off)\b)"
    rf"|\b(?:i|we) {ASKED_NOT} {_GUESSES}"
    rf"|\b{TAKES} {_GUESSES}|\b(?:take|throw|put) {_GUESSES} (?:out|away|back)\b"
    rf"|\b(?:{TAKES}|(?:don't|do not|didn't|did not) (?:want|need)(?: any of)?"
    r"(?![^.;!?]*\b(?:i|we) (?:asked for|wanted)\b))"
    r" (?:everything|anything|whatever|what|all|things|stuff"
    rf"|(?:all )?(?:the|those|these) (?:things|items|stuff|rest)){UNASKED_FOR}"
)
_SPECIFIC = re.compile(
    r"(?!.*\b(?:rest|everything|anything|all|else|extras?|junk|things?|stuff|items?|others?"
    rf"|products?|{SAME}|{SAME_ALL}|{SAME_TWO})\b).+"
)
"""Names one thing, and not all that there is."""


def unasked(said: Said, before: Sequence[Request] = ()) -> bool:
    """Whether the person wants nothing in the basket but what they asked for.

    "I didn't ask for those" is of all that was guessed, unless it stands behind what is to go by
    name alone, here or in `before`.
    """
    found = _UNASKED.finditer(said.text) if said.mood is Mood.ORDER else ()
    gone = (*before, *removed(said))
    named = bool(gone) and all(_SPECIFIC.fullmatch(each.phrase) for each in gone)
    return any(not (named and each["those"]) for each in found)
