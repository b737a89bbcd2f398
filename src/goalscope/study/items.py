"""What raters are shown of an episode. Nothing in it tells the method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from goalscope.domains import Domain, Settings, profile_named, settings_of
from goalscope.episode import Round
from goalscope.judge import possible_actions
from goalscope.store import EpisodeInfo, Store
from goalscope.study.plan import Check, Plan
from goalscope.types import InvalidInputError, Profile, Turn, counted

__all__ = ["Item", "chosen_episodes", "item_of", "item_of_check"]

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


def chosen_episodes(store: Store, plan: Plan) -> tuple[list[EpisodeInfo], int]:
    """The episodes of the store that fit all that is named, in the order in which they began.

    And how many were left out since they were with real people, whom nobody can judge for without
    the conversation.

    Raises:
        InvalidInputError: There are none, or one that is named cannot be rated.
    """
    selection = plan.episodes
    if selection.ids:
        found = [store.episode(id) for id in selection.ids]
        for info in found:
            if info.ended is None:
                raise InvalidInputError(f"Episode {info.id} has not ended, so it cannot be rated.")
            if info.domain not in get_args(Domain):
                raise InvalidInputError(
                    f"In episode {info.id} another program acted, so it cannot be rated."
                )
            if not (info.profile or plan.transcript):
                raise InvalidInputError(
                    f"Episode {info.id} was with a real person, who has no profile, so raters must "
                    "see the conversation: set transcript = true, or leave it out of [episodes]."
                )
    else:
        found = [info for info in store.episodes() if info.ended]
    found = [
        info
        for info in {info.id: info for info in found}.values()
        if selection.domain in ("", info.domain)
        and info.domain in get_args(Domain)
        and (not selection.methods or info.method in selection.methods)
        and (not selection.profiles or info.profile in selection.profiles)
    ]
    rateable = [info for info in found if info.profile or plan.transcript]
    left_out = len(found) - len(rateable)
    if not rateable:
        raise InvalidInputError(
            f"All that fit ({counted(left_out, 'episode')}) were with real people, who have no "
            "profile, so raters must see the conversations: set transcript = true."
            if left_out
            else "No episode that has ended fits [episodes] of the study. `goalscope episodes` "
            "lists them all."
        )
    return rateable, left_out


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


def item_of_check(check: Check, like: Item) -> Item:
    """The item of a check: another one, but for what the check says itself."""
    said = check.conversation
    turns = tuple(map(Turn, said[::2], said[1::2])) or like.transcript
    return Item(like.task, like.possible, check.profile, check.outcome or like.outcome, turns)
