"""What raters see of an episode; nothing in it reveals the method."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, get_args

from goalscope.agent.planner import undo
from goalscope.agent.round import Round
from goalscope.agent.settings import (
    Domain,
    Settings,
    open_environment,
    possible_actions,
    profile_named,
    settings_of,
)
from goalscope.base.types import GoalscopeError, InvalidInputError, Profile, Turn
from goalscope.envs.house import HomeRobot
from goalscope.envs.house.finding import kinds_in
from goalscope.envs.house.view import View, readable, the
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.study.plan import Plan

__all__ = ["Item", "chosen_episodes", "item_of"]

NOTHING = "The assistant did nothing."
DID, LEFT = "It did this, in this order:", "The situation at the end:"
_STATES = (
    ("openable", "isOpen"), ("toggleable", "isToggled"), ("dirtyable", "isDirty"),
    ("pickupable", "isPickedUp"), ("isSliced", "isSliced"), ("isCooked", "isCooked"),
    ("isBroken", "isBroken"), ("isUsedUp", "isUsedUp"), ("isFilledWithLiquid",) * 2,
)  # fmt: skip
"""Properties that mark things with a state, each with the property that holds the state."""


@dataclass(frozen=True, slots=True)
class Item:
    """What is rated, presented as in the paper (Sec. 5.1).

    Attributes:
        task: The assistant and its task.
        possible: What it can do.
        profile: Description of the person; empty for a real one.
        outcome: The final basket, or all actions that were not undone and the resulting state of
            the room.
        transcript: The conversation, if the study shows it.
    """

    task: str
    possible: tuple[str, ...]
    profile: str
    outcome: str
    transcript: tuple[Turn, ...] = ()


def chosen_episodes(store: Store, plan: Plan) -> list[EpisodeInfo]:
    """The episodes of the store to rate, in order of their start.

    A person is included only if each method has an episode with them, so that methods are compared
    rather than people, and a real person only if the conversation is shown.

    Raises:
        InvalidInputError: There are none.
    """
    found = [
        info
        for info in store.episodes()
        if info.ended
        and info.domain in ([plan.domain] if plan.domain else get_args(Domain))
        and (not plan.methods or info.method in plan.methods)
        and (info.profile or plan.transcript)
    ]
    methods = plan.methods or {info.method for info in found}
    served = [{info.profile for info in found if info.method == each} for each in methods]
    people = set[str | None]().union(*served).intersection(*served)
    if not people:
        raise InvalidInputError(
            "No person has a finished episode with each of the study's methods "
            f"({', '.join(methods) or 'any'}). `goalscope episodes` lists the episodes, and "
            "`goalscope run` makes new ones; transcript = true includes those of real people."
        )
    return [info for info in found if info.profile in people]


def item_of(store: Store, info: EpisodeInfo, plan: Plan) -> Item:
    """The item of a stored episode."""
    rounds = store.rounds(info.id)
    settings = settings_of(info.settings)
    person = profile_named(settings, info.profile) if info.profile else None
    profile = " ".join(person.description.split()) if person else ""
    if info.domain == "grocery":
        outcome = rounds[-1].status if rounds else ""
    else:
        outcome = _house(settings, person, rounds)
    return Item(
        info.task,
        tuple(dict.fromkeys(possible_actions(info.domain))),
        profile,
        outcome or NOTHING,
        tuple(round.turn for round in rounds) if plan.transcript else (),
    )


def _house(settings: Settings, person: Profile | None, rounds: Sequence[Round]) -> str:
    """The robot's actions, and the state of what it touched or the person mentioned.

    The state comes from replaying the actions in the embedded house. If that fails, and for
    AI2-THOR, it is the status of the last round, which only lists changes.
    """
    results = [result for round in rounds for result in round.results if result.ok]
    done = "\n".join(f"- {result.action}" for result in results if not result.terminated)
    if not done:
        return ""
    said = " ".join(round.turn.utterance for round in rounds)
    left = rounds[-1].status
    if settings.simulator == "house":
        with suppress(GoalscopeError):
            words = person.description if person else said
            left = "\n".join(_states(settings, person, rounds, words))
    return f"{DID}\n{done}\n{LEFT}\n{left}" if left else done


def _states(
    settings: Settings, profile: Profile | None, rounds: Sequence[Round], words: str
) -> Iterator[str]:
    """The state of each thing that was moved, changed or mentioned, one per line."""
    results = [each for round in rounds for each in round.results if each.ok]
    with open_environment(settings, profile) as env:
        assert isinstance(env, HomeRobot)
        start = View(env.metadata, env.names).table
        undo(env, results, rounds[-1].state or None)
        view = View(env.metadata, env.names)
    touched = {name for each in results for name in (each.action.target, each.action.destination)}
    touched |= {view.names[own] for own, _ in view.changes(start)}
    kinds = kinds_in(view, words)
    alike: dict[str, list[str]] = {}
    for own, thing in sorted(view.table.items()):
        name = view.names[own]
        if (name in touched or readable(thing["objectType"]) in kinds) and (how := _how(view, own)):
            alike.setdefault(how, []).append(name)
    yield from (f"- {', '.join(names)}: {how}" for how, names in alike.items())


def _how(view: View, own: str) -> str:
    """The state and place of a thing; "" for furniture without a state."""
    thing: Mapping[str, Any] = view.table[own]
    was = {**thing, **{key: not thing[key] for holds, key in _STATES if thing[holds]}}
    if was == thing:
        return ""
    said = view.told(own, was)[len(the(view.names[own])) :]
    return said.split(maxsplit=1)[1]
