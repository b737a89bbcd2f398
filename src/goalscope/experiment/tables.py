"""All tables of an experiment, from its results so far."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from goalscope.base.arrays import Array, Flags
from goalscope.base.stats import proportion
from goalscope.base.types import pluralize
from goalscope.belief.calibration import DEFAULT, PAPER, calibration_from_json
from goalscope.datasets.goal_sets import AFTER
from goalscope.experiment.dialogues import (
    AS_IN_PAPER,
    GOALSCOPE,
    among_goals,
    by_settings,
    dialogue_differences,
    dialogue_table,
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
    Sample,
    Table,
    average,
    chosen,
    count,
    few_notes,
    rows_of,
    slug,
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


AS_AGENT = "goalscope, an agent's"
FRESH = "goalscope, told of the change"
"""The evidence before the change is left out."""

CHANGE_NOTES = (
    "Each dialogue is scripted: turns of real people who had one goal, then of one who had another "
    f"({AFTER} turns). Followed within k rounds: the second goal was the likeliest after at least "
    "one of the first k turns of that person. Then, before the change: how often the first goal "
    "was the likeliest, in all of these rounds and in the last, and there its log-loss in nats.",
    f"{GOALSCOPE}: with the calibration known when it was measured; {AS_AGENT}: with that of an "
    f"agent that proposes its goals itself; {AS_IN_PAPER}: Bayes' rule as it stands in the paper; "
    f"{FRESH}: the evidence before the change is left out.",
    "Beliefs are over the goals alone. Intervals are 95 %, by a bootstrap that resamples whole "
    "groups of dialogues with the same first goal, since these begin with the same people's words. "
    f"{NO_INTERVAL}",
)


def read_changes(cells: Iterable[Measured]) -> tuple[Sample, ...]:
    """The cells of the kind "change", for each set, split and model, in this order.

    A record is what one `belief` made of one script: the mean `probabilities` [T, 2] of the first
    and the second goal after each turn, whether the second was `followed` within k turns, and
    unless the evidence before the change is left out, whether the first goal led before it.

    Args:
        cells: Of any kind.
    """
    samples: list[Sample] = []
    for (name, split, _, model), group in by_settings(cells, "change"):
        records = [record for cell in group for record in _change_records(cell)]
        goals = max(len(spec["case"]["goals"]) for spec, _ in group)
        title = (
            f"{name}, {split}, {goals} random goals each, {model}, "
            f"{pluralize(len(group), 'dialogue')}"
        )
        samples.append(Sample("-".join(map(slug, (name, split, model))), title, records))
    return tuple(samples)


def change_table(sample: Sample) -> Table:
    """How often each belief follows the change, and favours the first goal before it."""
    round = sample.records[0]["round"]
    columns = (
        count(),
        *(average(f"followed within {k}", f"followed {k}", "percent") for k in range(1, AFTER + 1)),
        average(f"first goal leads, rounds 1-{round - 1}", "first leads", "percent"),
        average(f"round {round - 1}", "first leads at last", "percent"),
        average(f"log-loss, round {round - 1}", "log-loss"),
    )
    ways = dict.fromkeys(each["belief"] for each in sample.records)
    rows = rows_of([({"belief": way}, sample.where(belief=way)) for way in ways], columns)
    title = f"A change of mind at round {round}: {sample.title}"
    return Table(f"changes-{sample.name}", title, rows, CHANGE_NOTES)


def _change_records(cell: Measured) -> Iterator[Record]:
    spec, result = cell
    own = calibration_from_json(result["calibration"])
    ways = {
        GOALSCOPE: own,
        f"{GOALSCOPE}, without switching": replace(own, switching=0.0),
        AS_AGENT: DEFAULT,
        AS_IN_PAPER: PAPER,
        FRESH: own,
    }
    table = np.array(result["role-play"], dtype=np.float64)
    pair = [spec["case"]["truth"], spec["case"]["second"]]
    table = np.column_stack([table[:, pair], np.delete(table, pair, axis=1)])
    for way, calibration in ways.items():
        beliefs = among_goals(table[-AFTER:] if way == FRESH else table, calibration)
        followed = np.logical_or.accumulate(_leads(beliefs[-AFTER:], 1))
        record = {
            "belief": way,
            "round": spec["change"],
            "group": spec["case"]["group"],
            "probabilities": np.exp(beliefs[:, :2]),
            **{f"followed {k + 1}": float(each) for k, each in enumerate(followed)},
        }
        if way != FRESH:
            before = beliefs[:-AFTER]
            leads = _leads(before, 0)
            record |= {
                "first leads": float(leads.mean()),
                "first leads at last": float(leads[-1]),
                "log-loss": -float(before[-1, 0]),
            }
        yield record


def _leads(beliefs: Array, goal: int) -> Flags:
    """[T] whether this goal is likelier than every other one."""
    others: Array = np.delete(beliefs, goal, axis=1).max(axis=1)
    return beliefs[:, goal] > others


def tables_of(cells: Sequence[Cell]) -> list[Table]:
    """The tables of the cells with results."""
    done = [cell for cell in cells if cell.result is not None]
    measured = [(cell.spec, cell.result or {}) for cell in done]
    tables = [
        *question_tables(measured),
        *(
            make(each)
            for each in read_dialogues(measured)
            for make in (dialogue_table, dialogue_differences)
        ),
        *map(change_table, read_changes(measured)),
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
