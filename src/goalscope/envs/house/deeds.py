"""Answers to questions about what the robot itself did: "Did you close the fridge?"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.orders import Clause, OrderReader
from goalscope.envs.house.names import the
from goalscope.envs.house.simulator.properties import ACTS, act_of
from goalscope.envs.house.view import View
from goalscope.envs.speech import LEAD, evened
from goalscope.types import Action

__all__ = ["told_of_deeds"]

_DID = re.compile(
    rf"{LEAD}(?:did|didn't|have|haven't|had) you(?: (?:already|just|really|actually|ever|even))*"
    r" (?P<act>[a-z0-9' ]+?)(?: (?:already|yet|now|before|again|just now|for me))*"
)
_WHAT = re.compile(
    rf"{LEAD}what(?: all| else)? (?:did|have) you(?: (?:already|just))* (?P<act>[a-z0-9' ]+?)"
    r"(?: (?:already|yet|now|so far|just now))*"
)
_IT = re.compile(r"\bit\b|\bthat$")
_LONGEST = 300
"""Characters of a question at most."""

_NAMED = 5
"""Things that an answer names at most."""


def told_of_deeds(question: str, done: Sequence[Action], view: View) -> str | None:
    """The answer to a question about what was done; None for anything else.

    Args:
        question: What the person asked.
        done: All that was done, in its order.
        view: The house now.
    """
    text = evened(question).rstrip(" ?!.") if len(question) <= _LONGEST else ""
    what = _WHAT.fullmatch(text)
    found = what or _DID.fullmatch(text)
    last = done[-1].target if done else ""
    act = _act(found["act"], view, last) if found else None
    if act is None or (not what and not act.things):
        return None
    if any(thing.word == "unknown" for thing in act.things):
        return "I see no such thing here."
    names = [each.target for each in done if _is_of(act, each, view)]
    names = [name for name in dict.fromkeys(names) if view.id(name)]
    more = f", and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    listed = ", ".join(names[:_NAMED]) + more
    if what:
        return f"{listed[:1].upper()}{listed[1:]}." if names else "Nothing."
    if not all(thing.types for thing in act.things):
        return f"Yes: {listed}." if names else "No."
    so = " ".join(_so(act, name, view) for name in names[:_NAMED]).strip()
    if names:
        return f"Yes. {so}" if so else "Yes, but that is no longer so."
    here = [name for own, name in view.names.items() if _is_named(act, own, view)]
    if not here:
        return "I see no such thing here."
    so = _so(act, here[0], view) if len(here) == 1 else ""
    return so if so and act.verb in ACTS else f"No. {so}".strip()


def _act(said: str, view: View, last: str) -> Clause | None:
    """What was done, in words such as "close the fridge" or "closed it".

    Args:
        said: The words.
        view: The house now.
        last: The name of what something was done to last, for "it"; empty if nothing was done.
    """
    said = _IT.sub(the(last) if last else "anything", said)
    reader = OrderReader(said.split(), {each["objectType"] for each in view.objects})
    verb = reader.verb(0, v.BASE) or reader.verb(0, v.DONE)
    if not verb:
        return None
    base = v.BASE_OF.get(verb[1], verb[1])
    act = None if base in ("keep", "leave") else reader.order(verb[0], base, verb[2], negated=False)
    known = act is not None and act.verb in (*ACTS, "put", "pick up", "push", "pull")
    vague = act and any(not t.types and t.word not in ("everything", "unknown") for t in act.things)
    strange = act and any(thing.word == "unknown" for thing in act.things)
    return act if known and not vague and (strange or not reader.leftover) else None


def _is_of(act: Clause, action: Action, view: View) -> bool:
    """Whether the action is one that is asked about."""
    name = act_of(action.name)
    moved = act.verb == "put" and not act.place and name == "pick up"
    places = act.place.types if act.place else ()
    if not (name == act.verb or moved) or (
        places and view.type_of(action.destination) not in places
    ):
        return False
    own = view.id(action.target)
    return bool(own) and (not any(t.types for t in act.things) or _is_named(act, own, view))


def _is_named(act: Clause, own: str, view: View) -> bool:
    """Whether the thing of this id is one that is asked about."""
    kind = view.table[own]["objectType"]
    return any(
        kind in thing.types and (not thing.which or view.names[own].endswith(f" {thing.which}"))
        for thing in act.things
    )


def _so(act: Clause, name: str, view: View) -> str:
    """Where a thing is that may have been moved; how it is if it is as the act makes it."""
    own = view.id(name)
    if act.verb in ACTS:
        _, state, value = ACTS[act.verb]
        if view.table[own][state] != value:
            return ""
    return view.is_so(act.verb, [own]).replace(" already.", ".")
