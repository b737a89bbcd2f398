"""Fit a calibration to dialogues whose goals are known, and measure how good beliefs are."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.optional_packages import package
from goalscope.base.stats import auroc
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.belief.belief import log_posteriors
from goalscope.belief.calibration import DEFAULT, EPSILONS, Calibration
from goalscope.datasets.goal_sets import chance
from goalscope.experiment.dialogues import truths_in

FOLDS = 5
"""Parts of the groups of dialogues, each judged by a calibration fitted on the others."""

LISTED = 0.8
"""Share of people whose goal is listed, by assumption; it weighs them, and is the prior."""

_LEAST, _MOST = 0.05, 20.0  # temperature
_JUDGED = 0.1  # eps of the conformal sets that are judged


@dataclass(frozen=True, slots=True)
class Observed:
    """A dialogue whose goal is known, as a model scored it.

    Attributes:
        id: Of the dialogue.
        group: Of dialogues that share people, with the name of its set.
        origin: Its set, and how its goals were drawn; all origins have the same weight.
        goals: [T, G] log-likelihoods in nats.
        unspecified: [T] log-likelihoods without a goal, nats.
        truths: [T] index of the true goal after each turn; None where it is not listed.
        likeness: [T, G] of words and goals; None where none was measured.
    """

    id: str
    group: str
    origin: str
    goals: Array
    unspecified: Array
    truths: Sequence[int | None]
    likeness: Array | None = None

    @property
    def true(self) -> list[int]:
        """The listed goals that are true at some turn, in the order of their turns."""
        return [*dict.fromkeys(place for place in self.truths if place is not None)]

    def with_fewer_goals(self) -> Observed:
        """With as many of its goals as chance says, two wrong ones at least."""
        random, true = chance(0, f"goals of {self.id}"), self.true
        wrong = [place for place in range(self.goals.shape[1]) if place not in true]
        least = min(2, len(wrong))
        kept = [*true, *random.sample(wrong, random.randint(least, len(wrong)))]
        return replace(
            self,
            goals=self.goals[:, kept],
            truths=[None if place is None else kept.index(place) for place in self.truths],
            likeness=None if self.likeness is None else self.likeness[:, kept],
        )


@dataclass(frozen=True, slots=True)
class Quality:
    """How far beliefs can be trusted.

    Attributes:
        n: Dialogues.
        log_loss: Of the truth, nats; see `fit_calibration`.
        auroc: How well Unspecified tells, after the last turn, that the true goal is missing.
        coverage: Share of conformal sets that hold the truth, with the true goal among the goals
            and without it; None without thresholds.
        size: Mean number of goals in them.
    """

    n: int
    log_loss: float
    auroc: float
    coverage: tuple[float, float] | None
    size: float | None


class Tables:
    """Many dialogues, each twice: with the true goal among the goals, and without it.

    A wrong goal is left out in the first case. In the second all goals are that are true at some
    turn, and Unspecified is the truth, as it is where no listed goal is true to begin with.

    Attributes:
        log_likelihood: [2, N, T, G] in nats; Unspecified first. Padded with 0 for turns and -inf
            for goals.
        likeness: [2, N, T, G] of words and goals.
        truth: [2, N, T] index of what is true.
        listed: [N] whether a listed goal is true after the last turn.
        turns: [N] number of turns.
        drawn: [N] a turn of each, drawn at random, from 0.
        weight: [N] of the dialogues, the same for all sets; they sum to 1.
    """

    def __init__(self, dialogues: Sequence[Observed]) -> None:
        n = len(dialogues)
        self.turns = np.array([len(each.goals) for each in dialogues])
        width = 1 + max(each.goals.shape[1] for each in dialogues)
        self.log_likelihood = np.full((2, n, self.turns.max(), width), -np.inf)
        self.likeness = np.zeros_like(self.log_likelihood)
        self.truth = np.zeros((2, n, int(self.turns.max())), dtype=int)
        self.listed = np.array([each.truths[-1] is not None for each in dialogues])
        self.drawn = np.zeros(n, dtype=int)
        sets = Counter(each.origin for each in dialogues)
        self.weight = np.array([1 / len(sets) / sets[each.origin] for each in dialogues])
        for i, each in enumerate(dialogues):
            random, (turns, goals) = chance(0, each.id), each.goals.shape
            true = each.true
            wrong = [place for place in range(goals) if place not in true]
            out = random.choice(wrong) if wrong else None
            rest = [place for place in wrong if place != out]
            self.drawn[i] = random.randrange(turns)
            places = {None: 0} | {place: n for n, place in enumerate(true, 1)}
            self.truth[0, i, :turns] = [places[place] for place in each.truths]
            for kind, kept in enumerate(([*true, *rest], wrong)):
                table = np.column_stack([each.unspecified, each.goals[:, kept]])
                self.log_likelihood[kind, i, :turns, : 1 + len(kept)] = table
                self.log_likelihood[kind, i, turns:, : 1 + len(kept)] = 0.0
                if each.likeness is not None:
                    self.likeness[kind, i, :turns, 1 : 1 + len(kept)] = each.likeness[:, kept]

    def believe(self, calibration: Calibration) -> Array:
        """[2, N, T, G] log-posteriors in nats, after each turn."""
        table = self.log_likelihood
        width = int(table.shape[-1])
        prior = np.where(np.isneginf(table[:, :, 0]), -np.inf, 0.0)
        stated = np.greater(np.arange(width), 0)
        if calibration.similarity:
            table = table + calibration.similarity * self.likeness
        return log_posteriors(prior, table, stated, calibration)[:, :, 1:]

    def losses(self, beliefs: Array) -> Array:
        """[N] log-loss of the truth, nats: mean over turns, and both kinds by `LISTED`."""
        each: Array = np.take_along_axis(beliefs, self.truth[..., None], -1)[..., 0]
        own: Array = LISTED * each[0] + (1 - LISTED) * each[1]
        real = np.less(np.arange(self.truth.shape[-1]), self.turns[:, None])
        return -np.where(real, own, 0.0).sum(1) / self.turns

    def log_loss(self, calibration: Calibration) -> float:
        """Mean of `losses`, weighted."""
        return float(self.weight @ self.losses(self.believe(calibration)))

    def drawn_turn(self, beliefs: Array) -> tuple[Array, Array]:
        """Probabilities [2, N, G] after the drawn turn, and those of the truth [2, N]."""
        every = np.arange(len(self.turns))
        found = np.exp(beliefs[:, every, self.drawn])
        true = self.truth[:, every, self.drawn]
        return found, np.take_along_axis(found, true[..., None], -1)[..., 0]

    def conformal_sets(self, beliefs: Array, threshold: float) -> tuple[Array, Array]:
        """Whether the set after the drawn turn holds the truth, and its size, both [2, N]."""
        found, sure = self.drawn_turn(beliefs)
        held = np.logical_or(sure >= threshold, sure >= found.max(-1))
        return held, np.maximum(np.greater_equal(found, threshold).sum(-1), 1)

    def last_odds(self, beliefs: Array) -> Array:
        """[2, N] log-odds of Unspecified after the last turn, nats."""
        own: Array = beliefs[:, np.arange(len(self.turns)), self.turns - 1, 0]
        return own - np.log(-np.expm1(np.minimum(own, -1e-12)))


def observed_in(cells: Iterable[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> list[Observed]:
    """The dialogues among measured cells that can calibrate: those with three goals or more.

    Each counts once; those that the model's adapter has learned from are left out.

    Args:
        cells: Spec and result of each, of any kind.
    """
    found: dict[tuple[str, str], Observed] = {}
    for spec, result in cells:
        if spec["kind"] != "dialogue" or not result.get("role-play") or result.get("learned"):
            continue
        case, goals = spec["case"], np.array(result["role-play"], dtype=np.float64)
        if goals.shape[1] > 2:
            origin = f"{spec['set']} {spec['goal_set']}"
            found[origin, case["id"]] = Observed(
                case["id"],
                f"{spec['set']} {case['group']}",
                origin,
                goals,
                np.array(result["unspecified"], dtype=np.float64),
                truths_in(case),
                np.array(each, np.float64) if (each := result.get("likeness")) else None,
            )
    return [*found.values()]


def fit_calibration(dialogues: Sequence[Observed]) -> Calibration:
    """Temperature, reference and similarity with the least log-loss, and thresholds.

    The log-loss is that of the truth over all turns, with the true goal among the goals and (in one
    of five, see `LISTED`) without it, where Unspecified is the truth. The number of goals varies
    (see `Observed.with_fewer_goals`), so that the numbers suit short lists, too. The chance of a
    change of mind and the weights of asides and orders are those of `DEFAULT`: most such dialogues
    have hardly any changes of mind, and they are not read.

    Thresholds are cross-conformal: the truth had at least that probability in all but a share eps
    of the dialogues, each judged by a calibration fitted on other people, both with the true goal
    among the goals and without it (the smaller of the two thresholds).

    Raises:
        InvalidInputError: All dialogues are of one group.
    """
    scores: list[Array] = []
    for train, rest in _folds(dialogues):
        tables = Tables(rest)
        scores.append(tables.drawn_turn(tables.believe(_fit(train)))[1])
    ranked = np.sort(np.concatenate(scores, axis=1), axis=1)
    n = len(dialogues)
    places = [(eps, int(eps * (n + 1))) for eps in EPSILONS]
    thresholds = tuple((eps, float(ranked[:, k - 1].min()) if k else 0.0) for eps, k in places)
    return replace(_fit(dialogues), n=n, thresholds=thresholds)


def quality(dialogues: Sequence[Observed], calibration: Calibration | None = None) -> Quality:
    """How good beliefs are with a calibration, or with one fitted on dialogues of other groups.

    Args:
        dialogues: Those to judge by.
        calibration: If None, each fold is judged by one that is fitted on the others.

    Raises:
        InvalidInputError: All dialogues are of one group.
    """
    sets = Counter(each.origin for each in dialogues)
    order: list[Observed] = []
    judged: list[tuple[Tables, Array, Calibration]] = []
    for train, rest in _folds(dialogues):
        own = calibration or fit_calibration(train)
        tables = Tables(rest)
        order += rest
        judged.append((tables, tables.believe(own), own))
    weights = np.array([1 / len(sets) / sets[each.origin] for each in order])
    losses = np.concatenate([tables.losses(beliefs) for tables, beliefs, _ in judged])
    odds = np.concatenate([tables.last_odds(beliefs) for tables, beliefs, _ in judged], axis=1)
    present, absent = odds[:, [each.truths[-1] is not None for each in order]]
    listed = [each.group for each in order if each.truths[-1] is not None]
    found = [
        tables.conformal_sets(beliefs, threshold)
        for tables, beliefs, own in judged
        if (threshold := dict(own.thresholds).get(_JUDGED)) is not None
    ]
    coverage = np.concatenate([holds for holds, _ in found], axis=1).mean(1) if found else None
    return Quality(
        n=len(dialogues),
        log_loss=float(weights @ losses),
        auroc=auroc(absent, present, listed)[0],
        coverage=None if coverage is None else (float(coverage[0]), float(coverage[1])),
        size=float(np.concatenate([size.ravel() for _, size in found]).mean()) if found else None,
    )


def _fit(dialogues: Sequence[Observed]) -> Calibration:
    optimize = package("scipy.optimize", "Calibration needs", GoalscopeError)
    tables = Tables([each.with_fewer_goals() for each in dialogues])

    def of(numbers: Array) -> Calibration:
        temperature, reference, similarity = numbers.tolist()
        found = round(min(max(math.exp(temperature), _LEAST), _MOST), 4)
        return replace(
            DEFAULT,
            temperature=found,
            reference=round(1 / (1 + math.exp(-reference)), 4),
            prior_unspecified=round(1 - LISTED, 4),
            similarity=round(found * abs(similarity), 4) if alike else 0.0,
        )

    def loss(numbers: Array) -> float:
        return tables.log_loss(of(numbers))

    alike = bool(tables.likeness.any())
    start = np.array([math.log(2), math.log(0.5), 5.0])
    found = optimize.minimize(
        loss,
        start,
        method="Nelder-Mead",
        options={
            "initial_simplex": start + np.array([[0, 0, 0], [0.5, 0, 0], [0, 1.0, 0], [0, 0, 2.0]]),
            "maxfev": 270,
            "xatol": 0.02,
            "fatol": 1e-4,
        },
    )
    return of(found.x)


def _folds(dialogues: Sequence[Observed]) -> Iterator[tuple[list[Observed], list[Observed]]]:
    """Dialogues to fit on, and those of other groups, among which each dialogue is once."""
    groups = sorted({each.group for each in dialogues})
    if len(groups) < 2:
        raise InvalidInputError(
            "There are too few people: some are to fit on, others to judge by. Give dialogues of "
            "at least three people, each with three goals or more."
        )
    order: list[int] = np.random.default_rng(0).permutation(len(groups)).tolist()
    for fold in range(min(FOLDS, len(groups))):
        out = {groups[place] for place in order[fold::FOLDS]}
        yield (
            [each for each in dialogues if each.group not in out],
            [each for each in dialogues if each.group in out],
        )
