"""Isolated inference (Sec. 4.1): how often the goal that explains the words best is right."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.experiment.summary import (
    NO_INTERVAL,
    Entry,
    Estimate,
    Labels,
    Measured,
    Row,
    Table,
    averaged,
    chosen,
)
from goalscope.stats import proportion

__all__ = ["mcq_tables"]

Array = npt.NDArray[np.float64]

PROMPTS = {
    "question": "question",
    "choices": "question and choices",
    "others": "question and other choices",
    "blank": "no question",
}
"""How the prompt of each condition is called."""

NOTES = (
    "Right if the likeliest goal is a rephrasing of the right choice, or of one in the same words "
    '(Sec. 4.1); goals that tie share. "With" Unspecified it is among the goals, and wrong where '
    "it wins. Log-loss is that of the right choice in nats, summed over its rephrasings.",
    'The paper\'s row is "question and choices": 94.4 % without and 93.2 % with Unspecified '
    '(Llama 3 8B Instruct). In "question and other choices" the one that the person takes is not '
    "shown. Word overlap asks no model: the goal that shares most words with the utterance wins.",
    f"Accuracy has Wilson's 95 % interval, log-loss that of a bootstrap over rows. {NO_INTERVAL}",
)


def mcq_tables(cells: Iterable[Measured]) -> list[Table]:
    """The table of all cells of the kind "mcq"; none where there are no such cells.

    Args:
        cells: Of any kind.
    """
    found = chosen(cells, "mcq")
    if not found:
        return []
    labels = Labels(_settings(spec) for spec, _ in found)
    groups: dict[str, list[Measured]] = {}
    for cell in found:
        groups.setdefault(labels[_settings(cell[0])], []).append(cell)
    rows: list[Row] = []
    for label, group in groups.items():
        for name, prompt in PROMPTS.items():
            for way in ("without", "with"):
                row = {"model": label, "prompt": prompt, "Unspecified": way}
                rows.append({**row, **_figures(group, name, unspecified=way == "with")})
    overlaps = {
        json.dumps(spec["row"], sort_keys=True): _share(
            np.array(result["overlap"], dtype=np.float64), _right(spec, result)
        )
        for spec, result in found
        if result.get("overlap")
    }
    head: dict[str, Entry] = {"model": "word overlap", "prompt": None, "Unspecified": "without"}
    rows.append({**head, "n": len(overlaps), "accuracy": _accuracy([*overlaps.values()])})
    return [Table("mcq", "Isolated inference on multiple-choice questions", rows, NOTES)]


def _settings(spec: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in spec.items() if key not in ("kind", "row")}


def _figures(cells: Iterable[Measured], name: str, *, unspecified: bool) -> Row:
    """Rows, accuracy and log-loss under one condition."""
    won: list[float] = []
    losses: list[float] = []
    for spec, result in cells:
        condition = result["conditions"].get(name)
        if not condition or (unspecified and condition.get("unspecified") is None):
            continue
        values, right = list(condition["log_likelihood"]), _right(spec, result)
        if unspecified:
            values, right = [*values, condition["unspecified"]], np.append(right, False)
        evidence = np.array(values, dtype=np.float64)
        won.append(_share(evidence, right))
        losses.append(float(np.logaddexp.reduce(evidence) - np.logaddexp.reduce(evidence[right])))
    return {"n": len(won), "accuracy": _accuracy(won), "log-loss": averaged(losses)}


def _right(spec: Mapping[str, Any], result: Mapping[str, Any]) -> npt.NDArray[np.bool_]:
    """[G] whether each goal rephrases the right choice, or one in the same words."""
    row = spec["row"]
    answer = row["choices"][row["answer"]]
    return np.array([row["choices"][goal["choice"]] == answer for goal in result["goals"]])


def _share(values: Array, right: npt.NDArray[np.bool_]) -> float:
    return float(right[values == values.max()].mean())


def _accuracy(won: list[float]) -> Estimate | None:
    if not won:
        return None
    return Estimate(sum(won) / len(won), proportion(sum(won), len(won)), "percent", len(won))
