"""What a person wants undone: the last order, or all of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from goalscope.envs.house.heard import HOME, Request
from goalscope.envs.house.properties import ACTS

__all__ = ["inverse", "meant_only", "undoes"]

_LEAD = (
    r"(?:(?:no|oh|oops|ok(?:ay)?|wait|sorry|actually|now|please|and|then|(?:can|could) you)[ ,]+)*"
)
_END = r"(?:[ ,]+(?:please|now|again|for me))*[ .!?]*"
_THAT = r"(?:that|it|this|the last (?:one|thing|step|order)|what you(?: just|'ve)? d(?:id|one))"
_ALL = r"(?:everything|(?:all (?:of )?)(?:that|it|this))(?: you(?: just|'ve)? d(?:id|one))?"
_UNDOES = re.compile(
    rf"{_LEAD}(?:(?:undo|revert|reverse) (?:(?P<all>{_ALL})|{_THAT})"
    r"|put (?:everything|all) back (?:to )?(?:how|(?:in )?the way|as)"
    rf" (?:it|everything|they|things) (?:was|were)(?: before)?|take that back){_END}"
)
_MEANT_ONLY = re.compile(
    r"(?:(?:no|oh|oops|wait|sorry|actually|hey)[ ,.!]+)*(?P<not>not [a-z0-9 ]+[,.;!]+ ?(?:but )?)?"
    r"(?:(?:i|we) )?(?P<only>(?:only|just) )?(?:(?:meant?|wanted|want|said|asked for) )?"
    r"(?P<too>(?:only|just) )?(?P<rest>[a-z0-9, ]+?)(?: please| instead)?[ .!]*"
)
_OPPOSITE = {
    **{"open": "close", "close": "open", "turn on": "turn off", "turn off": "turn on"},
    **{"put": "put", "pick up": "put"},
}


def undoes(said: str) -> str:
    """Whether `said`, evened, asks to undo: "last" or "all"; empty if it does not."""
    found = _UNDOES.fullmatch(said)
    if not found:
        return ""
    return "all" if found["all"] or "back " in said else "last"


def meant_only(said: str) -> str | None:
    """What alone was meant by the last order, where `said`, evened, tells that; else None."""
    found = _MEANT_ONLY.fullmatch(said)
    if not found or not (found["only"] or found["too"] or found["not"]):
        return None
    return found["rest"]


def inverse(request: Request, start: Mapping[str, Mapping[str, Any]]) -> Request | None:
    """What undoes the request as far as it changed the start; None where nothing can."""
    verb = _OPPOSITE.get(request.verb)
    if not verb:
        return None
    several = request.every or request.number > 1
    home = (HOME,) if verb == "put" else ()
    kinds = tuple(k for k in request.object_types if not start or _was(verb, k, start))
    return replace(
        request,
        **{"verb": verb, "object_types": kinds, "destination_types": home},
        **{"destination_name": "", "every": several, "number": 0, "passing": False},
    )


def _was(verb: str, kind: str, start: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether at the start something of this type was as the verb makes it."""
    alike = (each for each in start.values() if each["objectType"] == kind)
    _, state, value = ACTS.get(verb, ("", "", True))
    return any(not state or each[state] == value for each in alike)
