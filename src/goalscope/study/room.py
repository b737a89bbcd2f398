"""How the robot left its room, for people who rate what it did."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from goalscope.domains import Settings, open_environment
from goalscope.envs.house import HomeRobot
from goalscope.envs.house.finding import kinds_in
from goalscope.envs.house.view import View, readable, the
from goalscope.episode import Round
from goalscope.policy import undo
from goalscope.types import GoalscopeError, Profile

__all__ = ["room_left"]

_STATES = (
    ("openable", "isOpen"), ("toggleable", "isToggled"), ("dirtyable", "isDirty"),
    ("pickupable", "isPickedUp"), ("isSliced", "isSliced"), ("isCooked", "isCooked"),
    ("isBroken", "isBroken"), ("isUsedUp", "isUsedUp"), ("isFilledWithLiquid",) * 2,
)  # fmt: skip
"""What is told of a thing: where the first holds, the second."""


def room_left(
    settings: Settings, profile: Profile | None, rounds: Sequence[Round], words: str
) -> str:
    """How each thing is that was moved or changed, or that the words name, one state a line.

    The embedded house does again what was done. What it cannot do again, and AI2-THOR, has the
    status of the last round, which tells of changes alone.
    """
    if settings.simulator == "house":
        with suppress(GoalscopeError):
            return "\n".join(_states(settings, profile, rounds, words))
    return rounds[-1].status


def _states(
    settings: Settings, profile: Profile | None, rounds: Sequence[Round], words: str
) -> Iterator[str]:
    results = [each for round in rounds for each in round.results if each.ok]
    env = open_environment(settings, profile)
    try:
        assert isinstance(env, HomeRobot)
        start = View(env.metadata, env.names).table
        undo(env, results, rounds[-1].state or None)
        view = View(env.metadata, env.names)
    finally:
        env.close()
    told = {name for each in results for name in (each.action.target, each.action.destination)}
    told |= {view.names[own] for own, _ in view.changes(start)}
    kinds = kinds_in(view, words)
    alike: dict[str, list[str]] = {}
    for own, thing in sorted(view.table.items()):
        name = view.names[own]
        if (name in told or readable(thing["objectType"]) in kinds) and (how := _how(view, own)):
            alike.setdefault(how, []).append(name)
    yield from (f"- {', '.join(names)}: {how}" for how, names in alike.items())


def _how(view: View, own: str) -> str:
    """How and where a thing is, as if all of it were new; "" for furniture without a state."""
    thing: Mapping[str, Any] = view.table[own]
    was = {**thing, **{key: not thing[key] for holds, key in _STATES if thing[holds]}}
    if was == thing:
        return ""
    said = view.told(own, was)[len(the(view.names[own])) :]
    return said.split(maxsplit=1)[1]
