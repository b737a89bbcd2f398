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
    Table,
    chosen,
)
from goalscope.stats import bootstrap_mean, proportion

__all__ = ["mcq_tables"]

Array = npt.NDArray[np.float64]

PROMPTS = {
    "question": "question",
    "choices": "question and choices",
    "others": "question and other choices",
    "blank": "no question",
}
"""How the prompt of each condition is called; other conditions go by their own name."""

NOTES = (
    "Right if the likeliest goal is a rephrasing of the right choice (Sec. 4.1); goals that tie "
    'share. "With" Unspecified it is among the goals, and wrong where it wins.',
    "The utterance has the same tokens under each goal, so that the sum and the per-token mean of "
    "its log-probabilities put goals in the same order: accuracy is the same, and log-loss is not.",
    'The paper\'s row is "question and choices". In "question and other choices" the one that the '
    "person takes is not shown, so that there is nothing to copy.",
    "Log-loss is that of the right choice in nats, the posterior summed over its rephrasings.",
    "Word overlap asks no model: the goal that shares most words with the utterance wins.",
    "Choices in the same words as the right one are right, too.",
    f"Accuracy has Wilson's 95 % interval, log-loss that of a bootstrap over rows. {NO_INTERVAL}",
    "The paper has 94.4 % without and 93.2 % with Unspecified (Llama 3 8B Instruct).",
)


def mcq_tables(cells: Iterable[Measured], *, command: str = "") -> tuple[Table, ...]:
    """The table of all cells of the kind "mcq"; none where there are no such cells.

    Args:
        cells: Of any kind.
        command: What made them.
    """
    found = chosen(cells, "mcq")
    if not found:
        return ()
    labels = Labels(_settings(spec) for spec, _ in found)
    groups: dict[str, list[Measured]] = {}
    for cell in found:
        groups.setdefault(labels[_settings(cell[0])], []).append(cell)
    rows: list[tuple[Entry, ...]] = []
    for label, group in groups.items():
        names = dict.fromkeys([*PROMPTS, *(c for _, result in group for c in result["conditions"])])
        for name in names:
            for unspecified in (False, True):
                figures = _figures(group, name, unspecified=unspecified)
                with_it = "with" if unspecified else "without"
                rows.append((label, PROMPTS.get(name, name), with_it, *figures))
    rows.append(("word overlap", None, "without", *_overlap(found)))
    columns = (
        "model",
        "prompt",
        "Unspecified",
        "n",
        "accuracy",
        "log-loss, sum",
        "log-loss, per-token mean",
    )
    title = "Isolated inference on multiple-choice questions"
    return (Table("mcq", title, columns, tuple(rows), NOTES, command),)


def _settings(spec: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in spec.items() if key not in ("kind", "row")}


def _figures(
    cells: Iterable[Measured], name: str, *, unspecified: bool
) -> tuple[int, Estimate | None, Estimate | None, Estimate | None]:
    """Rows, accuracy, and log-loss by the sum and by the per-token mean, under one condition."""
    won: list[float] = []
    losses: tuple[list[float], list[float]] = ([], [])
    for spec, result in cells:
        condition = result["conditions"].get(name)
        if not condition or (unspecified and condition.get("unspecified") is None):
            continue
        values, right = list(condition["log_likelihood"]), _right(spec, result)
        if unspecified:
            values, right = [*values, condition["unspecified"]], np.append(right, False)
        evidence = np.array(values, dtype=np.float64)
        won.append(_share(evidence, right))
        for kept, scale in zip(losses, (1, result["tokens"]), strict=True):
            kept.append(_log_loss(evidence / scale, right))
    return len(won), _accuracy(won), _mean(losses[0]), _mean(losses[1])


def _overlap(cells: Iterable[Measured]) -> tuple[int, Estimate | None, None, None]:
    won = {
        json.dumps(spec["row"], sort_keys=True): _share(
            np.array(result["overlap"], dtype=np.float64), _right(spec, result)
        )
        for spec, result in cells
        if result.get("overlap")
    }
    return len(won), _accuracy(list(won.values())), None, None


def _right(spec: Mapping[str, Any], result: Mapping[str, Any]) -> npt.NDArray[np.bool_]:
    """[G] whether each goal rephrases the right choice, or one in the same words."""
    row = spec["row"]
    answer = row["choices"][row["answer"]]
    return np.array([row["choices"][goal["choice"]] == answer for goal in result["goals"]])


def _share(values: Array, right: npt.NDArray[np.bool_]) -> float:
    return float(right[values == values.max()].mean())


def _log_loss(evidence: Array, right: npt.NDArray[np.bool_]) -> float:
    return float(np.logaddexp.reduce(evidence) - np.logaddexp.reduce(evidence[right]))


def _accuracy(won: list[float]) -> Estimate | None:
    if not won:
        return None
    return Estimate(sum(won) / len(won), proportion(sum(won), len(won)), "percent")


def _mean(values: list[float]) -> Estimate | None:
    return Estimate(sum(values) / len(values), bootstrap_mean(values)) if values else None
