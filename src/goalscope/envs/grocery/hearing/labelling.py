"""Words that want out whatever no label says to be safe."""

from __future__ import annotations

import re

from goalscope.envs.grocery.hearing.diets import hinted, implied
from goalscope.envs.grocery.restrictions import ALLERGIES
from goalscope.envs.speech import evened

__all__ = ["unsafe"]

_OUT = (
    r"\b(?:remove|delete|drop|discard|ditch|get rid of|leave out|take out|throw out|take away)"
    r" (?:(?:any|every)(?:thing|\w* item)s?|all|whatever|what|(?:all |any )?(?:the |those )?"
    r"(?:things|items|products|stuff))(?: in (?:it|there|the basket))?"
)
_NOT = r"(?:isn't|aren't|is not|are not|'s not|(?:can't|cannot|may not|might not) be|not)"
_WHY = (
    rf"(?: (?:that|which))?(?: {_NOT}(?: (?:clearly|explicitly|definitely))?"
    r" (?:labell?ed|marked|certified|guaranteed|known|sure)"
    r"|,? (?:(?:you|i|we) )?(?:(?:can't|cannot|couldn't|aren't|are not|'re not|am not|'m not)"
    r" (?:be )?(?:sure|certain|guarantee|tell|say|know)|don't know)"
    r"|,? (?:might|may|could|possibly) (?:contain|have|be made with))\b(?P<of>[^.;!?]*)"
)
_UNSAFE = re.compile(rf"{_OUT}{_WHY}")
_UNLABELLED = re.compile(
    r"\b(?:remove|delete|drop|discard|leave out|take out|get rid of)"
    r" (?:all |everything |anything )?(?:(?:of )?the )?unlabell?ed"
    r"(?: (?:ones|things|items|stuff))?\b(?P<of>)"
)


def unsafe(utterance: str, standing: frozenset[str]) -> frozenset[str]:
    """The allergies for which all is to go that is not labelled for them; none where nothing is.

    As in "take out everything that isn't labelled nut-free", or "leave out anything you can't be
    sure is free of nuts".

    Args:
        utterance: What was said.
        standing: Restrictions that stand, which are meant where none is named.
    """
    text = evened(utterance)
    found = _UNSAFE.search(text) or _UNLABELLED.search(text)
    if not found:
        return frozenset()
    things = re.split(r"\b(?:of|from|contain|have|with|and|or)\b|,", f"{found['of']},{text}")
    named = hinted(found["of"]) | {name for thing in things for name in implied(thing.strip(" ?."))}
    return (named or standing) & ALLERGIES
