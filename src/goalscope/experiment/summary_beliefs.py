"""Beliefs before and after: what each part of the calibration, and the adapter, gives."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from goalscope.calibrating import Observed, Tables, observed_in
from goalscope.calibration import PAPER, USUAL, Calibration, calibration_from_json
from goalscope.experiment.predictors import GOALSCOPE, among_goals
from goalscope.experiment.summary import NO_INTERVAL, Entry, Estimate, Measured, Table
from goalscope.experiment.summary_dialogues import EPS, by_settings, mean_of
from goalscope.goals import UNEXPLAINED
from goalscope.stats import auroc, reliability

__all__ = ["AGENT", "PAPERS", "TURN", "belief_table"]

Array = npt.NDArray[np.float64]

TURN = 3
"""By this turn, or by the last of a shorter dialogue, it is to be known that a goal is missing."""

PAPERS = "Eq. 1"
AGENT = "an agent's"

COLUMNS = (
    *("dialogues", "model", "belief", "n", "top-1", "log-loss", "ECE"),
    *("open log-loss", f"AUROC by turn {TURN}"),
    *(f"proposes by turn {TURN} if {kind}" for kind in ("absent", "present")),
    *(f"{100 * (1 - EPS):g} % set holds it if {kind}" for kind in ("present", "absent")),
    f"goals in the {100 * (1 - EPS):g} % set",
)
NOTES = (
    "Each line adds one part to the line above it: Eq. 1 as it stands in the paper; a prior "
    "probability of Unspecified that does not depend on the number of goals; the temperature; the "
    f"reference; the chance of a change of mind; and, in the line {GOALSCOPE}, forgetting: the "
    f"whole. The first line without adapter is as the paper has it, the line {GOALSCOPE} with it "
    f"is what goalscope does. {AGENT}: the calibration of an agent that proposes its goals itself.",
    "They are fitted together, so that a part by itself may do harm. Switching and forgetting are "
    "for minds that change, and cost log-loss where nobody changes theirs.",
    "Top-1, log-loss (nats) and expected calibration error after the last turn, among the goals "
    "alone. Open log-loss: of what is true over all turns, half of the time with the true goal "
    "left out, where Unspecified is the truth, otherwise with a wrong goal left out.",
    f"AUROC: how well the posterior of Unspecified tells the two apart after turn {TURN}, or the "
    "last of a shorter dialogue; other tables have it after the last. Proposes: "
    f"share of dialogues in which goals would be proposed after one of the first {TURN} turns, "
    "which they should be if the true goal is absent: under Eq. 1 once Unspecified is the "
    f"likeliest, otherwise once it has {100 * UNEXPLAINED:g} % of the probability.",
    f"The {100 * (1 - EPS):g} % set is conformal, at a turn drawn at random; thresholds belong to "
    "the whole calibration alone. What comes with goalscope was calibrated on dialogues of these "
    "sets; `goalscope calibrate` says how good that is on dialogues of other people.",
    f"Intervals are 95 %, by a bootstrap that resamples whole groups. {NO_INTERVAL} Dialogues from "
    "which the adapter has learned are left out.",
)


def belief_table(cells: Iterable[Measured], *, command: str = "") -> Table:
    """One table over all dialogues, whatever their set; no rows where there are none.

    Args:
        cells: Of any kind.
        command: What makes it again.
    """
    rows: list[tuple[Entry, ...]] = []
    for (name, split, goal_set, model), found in by_settings(cells, "dialogue"):
        task = ", ".join([name] if goal_set == "own" else [name, split, goal_set])
        ways: dict[str, list[Measured]] = {}
        for cell in found:
            if cell[1].get("role-play"):
                ways.setdefault(json.dumps(cell[1]["calibration"]), []).append(cell)
        for own, same in ways.items():
            if observed := observed_in(same):
                rows += [(task, model, *row) for row in _rows(observed, _read(own))]
    title = "Beliefs before and after, and what each part gives"
    return Table("beliefs", title, COLUMNS, tuple(rows), NOTES, command)


def _read(calibration: str) -> Calibration:
    return calibration_from_json(json.loads(calibration))


def _parts(own: Calibration) -> Mapping[str, Calibration]:
    """The parts of a calibration, each added to the ones before it; and that of an agent."""
    prior = replace(PAPER, unstated=own.unstated)
    warm = replace(prior, temperature=own.temperature)
    reference = replace(warm, reference=own.reference)
    changing = replace(reference, switching=own.switching)
    return {
        PAPERS: PAPER,
        "+ prior": prior,
        "+ temperature": warm,
        "+ reference": reference,
        "+ switching": changing,
        GOALSCOPE: own,
        AGENT: USUAL,
    }


def _rows(dialogues: Sequence[Observed], own: Calibration) -> Iterator[tuple[Entry, ...]]:
    tables = Tables(dialogues)
    groups = [each.group for each in dialogues]
    everyone = np.arange(len(dialogues))
    by_then = np.minimum(TURN, tables.turns) - 1
    for name, way in _parts(own).items():
        closed = [among_goals(each.goals, way)[-1] for each in dialogues]
        top1 = [
            float(row.argmax() == each.truth) for row, each in zip(closed, dialogues, strict=True)
        ]
        ece = reliability([float(np.exp(row.max())) for row in closed], top1).ece
        loss = [-float(row[each.truth]) for row, each in zip(closed, dialogues, strict=True)]
        beliefs = tables.believe(way)
        then: Array = beliefs[:, everyone, by_then]
        odds = then[..., 0] - np.logaddexp.reduce(then[..., 1:], axis=-1)
        late = np.greater(np.arange(len(beliefs[0, 0])), by_then[:, None])
        leads = beliefs[..., 0] > beliefs[..., 1:].max(-1)
        proposes = leads if way is PAPER else beliefs[..., 0] >= np.log(UNEXPLAINED)
        present, absent = np.where(late, 0.0, proposes).max(-1).tolist()
        yield (
            name,
            len(dialogues),
            mean_of(top1, groups, "top1"),
            mean_of(loss, groups, "log_loss"),
            ece,
            mean_of(tables.losses(beliefs).tolist(), groups, "log_loss"),
            Estimate(*auroc(odds[1], odds[0], groups)) if len(set(groups)) > 1 else None,
            mean_of(absent, groups, "leads"),
            mean_of(present, groups, "leads"),
            *_sets(tables, beliefs, way, groups),
        )


def _sets(
    tables: Tables, beliefs: Array, calibration: Calibration, groups: Sequence[str]
) -> tuple[Entry, Entry, Entry]:
    """Coverage with the true goal and without it, and size; None without thresholds."""
    threshold = dict(calibration.thresholds).get(EPS)
    if threshold is None:
        return None, None, None
    held, sizes = tables.conformal_sets(beliefs, threshold)
    present, absent = held.astype(float).tolist()
    return (
        mean_of(present, groups, "held"),
        mean_of(absent, groups, "held"),
        mean_of(sizes.mean(0).tolist(), groups, "size"),
    )
