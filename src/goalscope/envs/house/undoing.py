"""What brings things back to how they were, and what nothing brings back."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from goalscope.envs import Resolution
from goalscope.envs.house.names import the
from goalscope.envs.house.offers import FILLS, IRREVERSIBLE
from goalscope.envs.house.simulator.properties import ACTS, PREDICATES
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import View
from goalscope.types import Action

__all__ = ["undoing"]

_RESTORED = ("turn off", "turn on", "open", "close", "empty", "fill")

Table = Mapping[str, Mapping[str, Any]]


def undoing(
    view: View, was: Table, then: Table, done: Sequence[Action], untouched: Collection[str]
) -> Resolution:
    """What brings back what some actions changed, and what of it stays.

    Args:
        view: The house now.
        was: Metadata by id, from before the actions.
        then: The same after them.
        done: The actions.
        untouched: Ids of what must not be touched.
    """
    changed = [
        own
        for own, thing in then.items()
        if own in was and any(thing[key] != was[own][key] for key in (*PREDICATES, "fillLiquid"))
    ]
    free = [own for own in changed if own not in untouched]
    plan = _restoring(view, was, free)
    kept = {act.target for act in _restoring(view, was, changed)} - {act.target for act in plan}
    told = [f"I leave {the(name)} alone, as you asked." for name in sorted(kept)]
    pushed = (view.phrase(each) for each in done if each.name in ("push", "pull"))
    lost = (each for own in changed for each in _lost(view, was, own))
    told += [f"I cannot undo that: {each}." for each in (*pushed, *lost)]
    return Resolution(tuple(plan), " ".join(told))


def _restoring(view: View, was: Table, things: Sequence[str]) -> list[Action]:
    """What brings things back to how they were, as far as anything can."""
    plan: list[Action] = []
    for own in things:
        now, then, name = view.table[own], was[own], view.names[own]
        if not is_whole(now):
            continue
        for verb in _RESTORED:
            needs, state, value = ACTS[verb]
            able = now[needs] and now["objectType"] != "StoveBurner"
            if able and now[state] != then[state] == value:
                filled = (act for act, liquid in FILLS.items() if liquid == then["fillLiquid"])
                plan.append(Action(next(filled, verb) if verb == "fill" else verb, name))
        home = view.place(then)
        if now["pickupable"] and home and (now["isPickedUp"] or view.place(now) != home):
            plan.append(Action("put", name, destination=home))
        if then["isPickedUp"] and not now["isPickedUp"]:
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


def _lost(view: View, was: Table, own: str) -> Iterator[str]:
    """What was done to a thing that nothing brings back."""
    for verb in (*IRREVERSIBLE, "clean"):
        _, state, value = ACTS[verb]
        if view.table[own][state] == value != was[own][state]:
            yield f"{verb} {the(view.names[own])}"
