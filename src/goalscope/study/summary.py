"""The results of a study: tables of scores, agreement of raters, and all answers as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from sqlalchemy import select

from goalscope.base.stats import RESAMPLES, Interval, pooled_sd_of_mean
from goalscope.base.text import model_shown
from goalscope.experiment.episodes import JUDGE_NOTES, Reading, evaluator_of, reading_of
from goalscope.experiment.summary import (
    Entry,
    Estimate,
    Labels,
    Measured,
    Row,
    Table,
    chosen,
    inert,
    mean,
    percent,
)
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.storage.tables import CELLS
from goalscope.study.plan import BEST
from goalscope.study.store import Participant, Study, StudyStore

COLUMNS = (
    "study", "participant", "external_id", "joined", "finished", "place", "item", "episode",
    "domain", "profile", "method", "state_score", "rating", "explanation", "revision", "opened",
    "answered",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Rated:
    """An episode with its ratings.

    Attributes:
        info: The episode.
        ratings: Ratings by the number of the participant, of those who finished.
        readings: Trials by the label of the evaluator.
    """

    info: EpisodeInfo
    ratings: dict[int, int] = field(default_factory=dict[int, int])
    readings: dict[str, Reading] = field(default_factory=dict[str, Reading])

    @property
    def trials(self) -> list[float]:
        """The ratings as shares of the best one."""
        return [rating / BEST for rating in self.ratings.values()]


def study_tables(store: Store, study: Study) -> list[Table]:
    """The progress of a study, and the scores by method."""
    studies = StudyStore(store)
    people = studies.participants(study)
    rated = {id: Rated(store.episode(id)) for id in studies.items(study).values()}
    for each in people:
        for answer in each.answers if each.finished else ():
            if answer.rating is not None:
                rated[answer.episode].ratings[each.number] = answer.rating
    judges = _judged(store, rated)
    found = list(rated.values())
    return [_progress(study, people, found), _methods(study, found, judges)]


def _progress(study: Study, people: Sequence[Participant], rated: Sequence[Rated]) -> Table:
    wanted = study.plan.ratings_per_item
    values: dict[str, Entry] = {
        "agreed to take part": len(people),
        "finished": sum(each.finished for each in people),
        "ratings that count": sum(len(each.ratings) for each in rated),
        "episodes": len(rated),
        f"episodes with {wanted} rating{'s' * (wanted > 1)}": sum(
            len(each.ratings) >= wanted for each in rated
        ),
        "Krippendorff's alpha, ordinal": krippendorff_alpha(
            [[*each.ratings.values()] for each in rated]
        ),
    }
    rows: list[Row] = [{"what": what, "value": value} for what, value in values.items()]
    notes = ("Only ratings of people who finished count.",)
    name = study.plan.name
    return Table(f"study-{name}-progress", f"Study {name}: how far it is", rows, notes)


def _methods(study: Study, rated: Sequence[Rated], judges: Sequence[str]) -> Table:
    groups: dict[tuple[str, str, str], list[Rated]] = {}
    for each in rated:
        key = (each.info.domain, model_shown(each.info.model), each.info.method)
        groups.setdefault(key, []).append(each)
    rows: list[Row] = []
    for key, every in sorted(groups.items()):
        group = [each for each in every if each.ratings]
        trials = [each.trials for each in group]
        human = _over_people(group, lambda each: mean(each.trials))
        row: dict[str, Entry] = dict(zip(("domain", "model", "method"), key, strict=True))
        row |= {"episodes rated": len(group), "ratings": sum(map(len, trials))}
        row["human score"] = human and Estimate(human.value, _interval(group), "percent")
        row["human SD"] = percent(pooled_sd_of_mean(trials) if trials else None)
        row["state score"] = _over_people(group, lambda each: each.info.score)
        for judge in judges:
            by = f" by {judge}" if len(judges) > 1 else ""
            row[f"judge score{by}"] = _over_people(
                group, lambda each, judge=judge: _judge(each, judge)
            )
        rows.append(row)
    notes = (
        "Scores are means over profiles, of the episodes that are rated. The human score is a "
        f"share of the best rating, {BEST}; the state score is that of the final state, as in "
        "experiments.",
        "Intervals of 95 % are bootstrapped over those who rated: what other people would say of "
        "the same episodes. There is none where all agree, or only one has rated.",
        "SD: pooled standard deviation of the mean (Sec. 5.1), the noise of several raters of an "
        "episode, and not of the choice of profiles; the paper gives no formula.",
        *(JUDGE_NOTES if judges else ()),
    )
    name = study.plan.name
    return Table(f"study-{name}-methods", f"Study {name}: methods", rows, notes)


def _judged(store: Store, rated: Mapping[str, Rated]) -> tuple[str, ...]:
    """Add the evaluators' trials in the store to each episode, and return their labels."""
    with store.reading() as connection:
        rows = connection.execute(select(CELLS).where(CELLS.c.result.is_not(None)))
        cells: list[tuple[str, Measured]] = [
            (row.key, (json.loads(row.spec), json.loads(row.result))) for row in rows
        ]
    own = {
        key: result
        for key, (spec, result) in cells
        if spec.get("kind") == "episode" and result.get("episode") in rated
    }
    of = [cell for _, cell in cells]
    judged = [cell for cell in chosen(of, "judge") if cell[0]["of"]["key"] in own]
    labels = Labels(evaluator_of(spec) for spec, _ in judged)
    for spec, result in judged:
        run = own[spec["of"]["key"]]
        reading = reading_of(spec, result, empty=run["empty"])
        rated[run["episode"]].readings[labels[evaluator_of(spec)]] = reading
    return tuple(dict.fromkeys(labels[evaluator_of(spec)] for spec, _ in judged))


def _judge(rated: Rated, judge: str) -> float | None:
    reading = rated.readings.get(judge)
    return mean(reading.trials) if reading else None


def _over_people(
    rated: Sequence[Rated], measure: Callable[[Rated], float | None]
) -> Estimate | None:
    """Mean over profiles of the mean over their episodes."""
    by_profile: dict[str, list[float]] = {}
    for each in rated:
        if (value := measure(each)) is not None:
            by_profile.setdefault(each.info.profile or each.info.id, []).append(value)
    return percent(mean([sum(each) / len(each) for each in by_profile.values()]))


def _interval(group: Sequence[Rated]) -> Interval | None:
    """Percentile bootstrap of the mean over profiles, resampling whole participants."""
    people = sorted({person for each in group for person in each.ratings})
    given = np.array([[each.ratings.get(person, np.nan) for each in group] for person in people])
    if len(people) < 2 or np.nanmin(given) == np.nanmax(given):
        return None
    rng = np.random.default_rng(0)
    drawn = rng.multinomial(len(people), np.full(len(people), 1 / len(people)), RESAMPLES)
    names = np.array([each.info.profile or each.info.id for each in group])
    ratings = np.ma.divide(drawn @ np.nan_to_num(given), drawn @ ~np.isnan(given)) / BEST
    profiles = np.ma.stack([ratings[:, names == name].mean(1) for name in np.unique(names)])
    low, high = np.quantile(profiles.mean(0).compressed(), (0.025, 0.975))
    return Interval(float(low), float(high))


def krippendorff_alpha(units: Sequence[Sequence[int]]) -> float | None:
    """Krippendorff's alpha of ordinal ratings: 1 if all agree, 0 at chance level.

    Args:
        units: The ratings of each item; items with fewer than two are ignored.

    Returns:
        Alpha; None if no item has two ratings, or all ratings are equal.
    """
    rated = [unit for unit in units if len(unit) > 1]
    values = np.unique([value for unit in rated for value in unit])
    if len(values) < 2:
        return None
    counts = np.array([[unit.count(v) for v in values.tolist()] for unit in map(list, rated)])
    pairs = counts[:, :, None] * counts[:, None, :] - counts[:, :, None] * np.eye(len(values))
    observed = (pairs / (counts.sum(1) - 1)[:, None, None]).sum(0)
    total = counts.sum(0)
    upto = total.cumsum() - total / 2  # differences of these are distances between ranks
    distance = (upto[:, None] - upto) ** 2
    expected = np.outer(total, total) * distance
    return float(1 - (total.sum() - 1) * (observed * distance).sum() / expected.sum())


def as_csv(store: Store, study: Study, *, ids: bool = True) -> str:
    """Every answer as a line of CSV, including those of people who have not finished.

    Args:
        store: Store with the study.
        study: The study.
        ids: Whether to include the ids from participants' links.
    """
    studies = StudyStore(store)
    infos = {id: store.episode(id) for id in studies.items(study).values()}
    file = io.StringIO(newline="")
    writer = csv.writer(file)
    writer.writerow(COLUMNS)
    for each in studies.participants(study):
        person = (each.number, each.external if ids else None, each.joined, each.finished)
        for answer in each.answers:
            info = infos[answer.episode]
            line = (
                study.plan.name, *person, answer.place, answer.item, info.id, info.domain,
                info.profile, info.method, info.score, answer.rating, answer.explanation,
                answer.revision, answer.opened, answer.answered,
            )  # fmt: skip
            writer.writerow([inert(cell) if isinstance(cell, str) else cell for cell in line])
    return file.getvalue()
