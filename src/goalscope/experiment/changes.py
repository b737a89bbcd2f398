"""Changes of mind: how soon a belief follows, and what expecting them costs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from goalscope.base.types import pluralize
from goalscope.belief.calibration import DEFAULT, PAPER, calibration_from_json
from goalscope.datasets.goal_sets import AFTER
from goalscope.experiment.dialogues import by_settings
from goalscope.experiment.predictors import AS_IN_PAPER, GOALSCOPE, among_goals
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Measured,
    Record,
    Sample,
    Table,
    average,
    count,
    rows_of,
    slug,
)

__all__ = ["change_table", "read_changes"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

AS_AGENT = "goalscope, an agent's"
FRESH = "goalscope, told of the change"
"""The evidence before the change is left out."""

NOTES = (
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
        records = [record for cell in group for record in _records(cell)]
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
    return Table(f"changes-{sample.name}", title, rows, NOTES)


def _records(cell: Measured) -> Iterator[Record]:
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
