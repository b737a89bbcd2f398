"""Episodes with simulated people (Sec. 5): how well each method does what they want."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from goalscope.experiment.results import Cell, cell_key
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Entry,
    Estimate,
    Labels,
    Row,
    Table,
    averaged,
    chosen,
    mean,
    percent,
    slug,
)
from goalscope.judge import JUDGE_TEMPERATURE
from goalscope.stats import paired_difference, pooled_sd_of_mean
from goalscope.types import pluralize

__all__ = ["JUDGE_NOTES", "Episodes", "Reading", "Run", "evaluator_of", "read_episodes",
           "reading_of"]  # fmt: skip

METHODS = ("good", "no-goals", "no-inference")
"""First those of the paper (Sec. 4.3), in its order; others follow by name."""
TOP = 3.0
"""The best that the evaluator can give (Sec. 5)."""

JUDGE_NOTES = (
    "The judge's score is a share of its best, 3. Trials whose answer could not be read are "
    "counted as unscored and are in no mean; a run that left nothing scores 0 in all its trials.",
)
NOTES = (
    "Score: share of the profile's conditions that hold in the end. It and the judge's are means "
    "over profiles of the means over their runs, with a 95 % bootstrap interval over profiles. "
    f"{NO_INTERVAL}",
    "SD: pooled standard deviation of the mean, the noise of repeated runs of a profile (score), "
    "or of repeated trials on a run (judge, Sec. 5.1), and not of the choice of profiles; the "
    "paper gives no formula.",
    "Unwanted: things in the basket, or changed in the room, that the profile neither asks for nor "
    "would welcome; a mean over the runs whose profile says what it would.",
    "Rounds, replans and terminated are means over runs; retries are attempts beyond the first.",
)
PAIR_NOTES = (
    "In percentage points, over profiles that both methods ran (with the same seeds, averaged), "
    f"with a 95 % paired bootstrap interval over profiles. {NO_INTERVAL} p is two-sided, from a "
    "sign-flip permutation test, and not corrected for several comparisons.",
)


@dataclass(frozen=True, slots=True)
class Reading:
    """What one evaluator made of one run.

    Attributes:
        trials: Fractions of the best score; all 0 where the run left nothing (Sec. 5.1).
        unscored: Trials whose answer could not be read.
    """

    trials: tuple[float, ...]
    unscored: int


@dataclass(frozen=True, slots=True)
class Run:
    """One episode, and what the evaluators made of it.

    Attributes:
        method: See `Agent`.
        profile: Name of the person.
        seed: Of everything that was drawn.
        result: Of the episode's cell.
        attempts: How often it came to a result or an error.
        readings: By the evaluator's label.
    """

    method: str
    profile: str
    seed: int
    result: Mapping[str, Any]
    attempts: int
    readings: dict[str, Reading] = field(default_factory=dict[str, Reading])

    def score(self, judge: str | None = None) -> float | None:
        """By the state in the end, or the mean by an evaluator; None where it gave none."""
        if judge is None:
            return float(self.result["score"])
        return mean(self.readings[judge].trials) if judge in self.readings else None


@dataclass(frozen=True, slots=True)
class Episodes:
    """All runs in one domain with one kind of human and one model.

    Attributes:
        domain: "grocery" or "house".
        human: "scripted", "simulated", or a `Habit`.
        model: The label of the model, and of all other settings that differ between groups.
        runs: By method, profile and seed.
        notes: Who the evaluators are, and how they were asked.
    """

    domain: str
    human: str
    model: str
    runs: Sequence[Run]
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        """For files."""
        return "-".join(map(slug, (self.domain, self.human, self.model)))

    @property
    def title(self) -> str:
        """Where the runs were, and with whom."""
        return f"{self.domain}, {self.human} human, {self.model}"

    @property
    def methods(self) -> tuple[str, ...]:
        """Those that were run."""
        found = {run.method for run in self.runs}
        return (*(m for m in METHODS if m in found), *sorted(found - {*METHODS}))

    @property
    def judges(self) -> dict[str, str]:
        """Labels of the evaluators, and what is added to the headings of their columns."""
        found = [*dict.fromkeys(judge for run in self.runs for judge in run.readings)]
        return {judge: f" by {judge}" if len(found) > 1 else "" for judge in found}

    def tables(self) -> list[Table]:
        """By method, the paired differences, and by profile."""
        judged = (*(JUDGE_NOTES if self.judges else ()), *self.notes)
        profiles = sorted({run.profile for run in self.runs})
        every = [
            ("methods", self.by_method(), (*NOTES, *judged)),
            ("differences", self.differences(), (*PAIR_NOTES, *judged)),
            ("profiles", [row for each in profiles for row in self.by_method(each)], judged),
        ]
        return [
            Table(f"episodes-{self.name}-{kind}", f"Episodes, {kind}: {self.title}", rows, notes)
            for kind, rows, notes in every
        ]

    def by_method(self, profile: str | None = None) -> list[Row]:
        """A row for each method, of all people or of one."""
        rows: list[Row] = []
        for method in self.methods:
            runs = [r for r in self.runs if r.method == method and profile in (None, r.profile)]
            states = _by_profile(runs)
            row: dict[str, Entry] = {"profile": profile} if profile else {}
            row |= {"method": method} if profile else {"method": method, "profiles": len(states)}
            row |= {"runs": len(runs), "score": _over_profiles(states)}
            row["SD"] = percent(pooled_sd_of_mean([*states.values()]))
            for key in ("rounds", "terminated", "replans"):
                value = mean([float(run.result[key]) for run in runs])
                row[key] = percent(value) if key == "terminated" else value
            row["retries"] = sum(max(run.attempts - 1, 0) for run in runs)
            counts = [len(each) for run in runs if (each := run.result.get("unwanted")) is not None]
            row["unwanted"] = mean([float(count) for count in counts]) if counts else None
            for judge, by in self.judges.items():
                read = [run.readings[judge] for run in runs if judge in run.readings]
                trials = [each.trials for each in read if each.trials]
                row[f"runs judged{by}"] = len(trials)
                row[f"judge score{by}"] = _over_profiles(_by_profile(runs, judge))
                row[f"judge SD{by}"] = percent(pooled_sd_of_mean(trials))
                row[f"trials scored{by}"] = sum(map(len, trials))
                row[f"trials unscored{by}"] = sum(each.unscored for each in read)
            rows.append(row)
        return rows

    def differences(self) -> list[Row]:
        """GOOD minus each other method, paired by profile."""
        rows: list[Row] = []
        others = [method for method in self.methods if method != "good"]
        judges = {None: "score", **{j: f"judge score{by}" for j, by in self.judges.items()}}
        for judge, measure in judges.items() if "good" in self.methods else ():
            for other in others:
                a, b = self._pairs(other, judge)
                row: dict[str, Entry] = {"measure": measure, "methods": f"good minus {other}"}
                row |= {"profiles": len(a), "difference": None, "p": None}
                if a:
                    found = paired_difference(a, b)
                    gap = Estimate(found.difference, found.interval, "percent", len(a))
                    row |= {"difference": gap, "p": found.p}
                rows.append(row)
        return rows

    def _pairs(self, other: str, judge: str | None) -> tuple[list[float], list[float]]:
        """GOOD's and the other method's mean for each profile, over the seeds that both have."""
        second = {(run.profile, run.seed): run for run in self.runs if run.method == other}
        first = [run for run in self.runs if run.method == "good"]
        both = [(run, twin) for run in first if (twin := second.get((run.profile, run.seed)))]
        known = [pair for pair in both if all(each.score(judge) is not None for each in pair)]
        a, b = (_by_profile((pair[i] for pair in known), judge) for i in (0, 1))
        return _means(a), _means(b)


def read_episodes(cells: Sequence[Cell]) -> tuple[Episodes, ...]:
    """The cells of the kind "episode" with the readings of those of the kind "judge".

    Args:
        cells: Of any kind, which have results.
    """
    measured = [(cell.spec, cell.result or {}) for cell in cells]
    labels = Labels(_shared(spec) for spec, _ in chosen(measured, "episode"))
    groups: dict[tuple[str, str, str], dict[str, Run]] = {}
    acting: dict[tuple[str, str, str], Mapping[str, Any]] = {}
    for cell in cells:
        if cell.spec.get("kind") != "episode":
            continue
        settings = cell.spec["settings"]
        key = settings["domain"], settings["human"], labels[_shared(cell.spec)]
        acting[key] = cell.spec["model"]
        groups.setdefault(key, {})[cell_key(cell.spec)] = Run(
            settings["method"], cell.spec["profile"], settings["seed"],
            cell.result or {}, cell.attempts,
        )  # fmt: skip
    found: list[Episodes] = []
    judged = chosen(measured, "judge")
    names = Labels(evaluator_of(spec) for spec, _ in judged)
    for key, runs in sorted(groups.items()):
        notes: dict[str, None] = {}
        for spec, result in judged:
            if run := runs.get(spec["of"]["key"]):
                judge = names[evaluator_of(spec)]
                run.readings[judge] = reading_of(spec, result, empty=run.result["empty"])
                notes[_how_asked(judge, spec, acting[key])] = None
        order = sorted(runs.values(), key=lambda run: (run.method, run.profile, run.seed))
        found.append(Episodes(*key, order, tuple(notes)))
    return tuple(found)


def reading_of(spec: Mapping[str, Any], result: Mapping[str, Any], *, empty: bool) -> Reading:
    """A cell of the kind "judge"; `empty` where the run left nothing."""
    given = [trial["score"] for trial in result["trials"]]
    if spec["empty"] or empty:
        return Reading((0.0,) * (len(given) or spec["trials"]), 0)
    scored = tuple(score / TOP for score in given if score is not None)
    return Reading(scored, len(given) - len(scored))


def evaluator_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """What tells evaluators apart, of a cell of the kind "judge"."""
    return {name: spec.get(name) for name in ("model", "trials", "seed")}


def _how_asked(judge: str, spec: Mapping[str, Any], acting: Mapping[str, Any]) -> str:
    """An evaluator's name, how often and how warm it was asked, and whether it acted."""
    often = pluralize(spec["trials"], "time")
    same = _writer(spec["model"]) == _writer(acting)
    return (
        f"The judge {judge} was asked {often} about each run, at temperature "
        f"{JUDGE_TEMPERATURE:g} (the paper has 0).{' It is the model that also acted.' * same}"
    )


def _writer(model: Mapping[str, Any]) -> object:
    return model.get("generator") or model.get("model")


def _shared(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that all runs of one group have."""
    own = ("method", "seed", "domain", "human")
    kept = {key: value for key, value in spec["settings"].items() if key not in own}
    return {**kept, "model": spec["model"]}


def _by_profile(runs: Iterable[Run], judge: str | None = None) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for run in runs:
        if (value := run.score(judge)) is not None:
            found.setdefault(run.profile, []).append(value)
    return found


def _means(values: Mapping[str, Sequence[float]]) -> list[float]:
    return [math.fsum(each) / len(each) for each in values.values()]


def _over_profiles(values: Mapping[str, Sequence[float]]) -> Estimate | None:
    return averaged(_means(values), form="percent")
