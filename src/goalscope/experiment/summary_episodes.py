"""Episodes with simulated people (Sec. 5): how well each method does what they want."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from goalscope.experiment.results import cell_key
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Entry,
    Estimate,
    Labels,
    Measured,
    Table,
    chosen,
    mean,
    percent,
    slug,
)
from goalscope.experiment.summary_compare import Comparison, comparisons_table, read_comparison
from goalscope.experiment.summary_judge import (
    JUDGE_NOTES,
    Reading,
    evaluator_of,
    how_asked,
    reading_of,
)
from goalscope.stats import bootstrap_mean, paired_difference, pooled_sd_of_mean

__all__ = ["Episodes", "Run", "read_episodes"]

METHODS = ("good", "no-goals", "no-inference")
"""First those of the paper (Sec. 4.3), in its order; others follow by name."""


@dataclass(frozen=True, slots=True)
class Run:
    """One episode, and what the evaluators made of it.

    Attributes:
        method: See `Agent`.
        profile: Name of the person.
        seed: Of everything that was drawn.
        key: Of the episode's cell.
        result: Of the episode's cell.
        attempts: How often it came to a result or an error.
        readings: By the evaluator's label.
    """

    method: str
    profile: str
    seed: int
    key: str
    result: Mapping[str, Any]
    attempts: int
    readings: dict[str, Reading] = field(default_factory=dict[str, Reading])


@dataclass(frozen=True, slots=True)
class Episodes:
    """All runs in one domain with one kind of human and one model.

    Attributes:
        domain: "grocery" or "house".
        human: "scripted", "simulated", or a `Habit`.
        model: The label of the model, and of all other settings that differ between groups.
        runs: By method, profile and seed.
        judges: Labels of the evaluators.
        comparisons: Runs of two methods that an evaluator saw side by side, in both orders.
        judging: Who the evaluators are, and how they were asked: one sentence for each.
        comparing: The same of those that saw two runs side by side.
        notes: What of the evaluators' readings belongs to no run.
    """

    domain: str
    human: str
    model: str
    runs: tuple[Run, ...]
    judges: tuple[str, ...]
    comparisons: tuple[Comparison, ...]
    judging: tuple[str, ...]
    comparing: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def title(self) -> str:
        """Where the runs were, and with whom."""
        return f"{self.domain}, {self.human} human, {self.model}"

    @property
    def methods(self) -> tuple[str, ...]:
        """Those that were run."""
        found = {run.method for run in self.runs}
        return (*(m for m in METHODS if m in found), *sorted(found - set(METHODS)))

    def of(self, method: str, profile: str | None = None) -> list[Run]:
        """The runs of a method, and of one person where `profile` is given."""
        return [r for r in self.runs if r.method == method and profile in (None, r.profile)]

    def tables(self, *, command: str = "") -> tuple[Table, ...]:
        """By method, the paired differences, by profile, and how steady the evaluator is."""
        found = (self.by_method(command), self.differences(command), self.by_profile(command))
        return (*found, self.by_order(command)) if self.comparisons else found

    def by_method(self, command: str = "") -> Table:
        """One row for each method."""
        columns = ("method", "profiles", "runs", "score", "SD")
        columns += ("rounds", "terminated", "replans", "retries")
        rows: list[tuple[Entry, ...]] = []
        for method in self.methods:
            runs = self.of(method)
            by_profile = _by_profile(runs, _score)
            row: list[Entry] = [method, len(by_profile), len(runs), _over_profiles(by_profile)]
            row += [percent(pooled_sd_of_mean(list(by_profile.values()))), *_course(runs)]
            row.append(sum(max(run.attempts - 1, 0) for run in runs))
            for judge in self.judges:
                read = [run for run in runs if judge in run.readings]
                scored = _by_profile(read, lambda run, judge=judge: _judged(run, judge))
                trials = [run.readings[judge].trials for run in read if run.readings[judge].trials]
                row += [len(trials), _over_profiles(scored), percent(pooled_sd_of_mean(trials))]
                row += _counts(read, judge)
            rows.append(tuple(row))
        for judge in self.judges:
            columns += (f"runs judged{self._by(judge)}", f"judge score{self._by(judge)}")
            columns += (f"judge SD{self._by(judge)}",)
            columns += (f"trials scored{self._by(judge)}", f"trials unscored{self._by(judge)}")
        return self._table("methods", "methods", columns, rows, METHOD_NOTES, command)

    def differences(self, command: str = "") -> Table:
        """GOOD minus each other method, paired by profile."""
        rows: list[tuple[Entry, ...]] = []
        others = [method for method in self.methods if method != "good"]
        for judge in (None, *self.judges) if "good" in self.methods else ():
            measure = "score" if judge is None else f"judge score{self._by(judge)}"
            for other in others:
                a, b = self._pairs(other, judge)
                row: tuple[Entry, ...] = (measure, f"good minus {other}", len(a), None, None)
                if a:
                    found = paired_difference(a, b)
                    gap = Estimate(found.difference, found.interval, "percent")
                    row = (*row[:3], gap, found.p)
                rows.append(row)
        columns = ("measure", "methods", "profiles", "difference", "p")
        return self._table("differences", "paired differences", columns, rows, PAIR_NOTES, command)

    def by_profile(self, command: str = "") -> Table:
        """One row for each profile and method."""
        rows: list[tuple[Entry, ...]] = []
        for profile in sorted({run.profile for run in self.runs}):
            for method in self.methods:
                runs = self.of(method, profile)
                score = percent(mean([_score(run) for run in runs]))
                row: list[Entry] = [profile, method, len(runs), score, *_course(runs)]
                for judge in self.judges:
                    read = [run for run in runs if judge in run.readings]
                    given = [value for run in read if (value := _judged(run, judge)) is not None]
                    row += [percent(mean(given)), *_counts(read, judge)]
                rows.append(tuple(row))
        columns = ("profile", "method", "runs", "score", "rounds", "terminated", "replans")
        for judge in self.judges:
            columns += (f"judge score{self._by(judge)}",)
            columns += (f"trials scored{self._by(judge)}", f"trials unscored{self._by(judge)}")
        return self._table("profiles", "profiles", columns, rows, PROFILE_NOTES, command)

    def by_order(self, command: str = "") -> Table:
        """What it does to an evaluator's scores which of two outcomes it is shown first."""
        columns, rows, notes = comparisons_table(self.comparisons)
        return self._table("order", "the judge's order effect", columns, rows, notes, command)

    def _by(self, judge: str) -> str:
        return f" by {judge}" if len(self.judges) > 1 else ""

    def _pairs(self, other: str, judge: str | None) -> tuple[list[float], list[float]]:
        """GOOD's and the other method's mean for each profile, over the seeds that both have."""
        pairs: dict[str, list[tuple[float, float]]] = {}
        second = {(run.profile, run.seed): run for run in self.of(other)}
        for run in self.of("good"):
            twin = second.get((run.profile, run.seed))
            if twin is None:
                continue
            a, b = (_score(r) if judge is None else _judged(r, judge) for r in (run, twin))
            if a is not None and b is not None:
                pairs.setdefault(run.profile, []).append((a, b))
        means = [tuple(math.fsum(x) / len(x) for x in zip(*p, strict=True)) for p in pairs.values()]
        return [a for a, _ in means], [b for _, b in means]

    def _table(
        self,
        kind: str,
        what: str,
        columns: tuple[str, ...],
        rows: Sequence[tuple[Entry, ...]],
        notes: tuple[str, ...],
        command: str,
    ) -> Table:
        name = "-".join(map(slug, ("episodes", self.domain, self.human, self.model, kind)))
        title = f"Episodes, {what}: {self.title}"
        judged = (*JUDGE_NOTES, *self.judging) if self.judges else ()
        if kind == "order":
            judged = self.comparing
        return Table(name, title, columns, tuple(rows), (*notes, *judged, *self.notes), command)


METHOD_NOTES = (
    "Score: share of the profile's conditions that hold in the end. It and the judge's are means "
    "over profiles of the means over their runs, with a 95 % bootstrap interval over profiles. "
    f"{NO_INTERVAL}",
    "SD: pooled standard deviation of the mean, the noise of repeated runs of a profile (score), "
    "or of repeated trials on a run (judge, Sec. 5.1), and not of the choice of profiles; the "
    "paper gives no formula.",
    "Rounds, replans and terminated are means over runs; retries are attempts beyond the first.",
)
PAIR_NOTES = (
    "In percentage points, over profiles that both methods ran (with the same seeds, averaged). "
    "The 95 % interval is a paired bootstrap over profiles. "
    f"{NO_INTERVAL}",
    "p is two-sided, from a sign-flip permutation test, and not corrected for several comparisons.",
)
PROFILE_NOTES = ("Means over the runs of a profile.",)


def read_episodes(
    cells: Sequence[Measured], *, attempts: Sequence[int] | None = None
) -> tuple[Episodes, ...]:
    """The cells of the kind "episode" with the readings of those of the kind "judge".

    Args:
        cells: Of any kind.
        attempts: How often the work of each cell was begun, in the cells' order; once if None.

    Raises:
        ValueError: `attempts` has another length than `cells`.
    """
    tries = [1] * len(cells) if attempts is None else list(attempts)
    if len(tries) != len(cells):
        raise ValueError(f"{len(cells)} cells need as many attempts, not {len(tries)}")
    found = [(*cell, n) for cell, n in zip(cells, tries, strict=True) if _is(cell, "episode")]
    labels = Labels(_shared(spec) for spec, _, _ in found)
    groups: dict[tuple[str, str, str], list[Run]] = {}
    group_of: dict[str, tuple[str, str, str]] = {}
    acting: dict[tuple[str, str, str], Mapping[str, Any]] = {}
    for spec, result, n in found:
        settings, key = spec["settings"], cell_key(spec)
        run = Run(settings["method"], spec["profile"], settings["seed"], key, result, n)
        group_of[key] = (settings["domain"], settings["human"], labels[_shared(spec)])
        groups.setdefault(group_of[key], []).append(run)
        acting[group_of[key]] = spec["model"]
    runs = {run.key: run for each in groups.values() for run in each}
    judged = chosen(cells, "judge")
    judging = Labels(evaluator_of(spec) for spec, _ in judged)
    judges, lost = _attach(judged, runs, judging)
    compared: dict[tuple[str, str, str], list[Comparison]] = {}
    pairs = chosen(cells, "compare")
    comparing = Labels(evaluator_of(spec) for spec, _ in pairs)
    for spec, result in pairs:
        homes = {group_of.get(of["key"]) for of in spec["of"]}
        home = homes.pop()
        if home is None or homes:
            lost += 1
            continue
        found_pair = read_comparison(spec, result, comparing[evaluator_of(spec)])
        compared.setdefault(home, []).append(found_pair)
    note = (f"{lost} readings by the judge belong to no run that is here.",) if lost else ()
    return tuple(
        Episodes(
            *key,
            tuple(sorted(runs, key=lambda run: (run.method, run.profile, run.seed))),
            tuple(judge for judge in judges if any(judge in run.readings for run in runs)),
            tuple(compared.get(key, ())),
            how_asked(
                (spec for spec, _ in judged if group_of.get(spec["of"]["key"]) == key),
                judging,
                acting[key],
            ),
            how_asked(
                (spec for spec, _ in pairs if group_of.get(spec["of"][0]["key"]) == key),
                comparing,
                acting[key],
            ),
            note,
        )
        for key, runs in sorted(groups.items())
    )


def _attach(
    cells: Sequence[Measured], runs: Mapping[str, Run], labels: Labels
) -> tuple[tuple[str, ...], int]:
    """Give each reading to its run; the evaluators' labels, and how many readings have no run."""
    lost = 0
    for spec, result in cells:
        run = runs.get(spec["of"]["key"])
        if run is None:
            lost += 1
        else:
            reading = reading_of(spec, result, empty=run.result["empty"])
            run.readings[labels[evaluator_of(spec)]] = reading
    return tuple(dict.fromkeys(labels[evaluator_of(spec)] for spec, _ in cells)), lost


def _is(cell: Measured, kind: str) -> bool:
    return cell[0].get("kind") == kind


def _shared(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that all runs of one group have."""
    own = ("method", "seed", "domain", "human")
    kept = {key: value for key, value in spec["settings"].items() if key not in own}
    return {**kept, "model": spec["model"]}


def _score(run: Run) -> float:
    return float(run.result["score"])


def _judged(run: Run, judge: str) -> float | None:
    """Mean of the scored trials; None where there are none."""
    reading = run.readings.get(judge)
    return mean(reading.trials) if reading else None


def _by_profile(
    runs: Iterable[Run], measure: Callable[[Run], float | None]
) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for run in runs:
        value = measure(run)
        if value is not None:
            found.setdefault(run.profile, []).append(value)
    return found


def _over_profiles(values: Mapping[str, Sequence[float]]) -> Estimate | None:
    means = [math.fsum(each) / len(each) for each in values.values()]
    if not means:
        return None
    return Estimate(math.fsum(means) / len(means), bootstrap_mean(means), "percent")


def _course(runs: Sequence[Run]) -> tuple[Entry, ...]:
    """Rounds, share terminated and replans."""
    rounds, terminated, replans = (
        mean([float(run.result[key]) for run in runs])
        for key in ("rounds", "terminated", "replans")
    )
    return rounds, percent(terminated), replans


def _counts(runs: Iterable[Run], judge: str) -> tuple[int, int]:
    """Trials that were scored, and those that were not."""
    readings = [run.readings[judge] for run in runs]
    return sum(len(each.trials) for each in readings), sum(each.unscored for each in readings)
