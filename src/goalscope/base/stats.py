"""Statistics: intervals, paired differences, and scores of a belief's probabilities.

Every function that draws does so from its own seed, so the same data give the same figures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError

RESAMPLES = 4_999
PERMUTATIONS = 9_999
BATCH = 256
"""Draws that are in memory at once."""

BINS = 10
"""Of confidence, for `reliability`."""

Z = 1.959963984540054
"""The normal quantile of a two-sided interval of 95 %."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A 95 % interval; both ends belong to it."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Difference:
    """A mean difference between pairs.

    Attributes:
        difference: Mean of a - b.
        interval: Its paired bootstrap interval; None for a single pair, or where all are equal.
        p: Two-sided, of the sign-flip permutation test.
        n: Number of pairs.
    """

    difference: float
    interval: Interval | None
    p: float
    n: int


@dataclass(frozen=True, slots=True)
class Scores:
    """How good a belief was in one case.

    Attributes:
        top1: Whether the truth is the likeliest goal; 1/k where k goals tie for it.
        reciprocal_rank: 1 over the truth's rank; goals that tie have their mean rank.
        log_loss: Minus the log-probability of the truth, nats; inf where it was ruled out.
        brier: Squared distance between the probabilities and the truth, 0 to 2.
    """

    top1: float
    reciprocal_rank: float
    log_loss: float
    brier: float


@dataclass(frozen=True, slots=True)
class Reliability:
    """Whether what was believed with probability p was right in a share p of the cases.

    Attributes:
        ece: Expected calibration error: mean gap between confidence and share correct, by bins.
        band: In which 95 % of the errors lie of a perfectly calibrated forecaster with the same
            confidences; well above 0 in small samples.
        bins: Mean confidence, share correct and number of cases of each bin that has any.
        n: Number of cases.
    """

    ece: float
    band: Interval
    bins: tuple[tuple[float, float, int], ...]
    n: int


def bootstrap_mean(
    values: Sequence[float] | Array, groups: Sequence[str] | None = None, *, seed: int = 0
) -> Interval | None:
    """Percentile bootstrap interval of the mean, which resamples whole groups.

    Args:
        values: What the mean is of; each value weighs the same, whatever its group.
        groups: The group of each value, such as people; without it each value is its own.
        seed: Of the resampling.

    Returns:
        The interval; None for a single group, and where the means of all groups are equal: such
        data do not say how much groups differ, and the interval would have no width.

    Raises:
        ValueError: There are no values, one is not finite, or `groups` has another length.
    """
    data = _finite(values, "values")
    if groups is None:
        totals, counts = data, np.ones(len(data))
    else:
        if len(groups) != len(data):
            raise ValueError(f"{len(data)} values need as many groups, not {len(groups)}")
        number = {name: i for i, name in enumerate(dict.fromkeys(groups))}
        index = np.array([number[name] for name in groups])
        totals, counts = np.bincount(index, data), np.bincount(index).astype(float)
    means = totals / counts
    if np.allclose(means, means[0], rtol=1e-12, atol=0):
        return None
    drawn = _scipy_stats().bootstrap(
        (totals, counts),
        _ratio,
        n_resamples=RESAMPLES,
        batch=BATCH,
        vectorized=True,
        paired=True,
        method="percentile",
        rng=np.random.default_rng(seed),
    )
    found = drawn.confidence_interval
    return Interval(float(found.low), float(found.high))


def auroc(
    positive: Sequence[float] | Array, negative: Sequence[float] | Array, groups: Sequence[str]
) -> tuple[float, Interval | None]:
    """How well a score tells two kinds of cases apart: the area under the ROC curve.

    Args:
        positive: The score of each case as one of the kind that should score high.
        negative: The score of the same cases as one of the other kind.
        groups: The group of each case; the bootstrap resamples whole groups.

    Returns:
        The chance that a positive score is above a negative one of another group, ties counting
        half; and its percentile interval, None for fewer than three groups, or where all draws are
        equal.

    Raises:
        ValueError: There is one group, a score is not finite, or the lengths differ.
    """
    high, low = _finite(positive, "positive"), _finite(negative, "negative")
    if not len(high) == len(low) == len(groups):
        raise ValueError(f"{len(high)} positive scores, {len(low)} negative, {len(groups)} groups")
    number = {name: i for i, name in enumerate(dict.fromkeys(groups))}
    own = np.zeros((len(number), len(groups)))
    own[[number[name] for name in groups], np.arange(len(groups))] = 1.0
    apart = high[:, None] - low
    wins = own @ ((apart > 0) + 0.5 * (apart == 0)) @ own.T
    pairs = own.sum(1)[:, None] * own.sum(1)
    for within in (wins, pairs):
        np.fill_diagonal(within, 0.0)
    if not pairs.any():
        raise ValueError("one group has no pairs with another")
    value = float(wins.sum() / pairs.sum())
    if len(number) < 3:
        return value, None
    rng = np.random.default_rng(0)
    drawn = rng.multinomial(len(number), np.full(len(number), 1 / len(number)), RESAMPLES)
    drawn = drawn[(drawn > 0).sum(1) > 1].astype(float)
    sums = (np.einsum("rg,gh,rh->r", drawn, each, drawn, optimize=True) for each in (wins, pairs))
    found = np.divide(*sums)
    low_end, high_end = np.quantile(found, (0.025, 0.975))
    return value, Interval(float(low_end), float(high_end)) if low_end < high_end else None


def proportion(successes: float, n: int) -> Interval:
    """Wilson's interval of a proportion; (0, 1) where n is 0.

    Args:
        successes: 0 to `n`; need not be whole, since cases that tie count in part.
        n: Number of cases, which must be independent.

    Raises:
        ValueError: `successes` does not lie between 0 and `n`.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"successes must lie between 0 and n = {n}, not be {successes}")
    if n == 0:
        return Interval(0.0, 1.0)
    share = successes / n
    centre = share + Z * Z / (2 * n)
    width = Z * math.sqrt(share * (1 - share) / n + Z * Z / (4 * n * n))
    scale = 1 + Z * Z / n
    low = 0.0 if successes == 0 else (centre - width) / scale
    high = 1.0 if successes == n else (centre + width) / scale
    return Interval(low, high)


def pooled_sd_of_mean(runs: Sequence[Sequence[float]]) -> float | None:
    """The "pooled standard deviation of the mean" of the paper's error bars (Sec. 5.1).

    The paper gives no formula. Taken here: K runs (one for each profile) with n_k trials each and
    sample variances s_k^2 have the pooled variance s^2 = sum (n_k - 1) s_k^2 / sum (n_k - 1); the
    mean of the K run means then has the standard deviation s sqrt(sum 1 / n_k) / K, which is
    s / sqrt(K n) for runs of n trials each. It holds the noise of the trials only: how much
    profiles differ is not in it, so it is much smaller than an interval over profiles.

    Args:
        runs: The trials of each run, one at least.

    Returns:
        The standard deviation in the trials' unit; None where no run has two trials.

    Raises:
        ValueError: A run has no trials, or a trial is not finite.
    """
    trials = [_finite(run, "trials of a run") for run in runs]
    freedom = sum(len(run) - 1 for run in trials)
    if not freedom:
        return None
    squares = sum(float(((run - run.mean()) ** 2).sum()) for run in trials)
    return math.sqrt(squares / freedom * sum(1 / len(run) for run in trials)) / len(trials)


def paired_difference(a: Sequence[float] | Array, b: Sequence[float] | Array) -> Difference:
    """Mean of a - b over pairs, with its bootstrap interval and its sign-flip permutation test.

    The test is exact where the signs of the pairs can be flipped in no more ways than are drawn
    otherwise, which holds for up to 13 pairs. One pair always has p = 1.

    Args:
        a: One value for each pair.
        b: The other values, in the same order.

    Raises:
        ValueError: There are no pairs, a value is not finite, or the lengths differ.
    """
    first, second = _finite(a, "values"), _finite(b, "values")
    if len(first) != len(second):
        raise ValueError(f"pairs need two values each, not {len(first)} and {len(second)}")
    gaps = first - second
    p = 1.0
    if len(gaps) > 1 and gaps.any():
        test = _scipy_stats().permutation_test(
            (first, second),
            _mean_gap,
            permutation_type="samples",
            n_resamples=PERMUTATIONS,
            batch=BATCH,
            vectorized=True,
            alternative="two-sided",
            rng=np.random.default_rng(0),
        )
        p = float(test.pvalue)
    return Difference(float(gaps.mean()), bootstrap_mean(gaps), p, len(gaps))


def holm(p: Sequence[float] | Array) -> list[float]:
    """Holm's correction of the p of several tests: the chance of any false alarm among them.

    Args:
        p: One for each test.

    Returns:
        The corrected p, in the same order.
    """
    values = np.asarray(p, dtype=np.float64)
    order = values.argsort(kind="stable")
    steps = values[order] * np.arange(len(values), 0, -1)
    corrected = np.empty_like(values)
    corrected[order] = np.maximum.accumulate(steps).clip(max=1.0)
    return corrected.tolist()


def log_softmax(values: Array) -> Array:
    """[..., G] normalised log-probabilities in nats."""
    shifted = values - values.max(axis=-1, keepdims=True)
    return shifted - np.log(np.exp(shifted).sum(axis=-1, keepdims=True))


def scores(log_posterior: Sequence[float] | Array, truth: int) -> Scores:
    """Score one belief against the goal that was true.

    Args:
        log_posterior: [G] in nats, normalised; -inf means ruled out.
        truth: Index of the true goal.

    Raises:
        ValueError: The posterior is not normalised, or holds no such goal.
    """
    belief = np.asarray(log_posterior, dtype=np.float64)
    probability = np.exp(belief)
    if belief.ndim != 1 or not abs(probability.sum() - 1) < 1e-6:
        raise ValueError(f"log_posterior must be [G] and sum to 1, not {probability.sum()}")
    if not 0 <= truth < len(belief):
        raise ValueError(f"truth must be one of the {len(belief)} goals, not {truth}")
    own = belief[truth]
    above, ties = int((belief > own).sum()), int((belief == own).sum())
    sure = float(probability[truth])
    rest = float((probability**2).sum()) - sure**2
    return Scores(
        top1=0.0 if above else 1 / ties,
        reciprocal_rank=1 / (above + (ties + 1) / 2),
        log_loss=max(0.0, -float(own)),
        brier=(1 - sure) ** 2 + max(0.0, rest),
    )


def reliability(
    confidence: Sequence[float] | Array, correct: Sequence[float] | Array, *, seed: int = 0
) -> Reliability:
    """Expected calibration error over bins of equal width, beside that of a perfect forecaster.

    Args:
        confidence: Probability that was given to the first choice, 0 to 1.
        correct: Whether it was right, 1 or 0; between them where choices tied.
        seed: Of the simulated forecaster.

    Raises:
        ValueError: There are no cases, the lengths differ, or a value is not in [0, 1].
    """
    sure, right = _finite(confidence, "confidences"), _finite(correct, "outcomes")
    if len(sure) != len(right):
        raise ValueError(f"{len(sure)} confidences need as many outcomes, not {len(right)}")
    for name, values in (("confidences", sure), ("outcomes", right)):
        if values.min() < -1e-9 or values.max() > 1 + 1e-9:
            raise ValueError(f"{name} must lie in [0, 1], not in [{values.min()}, {values.max()}]")
    n = len(sure)
    index = np.minimum((sure * BINS).astype(int), BINS - 1).clip(0)
    member = np.eye(BINS)[index]
    ece = float(np.abs((right - sure) @ member).sum() / n)
    rng = np.random.default_rng(seed)
    drawn = np.empty(RESAMPLES)
    for start in range(0, RESAMPLES, BATCH):
        size = min(BATCH, RESAMPLES - start)
        gaps = (rng.random((size, n)) < sure) - sure
        drawn[start : start + size] = np.abs(gaps @ member).sum(axis=1) / n
    low, high = np.quantile(drawn, (0.025, 0.975))
    counts = member.sum(axis=0)
    filled = tuple(
        (float(sure[index == i].mean()), float(right[index == i].mean()), int(counts[i]))
        for i in range(BINS)
        if counts[i]
    )
    return Reliability(ece, Interval(float(low), float(high)), filled, n)


def _ratio(totals: Array, counts: Array, axis: int = -1) -> Array:
    return totals.sum(axis=axis) / counts.sum(axis=axis)


def _mean_gap(a: Array, b: Array, axis: int = -1) -> Array:
    return (a - b).mean(axis=axis)


def _finite(values: Sequence[float] | Array, what: str) -> Array:
    data = np.asarray(values, dtype=np.float64)
    if data.ndim != 1 or not len(data) or not np.isfinite(data).all():
        raise ValueError(f"{what} must be a list of finite numbers, one at least")
    return data


def _scipy_stats() -> Any:
    return package("scipy.stats", "Statistics need", GoalscopeError)
