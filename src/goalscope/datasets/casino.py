"""CaSiNo: two campers negotiate over packages of food, water and firewood. People bluff."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from pathlib import Path

from goalscope.base.inputs import shown
from goalscope.base.types import Goal, InvalidInputError
from goalscope.datasets.case import Case, turns_of
from goalscope.datasets.files import json_rows
from goalscope.datasets.goal_sets import chance

__all__ = ["TASK", "casino"]

TASK = "Negotiate with the human, a fellow camper, over packages of food, water and firewood."
"""What the assistant is to do, in a sentence."""

_OPENING = "Hello!"
_ISSUES: tuple[str, ...] = ("Food", "Water", "Firewood")
_NO_WORDS = frozenset({"Submit-Deal", "Accept-Deal", "Reject-Deal", "Walk-Away"})


def casino(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Two cases of one group for each dialogue: what either camper ranks highest.

    The goals are all six rankings, whatever `goals` asks for; dialogues gave people each ranking
    with the same chance.

    Raises:
        InvalidInputError: The file is broken.
    """
    rankings = {order: Goal(_sentence(*order)) for order in permutations(_ISSUES)}
    for row in json_rows(file):
        number = row.values.get("dialogue_id")
        group = str(number if isinstance(number, int | str) else row.text("dialogue_id"))
        log = [
            (entry.text("id"), entry.text("text", empty=True)) for entry in row.rows("chat_logs")
        ]
        people = row.row("participant_info")
        for person in people.values:
            values = people.row(person).row("value2issue")
            order = tuple(values.text(rank) for rank in ("High", "Medium", "Low"))
            if order not in rankings:
                raise InvalidInputError(
                    f"{values.label}: expected a ranking of {', '.join(_ISSUES)}, "
                    f"got {shown(order)}."
                )
            said = [(who == person, text) for who, text in log if text not in _NO_WORDS]
            turns = turns_of(said, _OPENING)
            if not turns:
                yield "a camper says nothing"
                continue
            id = f"{group}-{person}"
            support = list(rankings.values())
            chance(seed, id).shuffle(support)
            yield Case(id, group, TASK, turns, tuple(support), support.index(rankings[order]))


def _sentence(high: str, medium: str, low: str) -> str:
    return (
        f"Get packages of {high.lower()} above all, then {medium.lower()}; "
        f"{low.lower()} matters least."
    )
