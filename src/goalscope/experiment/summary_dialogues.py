"""Goal inference on real dialogues: how good each predictor's belief is, turn by turn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

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
    Table,
    chosen,
    slug,
)
from goalscope.stats import Reliability, Scores, auroc, bootstrap_mean, reliability, scores
from goalscope.types import counted

__all__ = ["EPS", "Dialogues", "Openness", "Outcome", "by_settings", "mean_of", "read_dialogues"]

Array = npt.NDArray[np.float64]

TURNS = (1, 2, 3, 4, 5, None)
"""Turns that tables show; None for each dialogue's last."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One predictor's belief after one turn of one dialogue.

    Attributes:
        case: The dialogue, as it was measured.
        scores: How good the belief was.
        confidence: Probability of the likeliest goal.
    """

    case: Mapping[str, Any]
    scores: Scores
    confidence: float

    @property
    def group(self) -> str:
        """Of the dialogue; intervals resample groups."""
        return self.case["group"]


@dataclass(frozen=True, slots=True)
class Openness:
    """How likely Unspecified is after one turn of one dialogue, as log-odds in nats.

    Attributes:
        group: Of the dialogue.
        present: With the true goal among the goals, and one of the wrong ones left out.
        absent: With the true goal left out.
        leads: Whether Unspecified is the likeliest, with the true goal and without it.
        held: Whether the conformal set (`EPS`) holds what is true, in the same order; None where
            there is no threshold for it.
        sizes: Number of goals in it; 0 where there is none.
    """

    group: str
    present: float
    absent: float
    leads: tuple[bool, bool]
    held: tuple[bool, bool] | None
    sizes: tuple[int, int]


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
        outcomes: By predictor and turn, where None stands for each dialogue's last; those of the
            dialogues that have that turn and for which the predictor was run.
        notes: What was fitted, and what could not be read.
        openness: As `outcomes`, of the dialogues with more than two goals.
    """

    set: str
    split: str
    goal_set: str
    model: str
    n: int
    goals: int
    outcomes: Mapping[tuple[str, int | None], Sequence[Outcome]]
    notes: tuple[str, ...]
    openness: Mapping[tuple[str, int | None], Sequence[Openness]]

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

    def accuracy_by_turn(
        self, turns: int = 10
    ) -> dict[str, list[tuple[int | None, int, Estimate]]]:
        """Turn, number of dialogues that have it, and top-1 accuracy, for each predictor.

        In the end stands None, each dialogue's last turn, where some have more than one.
        """
        last = (None,) if (UNIFORM, 2) in self.outcomes else ()
        return {
            predictor: [
                (turn, len(found), estimate)
                for turn in (*range(1, turns + 1), *last)
                if (found := self.outcomes.get((predictor, turn), ()))
                and (estimate := _estimate(found, "top1"))
            ]
            for predictor in PREDICTORS
        }

    def reliabilities(self) -> dict[str, Reliability]:
        """Of each predictor that has any outcome, at each dialogue's last turn."""
        found = {name: self.outcomes.get((name, None), ()) for name in PREDICTORS}
        return {name: _reliability(outcomes) for name, outcomes in found.items() if outcomes}

    def table(self, *, command: str = "") -> Table:
        """What was predicted at turns 1 to 5, and at each dialogue's last."""
        rows: list[tuple[Entry, ...]] = []
        longer = any(turn and turn > 1 for _, turn in self.outcomes)
        for predictor, turn in product(PREDICTORS, TURNS if longer else (1,)):
            found = self.outcomes.get((predictor, turn))
            if not found:
                continue
            made = _reliability(found)
            rows.append(
                (
                    predictor,
                    "last" if turn is None else str(turn),
                    len(found),
                    *(_estimate(found, each) for each in FIELDS),
                    made.ece,
                    made.band,
                )
            )
        title = f"Goals inferred from dialogues: {self.title}, {counted(self.n, 'dialogue')}"
        own = (note for name, note in NOTES_OF.items() if (name, None) in self.outcomes)
        notes = (*self.notes, *NOTES, *own)
        return Table(self._name("dialogues"), title, COLUMNS, tuple(rows), notes, command)

    def open_set_table(self, *, command: str = "") -> Table:
        """How well Unspecified tells that the true goal is not among the goals."""
        rows: list[tuple[Entry, ...]] = []
        for predictor, turn in product((GOALSCOPE, AS_IN_PAPER), TURNS):
            found = self.openness.get((predictor, turn))
            if not found:
                continue
            groups = [each.group for each in found]
            sets = [(each.group, each.held, each.sizes) for each in found if each.held is not None]
            people = [group for group, _, _ in sets]
            rows.append(
                (
                    predictor,
                    "last" if turn is None else str(turn),
                    len(found),
                    self.area(turn, predictor),
                    mean_of([float(each.leads[1]) for each in found], groups, "leads"),
                    mean_of([float(each.leads[0]) for each in found], groups, "leads"),
                    *(
                        (
                            mean_of([float(held[0]) for _, held, _ in sets], people, "held"),
                            mean_of([float(held[1]) for _, held, _ in sets], people, "held"),
                            mean_of([sum(size) / 2 for _, _, size in sets], people, "size"),
                        )
                        if sets
                        else (None, None, None)
                    ),
                )
            )
        title = f"Is the goal in the set? {self.title}, {counted(self.n, 'dialogue')}"
        return Table(self._name("open-set"), title, OPEN_COLUMNS, tuple(rows), OPEN_NOTES, command)

    def area(self, turn: int | None, predictor: str = GOALSCOPE) -> Estimate | None:
        """The AUROC of `open_set_table`; None where it is not defined."""
        found = self.openness.get((predictor, turn), ())
        groups = [each.group for each in found]
        if len(set(groups)) < 2:
            return None
        area = auroc([e.absent for e in found], [e.present for e in found], groups)
        return Estimate(*area, groups=len(set(groups)))

    def _name(self, what: str) -> str:
        parts = [part for part in (self.set, self.split, self.goal_set, self.model) if part]
        return "-".join(map(slug, (what, *parts)))


FIELDS = ("top1", "reciprocal_rank", "log_loss", "brier")
COLUMNS = (
    "predictor",
    "turn",
    "n",
    "top-1",
    "MRR",
    "log-loss",
    "Brier",
    "ECE",
    "ECE if calibrated",
)
EPS = 0.1
"""Share of misses of the conformal sets that tables show."""

OPEN_COLUMNS = (
    *("belief", "turn", "n", "AUROC", "leads if absent", "leads if present"),
    *(f"{100 * (1 - EPS):g} % set holds it if {kind}" for kind in ("present", "absent")),
    "size",
)
OPEN_NOTES = (
    "Each dialogue counts twice: with the true goal left out, and with one of the wrong goals left "
    "out. AUROC: how well the posterior of Unspecified tells the two apart, for dialogues of "
    "different groups; 0.5 is chance, 1 is always.",
    "Then the share of dialogues in which Unspecified is the likeliest: it should be if the true "
    "goal is absent, and should not be if it is present.",
    f"The {100 * (1 - EPS):g} % set is conformal: it holds what is true (Unspecified if the true "
    "goal is absent) in such a share of dialogues like those of the calibration, at a turn drawn "
    "at random.",
    "n is the number of dialogues that have the turn; intervals are 95 %, by a bootstrap that "
    f"resamples whole groups. {NO_INTERVAL}",
    f"{GOALSCOPE}: with the calibration known when it was measured; {AS_IN_PAPER}: neither "
    "evidence nor prior changed.",
)
NOTES = (
    "n is the number of dialogues that have the turn; at the turn called last, each has its own. "
    "All is among the goals, without Unspecified: how often that leads stands with the open set.",
    "Intervals are 95 %, by a bootstrap that resamples whole groups of dialogues that share "
    "people. Goals that tie share the top, or have their mean rank. Log-loss is in nats. "
    f"{NO_INTERVAL}",
    f"{GOALSCOPE}: with the calibration known when it was measured; {AS_IN_PAPER}: Bayes' rule as "
    "it stands in the paper.",
    "ECE: expected calibration error. If calibrated: where that of a perfectly calibrated "
    "forecaster with the same confidences lies in 95 % of samples of this size, which is no "
    "interval of the ECE. Only above it is a predictor too sure, or not sure enough.",
    "TF-IDF, BM25 and embedding compare each goal with all of the person's words so far. Their "
    f"similarities become probabilities by a temperature that has the least log-loss on the "
    f"other folds of {FOLDS} (groups stay together), which favours them: goalscope's is fixed. Of "
    f"fewer than {FITTED_FROM} groups none is fitted: it is 1, and only top-1 and MRR compare them "
    "fairly.",
    f'"{GOALS_ALONE}" is a control that reads no dialogue: a goal is the likelier, the more words '
    "it shares with the other goals on average (Jaccard); its temperature is fitted likewise. "
    "Where wrong goals were made from the true one, this gives it away, and a predictor that sees "
    "the list of goals, such as the model that is asked outright, could use it; goalscope scores "
    "each goal without seeing the others.",
)
NOTES_OF = {
    SEEN[True]: "goal seen: goalscope where the adapter was fitted on the text of the true goal, "
    "with other people's words; goal unseen: where it was not.",
    OUTRIGHT: "The model that is asked outright names a goal and says how sure it is; the rest is "
    "spread evenly. Its certainty is taken between an even share, or just above, and "
    f"{100 * MOST_SURE:g} %, which favours it; a certainty that it does not give is the least.",
}
"""What is said only of predictors that were run."""


def read_dialogues(cells: Iterable[Measured]) -> tuple[Dialogues, ...]:
    """The cells of the kind "dialogue", for each set, split, goal set and model, in this order.

    Args:
        cells: Of any kind.
    """
    return tuple(_read(key, group) for key, group in by_settings(cells, "dialogue"))


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


def _settings(spec: Mapping[str, Any]) -> dict[str, Any]:
    own = ("kind", "set", "split", "goal_set", "case", "outright")
    return {key: value for key, value in spec.items() if key not in own}


def _read(key: tuple[str, str, str, str], cells: Sequence[Measured]) -> Dialogues:
    """Let each predictor believe, and score what it believes."""
    outcomes: dict[tuple[str, int | None], list[Outcome]] = {}
    openness: dict[tuple[str, int | None], list[Openness]] = {}
    notes: list[str] = []

    def keep(predictor: str, cell: Measured, table: Iterable[Array]) -> None:
        case, last = cell[0]["case"], None
        for turn, belief in enumerate(table, 1):
            scored = scores(belief, case["truth"])
            last = Outcome(case, scored, float(np.exp(belief.max())))
            outcomes.setdefault((predictor, turn), []).append(last)
        if last:
            outcomes.setdefault((predictor, None), []).append(last)

    known = {result["seen"] for _, result in cells if result.get("seen") is not None}
    unread = asked = 0
    for cell in cells:
        spec, result = cell
        goals, turns = len(spec["case"]["goals"]), len(spec["case"]["turns"])
        keep(UNIFORM, cell, np.full((turns, goals), -np.log(goals)))
        if result.get("role-play"):
            own = calibration_from_json(result["calibration"])
            for predictor, way in ((GOALSCOPE, own), (AS_IN_PAPER, PAPER)):
                keep(predictor, cell, role_play(result, way))
                if goals > 2:
                    last = None
                    for turn, last in enumerate(_openness(cell, way), 1):
                        openness.setdefault((predictor, turn), []).append(last)
                    if last:
                        openness.setdefault((predictor, None), []).append(last)
            if len(known) == 2 and result.get("seen") is not None:
                keep(SEEN[result["seen"]], cell, role_play(result, own))
        if answers := result.get("outright"):
            keep(OUTRIGHT, cell, [outright_belief(answer, goals) for answer in answers])
            asked += len(answers)
            unread += sum(answer["goal"] is None for answer in answers)
    for predictor in (GOALS_ALONE, *SIMILARITIES):
        found = [(cell, likeness(cell, predictor)) for cell in cells]
        own = [(cell, table) for cell, table in found if table.size]
        fitted = fitted_temperatures(own)
        for (cell, table), temperature in zip(own, fitted, strict=True):
            keep(predictor, cell, log_softmax(table / temperature))
        if fitted:
            low, high = min(fitted), max(fitted)
            span = f"{low:.2g}" if low == high else f"{low:.2g} to {high:.2g}"
            notes.append(f"{predictor}: temperature {span}.")
    if unread:
        notes.append(
            f"{unread:,} of {asked:,} answers of the model that is asked could not be read; they "
            "are scored as uniform."
        )
    if learned := sum(bool(result.get("learned")) for _, result in cells):
        notes.insert(0, f"The model's adapter has LEARNED from {learned:,} of these dialogues.")
    goals = max(len(spec["case"]["goals"]) for spec, _ in cells)
    return Dialogues(*key, len(cells), goals, outcomes, tuple(notes), openness)


def _openness(cell: Measured, calibration: Calibration) -> Iterator[Openness]:
    """Turn by turn."""
    case, result = cell[0]["case"], cell[1]
    table = np.column_stack([result["unspecified"], result["role-play"]])
    truth = case["truth"] + 1
    wrong = [place for place in range(1, table.shape[1]) if place != truth]
    out = chance(0, case["id"]).choice(wrong)
    beliefs = [
        beside_unspecified(np.delete(table, gone, axis=1), calibration) for gone in (out, truth)
    ]
    place = truth - (out < truth)  # of the true goal, once a wrong one is left out
    threshold = dict(calibration.thresholds).get(EPS)
    for present, absent in zip(*beliefs, strict=True):
        held, sizes = None, (0, 0)
        if threshold is not None:
            sets = [np.exp(row) >= min(threshold, np.exp(row.max())) for row in (present, absent)]
            held = bool(sets[0][place]), bool(sets[1][0])
            sizes = int(sets[0].sum()), int(sets[1].sum())
        yield Openness(
            case["group"],
            float(present[0] - np.logaddexp.reduce(present[1:])),
            float(absent[0] - np.logaddexp.reduce(absent[1:])),
            (bool(present[0] > present[1:].max()), bool(absent[0] > absent[1:].max())),
            held,
            sizes,
        )


def _estimate(outcomes: Sequence[Outcome], field: str) -> Estimate | None:
    if not outcomes:
        return None
    values: list[float] = [getattr(each.scores, field) for each in outcomes]
    return mean_of(values, [each.group for each in outcomes], field)


def mean_of(values: Sequence[float], groups: Sequence[str], field: str) -> Estimate:
    """Mean of a figure (one of the `Scores`, or a share), with an interval over groups."""
    form = "percent" if field in ("top1", "leads", "held") else "number"
    interval = bootstrap_mean(values, groups)
    return Estimate(sum(values) / len(values), interval, form, len(set(groups)))


def _reliability(outcomes: Sequence[Outcome]) -> Reliability:
    return reliability(
        [each.confidence for each in outcomes], [each.scores.top1 for each in outcomes]
    )
