"""Dialogues whose goals are known, and a user's own dialogues as JSON Lines."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
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
    goals_of,
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
        truth: Index of the true goal after the last turn; None if it is unknown, or no goal of the
            list.
        truths: [T] the same after each turn, if the goal is another one at some turn or is none of
            the list; otherwise empty.
    """

    id: str
    group: str
    task: str
    turns: tuple[Turn, ...]
    goals: tuple[Goal, ...]
    truth: int | None
    truths: tuple[int | None, ...] = ()

    @property
    def each_truth(self) -> tuple[int | None, ...]:
        """[T] `truths`, whether or not they differ."""
        return self.truths or (self.truth,) * len(self.turns)

    @property
    def true_goal(self) -> Goal:
        """The true goal after the last turn; `UNSPECIFIED` if it is none of the list.

        Raises:
            InvalidInputError: It is unknown.
        """
        if self.truth is None:
            if self.truths:
                return UNSPECIFIED
            raise InvalidInputError(f"The true goal of the dialogue {shown(self.id)} is unknown.")
        return self.goals[self.truth]

    def until(self, turns: int | None) -> Case:
        """The case up to a number of turns."""
        truths = self.truths[:turns]
        truth = truths[-1] if truths else self.truth
        return replace(self, turns=self.turns[:turns], truth=truth, truths=truths)

    def among(self, goals: Iterable[Goal]) -> Case:
        """The case with some of its goals, among which are the true ones."""
        kept = tuple(goals)
        place = {self.goals.index(goal): n for n, goal in enumerate(kept)} | {None: None}
        return replace(
            self,
            goals=kept,
            truth=place[self.truth],
            truths=tuple(place[each] for each in self.truths),
        )


def case_to_json(case: Case) -> dict[str, Any]:
    """The case as JSON, for a cell that any machine can measure."""
    return {
        "id": case.id,
        "group": case.group,
        "task": case.task,
        "turns": [asdict(turn) for turn in case.turns],
        "goals": [goal.text for goal in case.goals],
        "truth": case.truth,
        **({"truths": list(case.truths)} if case.truths else {}),
    }


def case_from_json(data: Mapping[str, Any]) -> Case:
    """The case that `case_to_json` wrote."""
    return Case(
        data["id"],
        data["group"],
        data["task"],
        tuple(Turn(**turn) for turn in data["turns"]),
        tuple(map(Goal, data["goals"])),
        data["truth"],
        tuple(data.get("truths", ())),
    )


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
EXPORT = "`goalscope data export SET --out FILE` writes such a file of a public dataset."


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
    true: str | int | tuple[str | int | None, ...] | None = None
    group: str | int | None = None


def read_cases(file: Path, *, labelled: bool = True) -> list[Case]:
    """Read and check a whole file, so that a broken row is found before the work begins.

    A row is `{"id", "task", "turns": [{"query", "utterance"}, ...], "goals": [...], "true"}`, where
    "true" is the text of one of the goals, or its place from 0. Where the goal changes, it is a
    list of these, one for each turn, and null for a goal that is not listed. Rows with one
    `"group"` share a dialogue or people; without it, a row is its own group. Other keys are
    ignored, and so are blank lines.

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
        InvalidInputError: The file is there already.
    """
    rows = [case_to_json(case) for case in cases]
    for row in rows:
        truth, truths = row.pop("truth"), row.pop("truths", None)
        row["true"] = row["goals"][truth] if truths is None else truths
    try:
        with file.open("x", encoding="utf-8", newline="\n") as lines:
            lines.writelines(json.dumps(row, ensure_ascii=False) + "\n" for row in rows)
    except FileExistsError:
        raise InvalidInputError(f"{file} already exists. Name another file.") from None


def _case(row: Row, *, labelled: bool) -> Case:
    line, label = validated(row.values, _Line, row.label, ignore_extra=True), row.label
    turns = tuple(Turn(turn.query, turn.utterance) for turn in line.turns)
    try:
        goals = tuple(goals_of(line.goals) if labelled else distinct(map(Goal, line.goals)))
    except InvalidInputError as error:
        raise InvalidInputError(f"{label}: {error}") from None
    if UNSPECIFIED in goals:
        raise InvalidInputError(
            f'{label}: the goal "Unspecified" always counts besides; leave it out.'
        )
    group = line.id if line.group is None else line.group
    truths = _truths(line, goals, label) if labelled else (None,)
    return Case(
        str(line.id),
        str(group),
        line.task,
        turns,
        goals,
        truths[-1],
        truths if labelled and (len({*truths}) > 1 or None in truths) else (),
    )


def _truths(line: _Line, goals: tuple[Goal, ...], label: str) -> tuple[int | None, ...]:
    """The index of the true goal, or one for each turn."""
    if not isinstance(line.true, tuple):
        return (_truth(line.true, goals, label),)
    if len(line.true) != len(line.turns):
        raise InvalidInputError(
            f'{label}: "true" is a list of {len(line.true)} for {len(line.turns)} turns; expected '
            "one for each turn."
        )
    return tuple(None if each is None else _truth(each, goals, label) for each in line.true)


def _truth(goal: str | int | None, goals: tuple[Goal, ...], label: str) -> int:
    """The index of a true goal."""
    if len(goals) < 2:
        raise InvalidInputError(f"{label}: there is one goal; expected at least two.")
    texts = [goal.text for goal in goals]
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
