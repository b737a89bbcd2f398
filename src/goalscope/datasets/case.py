"""A real dialogue whose goal is known."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from goalscope.base.types import Goal, Turn

__all__ = ["OPENING", "Case", "case_to_json", "said_key", "turns_of"]

OPENING = "Hello, how can I help you?"
"""What the assistant is taken to have said where the person speaks first."""


@dataclass(frozen=True, slots=True)
class Case:
    """What one person said, and the goals in question.

    Attributes:
        id: Of its own within a dataset and split.
        group: Cases of one group share a dialogue or people: intervals resample groups.
        task: The assistant's task.
        turns: At least one.
        goals: Distinct, the true one among them.
        truth: Index of the true goal.
    """

    id: str
    group: str
    task: str
    turns: tuple[Turn, ...]
    goals: tuple[Goal, ...]
    truth: int


def case_to_json(case: Case) -> dict[str, Any]:
    """The case as JSON, for a cell that any machine can measure."""
    return {
        "id": case.id,
        "group": case.group,
        "task": case.task,
        "turns": [asdict(turn) for turn in case.turns],
        "goals": [goal.text for goal in case.goals],
        "truth": case.truth,
    }


def said_key(turns: Iterable[Turn]) -> str:
    """A short hash of what the person said, by which a dialogue is known in whatever file."""
    words = "\n".join(turn.utterance for turn in turns)
    return hashlib.sha256(words.encode()).hexdigest()[:12]


def turns_of(said: Iterable[tuple[bool, str]], opening: str = OPENING) -> tuple[Turn, ...]:
    """Turns from utterances; True marks the person's, and what one side says in a row is joined.

    Blank utterances are passed over, and so is what the other one says after the person's last.
    """
    turns: list[Turn] = []
    query: list[str] = []
    words: list[str] = []
    for person, text in [*((person, text.strip()) for person, text in said if text.strip()),
                         (False, "")]:  # fmt: skip
        if person:
            words.append(text)
            continue
        if words:
            turns.append(Turn("\n".join(query) or opening, "\n".join(words)))
            query, words = [], []
        query.append(text)
    return tuple(turns)
