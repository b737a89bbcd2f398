"""Dialogues whose goals are known, and a user's own dialogues as JSON Lines."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from goalscope.base.inputs import nearest, shown
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, Turn, canonical, distinct
from goalscope.datasets.files import Row, own_rows

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


EXPECTED = (
    'A line is a dialogue: {"id": "1", "task": "...", "turns": [{"query": "...", "utterance": '
    '"..."}], "goals": ["...", "..."]}.'
)
EXPORT = "`goalscope data export SET` writes such a file of a public dataset."


@dataclass(frozen=True, slots=True)
class Dialogue:
    """A dialogue and the goals that are possible in it.

    Attributes:
        row: Of the file.
        id: Of its own within the file.
        task: The assistant's task.
        turns: At least one.
        goals: Distinct, at least one; `UNSPECIFIED` is none of them.
    """

    row: Row
    id: str | int
    task: str
    turns: tuple[Turn, ...]
    goals: tuple[Goal, ...]


def read_dialogues(file: Path) -> list[Dialogue]:
    """Read and check a whole file, so that a broken row is found before the work begins.

    A row is `{"id", "task", "turns": [{"query", "utterance"}, ...], "goals": [...]}`. Other keys
    are ignored, and so are blank lines; goals that differ only in case, spaces or the mark at the
    end merge.

    Raises:
        InvalidInputError: The file cannot be read or is empty, or a row cannot be used; names the
            line.
    """
    dialogues: list[Dialogue] = []
    places: dict[str | int, str] = {}
    for row in own_rows(file, f"{EXPECTED} {EXPORT}"):
        dialogue = _dialogue(row)
        if dialogue.id in places:
            raise InvalidInputError(
                f"{row.label}: the id {shown(dialogue.id)} is also that of {places[dialogue.id]}."
            )
        places[dialogue.id] = row.label
        dialogues.append(dialogue)
    if not dialogues:
        raise InvalidInputError(f"{file} holds no row. {EXPECTED}")
    return dialogues


def read_cases(file: Path) -> list[Case]:
    """Read and check a whole file of rows as `read_dialogues` does, with the true goal.

    Under "true" stands the text of one of the goals, or its place from 0. Rows with one `"group"`
    share a dialogue or people; without it, each row is its own group.

    Raises:
        InvalidInputError: The file cannot be read, or a row cannot be used; names the line.
    """
    cases: dict[str, Case] = {}
    for dialogue in read_dialogues(file):
        case = _case(dialogue)
        if case.id in cases:
            label = dialogue.row.label
            raise InvalidInputError(f"{label}: the id {shown(case.id)} is that of another line.")
        cases[case.id] = case
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


def _dialogue(row: Row) -> Dialogue:
    turns = tuple(
        Turn(turn.text("query", empty=True), turn.text("utterance")) for turn in row.rows("turns")
    )
    if not turns:
        raise InvalidInputError(f"{row.label}: 'turns' must hold at least one turn.")
    goals = tuple(distinct(map(Goal, row.texts("goals", empty=False))))
    if UNSPECIFIED in goals:
        raise InvalidInputError(
            f'{row.label}: the goal "Unspecified" always counts besides; leave it out.'
        )
    return Dialogue(row, row.name("id"), row.text("task"), turns, goals)


def _case(dialogue: Dialogue) -> Case:
    row, label = dialogue.row, dialogue.row.label
    texts = [goal.text for goal in dialogue.goals]
    given = len(row.entries("goals"))
    if given < 2:
        raise InvalidInputError(f"{label}: there is one goal; expected at least two.")
    if len(texts) < given:
        raise InvalidInputError(
            f"{label}: two of the goals are the same, or differ in case or in the mark at the end "
            "alone. Leave out one."
        )
    goal = row.values.get("true")
    if isinstance(goal, int) and not isinstance(goal, bool) and 0 <= goal < len(texts):
        goal = texts[goal]
    if not isinstance(goal, str):
        raise InvalidInputError(
            f'{label}: expected the true goal under "true", the text of one of the goals or its '
            f"place among them, counted from 0; got {shown(goal)}."
        )
    same = [place for place, text in enumerate(texts) if canonical(text) == canonical(goal)]
    if not same:
        raise InvalidInputError(
            f"{label}: the true goal {shown(goal)} is none of the goals; {nearest(goal, texts)}"
        )
    group = row.name("group") if "group" in row.values else dialogue.id
    (place,) = same
    id = str(dialogue.id)
    return Case(id, str(group), dialogue.task, dialogue.turns, dialogue.goals, place)
