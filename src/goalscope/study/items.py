"""What raters are shown of an episode. Nothing in it tells the method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from goalscope.domains import Domain, Settings, profile_named, settings_of
from goalscope.episode import Round
from goalscope.judge import possible_actions
from goalscope.store import EpisodeInfo, Store
from goalscope.study.plan import Plan
from goalscope.types import InvalidInputError, Profile, Turn

__all__ = ["Item", "chosen_episodes", "item_of"]

NOTHING = "The assistant has done nothing."
DID, LEFT = "It did this, in this order:", "This is how things are in the end:"


@dataclass(frozen=True, slots=True)
class Item:
    """What is rated, as the paper shows it (Sec. 5.1).

    Attributes:
        task: The assistant and its task.
        possible: What it can do.
        profile: The person, in words; empty for a real one.
        outcome: The basket in the end, or every action that stands and how it left the room.
        transcript: The conversation, where the study shows it.
    """

    task: str
    possible: tuple[str, ...]
    profile: str
    outcome: str
    transcript: tuple[Turn, ...] = ()


def chosen_episodes(store: Store, plan: Plan) -> list[EpisodeInfo]:
    """The episodes of the store that are rated, in the order in which they began.

    A person is in only if each method has an episode with them, so that methods are compared, and
    not people; a real one only if the conversation is shown, by which alone others can judge.

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
            "No person has an episode that has ended with each of the study's methods "
            f"({', '.join(methods) or 'any'}). `goalscope episodes` lists all, and `goalscope run` "
            "makes some; transcript = true takes in those of real people."
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
    """What the robot did, and how it left what it touched or the person speaks of."""
    from goalscope.study.room import room_left

    results = [result for round in rounds for result in round.results if result.ok]
    done = "\n".join(f"- {result.action}" for result in results if not result.terminated)
    if not done:
        return ""
    said = " ".join(round.turn.utterance for round in rounds)
    left = room_left(settings, person, rounds, person.description if person else said)
    return f"{DID}\n{done}\n{LEFT}\n{left}" if left else done
