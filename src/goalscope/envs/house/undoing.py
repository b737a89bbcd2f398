"""What a person wants undone: the last order, or all of them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from goalscope.envs.house.heard import HOME, Request
from goalscope.envs.house.properties import ACTS

__all__ = ["inverse", "meant_only", "undoes", "was_done"]

_LEAD = (
    r"(?:(?:no|oh|oops|ok(?:ay)?|wait|sorry|actually|now|please|and|then|(?:can|could) you)[ ,]+)*+"
)
_END = r"(?:[ ,]+(?:please|now|again|for me))*+[ .!?]*+"
_THAT = r"(?:that|it|this|the last (?:one|thing|step|order)|what you(?: just|'ve)? d(?:id|one))"
_ALL = r"(?:everything|(?:all (?:of )?)(?:that|it|this))(?: you(?: just|'ve)? d(?:id|one))?"
_UNDOES = re.compile(
    rf"{_LEAD}(?:(?:undo|revert|reverse) (?:(?P<all>{_ALL})|{_THAT})"
    r"|(?P<back>put) (?:everything|all) back (?:to )?(?:how|(?:in )?the way|as)"
    rf" (?:it|everything|they|things) (?:was|were)(?: before)?){_END}"
)
_PARTS = re.compile(r",+ *| (?:and|then) ")
_WHEN = re.compile(r"\b(?:if|unless|until|when|once|before|after|should|not|never)\b|n't\b")
_MEANT_ONLY = re.compile(
    r"(?:(?:no|oh|oops|wait|sorry|actually|hey)[ ,.!]++)*+(?:not (?P<no>[a-z0-9 ]++)[,.;!]++ ?)?+"
    r"(?:but )?+(?:(?:i|we) )?+(?P<only>(?:only|just) )?+"
    r"(?:(?:meant?|wanted|want|said|asked for) )?+(?P<too>(?:only|just) )?+"
    r"(?P<rest>[a-z0-9, ]++)[ .!]*+"
)
_OPPOSITE = {
    **{"open": "close", "close": "open", "turn on": "turn off", "turn off": "turn on"},
    **{"put": "put", "pick up": "put"},
}


def undoes(said: str) -> str:
    """Whether a part of `said`, evened, asks to undo: "last" or "all"; empty if none does."""
    sentences = [each for each in re.split(r"[.;:!?]+ *", said) if not _WHEN.search(each)]
    parts = (part for each in sentences for part in _PARTS.split(each))
    found = next(filter(None, map(_UNDOES.fullmatch, parts)), None)
    if not found:
        return ""
    return "all" if found["all"] or found["back"] else "last"


def meant_only(said: str) -> tuple[str, str] | None:
    """What was not meant by the last order, and what alone was; None if `said`, evened, is else."""
    found = _MEANT_ONLY.fullmatch(said)
    if not found or not (found["only"] or found["too"] or found["no"]):
        return None
    return found["no"] or "", re.sub(r",? (?:please|instead)$", "", found["rest"].strip(" ,"))


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


def was_done(
    request: Request,
    objects: Sequence[Mapping[str, Any]],
    start: Mapping[str, Mapping[str, Any]],
) -> bool:
    """Whether something that the request may mean is as it asks for, and was not at the start."""
    _, state, value = ACTS.get(request.verb, ("", "", None))
    alike = [each for each in objects if each["objectType"] in request.object_types]
    return not state or any(
        each.get(state) == value != start.get(each["objectId"], {}).get(state) for each in alike
    )


def _was(verb: str, kind: str, start: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether at the start something of this type was as the verb makes it."""
    alike = (each for each in start.values() if each["objectType"] == kind)
    _, state, value = ACTS.get(verb, ("", "", True))
    return any(not state or each[state] == value for each in alike)
