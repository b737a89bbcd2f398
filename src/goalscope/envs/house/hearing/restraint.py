"""Words for which nothing is guessed: orders, corrections, refusals and warnings."""

from __future__ import annotations

import re
from collections.abc import Collection

from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.aims import is_aim
from goalscope.envs.house.hearing.phrases import first_named
from goalscope.envs.speech import evened

__all__ = ["holds_back", "names_a_spot"]

_CLAUSE = re.compile(r"[,.;:!?\n]+|\b(?:and|but|or|so|then|because|since)\b")
_LEAD = re.compile(
    r"(?:(?:no|oh|oops|ok(?:ay)?|yes|wait|sorry|actually|now|please|just|well|hey|hi|first|next"
    r"|also|try to|rather|instead|(?:can|could|would|will|should|may|must|might) (?:you|we)"
    r"|you (?:can|could|should|may|must|might)|why don't you|why not|let's|i said|i meant?)\b ?)+"
)
_REFUSES = re.compile(
    r"(?:(?:do not|don't|never)\b(?! (?:worry|mind|bother|hesitate|forget))"
    r"|not (?:that|this|the|those|these|in|on|there|here)\b|nor\b|neither\b|stop\b|avoid\b"
    r"|undo\b|revert\b)"
    r"|.*\b(?:careful|gentle|refrain|under no circumstances)\b|no \w+ing\b|nobody \w+"
    r"|(?:mind|watch|beware)(?: out)? (?:the|my|our|of|for)\b|watch out"
)
_CORRECTS = re.compile(
    r"(?:(?:the )?(?:other|another|wrong) \w+(?: please)?$|the \w+ ones?(?: please)?$"
    r"|only (?:the|my|our|this|that|these|those) [\w ]+$"
    r"|(?:that|this|it)(?:'s| is| was)(?:n't| not)? (?:the )?(?:wrong|right|one)"
    r"|(?:that|this|it)(?:'s| is| was)(?:n't| not) the\b"
    r"|you (?:put|took|moved|left|forgot|missed|misunderstood)|i (?:meant?|said))\b(?! to\b)"
)
_WISHES = re.compile(
    r"\b(?:i|we)\b(?!'(?:ve|d have)\b)(?! (?:said|meant?|told|do not|don't|did not|didn't|never"
    r"|can't|cannot)\b)|\bshould be\b"
)
_AS_NOUN = frozenset(("light", "water", "plate", "run", "start", "use", "find", "hold", "keep"))
_VERB = re.compile(
    r"(?!(?:take (?:a look|care)|make (?:room|space|sure))\b)"
    rf"(?:{'|'.join(sorted(v.BASE.keys() - _AS_NOUN, key=len, reverse=True))})\b"
)
"""What orders; not what is often a noun, or leaves open what to do."""

_SPOT = re.compile(
    r"\b(?:beside|next to|near|behind|under(?:neath)?|in front of|on top of|above|inside|between"
    r"|around|against|by the)\b"
)
_OF_IT = re.compile(r"(?!make\b)\w+ (?:\w+ )?(?:it|them|that|this|these|those|one)\b")


def names_a_spot(text: str) -> bool:
    """Whether `text` says where beside other things something is to be."""
    return bool(_SPOT.search(evened(text)))


def holds_back(text: str, here: Collection[str]) -> bool:
    """Whether `text` orders something of a thing, or corrects, refuses or warns, without an aim.

    Args:
        text: What a person said.
        here: Object types that are in the scene.
    """
    refuses = wishes = False
    for part in _CLAUSE.split(evened(text)):
        said = part.strip()
        bare = _LEAD.sub("", said, count=1) if _LEAD.match(said) else said
        named = _OF_IT.match(bare) or first_named(bare, here)
        if _VERB.match(bare) and named and not is_aim(bare):
            return True
        refuses |= bool(_REFUSES.match(bare) or _CORRECTS.match(said) or _CORRECTS.match(bare))
        wishes |= bool(_WISHES.search(said) and not _REFUSES.search(said)) or is_aim(bare)
    return refuses and not wishes
