"""All tables of an experiment, from its results so far."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from goalscope.base.arrays import Array, Flags
from goalscope.base.stats import proportion
from goalscope.experiment.dialogues import (
    dialogue_differences,
    dialogue_table,
    following_table,
    read_dialogues,
)
from goalscope.experiment.episodes import episode_tables, read_episodes
from goalscope.experiment.results import Cell
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Columns,
    Estimate,
    Labels,
    Measured,
    Record,
    Row,
    Table,
    average,
    chosen,
    count,
    few_notes,
    rows_of,
)

PROMPTS = {
    "question": "question",
    "choices": "question and choices",
    "others": "question and other choices",
    "blank": "no question",
}
"""The name of each condition's prompt in tables."""

QUESTION_NOTES = (
    "Right if the likeliest goal is a rephrasing of the right choice, or of one in the same words "
    '(Sec. 4.1); goals that tie share. "With" Unspecified it is among the goals, and wrong where '
    "it wins. Log-loss is that of the right choice in nats, summed over its rephrasings.",
    'The paper\'s row is "question and choices": 94.4 % without and 93.2 % with Unspecified '
    '(Llama 3 8B Instruct). In "question and other choices" the one that the person takes is not '
    "shown. Word overlap asks no model: the goal that shares most words with the utterance wins.",
    f"Accuracy has Wilson's 95 % interval, log-loss that of a bootstrap over rows. {NO_INTERVAL}",
)


def _accuracy(records: Sequence[Record]) -> Row:
    right, n = sum(each["right"] for each in records), len(records)
    interval = proportion(right, n)
    return {"accuracy": Estimate(right / n, interval, "percent", n) if n else None}


QUESTION_COLUMNS: tuple[Columns, ...] = (count(), _accuracy, average("log-loss", "log-loss"))


def question_tables(cells: Iterable[Measured]) -> list[Table]:
    """The table of all cells of the kind "mcq"; no table without such cells.

    Args:
        cells: Of any kind.
    """
    found = chosen(cells, "mcq")
    if not found:
        return []
    labels = Labels(_question_settings(spec) for spec, _ in found)
    groups: dict[tuple[str, str | None, str], list[Record]] = {
        (label, prompt, way): []
        for label in dict.fromkeys(labels[_question_settings(spec)] for spec, _ in found)
        for prompt in PROMPTS.values()
        for way in ("without", "with")
    }
    overlaps: dict[str, Record] = {}
    for spec, result in found:
        for prompt, way, record in _question_records(spec, result):
            groups[labels[_question_settings(spec)], prompt, way].append(record)
        if result.get("overlap"):
            likeness = np.array(result["overlap"], dtype=np.float64)
            row = json.dumps(spec["row"], sort_keys=True)
            overlaps[row] = {"right": _share(likeness, _right(spec, result))}
    groups["word overlap", None, "without"] = [*overlaps.values()]
    heads = ("model", "prompt", "Unspecified")
    named: list[tuple[Row, list[Record]]] = [
        (dict(zip(heads, key, strict=True)), records) for key, records in groups.items()
    ]
    rows = rows_of(named, QUESTION_COLUMNS)
    return [Table("mcq", "Isolated inference on multiple-choice questions", rows, QUESTION_NOTES)]


def _question_settings(spec: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in spec.items() if key not in ("kind", "row")}


def _question_records(
    spec: Mapping[str, Any], result: Mapping[str, Any]
) -> Iterator[tuple[str, str, Record]]:
    """The results of each condition's prompt, without and with Unspecified."""
    for name, prompt in PROMPTS.items():
        condition = result["conditions"].get(name)
        values, right = list(condition["log_likelihood"]) if condition else [], _right(spec, result)
        if values:
            yield prompt, "without", _question_record(spec, values, right)
        if values and condition.get("unspecified") is not None:
            beside = [*values, condition["unspecified"]]
            yield prompt, "with", _question_record(spec, beside, np.append(right, False))


def _question_record(spec: Mapping[str, Any], values: Sequence[float], right: Flags) -> Record:
    evidence = np.array(values, dtype=np.float64)
    loss = float(np.logaddexp.reduce(evidence) - np.logaddexp.reduce(evidence[right]))
    row = json.dumps(spec["row"], sort_keys=True)
    return {"group": row, "right": _share(evidence, right), "log-loss": loss}


def _right(spec: Mapping[str, Any], result: Mapping[str, Any]) -> Flags:
    """[G] whether each goal rephrases the right choice or one with the same words."""
    row = spec["row"]
    answer = row["choices"][row["answer"]]
    return np.array([row["choices"][goal["choice"]] == answer for goal in result["goals"]])


def _share(values: Array, right: Flags) -> float:
    return float(right[values == values.max()].mean())


def tables_of(cells: Sequence[Cell]) -> list[Table]:
    """The tables of the cells with results."""
    done = [cell for cell in cells if cell.result is not None]
    measured = [(cell.spec, cell.result or {}) for cell in done]
    tables = [
        *question_tables(measured),
        *(
            make(each)
            for each in read_dialogues(measured)
            for make in (dialogue_table, dialogue_differences, following_table)
        ),
        *(table for sample in read_episodes(done) for table in episode_tables(sample)),
    ]
    notes = tuple(warnings_of(cells))
    return [
        replace(table, notes=(*notes, *few_notes(table), *table.notes))
        for table in tables
        if table.rows
    ]


def warnings_of(cells: Sequence[Cell]) -> Iterator[str]:
    """Warnings about figures computed from these cells, one sentence each."""
    done = [cell for cell in cells if cell.result is not None]
    known: dict[str, set[str]] = {}
    for cell in done:
        for name, value in (cell.identity or {}).items():
            known.setdefault(name, set()).add(value)
    mixed = sorted(name for name, values in known.items() if len(values) > 1)
    if mixed:
        yield f"These figures mix cells measured with different {', '.join(mixed)}."
    failed = [cell for cell in cells if cell.result is None and cell.error]
    missing = len(cells) - len(done) - len(failed)
    if missing:
        yield f"{missing:,} of {len(cells):,} cells are not measured yet, so figures will change."
    if failed:
        yield f"{len(failed):,} of {len(cells):,} cells failed and are not included."
