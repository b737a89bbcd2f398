"""Isolated inference (Sec. 4.1): how often the goal that best explains the words is right."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.base.stats import proportion
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
    rows_of,
)

__all__ = ["question_tables"]

Array = npt.NDArray[np.float64]

PROMPTS = {
    "question": "question",
    "choices": "question and choices",
    "others": "question and other choices",
    "blank": "no question",
}
"""The name of each condition's prompt in tables."""

NOTES = (
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


COLUMNS: tuple[Columns, ...] = (count(), _accuracy, average("log-loss", "log-loss"))


def question_tables(cells: Iterable[Measured]) -> list[Table]:
    """The table of all cells of the kind "mcq"; no table without such cells.

    Args:
        cells: Of any kind.
    """
    found = chosen(cells, "mcq")
    if not found:
        return []
    labels = Labels(_settings(spec) for spec, _ in found)
    groups: dict[tuple[str, str | None, str], list[Record]] = {
        (label, prompt, way): []
        for label in dict.fromkeys(labels[_settings(spec)] for spec, _ in found)
        for prompt in PROMPTS.values()
        for way in ("without", "with")
    }
    overlaps: dict[str, Record] = {}
    for spec, result in found:
        for prompt, way, record in _records(spec, result):
            groups[labels[_settings(spec)], prompt, way].append(record)
        if result.get("overlap"):
            likeness = np.array(result["overlap"], dtype=np.float64)
            row = json.dumps(spec["row"], sort_keys=True)
            overlaps[row] = {"right": _share(likeness, _right(spec, result))}
    groups["word overlap", None, "without"] = [*overlaps.values()]
    heads = ("model", "prompt", "Unspecified")
    rows = rows_of(
        [(dict(zip(heads, key, strict=True)), records) for key, records in groups.items()], COLUMNS
    )
    return [Table("mcq", "Isolated inference on multiple-choice questions", rows, NOTES)]


def _settings(spec: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in spec.items() if key not in ("kind", "row")}


def _records(
    spec: Mapping[str, Any], result: Mapping[str, Any]
) -> Iterator[tuple[str, str, Record]]:
    """The results of each condition's prompt, without and with Unspecified."""
    for name, prompt in PROMPTS.items():
        condition = result["conditions"].get(name)
        values, right = list(condition["log_likelihood"]) if condition else [], _right(spec, result)
        if values:
            yield prompt, "without", _record(spec, values, right)
        if values and condition.get("unspecified") is not None:
            beside = [*values, condition["unspecified"]]
            yield prompt, "with", _record(spec, beside, np.append(right, False))


def _record(
    spec: Mapping[str, Any], values: Sequence[float], right: npt.NDArray[np.bool_]
) -> Record:
    evidence = np.array(values, dtype=np.float64)
    loss = float(np.logaddexp.reduce(evidence) - np.logaddexp.reduce(evidence[right]))
    row = json.dumps(spec["row"], sort_keys=True)
    return {"group": row, "right": _share(evidence, right), "log-loss": loss}


def _right(spec: Mapping[str, Any], result: Mapping[str, Any]) -> npt.NDArray[np.bool_]:
    """[G] whether each goal rephrases the right choice or one with the same words."""
    row = spec["row"]
    answer = row["choices"][row["answer"]]
    return np.array([row["choices"][goal["choice"]] == answer for goal in result["goals"]])


def _share(values: Array, right: npt.NDArray[np.bool_]) -> float:
    return float(right[values == values.max()].mean())
