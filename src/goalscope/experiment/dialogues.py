"""Goal inference on real dialogues: the quality of each predictor's belief, turn by turn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from statistics import fmean
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.stats import Reliability, auroc, log_softmax, reliability, scores
from goalscope.base.types import pluralize
from goalscope.belief.belief import log_posteriors
from goalscope.belief.calibration import PAPER, Calibration, calibration_from_json
from goalscope.datasets.goal_sets import chance
from goalscope.experiment.baselines import TEMPERATURES, overlap, temperature_losses
from goalscope.experiment.fitted_baselines import FITTED_METHODS
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Columns,
    Estimate,
    Form,
    Labels,
    Measured,
    Record,
    Row,
    Sample,
    Table,
    average,
    chosen,
    count,
    difference_note,
    difference_rows,
    rows_of,
    short_names,
    slug,
)

GOALSCOPE = "goalscope"
"""With the calibration known at the first measurement."""

AS_IN_PAPER = "goalscope, Eq. 1"
"""Bayes' rule as it stands in the paper."""

SIMILARITIES = {"TF-IDF": "tfidf", "BM25": "bm25", "embedding": "embedding"}
"""Similarity of a goal to the words so far, and the key of its table in a result."""

UNIFORM = "uniform"
"""All goals equally likely."""

GOALS_ALONE = "goals alone"
"""A control that reads no dialogue: the similarity of a goal to the other goals."""

OUTRIGHT = "model asked"
"""The model is asked for the goal and its confidence."""

LETTERS = "model asked, letters"
"""The model is asked for the goal's letter, whose probability is the goal's."""

SEEN = {True: "goalscope, goal seen", False: "goalscope, goal unseen"}
"""goalscope where its adapter was fitted on the true goal's text, and where it was not."""

PREDICTORS = (
    *(GOALSCOPE, AS_IN_PAPER, *SEEN.values(), UNIFORM, GOALS_ALONE),
    *(*SIMILARITIES, *FITTED_METHODS, OUTRIGHT, LETTERS),
)
"""All predictors, in the order of the tables."""

FOLDS = 5
"""Number of folds for cross-fitting temperatures."""

FITTED_FROM = 20
"""Minimum number of groups for fitting a temperature.

With fewer, all predictions are often right, so the best temperature is 0 and the first wrong one
has an unbounded loss.
"""

MOST_SURE = 0.995
"""Cap on a stated confidence: 100 % would have an infinite log-loss when wrong."""


def among_goals(log_likelihood: Array, calibration: Calibration) -> Array:
    """[T, G] log-posteriors by turn, over the goals alone, from their log-likelihoods."""
    width = len(log_likelihood[0])
    stated = np.ones(width, dtype=bool)
    return log_posteriors(np.zeros(width), log_likelihood, stated, calibration)[1:]


def beside_unspecified(table: Array, calibration: Calibration) -> Array:
    """[T, 1 + G] log-posteriors by turn; the first column is Unspecified."""
    width = int(table.shape[1])
    return log_posteriors(np.zeros(width), table, np.arange(width) > 0, calibration)[1:]


def role_play(result: Mapping[str, Any], calibration: Calibration) -> Array:
    """[T, G] log-posteriors of `among_goals`, from the result of a cell."""
    return among_goals(evidence_in(result, calibration), calibration)


def evidence_in(result: Mapping[str, Any], calibration: Calibration) -> Array:
    """[T, G] log-likelihoods in nats, with the calibration's similarity of words and goals."""
    table = np.array(result["role-play"], dtype=np.float64)
    if calibration.similarity and result.get("likeness"):
        table += calibration.similarity * np.array(result["likeness"], dtype=np.float64)
    return table


def outright_belief(answer: Mapping[str, Any], goals: int) -> Array:
    """[G] log-probability: `sure` for the named goal, the rest spread evenly."""
    pick, sure = answer["goal"], answer["sure"]
    even = 1 / goals
    if pick is None or goals == 1:
        return np.full(goals, np.log(even))
    least = even * (1 + 1e-6)  # so that the goal that was named stays the likeliest
    own = least if sure is None else min(max(sure, least), MOST_SURE)
    belief = np.full(goals, np.log((1 - own) / (goals - 1)))
    belief[pick] = np.log(own)
    return belief


def likeness(cell: Measured, predictor: str) -> Array:
    """[T, G] similarity of each goal to the words so far, or to the other goals; [0] if not run."""
    spec, result = cell
    if predictor in SIMILARITIES:
        return np.array(result.get(SIMILARITIES[predictor]) or [], dtype=np.float64)
    goals: list[str] = spec["case"]["goals"]
    row = [
        overlap(goal, [*goals[:i], *goals[i + 1 :]]).mean() if len(goals) > 1 else 0.0
        for i, goal in enumerate(goals)
    ]
    return np.tile(np.array(row, dtype=np.float64), (len(spec["case"]["turns"]), 1))


def fitted_temperatures(cells: Sequence[tuple[Measured, Array]]) -> list[float]:
    """The temperature of each cell, fitted on the folds without its group.

    With fewer than `FITTED_FROM` groups it is 1.
    """
    groups = sorted({cell[0]["case"]["group"] for cell, _ in cells})
    if len(groups) < FITTED_FROM:
        return [1.0] * len(cells)
    order = np.random.default_rng(0).permutation(len(groups))
    fold_of = {groups[index]: position % FOLDS for position, index in enumerate(order)}
    fold = np.array([fold_of[cell[0]["case"]["group"]] for cell, _ in cells])
    losses = np.array(
        [temperature_losses(table, truths_in(cell[0]["case"])) for cell, table in cells]
    )
    best = [float(TEMPERATURES[(losses[fold != k].sum(axis=0)).argmin()]) for k in range(FOLDS)]
    return [best[k] for k in fold]


def truths_in(case: Mapping[str, Any]) -> list[int | None]:
    """[T] index of the true goal after each turn; None where it is not listed."""
    return case.get("truths") or [case["truth"]] * len(case["turns"])


TURNS = (1, 2, 3, 4, 5, None)
"""Turns that tables show; None for each dialogue's last."""

NOTES = (
    "n is the number of dialogues that have the turn; at the turn called last, each has its own. "
    "All up to the calibration error is among the goals, without Unspecified.",
    f"{GOALSCOPE}: with the calibration known when the first was measured; {AS_IN_PAPER}: Bayes' "
    "rule as it stands in the paper; goal seen: where the adapter was fitted on the text of the "
    "true goal.",
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
    f'is spread evenly. "{LETTERS}" answers the same question with a letter, whose probability '
    "among the letters is the goal's.",
)


def read_dialogues(cells: Iterable[Measured]) -> tuple[Sample, ...]:
    """The cells of the kind "dialogue", for each set, split, goal set and model, in this order.

    A record is the belief of a `predictor` after a `turn` of a `case`; `last` if the dialogue ends
    there. It has the metrics of `scores`; `sure`, the probability of the likeliest goal; and where
    goals can be left out, `absent` and `present`: the log-odds of Unspecified in nats without the
    true goal and without a wrong one, and whether Unspecified leads then. Where the true goal is
    not listed to begin with, it has `absent` alone. Where the true goal is another one than at the
    turn before, it has `at once` and `within 3`: whether it leads then, and at that turn or one of
    the next two; Unspecified stands for a goal that is not listed.

    Args:
        cells: Of any kind.
    """
    samples: list[Sample] = []
    for (name, split, goal_set, model), group in by_settings(cells, "dialogue"):
        own = goal_set == "own"
        most = max(len(spec["case"]["goals"]) for spec, _ in group)
        goals = f"{most} goals each" if own else f"{most} {goal_set} goals each"
        task = ", ".join(filter(None, (name, "" if own else split, goals)))
        named = [slug(each) for each in (name, split, goal_set, model) if each]
        records = [{"task": task, "model": model, **each} for each in _records(group)]
        samples.append(Sample("-".join(named), f"{task}, {model}", records, tuple(_notes(group))))
    return tuple(samples)


def predictors_of(sample: Sample) -> list[str]:
    """The predictors in the order of the tables; methods of one's own come last."""
    own = {record["predictor"] for record in sample.records} - {*PREDICTORS}
    return [*PREDICTORS, *sorted(own)]


def after_turn(sample: Sample, predictor: str, turn: int | None) -> list[Record]:
    """The records of a predictor after a turn; None for each dialogue's last."""
    which = {"last": True} if turn is None else {"turn": turn}
    return sample.where(predictor=predictor, **which)


def number_of(sample: Sample) -> str:
    """The number of dialogues, as text."""
    return pluralize(len(after_turn(sample, UNIFORM, None)), "dialogue")


def reliability_of(records: Sequence[Record]) -> Reliability:
    """The calibration of the beliefs."""
    listed = [each for each in records if "sure" in each]
    return reliability([each["sure"] for each in listed], [each["top1"] for each in listed])


def area(records: Sequence[Record]) -> Estimate | None:
    """How well Unspecified detects that the true goal is left out; None for a single group."""
    found = [each for each in records if "present" in each]
    groups = [each["group"] for each in found]
    if len({*groups}) < 2:
        return None
    present = [each["present"] for each in found]
    if real := [each["absent"] for each in records if "absent" in each and "present" not in each]:
        apart = np.subtract.outer(real, present)
        return Estimate(float(((apart > 0) + 0.5 * (apart == 0)).mean()), groups=len({*groups}))
    absent = [each["absent"] for each in found]
    return Estimate(*auroc(absent, present, groups), groups=len({*groups}))


def _calibration_error(records: Sequence[Record]) -> Row:
    made = reliability_of(records)
    return {"ECE": made.ece, "if calibrated, from": made.band.low, "to": made.band.high}


COLUMNS: tuple[Columns, ...] = (
    count(),
    average("top-1", "top1", "percent"),
    average("MRR", "reciprocal_rank"),
    average("log-loss", "log_loss"),
    average("Brier", "brier"),
    _calibration_error,
    lambda turns: {"AUROC": area(turns)} if any("absent" in each for each in turns) else {},
    average("leads if absent", "leads_absent", "percent"),
    average("leads if present", "leads_present", "percent"),
)


def dialogue_table(sample: Sample) -> Table:
    """The predictions at turns 1 to 5 and at the last turn of each dialogue."""
    longer = any(each["turn"] > 1 for each in sample.records)
    groups = [
        ({"predictor": predictor, "turn": str(turn or "last")}, records)
        for predictor, turn in product(predictors_of(sample), TURNS if longer else (1,))
        if (records := after_turn(sample, predictor, turn))
    ]
    title = f"Goals inferred from dialogues: {sample.title}"
    notes = (*sample.notes, *NOTES)
    return Table(f"dialogues-{sample.name}", title, rows_of(groups, COLUMNS), notes)


def following_table(sample: Sample) -> Table:
    """How soon a belief follows a change of the goal; without rows where no goal changes."""
    groups = [
        ({"predictor": predictor}, records)
        for predictor in predictors_of(sample)
        if (records := [each for each in sample.where(predictor=predictor) if "at once" in each])
    ]
    columns = (
        count("changes"),
        average("at once", "at once", "percent"),
        average("within 3", "within 3", "percent"),
    )
    note = (
        "How often the new goal is the likeliest at the turn that tells it, and there or at one of "
        "the next two. Unspecified stands for a goal that is not listed."
    )
    title = f"Changes of the goal: {sample.title}"
    return Table(f"following-{sample.name}", title, rows_of(groups, columns), (note,))


MEASURES: tuple[tuple[str, str, Form], ...] = (
    ("top-1", "top1", "percent"),
    ("log-loss", "log_loss", "number"),
)
"""What is compared: its heading, its key in a record, and how it is shown."""


def dialogue_differences(sample: Sample) -> Table:
    """goalscope, and each method of one's own, minus each other predictor after the last turn."""
    predictors = [
        each
        for each in predictors_of(sample)
        if each not in SEEN.values() and after_turn(sample, each, None)
    ]
    own = [each for each in predictors if each == GOALSCOPE or each not in PREDICTORS]
    pairs = dict.fromkeys(
        (one, other)
        for one in own
        for other in predictors
        if one != other and (other not in own or own.index(one) < own.index(other))
    )
    rows = difference_rows(
        ({"measure": name, "methods": f"{one} minus {other}"},
         *_group_means(sample, one, other, key), form)
        for name, key, form in MEASURES
        for one, other in pairs
    )  # fmt: skip
    title = f"Differences between predictors: {sample.title}"
    note = (
        "After the last turn. A pair is a group of dialogues that share people, whose mean counts "
        "once however many there are; so a difference may be another than that of the figures of "
        "the predictors, which are means over dialogues."
    )
    return Table(f"differences-{sample.name}", title, rows, (note, difference_note(rows)))


def _group_means(sample: Sample, one: str, other: str, key: str) -> tuple[list[float], list[float]]:
    """A measure of two predictors after the last turn, by group of dialogues that both judged."""
    first, second = (
        {record["case"]["id"]: record for record in after_turn(sample, each, None) if key in record}
        for each in (one, other)
    )
    groups: dict[str, list[str]] = {}
    for id in sorted(first.keys() & second):
        groups.setdefault(first[id]["group"], []).append(id)

    def means(records: Mapping[str, Record]) -> list[float]:
        return [fmean(records[id][key] for id in groups[group]) for group in sorted(groups)]

    return means(first), means(second)


def by_settings(
    cells: Iterable[Measured], kind: str
) -> Iterator[tuple[tuple[str, str, str, str], list[Measured]]]:
    """The cells of one kind, by dataset, split, goal set and label of the other settings.

    A case measured both with and without the model asked outright is included once, with it; of a
    case that was corrected later, only the newest version is.
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
    own = ("kind", "set", "split", "goal_set", "case", "outright", "fit")
    told = {key: value for key, value in spec.items() if key not in own}
    return {**told, "fit": spec["fit"]["sources"]} if "fit" in spec else told


def _records(cells: Sequence[Measured]) -> Iterator[Record]:
    """Score the belief of each predictor."""
    known = {result["seen"] for _, result in cells if result.get("seen") is not None}
    names = short_names({name for _, result in cells for name in result.get("methods", {})})
    begun = next((result["calibration"] for _, result in cells if result.get("role-play")), None)
    own = calibration_from_json(begun) if begun else PAPER  # of all, if another is saved meanwhile
    for cell in cells:
        spec, result = cell
        goals, turns = len(spec["case"]["goals"]), len(spec["case"]["turns"])
        yield from _scored(UNIFORM, cell, np.full((turns, goals), -np.log(goals)))
        if result.get("role-play"):
            yield from _scored(GOALSCOPE, cell, role_play(result, own), own)
            yield from _scored(AS_IN_PAPER, cell, role_play(result, PAPER), PAPER)
            if len(known) == 2 and result.get("seen") is not None:
                yield from _scored(SEEN[result["seen"]], cell, role_play(result, own))
        answers = result.get("outright") or ()
        yield from _scored(OUTRIGHT, cell, [outright_belief(each, goals) for each in answers])
        methods = {names[name]: each for name, each in result.get("methods", {}).items()}
        listed = {LETTERS: result.get("letters")}
        for name, beliefs in {**result.get("fitted", {}), **methods, **listed}.items():
            yield from _scored(name, cell, np.array(beliefs or []))
    for predictor in (GOALS_ALONE, *SIMILARITIES):
        likes = [(cell, table) for cell in cells if (table := likeness(cell, predictor)).size]
        for (cell, table), heat in zip(likes, fitted_temperatures(likes), strict=True):
            yield from _scored(predictor, cell, log_softmax(table / heat))


def _scored(
    predictor: str,
    cell: Measured,
    beliefs: Sequence[Array] | Array,
    calibration: Calibration | None = None,
) -> Iterator[Record]:
    """A record for each turn; goals are left out if a calibration of Unspecified is given."""
    case = cell[0]["case"]
    beside = _left_out(cell, calibration) if calibration and len(case["goals"]) > 2 else []
    truths = truths_in(case)
    for turn, belief in enumerate(beliefs, 1):
        record = {
            "predictor": predictor,
            "turn": turn,
            "last": turn == len(beliefs),
            "case": case,
            "group": case["group"],
            **({k: v for k, v in beside[turn - 1].items() if k != "leads"} if beside else {}),
        }
        if beside and turn > 1 and truths[turn - 1] != truths[turn - 2]:
            record |= _follows(beside, truths, turn - 1)
        if (truth := truths[turn - 1]) is not None:
            good = scores(belief, truth)
            record["sure"] = float(np.exp(belief.max()))
            for key in ("top1", "reciprocal_rank", "log_loss", "brier"):
                record[key] = getattr(good, key)
        yield record


def _follows(
    beside: Sequence[Mapping[str, float]], truths: Sequence[int | None], turn: int
) -> dict[str, float]:
    """Whether the belief follows a change at a turn, counted from 0."""
    ahead = [
        beside[later]["leads"] == (-1 if truths[turn] is None else truths[turn])
        for later in range(turn, min(turn + 3, len(truths)))
        if truths[later] == truths[turn]
    ]
    return {"at once": float(ahead[0]), "within 3": float(any(ahead))}


def _left_out(cell: Measured, calibration: Calibration) -> list[dict[str, float]]:
    """Unspecified by turn, with the true goal left out (absent) and with a wrong one (present)."""
    case, result = cell[0]["case"], cell[1]
    table = np.column_stack([result["unspecified"], evidence_in(result, calibration)])
    truths = truths_in(case)
    wrong = [place for place in range(table.shape[1] - 1) if place not in truths]
    other = chance(0, case["id"]).choice(wrong) if wrong else None
    whole = beside_unspecified(table, calibration)
    rows = [{"leads": float(belief.argmax() - 1)} for belief in whole]
    for out in {*truths, other}:
        kept = table if out is None else np.delete(table, out + 1, axis=1)
        beliefs = beside_unspecified(kept, calibration)
        for row, belief, truth in zip(rows, beliefs, truths, strict=True):
            kind = "absent" if out == truth else "present"
            if kind == "absent" or (out == other and truth is not None):
                row[kind] = float(belief[0] - np.logaddexp.reduce(belief[1:]))
                row[f"leads_{kind}"] = float(belief[0] > belief[1:].max())
    return rows


def _notes(cells: Sequence[Measured]) -> Iterator[str]:
    for own in dict.fromkeys(spec["likelihood"] for spec, _ in cells if spec.get("likelihood")):
        yield f"{GOALSCOPE} has its evidence from the likelihood {own}, not from role-play."
    for names in dict.fromkeys(tuple(spec["fit"]["sources"]) for spec, _ in cells if "fit" in spec):
        yield (
            f"{', '.join(FITTED_METHODS)}: fitted on {', '.join(names)}, which also chose their "
            "temperature."
        )
    if learned := sum(bool(result.get("learned")) for _, result in cells):
        yield f"The model's adapter was TRAINED on {learned:,} of these dialogues."
    answers = [each for _, result in cells for each in result.get("outright") or ()]
    if unread := sum(each["goal"] is None for each in answers):
        yield (
            f"{unread:,} of {len(answers):,} answers of the model that is asked could not be "
            "read; they are scored as uniform."
        )
