"""What a person wants undone, and what brings it back."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from goalscope.envs.house.heard import HOME, Request
from goalscope.envs.house.hearing.leave import IRREVERSIBLE
from goalscope.envs.house.meeting import FILLS
from goalscope.envs.house.names import the
from goalscope.envs.house.simulator.properties import ACTS, act_of
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import View
from goalscope.envs.undoing import END, LEAD
from goalscope.types import Action

__all__ = [
    "NOTHING",
    "besides_guesses",
    "inverse",
    "lasting",
    "meant_only",
    "restoring",
    "reverses",
    "was_done",
]

NOTHING = "There is nothing to undo."
"""Told where nothing that was guessed can be undone."""

_GUESSES = re.compile(
    rf"{LEAD}(?:undo|revert|reverse|take back|put back) (?:"
    r"(?:what(?:ever)?|everything|all(?: that)?) you(?:'ve| have)?(?: just)? guessed"
    rf"|(?:all )?(?:of )?(?:your|the) (?:last )?(?:guess(?:es|work)?"
    rf"|guessed (?:things?|ones?|moves?))){END}"
)
_PARTS = re.compile(r"([.;:!?]+ *|,+ *| (?:and|then) )")
_WHEN = re.compile(r"\b(?:if|unless|until|when|once|before|after|should|not|never)\b|n't\b")
_MEANT_ONLY = re.compile(
    r"(?:(?:no|oh|oops|wait|sorry|actually|hey)[ ,.!]++)*+(?:not (?P<no>[a-z0-9 ]++)[,.;!]++ ?)?+"
    r"(?:but )?+(?:(?:i|we) )?+(?P<only>(?:only|just) )?+"
    r"(?:(?:meant?|wanted|want|said|asked for) )?+(?P<too>(?:only|just) )?+"
    r"(?P<rest>[a-z0-9, ]++)[ .!]*+"
)
_REST = re.compile(
    r"[.,;]? (?:(?:and|but|so) )?(?:leave|keep|put|take) (?:all )?(?:the )?(?:others?|rest)\b"
    r"[^.;!?]*"
)
"""What is said of the rest, and goes without saying: "leave the other one where it was"."""

_OPPOSITE = {
    **{"open": "close", "close": "open", "turn on": "turn off", "turn off": "turn on"},
    **{"put": "put", "pick up": "put", "fill": "empty"},
}
_LASTING = (*IRREVERSIBLE, "clean")


def besides_guesses(said: str) -> str | None:
    """What `said`, evened, says besides asking to undo what was guessed; None if it does not."""
    parts = _PARTS.split(said)
    for i in range(0, len(parts), 2):
        if _GUESSES.fullmatch(parts[i]) and not _WHEN.search(_sentence_of(parts, i)):
            return "".join([*parts[:i], *parts[i + 2 :]]).strip(" ,")
    return None


def _sentence_of(parts: Sequence[str], i: int) -> str:
    """The sentence in which a part stands."""
    ends = [n for n in range(1, len(parts), 2) if parts[n][0] in ".;:!?"]
    start = max((n + 1 for n in ends if n < i), default=0)
    return "".join(parts[start : next((n for n in ends if n > i), len(parts))])


def meant_only(said: str) -> tuple[str, str, bool] | None:
    """What was not meant by the last order, what was, and whether that alone.

    None if `said`, evened, is else.
    """
    found = _MEANT_ONLY.fullmatch(_REST.sub("", said).replace(" but ", ", but "))
    if not found or not (found["only"] or found["too"] or found["no"]):
        return None
    rest = re.sub(r",? (?:please|instead|there|in there)$", "", found["rest"].strip(" ,"))
    return found["no"] or "", rest, bool(found["only"] or found["too"])


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
        **{"destination_name": "", "every": several, "number": 0, "passing": False, "liquid": ""},
    )


def was_done(
    request: Request,
    objects: Sequence[Mapping[str, Any]],
    start: Mapping[str, Mapping[str, Any]],
) -> bool:
    """Whether something that the request may mean is as it asks for, and was not at the start."""
    _, state, value = ACTS.get(request.verb, ("", "parentReceptacles", None))
    alike = [each for each in objects if each["objectType"] in request.object_types]
    return any(
        each.get(state) != start.get(each["objectId"], {}).get(state)
        and (value is None or each.get(state) == value)
        for each in alike
    )


def _was(verb: str, kind: str, start: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether at the start something of this type was as the verb makes it."""
    alike = (each for each in start.values() if each["objectType"] == kind)
    _, state, value = ACTS.get(verb, ("", "", True))
    return any(not state or each[state] == value for each in alike)


def restoring(
    view: View, start: Mapping[str, Mapping[str, Any]], only: Collection[str]
) -> list[Action]:
    """What brings things back to how they were once, as far as anything can.

    Args:
        view: The house now.
        start: Metadata by id, of then.
        only: Names of the things.
    """
    plan: list[Action] = []
    for own, thing in view.table.items():
        was, name = start.get(own), view.names[own]
        if was is None or not is_whole(thing) or name not in only:
            continue
        for verb in ("turn off", "turn on", "open", "close", "empty", "fill", "clean"):
            needs, state, value = ACTS[verb]
            able = thing[needs] and thing["objectType"] != "StoveBurner"
            if able and thing[state] != was[state] == value:
                filled = (act for act, what in FILLS.items() if what == was["fillLiquid"])
                plan.append(Action(next(filled, verb) if verb == "fill" else verb, name))
        home = view.place(was)
        if thing["pickupable"] and home and (thing["isPickedUp"] or view.place(thing) != home):
            plan.append(Action("put", name, destination=home))
        if was["isPickedUp"] and not thing["isPickedUp"]:
            plan.append(Action("pick up", name))
    held = view.names.get(view.held, "")
    return sorted(
        plan,
        key=lambda act: (
            act.name == "pick up",
            act.name != "turn off",
            act.target != held,
            act.name != "put",
        ),
    )


def reverses(action: Action, done: Action) -> bool:
    """Whether an action that restores a thing is about what another one did to it."""
    place = ("", "parentReceptacles", None)
    states = {ACTS.get(act_of(each.name), place)[1] for each in (action, done)}
    return action.target == done.target and len(states) == 1


def lasting(
    view: View, start: Mapping[str, Mapping[str, Any]], only: Collection[str]
) -> Iterator[str]:
    """Sentences that tell what of things is not as it was, and cannot be so again.

    Args:
        view: The house now.
        start: Metadata by id, of then.
        only: Names of the things.
    """
    for own, thing in view.table.items():
        was = start.get(own, thing)
        for verb in _LASTING if view.names[own] in only else ():
            _, state, value = ACTS[verb]
            if thing[state] != was[state] and thing[state] == value:
                yield f"I cannot undo that: {verb} {the(view.names[own])}."
