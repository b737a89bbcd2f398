"""TEACh: a commander tells a robot about one household task."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from goalscope.datasets.case import Case, turns_of
from goalscope.datasets.files import line_rows
from goalscope.datasets.goal_sets import by_shared_words, chance, draw

__all__ = ["TASK", "teach"]

TASK = "Do a household task in this room for the human."
"""What the assistant is to do, in a sentence."""


def teach(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Games in the order of the file; instead of one that is left out, the reason.

    Many games share a goal text. "random" draws from the other texts of the file; "hard" first from
    those of the same task with other parameters, then from those that share the most words.

    Raises:
        InvalidInputError: The file is broken.
    """
    games = [
        (row.text("game_id"), row.text("task_name"), row.text("desc"), tuple(
            (each.text("agent") == "commander", each.text("utterance", empty=True))
            for each in row.rows("interactions") if "utterance" in each.values
        ))
        for row in line_rows(file)
    ]  # fmt: skip
    every = sorted({goal for _, _, goal, _ in games})
    of_task: dict[str, set[str]] = {}
    for _, name, goal, _ in games:
        of_task.setdefault(name, set()).add(goal)
    for id, name, goal, said in games:
        turns = turns_of(said)
        if not turns:
            yield "the commander says nothing"
            continue
        tiers = [every]
        if goal_set == "hard":
            tiers = [sorted(of_task[name]), *by_shared_words(goal, every)]
        drawn = draw(chance(seed, id), goal, tiers, goals)
        if drawn is None:
            yield f"fewer than {goals} goals in the file"
            continue
        yield Case(id, id, TASK, turns, *drawn)
