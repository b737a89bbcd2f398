"""Episodes with simulated people (Sec. 5): how well each method serves them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations, product
from pathlib import Path
from typing import Any

from goalscope.agent.settings import Settings
from goalscope.agent.toolkit import MODULES
from goalscope.base.stats import pooled_sd_of_mean
from goalscope.base.types import pluralize
from goalscope.envs import Outcome
from goalscope.experiment.judge import JUDGE_TEMPERATURE
from goalscope.experiment.measure import figures_of
from goalscope.experiment.results import Cell
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Columns,
    Estimate,
    Form,
    Labels,
    Record,
    Row,
    Sample,
    Table,
    averaged,
    chosen,
    count,
    difference_note,
    difference_rows,
    mean,
    percent,
    rows_of,
    short_names,
    slug,
)

METHODS = ("good", "no-goals", "no-inference")
"""The methods of the paper (Sec. 4.3), in its order; others follow by name."""
TRIVIAL = ("nothing", "random item", "bananas", "everything")
"""Policies that do the same for everybody (see `trivial_figures`), below the methods in tables."""
DEFAULTS: Mapping[str, Any] = {
    key: value for key, value in asdict(Settings()).items() if key in ("propose", "k", "prompted")
}
"""Settings that a cell only names where they are others."""
TOP = 3.0
"""The evaluator's highest score (Sec. 5)."""

JUDGE_NOTES = (
    "The judge's score is a share of its best, 3. Trials whose answer could not be read are "
    "counted as unscored and are in no mean; a run that left nothing scores 0 in all its trials.",
)
NOTES = (
    "Score: m / (n + u + v) for n needs, of which m are met, u unwanted things and v violated "
    "prohibitions. Needs are the profile's checks that do not hold at the start; prohibitions are "
    "those that do. It and the judge's score are means over profiles of the means over their runs, "
    f"with a 95 % bootstrap interval over profiles. {NO_INTERVAL}",
    "Nothing, random item, bananas and everything are trivial policies: they leave all as it is, "
    "or put one item of the catalogue (a mean over its items), bananas, or one of each item into "
    "everybody's basket.",
    "SD: pooled standard deviation of the mean, the noise of repeated runs of a profile (score), "
    "or of repeated trials on a run (judge, Sec. 5.1), and not of the choice of profiles; the "
    "paper gives no formula.",
    "Unwanted: things in the basket, or changed in the room, that the profile neither asks for nor "
    "would welcome; a mean over the runs whose profile says what it would. For other profiles u is "
    "0 in the score.",
    "Rounds, replans and terminated are means over runs; retries are attempts beyond the first.",
)
PAIR_NOTE = (
    "In percentage points, over people whom both methods served (with the same seeds, averaged)."
)


@dataclass(frozen=True, slots=True)
class Reading:
    """One evaluator's scores of one run.

    Attributes:
        trials: Fractions of the best score; all 0 if the outcome is empty (Sec. 5.1).
        unscored: Trials with an unreadable answer.
    """

    trials: tuple[float, ...]
    unscored: int


def read_episodes(cells: Sequence[Cell]) -> tuple[Sample, ...]:
    """The cells of the kind "episode" with the trials of those of the kind "judge".

    There is a sample for each domain, file of people, kind of human, and model with other
    settings. A record is a run. An evaluator's results are under "judge score", "trials" and
    "unscored", each followed by its name if there are several.

    Args:
        cells: Of any kind, which have results.
    """
    measured = [(cell.spec, cell.result or {}) for cell in cells]
    labels = Labels((_shared(spec) for spec, _ in chosen(measured, "episode")), DEFAULTS)
    groups: dict[tuple[str, str, str, str], dict[str, Cell]] = {}
    for cell in cells:
        if cell.spec.get("kind") == "episode":
            settings = cell.spec["settings"]
            people = settings.get("profiles") or ""
            key = settings["domain"], people, settings["human"], labels[_shared(cell.spec)]
            groups.setdefault(key, {})[cell.key] = cell
    judged = chosen(measured, "judge")
    judges = Labels(evaluator_of(spec) for spec, _ in judged)
    several = len({judges[evaluator_of(spec)] for spec, _ in judged}) > 1
    samples: list[Sample] = []
    for (domain, people, human, model), runs in sorted(groups.items()):
        readings: dict[str, dict[str, Reading]] = {key: {} for key in runs}
        notes: dict[str, None] = {}
        for spec, result in judged:
            if run := runs.get(spec["of"]["key"]):
                judge = judges[evaluator_of(spec)]
                empty = (run.result or {})["empty"]
                readings[run.key][judge] = reading_of(spec, result, empty=empty)
                notes[_how_asked(judge, spec, run.spec["model"])] = None
        order = sorted(runs.values(), key=_place)
        records = _records(order, [readings[run.key] for run in order], several=several)
        where = [Path(file).stem for file in (domain, people) if file]
        name = "-".join(map(slug, (*where, human, model)))
        title = f"{', '.join(where)}, {human} human, {model}"
        samples.append(Sample(name, title, records, tuple(notes)))
    return tuple(samples)


def headings_of_judges(sample: Sample) -> list[str]:
    """The suffix of each evaluator's column headings; none without evaluators."""
    keys = dict.fromkeys(key for run in sample.records for key in run if key.startswith("trials"))
    return [key.removeprefix("trials") for key in keys]


def method_rows(sample: Sample, profile: str | None = None) -> list[Row]:
    """A row for each method, for all people or for one; for all also each trivial policy."""
    groups: list[tuple[Row, list[Record]]] = []
    for method in methods_of(sample):
        runs = sample.where(method=method, **({"profile": profile} if profile else {}))
        people = len({run["profile"] for run in runs})
        own = {"profile": profile, "method": method}
        groups.append((own if profile else {"method": method, "profiles": people}, runs))
    judged = [column for by in headings_of_judges(sample) for column in _judge_columns(by)]
    rows = rows_of(groups, [*COLUMNS, *judged])
    if profile is None:
        found = [(policy, sample.where(method=policy)) for policy in TRIVIAL]
        heads = [({"method": name, "profiles": len(runs)}, runs) for name, runs in found if runs]
        rows += rows_of(heads, OUTCOME)
    return rows


def outcome_of(
    sample: Sample, measure: str, method: str, profile: str | None = None
) -> tuple[Estimate | None, float | None]:
    """A measure of a method, for all people or for one.

    Args:
        sample: Of episodes.
        measure: "score", "unwanted", or "judge score" with the suffix of an evaluator.
        method: The method.
        profile: The person; None for all of them.

    Returns:
        The mean over people of the means over their runs, with its bootstrap interval over people;
        and the pooled SD of the mean over an evaluator's trials, or else over seeds. None where
        there is no such thing.
    """
    whose = {} if profile is None else {"profile": profile}
    runs = sample.where(method=method, **whose)
    by_profile = _by_profile(runs, measure)
    repeated: list[Sequence[float]] = [*by_profile.values()]
    if measure.startswith("judge score"):
        key = f"trials{measure.removeprefix('judge score')}"
        repeated = [run[key] for run in runs if run.get(key)]
    form: Form = "number" if measure == "unwanted" else "percent"
    return averaged(_means(by_profile), form=form), pooled_sd_of_mean(repeated)


def episode_tables(sample: Sample) -> list[Table]:
    """Tables by method, of paired differences, and by profile."""
    judged = (*(JUDGE_NOTES if headings_of_judges(sample) else ()), *sample.notes)
    profiles = sorted({run["profile"] for run in sample.records})
    pairs = _differences(sample)
    every = [
        ("methods", method_rows(sample), (*NOTES, *judged)),
        ("differences", pairs, (PAIR_NOTE, difference_note(pairs), *judged)),
        ("profiles", [row for each in profiles for row in method_rows(sample, each)], judged),
    ]
    return [
        Table(f"episodes-{sample.name}-{kind}", f"Episodes, {kind}: {sample.title}", rows, notes)
        for kind, rows, notes in every
    ]


def reading_of(spec: Mapping[str, Any], result: Mapping[str, Any], *, empty: bool) -> Reading:
    """A cell of the kind "judge"; `empty` if the run's outcome is empty."""
    given = [trial["score"] for trial in result["trials"]]
    if spec["empty"] or empty:
        return Reading((0.0,) * (len(given) or spec["trials"]), 0)
    scored = tuple(score / TOP for score in given if score is not None)
    return Reading(scored, len(given) - len(scored))


def evaluator_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The part of a "judge" cell that distinguishes evaluators."""
    asked = {name: spec.get(name) for name in ("model", "trials", "seed")}
    return {**asked, "temperature": _temperature(spec)}


def _records(
    runs: Sequence[Cell], readings: Sequence[Mapping[str, Reading]], *, several: bool
) -> list[Record]:
    """A record of each run, and of each trivial policy and person.

    Args:
        runs: The cells.
        readings: For each the trials by evaluator.
        several: Whether there are several evaluators.
    """
    methods = _method_names(runs)
    records: list[Record] = []
    for run, read in zip(runs, readings, strict=True):
        result, settings = run.result or {}, run.spec["settings"]
        record: dict[str, Any] = {
            "method": methods[run.key],
            "profile": run.spec["profile"],
            "seed": settings["seed"],
            "retries": max(run.attempts - 1, 0),
            **{key: float(result[key]) for key in ("rounds", "terminated", "replans")},
        }
        if "start" in result:
            unwanted = result["unwanted"]
            told = None if unwanted is None else tuple(unwanted)
            record |= figures_of(Outcome(tuple(result["start"]), tuple(result["met"]), told))
        for judge, reading in read.items():
            by = f" by {judge}" if several else ""
            record |= {f"trials{by}": reading.trials, f"unscored{by}": reading.unscored}
            if reading.trials:
                record[f"judge score{by}"] = mean(reading.trials)
        records.append(record)
    trivial = {run.spec["profile"]: (run.result or {}).get("trivial", {}) for run in runs}
    return records + [
        {"method": policy, "profile": profile, **figures}
        for profile, policies in trivial.items()
        for policy, figures in policies.items()
    ]


def _method_names(runs: Sequence[Cell]) -> dict[str, str]:
    """The method of each run by its key; GOOD with a likelihood of one's own has the latter's name.

    The name is without the folder, as long as no two share it.
    """
    found: dict[str, str] = {}
    for run in runs:
        method, own = (run.spec["settings"].get(key) for key in ("method", "likelihood"))
        found[run.key] = own if own and method == "good" else method
    short = short_names(found.values())
    return {key: short[name] for key, name in found.items()}


def _plain_mean(name: str) -> Columns:
    return lambda runs: {name: mean([run[name] for run in runs if name in run])}


def _score(name: str) -> Columns:
    """The mean over profiles of the means over their runs."""
    return lambda runs: {name: averaged(_means(_by_profile(runs, name)), form="percent")}


OUTCOME: tuple[Columns, ...] = (
    _score("score"),
    lambda runs: {"needs met": percent(mean(_means(_by_profile(runs, "needs met"))))},
    _plain_mean("violated"),
    _plain_mean("unwanted"),
)
COLUMNS: tuple[Columns, ...] = (
    count("runs"),
    *OUTCOME,
    lambda runs: {"SD": percent(pooled_sd_of_mean([*_by_profile(runs, "score").values()]))},
    _plain_mean("rounds"),
    lambda runs: {"terminated": percent(mean([run["terminated"] for run in runs]))},
    _plain_mean("replans"),
    lambda runs: {"retries": sum(run["retries"] for run in runs)},
)


def _judge_columns(by: str) -> tuple[Columns, ...]:
    def trials(runs: Sequence[Record]) -> list[tuple[float, ...]]:
        return [run[f"trials{by}"] for run in runs if run.get(f"trials{by}")]

    return (
        lambda runs: {f"runs judged{by}": len(trials(runs))},
        _score(f"judge score{by}"),
        lambda runs: {f"judge SD{by}": percent(pooled_sd_of_mean(trials(runs)))},
        lambda runs: {f"trials scored{by}": sum(map(len, trials(runs)))},
        lambda runs: {f"trials unscored{by}": sum(run.get(f"unscored{by}", 0) for run in runs)},
    )


def _differences(sample: Sample) -> list[Row]:
    """Each method minus each that follows it, paired by profile."""
    measures = ["score", *(f"judge score{by}" for by in headings_of_judges(sample))]
    pairs = product(measures, combinations(methods_of(sample), 2))
    return difference_rows(
        ({"measure": measure, "methods": f"{one} minus {other}"},
         *_pairs(sample, one, other, measure), "percent")
        for measure, (one, other) in pairs
    )  # fmt: skip


def _pairs(sample: Sample, one: str, other: str, measure: str) -> tuple[list[float], list[float]]:
    """The means of two methods by profile, over the seeds that both have."""
    second = {(run["profile"], run["seed"]): run for run in sample.where(method=other)}
    pairs = [
        (run, twin)
        for run in sample.where(method=one)
        if (twin := second.get((run["profile"], run["seed"]))) and measure in run.keys() & twin
    ]
    a, b = (_means(_by_profile((pair[i] for pair in pairs), measure)) for i in (0, 1))
    return a, b


def _how_asked(judge: str, spec: Mapping[str, Any], acting: Mapping[str, Any]) -> str:
    """An evaluator's name, number of trials and temperature, and whether it also acted."""
    same, heat = _writer(spec["model"]) == _writer(acting), _temperature(spec)
    return (
        f"The judge {judge} was asked {pluralize(spec['trials'], 'time')} about each run, at "
        f"temperature {heat:g}{' (the paper has 0)' if heat else ', as in the paper'}."
        f"{' It is the model that also acted.' * same}"
    )


def _temperature(spec: Mapping[str, Any]) -> float:
    return spec.get("temperature", JUDGE_TEMPERATURE)


def _writer(model: Mapping[str, Any]) -> object:
    return model.get("generator") or model.get("model")


def methods_of(*samples: Sample) -> list[str]:
    """The methods, in the order of the paper."""
    found = {run["method"] for sample in samples for run in sample.records} - {*TRIVIAL}
    return [*(each for each in METHODS if each in found), *sorted(found - {*METHODS})]


def _place(run: Cell) -> tuple[str, str, int]:
    settings = run.spec["settings"]
    return settings["method"], run.spec["profile"], settings["seed"]


def _shared(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The settings shared by all runs of a group."""
    own = ("method", "likelihood", "seed", "domain", "profiles", "human")
    kept = {key: value for key, value in spec["settings"].items() if key not in own}
    every = {"prompted": "all"} if set(kept.get("prompted", ())) == {*MODULES} else {}
    return {**DEFAULTS, **kept, **every, "model": spec["model"]}


def _by_profile(runs: Iterable[Record], key: str) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for run in runs:
        if key in run:
            found.setdefault(run["profile"], []).append(run[key])
    return found


def _means(values: Mapping[str, Sequence[float]]) -> list[float]:
    return [math.fsum(each) / len(each) for each in values.values()]
