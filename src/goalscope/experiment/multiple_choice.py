"""Isolated inference (Sec. 4.1): which choice's paraphrases best explain the answer?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from typing import Annotated, Any

from annotated_types import MinLen

from goalscope.base.inputs import read_csv, shown, validated
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    ModelError,
    Turn,
    canonical,
)
from goalscope.belief.likelihood import Layout, RolePlay
from goalscope.datasets.case import Text
from goalscope.datasets.files import Row, line_rows
from goalscope.experiment.baselines import overlap
from goalscope.models import Generator, LikelihoodModel
from goalscope.prompts import render

LETTERS = ("A", "B", "C", "D", "E")
TASK = "Ask the human a question."
BLANK = "What do you say?"
"""What the agent asks in the control without the question."""

_LONGEST_NAME = 20  # of a choice


@dataclass(frozen=True, slots=True)
class Question:
    """One multiple-choice question.

    `choices`, their paraphrases (`rephrasings`, empty if not written yet) and the right `answer`
    are by letter.
    """

    id: Text
    prompt: Text
    choices: Annotated[Mapping[str, Text], MinLen(2)]
    answer: str
    rephrasings: Mapping[str, Annotated[list[Text], MinLen(1)]]

    def __post_init__(self) -> None:
        for name in self.choices:
            if not (name.isprintable() and 0 < len(name) <= _LONGEST_NAME):
                raise ValueError(f"a choice needs a short name such as A, not {shown(name)}.")
        if self.answer not in self.choices:
            names = ", ".join(self.choices)
            raise ValueError(f"'answer' must be one of {names}, not {shown(self.answer)}.")
        if self.rephrasings and {*self.rephrasings} != {*self.choices}:
            raise ValueError("'rephrasings' must have a list for each choice.")
        for name, texts in self.rephrasings.items():
            if canonical(self.choices[name]) in map(canonical, texts):
                raise ValueError(f"a rephrasing of {name} must not be the choice itself.")


def read_questions(file: Path, limit: int | None = None) -> list[Question]:
    """Read questions: JSON Lines, with rephrasings or without, or the CSV file of the paper's set.

    A row of JSON is `{"id", "prompt", "choices": {"A": ..., "E": ...}, "answer": "A",
    "rephrasings": {"A": [...], ...}}`; the columns of a CSV file are prompt, A to E, answer.

    Raises:
        InvalidInputError: The file cannot be read, or a row is invalid; the message names the row.
    """
    rows = _csv_rows(file) if file.suffix.lower() == ".csv" else line_rows(file, "")
    questions = [_question(row) for row in islice(rows, limit)]
    if not questions:
        raise InvalidInputError(f"{file} has no questions.")
    ((double, count),) = Counter(question.id for question in questions).most_common(1)
    if count > 1:
        raise InvalidInputError(f"{file}: two questions have the id {shown(double)}.")
    return questions


def rephrase(generator: Generator, question: Question, *, count: int = 4) -> Question:
    """The question with paraphrases of each choice, written by a model (Sec. 4.1).

    If the model writes too few different ones, they are repeated in turn, which changes neither the
    likeliest goal nor any choice's share.

    Raises:
        ModelError: The model only repeats the words of a choice, or writes nothing.
    """
    written: dict[str, list[str]] = {}
    for letter, choice in question.choices.items():
        found: dict[str, str] = {}
        for draw in range(3 * count):
            reply = generator.generate(
                render("rephrase", prompt=question.prompt, choice=choice),
                max_tokens=120,
                temperature=0.8 if draw else 0.0,
                seed=draw,
                stop=("\n",),
            )
            words = " ".join(reply.text.split()).strip('" ')
            key = canonical(words)
            if key and reply.finish == "stop" and key != canonical(choice):
                found.setdefault(key, words)
            if len(found) == count:
                break
        if not found:
            raise ModelError(
                f"The model failed {3 * count} times to rephrase choice {letter} of the "
                f"question {shown(question.id)}. Name a better writer with --generator."
            )
        written[letter] = list(islice(cycle(found.values()), count))
    return Question(question.id, question.prompt, question.choices, question.answer, written)


def measure_question(
    model: LikelihoodModel, question: Question, *, layout: Layout
) -> dict[str, Any]:
    """Log-likelihoods of the right choice's words under each rephrasing as the goal.

    Returns:
        `goals`, each a `choice` and its `text`; `tokens` of the words; for each of `conditions`
        the `log_likelihood` [G] in nats, and that of `unspecified`: the agent asks the question
        alone ("question"), with its choices ("choices"), with all choices but the one that the
        person takes ("others"), or something else ("blank"); and `overlap` [G] of the words.
    """
    words = question.choices[question.answer]
    goals = [(key, text) for key in question.choices for text in question.rephrasings[key]]
    roleplay = RolePlay(model, layout=layout, similarity=0.0)
    support = [*(Goal(text) for _, text in goals), UNSPECIFIED]
    listed = [f"{key}. {text}" for key, text in question.choices.items()]
    others = [f"- {text}" for text in question.choices.values() if text != words]
    queries = {
        "question": question.prompt,
        "choices": "\n".join([question.prompt, *listed]),
        "others": "\n".join([question.prompt, *others]),
        "blank": BLANK,
    }
    conditions: dict[str, Any] = {}
    for name, query in queries.items():
        row = roleplay.log_likelihood(TASK, support, [Turn(query, words)])[0]
        conditions[name] = {"log_likelihood": row[:-1].tolist(), "unspecified": float(row[-1])}
    (scored,) = model.token_logprobs(
        [render("goal_last", task=TASK, goal="", query=BLANK)], [words]
    )
    return {
        "tokens": len(scored),
        "goals": [{"choice": key, "text": text} for key, text in goals],
        "conditions": conditions,
        "overlap": overlap(words, [text for _, text in goals]).tolist(),
    }


def _csv_rows(file: Path) -> Iterator[Row]:
    """The rows of a CSV file, as the objects of JSON Lines."""
    rows = read_csv(file, str(file))
    headings = next(rows, list[str]())
    for number, row in enumerate(rows, 1):
        given = dict(zip(headings, row, strict=False))
        choices = {letter: given.pop(letter, None) for letter in LETTERS}
        yield Row(f"{file}, row {number}", {**given, "id": f"row {number}", "choices": choices})


def _question(row: Row) -> Question:
    values: dict[str, Any] = {**row.values, "rephrasings": row.values.get("rephrasings") or {}}
    if type(values.get("id")) is int:
        values["id"] = str(values["id"])
    return validated(values, Question, row.label, ignore_extra=True)
