"""Laws of the statistics, and what is known of them in closed form."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from goalscope.base.stats import (
    Interval,
    auroc,
    bootstrap_mean,
    holm,
    paired_difference,
    pooled_sd_of_mean,
    proportion,
    reliability,
    scores,
)

scipy_stats = pytest.importorskip("scipy.stats")

unit = st.floats(0, 1)
numbers = st.floats(-1e3, 1e3)


@settings(max_examples=15)
@given(st.lists(st.tuples(numbers, st.sampled_from("abcd")), min_size=1, max_size=12))
def test_bootstrap_interval_lies_between_the_means_of_groups(rows) -> None:
    values, groups = zip(*rows, strict=True)
    means = [np.mean([v for v, g in rows if g == name]) for name in set(groups)]
    interval = bootstrap_mean(values, groups)
    if interval is None:
        assert np.allclose(means, means[0])
    else:
        assert len(set(groups)) > 1
        assert min(means) - 1e-9 <= interval.low <= interval.high <= max(means) + 1e-9


def test_bootstrap_covers_the_mean_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    found = [bootstrap_mean(rng.normal(size=50), seed=i) for i in range(200)]
    covered = sum(each is not None and each.low <= 0 <= each.high for each in found)
    assert 0.89 <= covered / 200 <= 0.99


def test_bootstrap_resamples_whole_groups() -> None:
    values = [0.0, 1.0] * 20
    mixed = bootstrap_mean(values, [str(i // 2) for i in range(40)])
    assert mixed is None  # each group has the same mean
    apart = bootstrap_mean(sorted(values), [str(i // 10) for i in range(40)])
    alone = bootstrap_mean(values)
    assert apart is not None
    assert alone is not None
    assert apart.high - apart.low > 2 * (alone.high - alone.low)


def test_bootstrap_is_repeatable_and_depends_on_the_seed() -> None:
    values = list(np.random.default_rng(1).normal(size=30))
    assert bootstrap_mean(values, seed=3) == bootstrap_mean(values, seed=3)
    assert bootstrap_mean(values, seed=3) != bootstrap_mean(values, seed=4)


def test_one_value_or_equal_ones_have_no_bootstrap_interval() -> None:
    assert bootstrap_mean([0.3]) is None
    assert bootstrap_mean([0.3, 0.4], ["a", "a"]) is None
    assert bootstrap_mean([0.1] * 7, list("aaabbcc")) is None
    assert bootstrap_mean([0.3, 0.3 + 1e-9]) is not None
    assert paired_difference([1.0, 2.0, 3.0], [0.5, 1.5, 2.5]).interval is None


@pytest.mark.parametrize("values", [[], [math.nan], [1.0, math.inf]])
def test_what_is_no_number_is_refused(values: list[float]) -> None:
    for call in (
        lambda: bootstrap_mean(values),
        lambda: paired_difference(values, values),
        lambda: pooled_sd_of_mean([values]),
        lambda: reliability(values, values),
    ):
        with pytest.raises(ValueError, match="finite"):
            call()


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: bootstrap_mean([1.0, 2.0], ["a"]), "as many groups"),
        (lambda: paired_difference([1.0, 2.0], [1.0]), "two values each"),
        (lambda: reliability([1.0, 0.5], [1.0]), "as many outcomes"),
        (lambda: reliability([1.1], [1.0]), "lie in"),
        (lambda: proportion(3, 2), "between 0 and n = 2"),
        (lambda: scores([0.0, 0.0], 0), "sum to 1"),
        (lambda: scores([0.0], -1), "one of the 1 goals"),
        (lambda: auroc([1.0], [1.0, 2.0], ["a"]), "2 negative"),
        (lambda: auroc([1.0, 2.0], [1.0, 2.0], ["a", "a"]), "no pairs"),
    ],
)
def test_what_does_not_fit_is_refused(call, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        call()


@given(st.integers(1, 10_000), st.data())
def test_proportion_is_wilsons_interval(n: int, data) -> None:
    k = data.draw(st.integers(0, n))
    wilson = scipy_stats.binomtest(k, n).proportion_ci(method="wilson")
    interval = proportion(k, n)
    assert interval.low == pytest.approx(wilson.low, abs=1e-12)
    assert interval.high == pytest.approx(wilson.high, abs=1e-12)
    assert 0 <= interval.low <= k / n <= interval.high <= 1


def test_proportion_of_nothing_says_nothing() -> None:
    assert proportion(0, 0) == Interval(0, 1)


def test_pooled_sd_of_equal_runs_is_s_over_root_kn() -> None:
    runs = [[1.0, 2.0, 3.0], [4.0, 6.0, 8.0]]  # variances 1 and 4
    assert pooled_sd_of_mean(runs) == pytest.approx(math.sqrt(2.5) / math.sqrt(6))


@given(st.lists(st.lists(numbers, min_size=2, max_size=5), min_size=1, max_size=4), numbers)
def test_pooled_sd_ignores_what_runs_differ_by(runs: list[list[float]], shift: float) -> None:
    moved = [[value + i * shift for value in run] for i, run in enumerate(runs)]
    assert pooled_sd_of_mean(moved) == pytest.approx(pooled_sd_of_mean(runs), abs=1e-8)


def test_pooled_sd_needs_a_run_of_two_trials() -> None:
    assert pooled_sd_of_mean([]) is None
    assert pooled_sd_of_mean([[1.0], [2.0]]) is None
    assert pooled_sd_of_mean([[1.0], [2.0, 2.0]]) == 0


@settings(max_examples=20)
@given(st.lists(st.integers(-5, 5), min_size=2, max_size=6))
def test_sign_flip_test_is_exact_where_small(gaps: list[int]) -> None:
    flipped = [
        sum(s * g for s, g in zip(signs, gaps, strict=True))
        for signs in itertools.product((1, -1), repeat=len(gaps))
    ]
    exact = np.mean([abs(total) >= abs(sum(gaps)) for total in flipped])
    found = paired_difference([g / 8 for g in gaps], [0.0] * len(gaps))
    assert found.p == pytest.approx(min(1.0, exact))
    assert found.difference == pytest.approx(sum(gaps) / 8 / len(gaps))
    assert found.n == len(gaps)


def test_the_other_way_round_the_difference_changes_its_sign_only() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.random(30), rng.random(30)
    one, other = paired_difference(a, b), paired_difference(b, a)
    assert one.difference == -other.difference
    assert one.p == pytest.approx(other.p)
    assert one.interval is not None
    assert other.interval is not None
    assert one.interval.low == pytest.approx(-other.interval.high, abs=0.01)


def test_scores_of_a_belief_by_hand() -> None:
    found = scores(np.log([0.5, 0.3, 0.2]), 1)
    assert (found.top1, found.reciprocal_rank) == (0, 1 / 2)
    assert found.log_loss == pytest.approx(-math.log(0.3))
    assert found.brier == pytest.approx(0.25 + 0.49 + 0.04)


@given(st.integers(1, 30), st.data())
def test_goals_that_tie_share(g: int, data) -> None:
    truth = data.draw(st.integers(0, g - 1))
    found = scores(np.full(g, -math.log(g)), truth)
    assert found.top1 == pytest.approx(1 / g)
    assert found.reciprocal_rank == pytest.approx(2 / (g + 1))
    assert found.log_loss == pytest.approx(math.log(g))
    assert found.brier == pytest.approx(1 - 1 / g)


@given(st.lists(st.floats(-50, 0), min_size=1, max_size=8), st.randoms(), st.data())
def test_scores_do_not_depend_on_the_order_of_goals(values, random, data) -> None:
    belief = np.array(values) - np.log(np.exp(values).sum())
    truth = data.draw(st.integers(0, len(values) - 1))
    order = list(range(len(values)))
    random.shuffle(order)
    found = scores(belief, truth)
    other = scores(belief[order], order.index(truth))
    assert found.brier == pytest.approx(other.brier, abs=1e-12)
    assert (found.top1, found.reciprocal_rank) == (other.top1, other.reciprocal_rank)
    assert 0 <= found.brier <= 2
    assert 0 < found.top1 <= found.reciprocal_rank <= 1 or found.top1 == 0


def test_a_truth_that_was_ruled_out_costs_infinitely_much() -> None:
    found = scores([0.0, -math.inf], 1)
    assert (found.log_loss, found.brier, found.top1) == (math.inf, 2, 0)


@pytest.mark.parametrize("n", [1, 2, 50, 200])
def test_the_band_covers_a_perfect_forecaster(n: int) -> None:
    rng = np.random.default_rng(n)
    inside = 0
    for seed in range(60):
        sure = rng.random(n)
        found = reliability(sure, rng.random(n) < sure, seed=seed)
        inside += found.band.low <= found.ece <= found.band.high
    assert inside >= 51


def test_overconfidence_lies_outside_the_band() -> None:
    found = reliability([0.95] * 200, [1.0, 0.0] * 100)
    assert found.ece == pytest.approx(0.45)
    assert found.ece > found.band.high
    assert found.bins == ((pytest.approx(0.95), 0.5, 200),)


@given(st.lists(st.tuples(unit, unit), min_size=1, max_size=40))
@settings(max_examples=25, deadline=None)
def test_bins_hold_every_case_and_make_the_error(rows) -> None:
    sure, right = zip(*rows, strict=True)
    found = reliability(sure, right)
    assert sum(n for _, _, n in found.bins) == found.n == len(rows)
    gap = sum(n * abs(conf - share) for conf, share, n in found.bins) / len(rows)
    assert found.ece == pytest.approx(gap, abs=1e-9)
    assert 0 <= found.ece <= 1


def test_auroc_is_the_share_of_pairs_in_the_right_order() -> None:
    positive, negative = [3.0, 1.0, 2.0], [0.0, 1.0, 2.5]
    # of other cases, 3 beats 1 and 2.5, 1 beats 0 and loses to 2.5, 2 beats 0 and 1
    assert auroc(positive, negative, ["a", "b", "c"])[0] == pytest.approx(5 / 6)
    assert auroc([3.0, 1.0], [0.0, 3.0], ["a", "b"])[0] == pytest.approx((0.5 + 1) / 2)
    # within a group nothing is compared: only 3 > 2.5, 1 < 2.5, 2 > 0 and 2 > 1 are left
    assert auroc(positive, negative, ["a", "a", "b"])[0] == pytest.approx(3 / 4)


def test_aurocs_interval_resamples_groups() -> None:
    rng = np.random.default_rng(1)
    positive, negative = rng.normal(1, 1, 60), rng.normal(0, 1, 60)
    alone, own = auroc(positive, negative, [str(i) for i in range(60)])
    shared = auroc(positive, negative, [str(i % 4) for i in range(60)])[1]
    assert own is not None
    assert shared is not None
    assert own.low < alone < own.high
    expected = 0.76  # the normal quantile of 1 / sqrt(2)
    assert own.low < expected < own.high
    assert 0.05 < own.high - own.low < 0.25
    doubled = auroc([*positive] * 2, [*negative] * 2, [str(i % 60) for i in range(120)])
    assert doubled[0] == pytest.approx(alone)
    assert (doubled[1].low, doubled[1].high) == pytest.approx((own.low, own.high))


def test_holms_correction_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]) == [1, 1]
    assert holm([0.2]) == [0.2]
    assert holm([]) == []


@given(st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_holms_correction_raises_p_and_keeps_their_order(p: list[float]) -> None:
    found = holm(p)
    assert all(own <= corrected <= 1 for own, corrected in zip(p, found, strict=True))
    assert min(found) == min(1, len(p) * min(p))
    pairs = sorted(zip(p, found, strict=True))
    assert [corrected for _, corrected in pairs] == sorted(found)
