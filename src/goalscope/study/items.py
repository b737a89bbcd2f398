"""What raters are shown of an episode. Nothing in it tells the method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from goalscope.domains import Domain, profile_named, settings_of
from goalscope.judge import possible_actions
from goalscope.store import EpisodeInfo, Store
from goalscope.study.plan import Check, Plan
from goalscope.types import InvalidInputError, Turn, counted

__all__ = ["Item", "chosen_episodes", "item_of", "item_of_check"]

NOTHING = "The assistant has done nothing."


@dataclass(frozen=True, slots=True)
class Item:
    """What is rated, as the paper shows it (Sec. 5.1).

    Attributes:
        task: The assistant and its task.
        possible: What it can do.
        profile: The person, in words; empty for a real one.
        outcome: The basket in the end, or every action that stands.
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
    profile = profile_named(settings, info.profile).description if info.profile else ""
    if info.domain == "grocery":
        outcome = rounds[-1].status if rounds else ""
    else:
        done = [result for round in rounds for result in round.results if result.ok]
        outcome = "\n".join(f"- {result.action}" for result in done if not result.terminated)
    return Item(
        info.task,
        tuple(dict.fromkeys(possible_actions(info.domain))),
        " ".join(profile.split()),
        outcome or NOTHING,
        tuple(round.turn for round in rounds) if plan.transcript else (),
    )


def item_of_check(check: Check, like: Item) -> Item:
    """The item of a check: another one, but for what the check says itself."""
    said = check.conversation
    turns = tuple(map(Turn, said[::2], said[1::2])) or like.transcript
    return Item(like.task, like.possible, check.profile, check.outcome or like.outcome, turns)
