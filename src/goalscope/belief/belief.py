"""A belief over goals: the evidence table, and the posterior that follows from it (Eq. 1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.base.arrays import Array, Flags
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, canonical, pluralize
from goalscope.belief.calibration import EPSILONS, PAPER, Calibration, calibration_from_json

PINNED = 0.99
"""Lowest probability of a goal that the person has just confirmed."""

_CLEARLY = 4
"""Power that discounts words which speak for a change of mind, but not clearly (docs/log.md)."""

_FAINTLY = 0.01
"""Below it nothing speaks for a change of mind: it may be rounding error."""


@dataclass(frozen=True, eq=False)
class Belief:
    """Log-evidence for each goal, turn by turn; immutable.

    The table is the belief: the posterior is derived from it whenever it is asked for, so a goal
    can be added late or dropped without a trace, and no evidence can count twice. Eq. 2's sum over
    goals is the same for every goal and cancels in Eq. 1, so rows hold plain log-likelihoods.

    Attributes:
        goals: The support, `G` distinct goals.
        log_prior: [G] in nats, unnormalised. The entry of Unspecified is ignored if the
            calibration has a `prior_unspecified`.
        log_likelihood: [T, G] in nats, log P(u_t | g, q_t, transcript before t).
        calibration: Turns log-evidence into probabilities.
        pinned: The goal that the person confirmed last, as a pair (number of turns before, goal);
            empty if there is none. At that point it has a probability of at least `PINNED`; later
            turns move the belief on from there, as a person can still change their mind.
        weights: Weights of the turns whose evidence does not fully count, as pairs (turn from 0,
            weight from 0 to 1).
        ruled_out: Goals that the person rejected or reworded. They are not proposed again.
        inferred: Whether evidence decides. If not, a model was asked for the order of the goals:
            the prior holds that order, and there is no evidence (see `GoalOrder`).

    Raises:
        ValueError: Shapes disagree, a goal occurs twice, a pinned goal or a weighed turn does not
            exist, or a value is NaN or +inf.
    """

    goals: tuple[Goal, ...]
    log_prior: Array
    log_likelihood: Array
    calibration: Calibration = PAPER
    pinned: tuple[tuple[int, Goal], ...] = ()
    ruled_out: tuple[Goal, ...] = ()
    weights: tuple[tuple[int, float], ...] = ()
    inferred: bool = True

    def __post_init__(self) -> None:
        """Check the invariants of the arithmetic."""
        if len(set(self.goals)) != len(self.goals):
            raise ValueError("goals must be distinct; Belief.add merges exact duplicates")
        g = len(self.goals)
        if self.log_prior.shape != (g,) or self.log_likelihood.shape[1:] != (g,):
            raise ValueError(
                f"{g} goals need log_prior [{g}] and log_likelihood [T, {g}], "
                f"not {self.log_prior.shape} and {self.log_likelihood.shape}"
            )
        for when, goal in self.pinned:
            if goal not in self.goals or not 0 <= when <= len(self.log_likelihood):
                raise ValueError(
                    f"{str(goal)!r}, pinned after {pluralize(when, 'turn')}, is not in the belief"
                )
        turns = [turn for turn, _ in self.weights]
        if len(set(turns)) < len(turns) or not all(
            0 <= turn < len(self.log_likelihood) and 0 <= weight <= 1
            for turn, weight in self.weights
        ):
            raise ValueError(f"weights must be one from 0 to 1 for turns, not {self.weights}")
        for name, values in (
            ("log_prior", self.log_prior),
            ("log_likelihood", self.log_likelihood),
        ):
            if np.isnan(values).any() or np.isposinf(values).any():
                raise ValueError(f"{name} must not hold NaN or +inf; -inf means impossible")

    def __repr__(self) -> str:
        """The likeliest goals, and the number of turns."""
        shown = [f"{goal.text!r}: {probability:.2f}" for goal, probability in self.top(5)]
        more = ["..."] * (len(self.goals) > len(shown))
        return (
            f"Belief({', '.join([*shown, *more])}; {pluralize(len(self.log_likelihood), 'turn')})"
        )

    @classmethod
    def uniform(cls, goals: Iterable[Goal], calibration: Calibration = PAPER) -> Belief:
        """A belief before any evidence, with a flat prior; exact duplicates merge."""
        support = tuple(dict.fromkeys(goals))
        g = len(support)
        return cls(support, np.zeros(g), np.zeros((0, g)), calibration)

    @property
    def log_posteriors(self) -> Array:
        """[T + 1, G] log P(g | transcript up to turn t) in nats; row 0 is the prior.

        Without `switching` it is Eq. 1. With it, the words also decide how much of the belief
        before them is forgotten (see `Calibration.switching`), so it is no filter of a hidden
        Markov model, whose hazard would not depend on them. A row is all -inf if the words are
        impossible under every goal.
        """
        table = weighed(self.log_likelihood, self.weights)
        return log_posteriors(
            self.log_prior, table, self._stated, self.calibration, self._confirmed
        )

    @property
    def changes(self) -> Array:
        """[T] probability of a change of mind before each turn; see `Calibration.switching`."""
        switching = self.calibration.switching
        if not switching:
            return np.zeros(len(self.log_likelihood))
        before = self.log_posteriors[:-1]
        fresh = replace(self, log_likelihood=self.log_likelihood[:0], pinned=(), weights=())
        found = np.exp(_log_hazard(switching, before, fresh.log_posterior, self.evidence)[:, 0])
        return np.where(np.arange(len(found)), found, 0.0)

    @property
    def evidence(self) -> Array:
        """[T, G] evidence of each turn for each goal, after weight, temperature and reference."""
        table = weighed(self.log_likelihood, self.weights)
        return _counted(table, self._stated, self.calibration)

    @property
    def _stated(self) -> Flags:
        return np.array([goal != UNSPECIFIED for goal in self.goals], dtype=bool)

    @property
    def log_posterior(self) -> Array:
        """[G] log P(g | transcript) in nats; all -inf where `is_degenerate`."""
        return self.log_posteriors[-1]

    @property
    def probability(self) -> Array:
        """[G] posterior probabilities; they sum to 1, or are all 0 where `is_degenerate`."""
        return np.exp(self.log_posterior)

    @property
    def is_degenerate(self) -> bool:
        """Whether the words are impossible under every goal, or there is no goal."""
        return bool(np.isneginf(self.log_posterior).all())

    @property
    def entropy(self) -> float:
        """Posterior entropy in nats; 0 where `is_degenerate`."""
        p = self.probability
        p = p[p > 0]
        return float(max(0.0, -(p * np.log(p)).sum()))

    def top(self, k: int | None = None) -> list[tuple[Goal, float]]:
        """The `k` likeliest goals with their probabilities, likeliest first; ties keep order.

        Raises:
            InvalidInputError: `k` is below 1.
        """
        if k is not None and k < 1:
            raise InvalidInputError(f"k must be a whole number, 1 or more, not {k!r}")
        p = self.probability
        order = np.argsort(-self.log_posterior, kind="stable")[:k]
        return [(self.goals[i], float(p[i])) for i in order]

    def conformal_set(self, eps: float = 0.1) -> tuple[Goal, ...]:
        """The smallest set of goals that holds the true one with probability 1 - `eps`.

        The coverage holds at a random turn of dialogues like those that the calibration was fitted
        on; if the true goal is not among the goals, `UNSPECIFIED` stands for it (cross-conformal
        prediction with least ambiguous sets; Vovk, 2015; Sadinle et al., 2019). Without a threshold
        for `eps`, the calibration uses that of the next smaller one. The likeliest goal comes
        first. A degenerate belief returns all goals.

        Raises:
            InvalidInputError: `eps` is not between 0 and 1, or smaller than every threshold.
        """
        if not 0 < eps < 1:
            raise InvalidInputError(f"eps must be a number between 0 and 1, not {eps!r}")
        known = {each: p for each, p in self.calibration.thresholds if each <= eps + 1e-9}
        if not known:
            raise InvalidInputError(
                f"the calibration has no threshold for eps = {eps:g}; `goalscope calibrate` makes "
                f"some, for {', '.join(f'{each:g}' for each in EPSILONS)}"
            )
        ranked = self.top()
        least = min(known[max(known)], ranked[0][1]) if ranked else 0.0
        return tuple(goal for goal, p in ranked if p >= least)

    def observe(self, row: npt.ArrayLike, weight: float = 1.0) -> Belief:
        """Add one turn's evidence.

        Args:
            row: [G] log-likelihood of the turn's utterance under each goal, in nats.
            weight: Weight of the evidence, from 0 to 1.
        """
        values = np.asarray(row, dtype=np.float64).reshape(1, -1)
        if values.shape[1] != len(self.goals):
            raise ValueError(f"expected {len(self.goals)} log-likelihoods, got {values.shape[1]}")
        new = [(len(self.log_likelihood), weight)] * (weight != 1)
        return replace(
            self,
            log_likelihood=np.vstack([self.log_likelihood, values]),
            weights=(*self.weights, *new),
        )

    def without(self, turn: int) -> Belief:
        """The belief without the evidence of one turn (from 0).

        The evidence of later turns stays as it is: it was scored with that turn in the transcript.
        """
        others = (each for each in self.weights if each[0] != turn)
        return replace(self, weights=(*others, (turn, 0.0)))

    def since(self, turn: int) -> Belief:
        """The belief from the turns after the first `turn` ones, with that before them as prior.

        If the calibration has a `prior_unspecified`, Unspecified starts from that again.
        """
        return replace(
            self,
            log_prior=self.log_posteriors[turn],
            log_likelihood=self.log_likelihood[turn:],
            pinned=tuple((when - turn, goal) for when, goal in self.pinned if when >= turn),
            weights=tuple((t - turn, weight) for t, weight in self.weights if t >= turn),
        )

    def add(
        self, goals: Iterable[Goal], columns: Callable[[Sequence[Goal]], npt.ArrayLike]
    ) -> Belief:
        """Add goals, with their evidence over all past turns.

        A late goal gets the posterior that it would have, had it been there from the start. Its
        prior is that of the average goal (0 nats in an empty belief). Goals of the belief are
        skipped.

        Args:
            goals: Goals to add.
            columns: Returns the [T, len(new)] log-likelihoods of the new goals.
        """
        new = [goal for goal in dict.fromkeys(goals) if goal not in self.goals]
        if not new:
            return self
        turns = self.log_likelihood.shape[0]
        table = np.asarray(columns(new), dtype=np.float64).reshape(turns, len(new))
        prior = np.full(len(new), _log_mean(self.log_prior))
        return replace(
            self,
            goals=(*self.goals, *new),
            log_prior=np.concatenate([self.log_prior, prior]),
            log_likelihood=np.hstack([self.log_likelihood, table]),
        )

    def drop(self, goals: Iterable[Goal]) -> Belief:
        """Remove goals; unknown ones are skipped.

        With the calibration of the paper, and without pins, this is conditioning: the true goal is
        none of them.
        """
        gone = set(goals)
        keep = [i for i, goal in enumerate(self.goals) if goal not in gone]
        return replace(
            self,
            goals=tuple(self.goals[i] for i in keep),
            log_prior=self.log_prior[keep],
            log_likelihood=self.log_likelihood[:, keep],
            pinned=tuple(each for each in self.pinned if each[1] not in gone),
        )

    def pin(self, goal: Goal) -> Belief:
        """Record that the person confirmed a goal of the belief, in place of one before it."""
        free = tuple(
            each for each in self.ruled_out if canonical(each.text) != canonical(goal.text)
        )
        return replace(self, pinned=((len(self.log_likelihood), goal),), ruled_out=free)

    def rule_out(self, goal: Goal) -> Belief:
        """Remove a goal that the person rejected; see `ruled_out`."""
        return replace(self.drop([goal]), ruled_out=(*self.ruled_out, goal))

    def _confirmed(self, turns: int, row: Array) -> Array:
        """A row of `log_posteriors` after the goals that were confirmed at that point."""
        for when, goal in self.pinned:
            if when == turns:
                own = np.array([each == goal for each in self.goals], dtype=bool)
                sure = max(math.log(PINNED), float(row[own][0]))
                others = _normalised(np.where(own, -np.inf, row))
                with np.errstate(divide="ignore"):
                    row = np.where(own, sure, others + np.log(-np.expm1(sure)))
                row = _normalised(row)
        return row


def belief_to_json(belief: Belief) -> dict[str, Any]:
    """A belief as strict JSON; -inf, which JSON lacks, is the string "-inf"."""
    return {
        "goals": [goal.text for goal in belief.goals],
        "log_prior": _numbers(belief.log_prior.tolist()),
        "log_likelihood": [_numbers(row) for row in belief.log_likelihood.tolist()],
        "calibration": asdict(belief.calibration),
        "pinned": [[turns, goal.text] for turns, goal in belief.pinned],
        "ruled_out": [goal.text for goal in belief.ruled_out],
        "weights": [list(each) for each in belief.weights],
        "inferred": belief.inferred,
    }


def belief_from_json(data: Mapping[str, Any]) -> Belief:
    """The belief that `belief_to_json` wrote, equal in every value."""
    goals = tuple(map(Goal, data["goals"]))
    table = np.array(data["log_likelihood"], dtype=np.float64)
    return Belief(
        goals,
        np.array(data["log_prior"], dtype=np.float64),
        table.reshape(len(data["log_likelihood"]), len(goals)),
        calibration_from_json(data["calibration"]),
        tuple((turns, Goal(text)) for turns, text in data["pinned"]),
        tuple(map(Goal, data["ruled_out"])),
        tuple((turn, weight) for turn, weight in data["weights"]),
        data["inferred"],
    )


def _numbers(values: list[float]) -> list[float | str]:
    """The numbers, with -inf as a string, which numpy reads."""
    return ["-inf" if value == -math.inf else value for value in values]


def weighed(log_likelihood: Array, weights: Iterable[tuple[int, float]]) -> Array:
    """[T, G] log-likelihoods in nats, each turn times its weight; see `Belief.weights`."""
    table = log_likelihood.copy()
    for turn, weight in weights:
        table[turn] = weight * table[turn] if weight else 0.0  # not -inf times 0
    return table


def log_posteriors(
    log_prior: Array,
    log_likelihood: Array,
    stated: Flags,
    calibration: Calibration,
    after: Callable[[int, Array], Array] = lambda _, row: row,
) -> Array:
    """Beliefs turn by turn; leading axes are independent dialogues.

    Args:
        log_prior: [..., G] in nats, unnormalised.
        log_likelihood: [..., T, G] in nats.
        stated: [G] true for all goals but `UNSPECIFIED`.
        calibration: Turns these into probabilities.
        after: Maps a number of turns and the belief [..., G] after them to a revised belief.

    Returns:
        [..., T + 1, G] in nats, normalised; a row is all -inf if every goal is impossible.
    """
    rows, prior = _counted(log_likelihood, stated, calibration), log_prior
    prior_unspecified = calibration.prior_unspecified
    if prior_unspecified is not None and stated.any() and not stated.all():
        odds = math.log(prior_unspecified) - math.log1p(-prior_unspecified)
        rest = np.logaddexp.reduce(np.where(stated, prior, -np.inf), -1, keepdims=True)
        prior = np.where(stated, prior, rest + odds)
    prior = _normalised(prior)
    found: list[Array] = []
    row = prior
    for t in range(rows.shape[-2] + 1):
        if t:
            words = rows[..., t - 1, :]
            if t > 1 and calibration.switching:
                change = _log_hazard(calibration.switching, row, prior, words)
                with np.errstate(divide="ignore"):
                    row = np.logaddexp(np.log1p(-np.exp(change)) + row, change + prior)
            row = _normalised(row + words)
        row = after(t, row)
        found.append(row)
    return np.stack(found, -2)


def _log_hazard(switching: float, before: Array, prior: Array, words: Array) -> Array:
    """[..., 1] log-probability of a change of mind before the words of a turn.

    It is `switching` times (1 - P(words | belief before) / P(words | prior))^4 if the bracket is
    0.01 or more, and 0 otherwise.
    """
    peak: Array = words.max(-1, keepdims=True, initial=-np.inf)
    words = words - np.where(np.isneginf(peak), 0.0, peak)  # so that few digits cancel
    same = np.logaddexp.reduce(before + words, -1, keepdims=True)
    fresh = np.logaddexp.reduce(prior + words, -1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio: Array = np.exp(np.minimum(same - fresh, 0.0))
        speaks = np.where(np.isneginf(fresh) | (1.0 - ratio < _FAINTLY), 0.0, 1.0 - ratio)
        found: Array = np.log(switching) + _CLEARLY * np.log(speaks)
    return found


def _counted(log_likelihood: Array, stated: Flags, calibration: Calibration) -> Array:
    """[..., T, G] evidence in nats after temperature and reference."""
    rows = log_likelihood / calibration.temperature
    if not calibration.reference or stated.all() or not stated.any():
        return rows
    possible = np.isfinite(rows) & stated
    counts = np.maximum(np.count_nonzero(possible, axis=-1, keepdims=True), 1)
    means = np.where(possible, rows, 0.0).sum(-1, keepdims=True) / counts
    share = calibration.reference * (1 - 1 / counts)
    return np.where(stated, rows, (1 - share) * rows + share * means)


def _normalised(log_values: Array) -> Array:
    """[..., G] shifted so that exp(values) sum to 1; rows of -inf stay as they are."""
    peak: Array = log_values.max(-1, keepdims=True, initial=-np.inf)
    shifted = log_values - np.where(np.isneginf(peak), 0.0, peak)
    total = np.logaddexp.reduce(shifted, -1, keepdims=True)
    return shifted - np.where(np.isneginf(total), 0.0, total)


def _log_mean(log_values: Array) -> float:
    """Log of the mean of exp(values); 0 for none, so that a first goal has prior 1."""
    peak = log_values.max(initial=-np.inf)
    if np.isneginf(peak):
        return 0.0
    return float(peak + np.log(np.exp(log_values - peak).mean()))
