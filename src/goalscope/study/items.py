"""What raters see of an episode; nothing in it reveals the method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from goalscope.agent.round import Round
from goalscope.agent.settings import settings_of
from goalscope.base.types import InvalidInputError, Turn
from goalscope.envs.registry import BUILT_IN, domain_named, profile_named
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.study.plan import Plan

NOTHING = "The assistant did nothing."
DID, LEFT = "It did this, in this order:", "The situation at the end:"


@dataclass(frozen=True, slots=True)
class Item:
    """What is rated, presented as in the paper (Sec. 5.1).

    Attributes:
        task: The assistant and its task.
        possible: What it can do.
        profile: Description of the person; empty for a real one.
        outcome: The final basket, or all actions that were not undone and what they changed.
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
        and info.domain in ([plan.domain] if plan.domain else BUILT_IN)
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
    person = profile_named(settings_of(info.settings), info.profile) if info.profile else None
    profile = " ".join(person.description.split()) if person else ""
    domain = domain_named(info.domain)
    if domain.judged == ("outcome",):
        outcome = rounds[-1].status if rounds else ""
    else:
        outcome = _actions(rounds)
    return Item(
        info.task,
        tuple(dict.fromkeys(domain.possible or ())),
        profile,
        outcome or NOTHING,
        tuple(round.turn for round in rounds) if plan.transcript else (),
    )


def _actions(rounds: Sequence[Round]) -> str:
    """The actions, and the status at the end, which lists what they changed."""
    results = [result for round in rounds for result in round.results if result.ok]
    done = "\n".join(f"- {result.action}" for result in results if not result.terminated)
    if not done:
        return ""
    left = rounds[-1].status
    return f"{DID}\n{done}\n{LEFT}\n{left}" if left else done
