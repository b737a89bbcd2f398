"""Words that want out whatever no label says to be safe."""

from __future__ import annotations

import re

from goalscope.envs.grocery.hearing.diets import hinted, implied
from goalscope.envs.grocery.hearing.moods import Mood
from goalscope.envs.grocery.hearing.rewording import Said
from goalscope.envs.grocery.restrictions import ALLERGIES

__all__ = ["unsafe"]

_LEAD = (
    r"\W*(?:(?:please|no|ok|okay|so|and|then|also|but|well|now|just|yes|actually|can you|could you"
    r"|would you|let's|i want you to|i'd like you to)[ ,]+)*"
)
_OUT = (
    r"(?:remove|delete|drop|discard|ditch|get rid of|leave out|take out|throw out|take away)"
    r" (?:(?:any|every)(?:thing|\w* item)s?|all|whatever|what|(?:all |any )?(?:the |those )?"
    r"(?:things|items|products|food))(?: in (?:it|there|the basket))?"
)
_NOT = r"(?:isn't|aren't|is not|are not|'s not|(?:can't|cannot|may not|might not) be|not)"
_UNLABELLED = (
    rf"(?: (?:that|which))?(?: {_NOT}(?: (?:clearly|explicitly|definitely))?"
    r" (?:labell?ed|marked|certified|guaranteed)\b)"
)
_UNSURE = (
    r"(?: (?:that|which))?,? (?:(?:you|i|we) )?(?:(?:can't|cannot|couldn't|aren't|are not|'re not"
    r"|am not|'m not) (?:be )?(?:sure|certain|guarantee|tell|say|know)|don't know)\b"
)
_MAY = r"(?: (?:that|which))?,? (?:might|may|could|possibly) (?:contain|have|be made with)\b"
_UNSAFE = re.compile(
    rf"{_LEAD}{_OUT}(?:(?P<label>{_UNLABELLED})|{_UNSURE}|{_MAY})(?P<of>[^.;!?]*)"
    rf"|{_LEAD}(?:remove|delete|drop|discard|leave out|take out|get rid of)"
    r" (?:all |everything |anything )?(?:(?:of )?the )?(?P<bare>unlabell?ed)"
    r"(?: (?:ones|things|items|food))?(?:,? (?:please|now))*[ .!]*"
)
_SO = re.compile(
    r"(?: (?:as|to be|that|is|are|it is|it's|they are|they're))*(?: (?:safe|so|such|suitable))?"
    r"(?: for [\w ]+)?(?:,? (?:please|now))*[ .!?]*"
)
"""Behind what no label says: nothing is named by it."""


def unsafe(said: Said, standing: frozenset[str]) -> frozenset[str]:
    """The allergies for which all is to go that is not labelled for them; none where nothing is.

    As in "take out everything that isn't labelled nut-free", or "leave out anything you can't be
    sure is free of nuts".

    Args:
        said: A clause.
        standing: Restrictions that stand, which are meant where none is named.
    """
    found = _UNSAFE.match(said.text) if said.mood is Mood.ORDER else None
    if not found:
        return frozenset()
    of = found["of"] or ""
    things = re.split(r"\b(?:of|from|contain|have|with|and|or|any|traces)\b|,", of)
    named = hinted(of) | {name for thing in things for name in implied(thing.strip(" ?.!"))}
    if named or not _SO.fullmatch(of):
        return named & ALLERGIES
    return standing & ALLERGIES if found["label"] or found["bare"] or "safe" in of else frozenset()
