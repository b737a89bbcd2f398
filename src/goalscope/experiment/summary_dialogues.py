"""Goal inference on real dialogues: how good each predictor's belief is, turn by turn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from goalscope.calibration import PAPER, Calibration, calibration_from_json
from goalscope.datasets.goal_sets import chance
from goalscope.experiment.predictors import (
    AS_IN_PAPER,
    FITTED_FROM,
    FOLDS,
    GOALS_ALONE,
    GOALSCOPE,
    MOST_SURE,
    OUTRIGHT,
    PREDICTORS,
    SEEN,
    SIMILARITIES,
    UNIFORM,
    beside_unspecified,
    fitted_temperatures,
    likeness,
    log_softmax,
    outright_belief,
    role_play,
)
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
    slug,
)
from goalscope.stats import Reliability, auroc, reliability, scores
from goalscope.types import pluralize

__all__ = ["Dialogues", "area", "by_settings", "model_tables", "read_dialogues"]

Array = npt.NDArray[np.float64]
Field = Literal["top1", "reciprocal_rank", "log_loss", "brier", "leads_absent", "leads_present"]

TURNS = (1, 2, 3, 4, 5, None)
"""Turns that tables show; None for each dialogue's last."""
FIELDS: Mapping[str, Field] = {
    "top-1": "top1",
    "MRR": "reciprocal_rank",
    "log-loss": "log_loss",
    "Brier": "brier",
}
OPEN: Mapping[str, Field] = {
    "leads if absent": "leads_absent",
    "leads if present": "leads_present",
}
"""How often Unspecified is the likeliest, with the true goal left out, and a wrong one."""
DIFFERENCE = ", difference"

NOTES = (
    "n is the number of dialogues that have the turn; at the turn called last, each has its own. "
    "All up to the calibration error is among the goals, without Unspecified.",
    f"{GOALSCOPE}: with the calibration known when it was measured; {AS_IN_PAPER}: Bayes' rule as "
    "it stands in the paper; goal seen: where the adapter was fitted on the text of the true goal.",
    "Intervals are 95 %, by a bootstrap that resamples whole groups of dialogues that share "
    f"people. Log-loss is in nats. {NO_INTERVAL}",
    "ECE: expected calibration error; only above the errors of a perfectly calibrated forecaster "
    "(95 % of them lie in the span) is a predictor too sure, or not sure enough.",
    "AUROC: how well Unspecified tells that the true goal is left out from that a wrong one is; "
    "0.5 is chance. Leads: how often Unspecified is the likeliest then.",
    f"TF-IDF, BM25, embedding and {GOALS_ALONE} have a temperature that was fitted on the other "
    f"folds of {FOLDS}, which favours them; of fewer than {FITTED_FROM} groups it is 1. "
    f'"{GOALS_ALONE}" is a control that reads no dialogue, only the words that goals share.',
    f'"{OUTRIGHT}" names a goal and says how sure it is, at most {100 * MOST_SURE:g} %; the rest '
    "is spread evenly.",
)
MODEL_NOTES = (
    "goalscope with each model, which has its own calibration. Difference: from the first model, "
    "on the dialogues that both have met in the same words and with the same goals; Eq. 1: without "
    "calibration, so that only the models differ.",
    *NOTES[2:3],
)


@dataclass(frozen=True, slots=True)
class Dialogues:
    """What the predictors made of one set of dialogues with one model.

    Attributes:
        set: Name of the data set.
        split: Which part of it; empty for a file of one's own.
        goal_set: How the goals beside the true one were chosen.
        model: The model's label.
        n: Number of dialogues.
        goals: Most goals of a dialogue.
        beliefs: By predictor and turn, where None stands for each dialogue's last, a dict for each
            dialogue that has it: its `case`, its `group`, a `Field` each, `sure`, the probability
            of the likeliest goal, and log-odds of Unspecified where goals are left out.
        notes: What could not be read, or was learned from.
    """

    set: str
    split: str
    goal_set: str
    model: str
    n: int
    goals: int
    beliefs: Mapping[tuple[str, int | None], Sequence[Mapping[str, Any]]]
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        """For files."""
        parts = (self.set, self.split, self.goal_set, self.model)
        return "-".join(slug(part) for part in parts if part)

    @property
    def task(self) -> str:
        """What was inferred."""
        own = self.goal_set == "own"
        goals = f"{self.goals} goals each" if own else f"{self.goals} {self.goal_set} goals each"
        return ", ".join(filter(None, (self.set, "" if own else self.split, goals)))

    @property
    def title(self) -> str:
        """What was inferred, and with which model."""
        return f"{self.task}, {self.model}"

    def at(self, predictor: str, turn: int | None) -> Sequence[Mapping[str, Any]]:
        """The beliefs of a predictor after a turn; None for the last."""
        return self.beliefs.get((predictor, turn), ())

    def estimate(self, predictor: str, turn: int | None, field: Field) -> Estimate | None:
        """A figure of a predictor after a turn; None without any."""
        found = self.at(predictor, turn)
        return _estimate([(each[field], each) for each in found if field in each], field)

    def area(self, turn: int | None, predictor: str = GOALSCOPE) -> Estimate | None:
        """How well Unspecified tells that the true goal is left out; None where it cannot be."""
        found = [each for each in self.at(predictor, turn) if "absent" in each]
        absent, present = ([each[kind] for each in found] for kind in ("absent", "present"))
        return area(absent, present, [each["group"] for each in found])

    def reliability(self, predictor: str, turn: int | None) -> Reliability:
        """Of beliefs that there are."""
        found = self.at(predictor, turn)
        return reliability([each["sure"] for each in found], [each["top1"] for each in found])

    def table(self) -> Table:
        """What was predicted at turns 1 to 5, and at each dialogue's last."""
        rows: list[Row] = []
        longer = any(turn and turn > 1 for _, turn in self.beliefs)
        for predictor, turn in product(PREDICTORS, TURNS if longer else (1,)):
            if not (found := self.at(predictor, turn)):
                continue
            made = self.reliability(predictor, turn)
            row: dict[str, Entry] = {
                "predictor": predictor, "turn": _after(turn), "n": len(found),
                **{name: self.estimate(predictor, turn, each) for name, each in FIELDS.items()},
                "ECE": made.ece, "if calibrated, from": made.band.low, "to": made.band.high,
            }  # fmt: skip
            if any("absent" in each for each in found):
                row["AUROC"] = self.area(turn, predictor)
                row |= {name: self.estimate(predictor, turn, each) for name, each in OPEN.items()}
            rows.append(row)
        title = f"Goals inferred from dialogues: {self.title}, {pluralize(self.n, 'dialogue')}"
        return Table(f"dialogues-{self.name}", title, rows, (*self.notes, *NOTES))


def model_tables(found: Iterable[Dialogues]) -> Iterator[Table]:
    """A table for each task that more than one model has met.

    Args:
        found: Of each task and model; the first model is what the others are compared with.
    """
    tasks: dict[str, list[Dialogues]] = {}
    for each in found:
        tasks.setdefault(each.task, []).append(each)
    for task, every in tasks.items():
        if len(every) > 1:
            rows = [
                _compared(each, every[0], turn)
                for turn in (1, 2, 3, None)
                for each in every
                if each.at(GOALSCOPE, turn)
            ]
            yield Table(f"models-{slug(task)}", f"Models compared: {task}", rows, MODEL_NOTES)


def _compared(own: Dialogues, first: Dialogues, turn: int | None) -> Row:
    """How good a belief is with one model, and how much more its figures are than another's."""

    def difference(predictor: str, field: Field) -> Estimate | None:
        before = {each["case"]["id"]: each for each in first.at(predictor, turn)}
        pairs = [
            (each[field] - before[id][field], each)
            for each in own.at(predictor, turn)
            if (id := each["case"]["id"]) in before and before[id]["case"] == each["case"]
        ]
        return None if own is first else _estimate(pairs, field)

    row: dict[str, Entry] = {
        "model": own.model, "turn": _after(turn), "n": len(own.at(GOALSCOPE, turn))
    }  # fmt: skip
    for name in ("top-1", "log-loss"):
        row[name] = own.estimate(GOALSCOPE, turn, FIELDS[name])
        row[name + DIFFERENCE] = difference(GOALSCOPE, FIELDS[name])
    row[f"Eq. 1: log-loss{DIFFERENCE}"] = difference(AS_IN_PAPER, "log_loss")
    return {**row, "open-set AUROC": own.area(turn)}


def read_dialogues(cells: Iterable[Measured]) -> tuple[Dialogues, ...]:
    """The cells of the kind "dialogue", for each set, split, goal set and model, in this order.

    Args:
        cells: Of any kind.
    """
    return tuple(
        Dialogues(
            *key,
            len(group),
            max(len(spec["case"]["goals"]) for spec, _ in group),
            _beliefs(group),
            tuple(_notes(group)),
        )
        for key, group in by_settings(cells, "dialogue")
    )


def by_settings(
    cells: Iterable[Measured], kind: str
) -> Iterator[tuple[tuple[str, str, str, str], list[Measured]]]:
    """The cells of one kind, for each set, split, goal set and label of what else was set.

    A case that was measured both with and without the model asked outright is there once, with it;
    and of one that was corrected since, the newest is.
    """
    tasks: dict[tuple[str, str, str], list[Measured]] = {}
    for cell in chosen(cells, kind):
        spec = cell[0]
        tasks.setdefault((spec["set"], spec["split"] or "", spec["goal_set"]), []).append(cell)
    for task, found in sorted(tasks.items()):
        labels = Labels(_settings(spec) for spec, _ in found)
        groups: dict[str, dict[str, Measured]] = {}
        for cell in found:
            group = groups.setdefault(labels[_settings(cell[0])], {})
            case = cell[0]["case"]
            before = group.get(case["id"])
            if before is None or before[0]["case"] != case or cell[1].get("outright"):
                group[case["id"]] = cell
        for label, group in groups.items():
            yield (*task, label), [*group.values()]


def area(
    absent: Sequence[float], present: Sequence[float], groups: Sequence[str]
) -> Estimate | None:
    """The AUROC of log-odds of Unspecified with its interval; None for a single group."""
    n = len({*groups})
    return Estimate(*auroc(absent, present, groups), groups=n) if n > 1 else None


def _settings(spec: Mapping[str, Any]) -> dict[str, Any]:
    own = ("kind", "set", "split", "goal_set", "case", "outright")
    return {key: value for key, value in spec.items() if key not in own}


def _beliefs(cells: Sequence[Measured]) -> dict[tuple[str, int | None], list[dict[str, Any]]]:
    """Let each predictor believe, and score what it believes; see `Dialogues`."""
    found: dict[tuple[str, int | None], list[dict[str, Any]]] = {}
    known = {result["seen"] for _, result in cells if result.get("seen") is not None}

    def keep(
        predictor: str, cell: Measured, table: Iterable[Array], way: Calibration | None = None
    ) -> None:
        case = cell[0]["case"]
        beside = _left_out(cell, way) if way and len(case["goals"]) > 2 else []
        kept: dict[str, Any] = {}
        for turn, belief in enumerate(table):
            good = scores(belief, case["truth"])
            kept = {"case": case, "group": case["group"], "sure": float(np.exp(belief.max()))}
            kept |= {each: getattr(good, each) for each in FIELDS.values()}
            kept |= beside[turn] if beside else {}
            found.setdefault((predictor, turn + 1), []).append(kept)
        if kept:
            found.setdefault((predictor, None), []).append(kept)

    for cell in cells:
        spec, result = cell
        goals, turns = len(spec["case"]["goals"]), len(spec["case"]["turns"])
        keep(UNIFORM, cell, np.full((turns, goals), -np.log(goals)))
        if result.get("role-play"):
            own = calibration_from_json(result["calibration"])
            keep(GOALSCOPE, cell, role_play(result, own), own)
            keep(AS_IN_PAPER, cell, role_play(result, PAPER), PAPER)
            if len(known) == 2 and result.get("seen") is not None:
                keep(SEEN[result["seen"]], cell, role_play(result, own))
        answers = result.get("outright") or ()
        keep(OUTRIGHT, cell, [outright_belief(answer, goals) for answer in answers])
    for predictor in (GOALS_ALONE, *SIMILARITIES):
        likes = [(cell, table) for cell in cells if (table := likeness(cell, predictor)).size]
        for (cell, table), heat in zip(likes, fitted_temperatures(likes), strict=True):
            keep(predictor, cell, log_softmax(table / heat))
    return found


def _left_out(cell: Measured, calibration: Calibration) -> list[dict[str, float]]:
    """Unspecified turn by turn with the true goal left out (absent), and a wrong one (present)."""
    case, result = cell[0]["case"], cell[1]
    table = np.column_stack([result["unspecified"], result["role-play"]])
    truth = case["truth"] + 1
    wrong = [place for place in range(1, table.shape[1]) if place != truth]
    rows: list[dict[str, float]] = [{} for _ in table]
    for kind, out in (("absent", truth), ("present", chance(0, case["id"]).choice(wrong))):
        beliefs = beside_unspecified(np.delete(table, out, axis=1), calibration)
        for row, belief in zip(rows, beliefs, strict=True):
            row[kind] = float(belief[0] - np.logaddexp.reduce(belief[1:]))
            row[f"leads_{kind}"] = float(belief[0] > belief[1:].max())
    return rows


def _notes(cells: Sequence[Measured]) -> Iterator[str]:
    if learned := sum(bool(result.get("learned")) for _, result in cells):
        yield f"The model's adapter has LEARNED from {learned:,} of these dialogues."
    answers = [each for _, result in cells for each in result.get("outright") or ()]
    if unread := sum(each["goal"] is None for each in answers):
        yield (
            f"{unread:,} of {len(answers):,} answers of the model that is asked could not be read; "
            "they are scored as uniform."
        )


def _after(turn: int | None) -> str:
    return "last" if turn is None else str(turn)


def _estimate(values: Sequence[tuple[float, Mapping[str, Any]]], field: Field) -> Estimate | None:
    form = "percent" if field in ("top1", "leads_absent", "leads_present") else "number"
    groups = [each["group"] for _, each in values]
    return averaged([value for value, _ in values], groups, form)
