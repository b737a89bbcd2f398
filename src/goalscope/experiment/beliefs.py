"""Beliefs before and after: the effect of each part of the calibration and of the adapter."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from goalscope.belief.calibration import DEFAULT, PAPER, Calibration, calibration_from_json
from goalscope.belief.goal_manager import UNEXPLAINED
from goalscope.experiment.dialogues import GOALSCOPE, among_goals, area, by_settings, reliability_of
from goalscope.experiment.fit_calibration import Observed, Tables, observed_in
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Columns,
    Measured,
    Record,
    Row,
    Table,
    average,
    count,
    rows_of,
)

Array = npt.NDArray[np.float64]

TURN = 3
"""The turn (or the last of a shorter dialogue) by which a missing goal should be noticed."""

EQ1 = "Eq. 1"
AGENT = "an agent's"
EPS = 0.1
"""Miss rate of the conformal sets."""

NOTES = (
    f"Each line adds one part to the line above it: {EQ1} as it stands in the paper; a prior of "
    "Unspecified that does not depend on the number of goals; the temperature; the reference; and, "
    f"in the line {GOALSCOPE}, the chance of a change of mind. They are fitted together, so that a "
    f"part by itself may do harm. {AGENT}: the calibration of an agent that proposes its goals "
    "itself.",
    "Top-1, log-loss (nats) and expected calibration error after the last turn, among the goals "
    "alone. Open log-loss: of what is true over all turns, half of the time with the true goal "
    "left out, where Unspecified is the truth, otherwise with a wrong goal left out.",
    f"AUROC: how well Unspecified tells the two apart after turn {TURN}, or the last of a shorter "
    "dialogue. Proposes: share of dialogues in which goals would be proposed by then, as they "
    f"should be if the true goal is absent: under {EQ1} once Unspecified is the likeliest, "
    f"otherwise once it has {100 * UNEXPLAINED:g} % of the probability.",
    f"The {100 * (1 - EPS):g} % set is conformal, at a turn drawn at random. What comes with "
    "goalscope was calibrated on dialogues of these sets; `goalscope calibrate` says how good that "
    "is on dialogues of other people.",
    f"Intervals are 95 %, by a bootstrap that resamples whole groups. {NO_INTERVAL} Dialogues from "
    "which the adapter has learned are left out.",
)


SET = f"{100 * (1 - EPS):g} % set"
COLUMNS: tuple[Columns, ...] = (
    count(),
    average("top-1", "top1", "percent"),
    average("log-loss", "loss"),
    lambda found: {"ECE": reliability_of(found).ece},
    average("open log-loss", "open loss"),
    lambda found: {f"AUROC by turn {TURN}": area(found)},
    average(f"proposes by turn {TURN} if absent", "proposes absent", "percent"),
    average(f"proposes by turn {TURN} if present", "proposes present", "percent"),
    average(f"{SET} holds it if present", "held present", "percent"),
    average(f"{SET} holds it if absent", "held absent", "percent"),
    average(f"goals in the {SET}", "set size"),
)


def belief_table(cells: Iterable[Measured]) -> Table:
    """One table over the dialogues of all datasets; no rows if there are none.

    Args:
        cells: Of any kind.
    """
    rows: list[Row] = []
    for (name, split, goal_set, model), found in by_settings(cells, "dialogue"):
        task = ", ".join([name] if goal_set == "own" else [name, split, goal_set])
        ways: dict[str, list[Measured]] = {}
        for cell in found:
            if cell[1].get("role-play"):
                ways.setdefault(json.dumps(cell[1]["calibration"]), []).append(cell)
        for own, same in ways.items():
            if observed := observed_in(same):
                calibration = calibration_from_json(json.loads(own))
                head: Row = {"dialogues": task, "model": model}
                groups = [
                    ({**head, "belief": belief}, records)
                    for belief, records in _records(observed, calibration)
                ]
                rows += rows_of(groups, COLUMNS)
    return Table("beliefs", "Beliefs before and after, and what each part gives", rows, NOTES)


def _parts(own: Calibration) -> Mapping[str, Calibration]:
    """The parts of a calibration, each added to those before it, and the agent's calibration."""
    prior = replace(PAPER, prior_unspecified=own.prior_unspecified)
    warm = replace(prior, temperature=own.temperature)
    reference = replace(warm, reference=own.reference)
    return {
        EQ1: PAPER,
        "+ prior": prior,
        "+ temperature": warm,
        "+ reference": reference,
        GOALSCOPE: own,
        AGENT: DEFAULT,
    }


def _records(dialogues: Sequence[Observed], own: Calibration) -> Iterator[tuple[str, list[Record]]]:
    """The name of each belief and its records, one per dialogue."""
    tables = Tables(dialogues)
    everyone = np.arange(len(dialogues))
    by_then = np.minimum(TURN, tables.turns) - 1
    for name, way in _parts(own).items():
        beliefs = tables.believe(way)
        then: Array = beliefs[:, everyone, by_then]
        odds = then[..., 0] - np.logaddexp.reduce(then[..., 1:], axis=-1)
        late = np.greater(np.arange(len(beliefs[0, 0])), by_then[:, None])
        leads = beliefs[..., 0] > beliefs[..., 1:].max(-1)
        proposes = leads if way is PAPER else beliefs[..., 0] >= np.log(UNEXPLAINED)
        present, absent = np.where(late, 0.0, proposes).max(-1)
        values: dict[str, Array] = {
            "open loss": tables.losses(beliefs),
            "present": odds[0],
            "absent": odds[1],
            "proposes present": present,
            "proposes absent": absent,
        }
        threshold = dict(way.thresholds).get(EPS)
        if threshold is not None:
            held, sizes = tables.conformal_sets(beliefs, threshold)
            values |= {"held present": held[0], "held absent": held[1], "set size": sizes.mean(0)}
        records: list[Record] = []
        for i, each in enumerate(dialogues):
            last = among_goals(each.goals, way)[-1]
            records.append({
                "group": each.group,
                "top1": float(last.argmax() == each.truth),
                "loss": -float(last[each.truth]),
                "sure": float(np.exp(last.max())),
                **{key: float(array[i]) for key, array in values.items()},
            })  # fmt: skip
        yield name, records
