"""A user's own dialogues whose goals are known, as JSON Lines."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from goalscope.datasets.case import Case
from goalscope.envs.tables import nearest, shown
from goalscope.infer import Dialogue, read_dialogues
from goalscope.types import InvalidInputError, canonical

__all__ = ["read_cases", "write_cases"]


def read_cases(file: Path) -> list[Case]:
    """Read and check a whole file of rows as `goalscope infer` reads them, with the true goal.

    A row is `{"id", "task", "turns": [{"query", "utterance"}, ...], "goals": [...], "true"}`, where
    "true" is the text of one of the goals, or its place from 0. Rows with one `"group"` share a
    dialogue or people; without it, each row is its own group.

    Raises:
        InvalidInputError: The file cannot be read, or a row cannot be used; names the line.
    """
    dialogues = read_dialogues(file)
    lines = file.read_bytes().split(b"\n")
    cases: list[Case] = []
    ids: set[str] = set()
    for dialogue in dialogues:
        label = f"{file}, line {dialogue.line}"
        case = _case(dialogue, json.loads(lines[dialogue.line - 1].decode("utf-8-sig")), label)
        if case.id in ids:
            raise InvalidInputError(f"{label}: the id {shown(case.id)} is that of another line.")
        ids.add(case.id)
        cases.append(case)
    return cases


def write_cases(cases: Iterable[Case], file: Path) -> None:
    """Write a new file of rows that `read_cases` reads.

    Raises:
        InvalidInputError: The file is there already, or cannot be written.
    """
    rows = [
        {
            "id": case.id,
            "group": case.group,
            "task": case.task,
            "turns": [asdict(turn) for turn in case.turns],
            "goals": [goal.text for goal in case.goals],
            "true": case.goals[case.truth].text,
        }
        for case in cases
    ]
    try:
        with file.open("x", encoding="utf-8", newline="\n") as lines:
            lines.writelines(json.dumps(row, ensure_ascii=False) + "\n" for row in rows)
    except FileExistsError:
        raise InvalidInputError(f"{file} is there already. Name another file.") from None
    except OSError as error:
        raise InvalidInputError(f"{file} cannot be written: {error.strerror or error}.") from error


def _case(dialogue: Dialogue, row: dict[str, Any], label: str) -> Case:
    texts = [goal.text for goal in dialogue.goals]
    if len(row["goals"]) < 2:
        raise InvalidInputError(f"{label}: there is one goal; expected at least two.")
    if len({canonical(text) for text in texts}) < len(row["goals"]):
        raise InvalidInputError(
            f"{label}: two of the goals are the same, or differ in case or in the mark at the end "
            "alone. Leave out one."
        )
    goal = row.get("true")
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
    group = row.get("group", dialogue.id)
    if isinstance(group, bool) or not isinstance(group, str | int):
        raise InvalidInputError(f'{label}: "group" must be a text or a whole number.')
    (place,) = same
    id = str(dialogue.id)
    return Case(id, str(group), dialogue.task, dialogue.turns, dialogue.goals, place)
