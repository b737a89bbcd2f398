"""Isolated inference (Sec. 4.1): which choice's paraphrases best explain the answer?"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from typing import Any

from goalscope.base.inputs import shown
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    ModelError,
    Turn,
    canonical,
)
from goalscope.belief.likelihood import Layout, RolePlay
from goalscope.datasets.files import Row, own_rows
from goalscope.experiment.baselines import overlap
from goalscope.models import Generator, LikelihoodModel
from goalscope.prompts import render

LETTERS = ("A", "B", "C", "D", "E")
TASK = "Ask the human a question."
BLANK = "What do you say?"
"""What the agent asks in the control without the question."""

_LONGEST_KEY = 20
"""Maximum length of the name of a choice."""


@dataclass(frozen=True, slots=True)
class Question:
    """One multiple-choice question.

    Attributes:
        id: Unique within a file.
        prompt: The question.
        choices: The words of each choice, by its letter.
        answer: Letter of the right choice.
        rephrasings: Paraphrases of each choice, by its letter; empty if they are not written yet.
    """

    id: str
    prompt: str
    choices: Mapping[str, str]
    answer: str
    rephrasings: Mapping[str, Sequence[str]]


def read_questions(file: Path, limit: int | None = None) -> list[Question]:
    """Read questions: JSON Lines, with rephrasings or without, or the CSV file of the paper's set.

    A row of JSON is `{"id", "prompt", "choices": {"A": ..., "E": ...}, "answer": "A",
    "rephrasings": {"A": [...], ...}}`; the columns of a CSV file are prompt, A to E, answer.

    Raises:
        InvalidInputError: The file cannot be read, or a row is invalid; the message names the row.
    """
    rows = _csv_rows(file) if file.suffix.lower() == ".csv" else own_rows(file)
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
    roleplay = RolePlay(model, layout=layout)
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
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise InvalidInputError(f"{file} cannot be read: {cause}.") from None
    columns = ("prompt", *LETTERS, "answer")
    number = 0
    try:
        for number, row in enumerate(csv.DictReader(io.StringIO(text, newline="")), 1):
            label = f"{file}, row {number}"
            missing = [name for name in columns if not isinstance(row.get(name), str)]
            if missing or None in row:
                why = f"{', '.join(missing)} is missing" if missing else "there are more values"
                raise InvalidInputError(f"{label}: the columns must be {', '.join(columns)}; {why}")
            choices = {letter: row[letter] for letter in LETTERS}
            given = {"prompt": row["prompt"], "choices": choices, "answer": row["answer"]}
            yield Row(label, {"id": f"row {number}", **given})
    except csv.Error as error:
        raise InvalidInputError(f"{file}, row {number + 1}: {error}") from None


def _question(row: Row) -> Question:
    label = row.label
    choices, answer = row.row("choices"), row.text("answer")
    if len(choices.values) < 2:
        raise InvalidInputError(f"{label}: 'choices' must have at least two texts.")
    for key in choices.values:
        if not (key.isprintable() and 0 < len(key) <= _LONGEST_KEY):
            raise InvalidInputError(
                f"{label}: a choice needs a short name such as A, not {shown(key)}."
            )
    read = {key: choices.text(key) for key in choices.values}
    if answer not in read:
        raise InvalidInputError(
            f"{label}: 'answer' must be one of {', '.join(read)}, not {shown(answer)}."
        )
    given = row.row("rephrasings") if row.values.get("rephrasings") else Row(label, {})
    if given.values and set(given.values) != set(read):
        raise InvalidInputError(f"{label}: 'rephrasings' must have a list for each choice.")
    rephrasings = {key: given.texts(key, empty=False) for key in given.values}
    for key, texts in rephrasings.items():
        if canonical(read[key]) in map(canonical, texts):
            raise InvalidInputError(
                f"{label}: a rephrasing of {key} must not be the choice itself."
            )
    return Question(str(row.name("id")), row.text("prompt"), read, answer, rephrasings)
