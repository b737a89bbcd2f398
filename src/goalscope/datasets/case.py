"""Dialogues whose goals are known, and a user's own dialogues as JSON Lines."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from annotated_types import MinLen
from pydantic import AfterValidator

from goalscope.base.inputs import nearest, shown, validated
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    Turn,
    canonical,
    checked_text,
    distinct,
)
from goalscope.datasets.files import Row, line_rows

Text = Annotated[str, AfterValidator(partial(checked_text, what="text"))]
Query = Annotated[
    str, AfterValidator(lambda text: checked_text(text, "query") if text.strip() else "")
]

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
        goals: Distinct; `UNSPECIFIED` is none of them.
        truth: Index of the true goal; None if it is unknown.
    """

    id: str
    group: str
    task: str
    turns: tuple[Turn, ...]
    goals: tuple[Goal, ...]
    truth: int | None

    @property
    def true_goal(self) -> Goal:
        """The true goal.

        Raises:
            InvalidInputError: It is unknown.
        """
        if self.truth is None:
            raise InvalidInputError(f"The true goal of the dialogue {shown(self.id)} is unknown.")
        return self.goals[self.truth]


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


EXPECTED = (
    'A line is a dialogue: {"id": "1", "task": "...", "turns": [{"query": "...", "utterance": '
    '"..."}], "goals": ["...", "..."]}.'
)
EXPORT = "`goalscope data export SET` writes such a file of a public dataset."


@dataclass(frozen=True, slots=True)
class _Turn:
    query: Query
    utterance: Text


@dataclass(frozen=True, slots=True)
class _Line:
    id: str | int
    task: Text
    turns: Annotated[tuple[_Turn, ...], MinLen(1)]
    goals: Annotated[tuple[Text, ...], MinLen(1)]
    true: str | int | None = None
    group: str | int | None = None


def read_cases(file: Path, *, labelled: bool = True) -> list[Case]:
    """Read and check a whole file, so that a broken row is found before the work begins.

    A row is `{"id", "task", "turns": [{"query", "utterance"}, ...], "goals": [...], "true"}`, where
    "true" is the text of one of the goals, or its place from 0. Rows with one `"group"` share a
    dialogue or people; without it, a row is its own group. Other keys are ignored, and so are blank
    lines.

    Args:
        file: JSON Lines.
        labelled: Whether rows have a true goal. Without one, goals that differ only in case, spaces
            or final punctuation merge.

    Raises:
        InvalidInputError: The file cannot be read or is empty, or a row cannot be used; names the
            line.
    """
    cases: dict[str, Case] = {}
    for row in line_rows(file, f"{EXPECTED} {EXPORT}"):
        case = _case(row, labelled=labelled)
        if case.id in cases:
            raise InvalidInputError(
                f"{row.label}: another line has the id {shown(case.id)}, too. Change one of them."
            )
        cases[case.id] = case
    if not cases:
        raise InvalidInputError(f"{file} holds no row. {EXPECTED}")
    return [*cases.values()]


def write_cases(cases: Iterable[Case], file: Path) -> None:
    """Write a new file of rows that `read_cases` reads.

    Raises:
        InvalidInputError: The file is there already, or cannot be written.
    """
    rows = [case_to_json(case) for case in cases]
    for row in rows:
        row["true"] = row["goals"][row.pop("truth")]
    try:
        with file.open("x", encoding="utf-8", newline="\n") as lines:
            lines.writelines(json.dumps(row, ensure_ascii=False) + "\n" for row in rows)
    except FileExistsError:
        raise InvalidInputError(f"{file} already exists. Name another file.") from None
    except OSError as error:
        raise InvalidInputError(f"Cannot write {file}: {error.strerror or error}.") from error


def _case(row: Row, *, labelled: bool) -> Case:
    line, label = validated(row.values, _Line, row.label, ignore_extra=True), row.label
    turns = tuple(Turn(turn.query, turn.utterance) for turn in line.turns)
    goals = tuple(distinct(map(Goal, line.goals)))
    if UNSPECIFIED in goals:
        raise InvalidInputError(
            f'{label}: the goal "Unspecified" always counts besides; leave it out.'
        )
    group = line.id if line.group is None else line.group
    truth = _truth(line, goals, label) if labelled else None
    return Case(str(line.id), str(group), line.task, turns, goals, truth)


def _truth(line: _Line, goals: tuple[Goal, ...], label: str) -> int:
    """The index of the true goal."""
    if len(line.goals) < 2:
        raise InvalidInputError(f"{label}: there is one goal; expected at least two.")
    if len(goals) < len(line.goals):
        raise InvalidInputError(
            f"{label}: two of the goals are the same, or differ only in case or final punctuation. "
            "Leave out one."
        )
    texts, goal = [goal.text for goal in goals], line.true
    if isinstance(goal, int) and 0 <= goal < len(texts):
        return goal
    if not isinstance(goal, str):
        raise InvalidInputError(
            f'{label}: expected the true goal under "true", the text of one of the goals or its '
            f"place among them, counted from 0; got {shown(goal)}."
        )
    keys = [*map(canonical, texts)]
    if canonical(goal) not in keys:
        raise InvalidInputError(
            f"{label}: the true goal {shown(goal)} is none of the goals; {nearest(goal, texts)}"
        )
    return keys.index(canonical(goal))
