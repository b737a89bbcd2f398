"""A belief over goals: the evidence table, and the posterior that follows from it (Eq. 1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from goalscope.calibration import EPSILONS, PAPER, Calibration
from goalscope.types import UNSPECIFIED, Goal, InvalidInputError, canonical, pluralize

__all__ = ["PINNED", "Belief", "log_posteriors", "weighed"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

PINNED = 0.99
"""Least probability of a goal that the person has just confirmed."""

_CLEARLY = 4
"""Power that makes little of words which speak for a change of mind, but not clearly (LOG.md)."""

_FAINTLY = 0.01
"""Below it words speak for no change: what is left by rounding must not move mountains of nats."""


@dataclass(frozen=True, eq=False)
class Belief:
    """Log-evidence for each goal, turn by turn; immutable.

    The table is the belief: the posterior is derived from it whenever it is asked for, so a goal
    can be added late or dropped without a trace, and no evidence can count twice. Eq. 2's sum over
    goals is the same for every goal and cancels in Eq. 1, so rows hold plain log-likelihoods.

    Attributes:
        goals: The support, `G` distinct goals.
        log_prior: [G] in nats, unnormalised; that of Unspecified counts where the calibration has
            no `prior_unspecified`.
        log_likelihood: [T, G] in nats, log P(u_t | g, q_t, transcript before t).
        calibration: How these become probabilities.
        pinned: Goals that the person has confirmed, each with the number of turns before that:
            evidence of its own kind, after which such a goal has the probability `PINNED` or more.
            What is said later moves the belief on from there; a confirmed mind can change, too.
        weights: How much a turn's evidence counts where that is not 1, as pairs (turn from 0,
            weight from 0 to 1).
        ruled_out: Goals that the person said it is not, or said in other words. None is proposed
            again: `goalscope.goals.propose` is given `[*goals, *ruled_out]`.

    Raises:
        ValueError: Shapes disagree, a goal occurs twice, one is pinned that is not there, a turn is
            weighed that is not there, or a value is NaN or +inf.
    """

    goals: tuple[Goal, ...]
    log_prior: Array
    log_likelihood: Array
    calibration: Calibration = PAPER
    pinned: tuple[tuple[int, Goal], ...] = ()
    ruled_out: tuple[Goal, ...] = ()
    weights: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        """Check every invariant that the arithmetic rests on."""
        for each in self.goals:
            if not hasattr(each, "text"):
                raise InvalidInputError(f"goals must be like Goal('bake a cake'), not {each!r}")
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
        """[T + 1, G] log P(g | transcript up to turn t) in nats; row 0 is before any.

        The forward filter of a hidden Markov model whose hazard rate is `switching`, as far as the
        words speak for a change.

        All -inf where no goal can have said what was said.
        """
        table = weighed(self.log_likelihood, self.weights)
        return log_posteriors(
            self.log_prior, table, self._stated, self.calibration, self._confirmed
        )

    @property
    def changes(self) -> Array:
        """[T] chance of a change of mind before each turn, as far as its words speak for one."""
        switching = self.calibration.switching
        if not switching:
            return np.zeros(len(self.log_likelihood))
        before = self.log_posteriors[:-1]
        fresh = replace(self, log_likelihood=self.log_likelihood[:0], pinned=(), weights=())
        found = np.exp(_log_hazard(switching, before, fresh.log_posterior, self.evidence)[:, 0])
        return np.where(np.arange(len(found)), found, 0.0)

    @property
    def evidence(self) -> Array:
        """[T, G] what each turn says for each goal in nats, as it counts when it is said.

        That is, after its weight, temperature and reference.
        """
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
        """Whether no goal can have said what was said (or there is no goal at all)."""
        return bool(np.isneginf(self.log_posterior).all())

    @property
    def entropy(self) -> float:
        """Posterior entropy in nats; 0 where `is_degenerate`."""
        p = self.probability
        p = p[p > 0]
        return float(max(0.0, -(p * np.log(p)).sum()))

    @property
    def effective_goals(self) -> float:
        """Number of equally likely goals with the same entropy, 1 to G."""
        return float(np.exp(self.entropy))

    def top(self, k: int | None = None) -> list[tuple[Goal, float]]:
        """The `k` likeliest goals with their probabilities, likeliest first; ties keep order.

        Raises:
            InvalidInputError: `k` is no whole number, or below 1.
        """
        if k is not None and not (hasattr(k, "__index__") and k >= 1):
            raise InvalidInputError(
                f"k must be a whole number, 1 or more, or None for all goals, not {k!r}"
            )
        p = self.probability
        order = np.argsort(-self.log_posterior, kind="stable")[:k]
        return [(self.goals[i], float(p[i])) for i in order]

    def conformal_set(self, eps: float = 0.1) -> tuple[Goal, ...]:
        """Goals that could be the true one, likeliest first: the smallest set that is safe to name.

        In all but about a share `eps` of dialogues like those that it was calibrated on, at a turn
        drawn at random, it holds the true goal, or `UNSPECIFIED` where the true goal is not among
        them (cross-conformal prediction with least ambiguous sets; Vovk, 2015; Sadinle et al.,
        2019). Where the calibration has no threshold for `eps`, that for the next smaller one
        counts. All goals, where the belief is degenerate.

        Raises:
            InvalidInputError: `eps` is no share, or the calibration has no threshold so
                small.
        """
        if not (hasattr(eps, "__float__") and 0 < eps < 1):
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
            weight: How much it counts, from 0 to 1.
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
        """The belief had the evidence of one turn (from 0) not come in.

        Later words keep their evidence, which was weighed with that turn in the transcript.
        """
        others = (each for each in self.weights if each[0] != turn)
        return replace(self, weights=(*others, (turn, 0.0)))

    def since(self, turn: int) -> Belief:
        """The belief by the words from one turn (from 0) on, where that before it is the prior.

        Where the calibration has an `prior_unspecified`, Unspecified has that probability again.
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

        A late goal stands exactly where it would, had it been tracked from the start. Its prior
        is that of the average present goal (0 nats in an empty belief). Goals that are already
        present change nothing.

        Args:
            goals: Goals to add.
            columns: Gives the [T, len(new)] log-likelihoods of the goals that are really new.
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
        """Take goals out; unknown ones change nothing.

        Where the calibration is that of the paper, this is conditioning on the true goal being none
        of them.
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
        """Take in that the person confirms a goal of the belief (see `pinned`)."""
        free = tuple(
            each for each in self.ruled_out if canonical(each.text) != canonical(goal.text)
        )
        when = len(self.log_likelihood)
        return replace(self, pinned=(*self.pinned, (when, goal)), ruled_out=free)

    def rule_out(self, goal: Goal) -> Belief:
        """Take in that the person wants something else: drop a goal for good."""
        return replace(self.drop([goal]), ruled_out=(*self.ruled_out, goal))

    def _confirmed(self, turns: int, row: Array) -> Array:
        """A row of `log_posteriors` once the goals confirmed after so many turns are."""
        for when, goal in self.pinned:
            if when == turns:
                own = np.array([each == goal for each in self.goals], dtype=bool)
                sure = max(math.log(PINNED), float(row[own][0]))
                others = _normalised(np.where(own, -np.inf, row))
                with np.errstate(divide="ignore"):
                    row = np.where(own, sure, others + np.log(-np.expm1(sure)))
                row = _normalised(row)
        return row


def weighed(log_likelihood: Array, weights: Iterable[tuple[int, float]]) -> Array:
    """[T, G] log-likelihoods in nats, each turn times its weight, as in `Belief.weights`."""
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
    """Beliefs turn by turn; of many dialogues at once where there are leading axes.

    Args:
        log_prior: [..., G] in nats, unnormalised.
        log_likelihood: [..., T, G] in nats.
        stated: [G], all but `UNSPECIFIED`.
        calibration: How these become probabilities.
        after: Changes the belief [..., G] after so many turns, before the next one counts.

    Returns:
        [..., T + 1, G] in nats, normalised, or all -inf where nothing is possible.
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
    """[..., 1] the log-chance of a change of mind before some words, as far as they speak for one.

    The chance is `switching` times (1 - P(words | as before) / P(words | any goal, by the prior))^4
    where the bracket is 0.01 or more, else 0; but a `switching` of 1 is certain.
    """
    peak: Array = words.max(-1, keepdims=True, initial=-np.inf)
    words = words - np.where(np.isneginf(peak), 0.0, peak)  # so that few digits cancel
    same = np.logaddexp.reduce(before + words, -1, keepdims=True)
    fresh = np.logaddexp.reduce(prior + words, -1, keepdims=True)
    if switching == 1:
        return np.zeros_like(same)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio: Array = np.exp(np.minimum(same - fresh, 0.0))
        speaks = np.where(np.isneginf(fresh) | (1.0 - ratio < _FAINTLY), 0.0, 1.0 - ratio)
        found: Array = np.log(switching) + _CLEARLY * np.log(speaks)
    return found


def _counted(log_likelihood: Array, stated: Flags, calibration: Calibration) -> Array:
    """[..., T, G] evidence in nats as it counts: after temperature and reference."""
    rows = log_likelihood / calibration.temperature
    if not calibration.reference or stated.all() or not stated.any():
        return rows
    possible = np.isfinite(rows) & stated
    counts = np.maximum(np.count_nonzero(possible, axis=-1, keepdims=True), 1)
    means = np.where(possible, rows, 0.0).sum(-1, keepdims=True) / counts
    share = calibration.reference * (1 - 1 / counts)
    return np.where(stated, rows, (1 - share) * rows + share * means)


def _normalised(log_values: Array) -> Array:
    """[..., G] the same but for a constant, so that exp(values) sum to 1; all -inf stay so."""
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
