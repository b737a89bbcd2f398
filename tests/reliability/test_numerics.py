"""The belief against the same arithmetic in thirty decimal places."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Context, Decimal, localcontext

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from goalscope.base.types import UNSPECIFIED, Goal
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT, PAPER, Calibration

IMPOSSIBLE = Decimal(0)
BATCH = 25
"""Beliefs of one example."""
LONG = Context(prec=30, Emin=-(10**15), Emax=10**15)


def shares(weights: Sequence[Decimal]) -> list[Decimal]:
    total = sum(weights)
    return [weight / total for weight in weights] if total else [*weights]


def likelihoods(
    row: Sequence[float], stated: Sequence[bool], calibration: Calibration
) -> list[Decimal]:
    """Of one turn, after temperature and reference; the likeliest is 1."""
    nats = [
        None if value == -np.inf else Decimal(value) / Decimal(calibration.temperature)
        for value in row
    ]
    others = [nat for nat, each in zip(nats, stated, strict=True) if each and nat is not None]
    if others and any(stated) and not all(stated):
        part = Decimal(calibration.reference) * (1 - Decimal(1) / len(others))
        mean = sum(others) / len(others)
        nats = [
            nat if each or nat is None else (1 - part) * nat + part * mean
            for nat, each in zip(nats, stated, strict=True)
        ]
    most = max([nat for nat in nats if nat is not None], default=Decimal(0))
    return [IMPOSSIBLE if nat is None else (nat - most).exp() for nat in nats]


def hazard(
    switching: Decimal, now: list[Decimal], prior: list[Decimal], heard: list[Decimal]
) -> Decimal:
    """The chance of a change of mind before words, as far as they speak for one."""
    same, fresh = (
        sum((each * words for each, words in zip(belief, heard, strict=True)), IMPOSSIBLE)
        for belief in (now, prior)
    )
    if not fresh:
        return IMPOSSIBLE
    speaks = 1 - same / fresh
    return switching * speaks**4 if speaks >= Decimal("0.01") else IMPOSSIBLE


def exact(belief: Belief) -> list[list[Decimal]]:
    """Probabilities after each number of turns."""
    calibration, stated = belief.calibration, [goal != UNSPECIFIED for goal in belief.goals]
    prior = [IMPOSSIBLE if value == -np.inf else Decimal(value).exp() for value in belief.log_prior]
    if calibration.prior_unspecified is not None and any(stated) and not all(stated):
        rest = sum(weight for weight, each in zip(prior, stated, strict=True) if each)
        own = (
            rest
            * Decimal(calibration.prior_unspecified)
            / (1 - Decimal(calibration.prior_unspecified))
        )
        prior = [weight if each else own for weight, each in zip(prior, stated, strict=True)]
    prior = shares(prior)
    found, now = [prior], prior
    weights = dict(belief.weights)
    for turn, row in enumerate(belief.log_likelihood):
        weight = weights.get(turn, 1.0)
        words = [value * weight if weight else 0.0 for value in row.tolist()]
        heard = likelihoods(words, stated, calibration)
        if turn:
            go = hazard(Decimal(calibration.switching), now, prior, heard)
            now = [(1 - go) * each + go * first for each, first in zip(now, prior, strict=True)]
        now = shares([weight * each for weight, each in zip(now, heard, strict=True)])
        found.append(now)
    return found


share = st.floats(0, 1)
calibrations = st.sampled_from([PAPER, PAPER, PAPER, DEFAULT]) | st.builds(
    Calibration,
    st.floats(0.1, 20),
    share,
    st.none() | st.floats(0.01, 0.99),
    share | st.just(0.0),
)


def some_belief(random: np.random.Generator, calibration: Calibration) -> Belief:
    """Of one to six goals and none to six turns, with numbers of a nat to a million."""
    g, t = random.integers(1, 7), random.integers(7)
    table = -random.choice([1.0, 30.0, 1e3, 1e6]) * random.random((t, g))
    table[random.random((t, g)) < random.choice([0.0, 0.1, 0.5])] = -np.inf
    table[random.random((t, g)) < random.choice([0.0, 0.2])] = -1e6
    prior = -random.random(g) * random.choice([0.0, 5.0, 1e3])
    goals = [Goal(f"goal {n}") for n in range(g)]
    if random.random() < 0.7:
        goals[random.integers(g)] = UNSPECIFIED
    weights = tuple((turn, float(random.random())) for turn in range(t) if random.random() < 0.2)
    return Belief(tuple(goals), prior, table, calibration, weights=weights)


def compare(belief: Belief) -> tuple[float, float]:
    """Most that probabilities differ by (total variation), and that their sum does from 1."""
    apart = off = 0.0
    with localcontext(LONG):
        table = [[*map(float, row)] for row in exact(belief)]
    rows = belief.log_posteriors
    assert rows.shape == (len(table), len(belief.goals))
    assert not np.isnan(rows).any()
    assert belief.is_degenerate == (not any(table[-1]))
    for row, expected in zip(np.exp(rows), np.array(table), strict=True):
        off = max(off, abs(float(row.sum()) - any(expected)))
        apart = max(apart, float(np.abs(row - expected).sum()) / 2)
    return apart, off


@pytest.mark.parametrize("cases", [3_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_probabilities_are_those_of_exact_arithmetic(cases: int, figure) -> None:
    apart = off = 0.0
    seen = impossible = 0

    @settings(max_examples=cases // BATCH, database=None, suppress_health_check=[*HealthCheck])
    @given(calibrations, st.integers(0, 2**64))
    def holds(calibration: Calibration, seed: int) -> None:
        nonlocal apart, off, seen, impossible
        random = np.random.default_rng(seed)
        for _ in range(BATCH):
            belief = some_belief(random, calibration)
            found = compare(belief)
            assert found[0] <= 1e-9
            assert found[1] <= 1e-12
            apart, off = max(apart, found[0]), max(off, found[1])
            seen += 1
            impossible += belief.is_degenerate

    holds()
    assert seen >= cases * 0.9
    assert impossible
    figure(
        f"{seen:,} beliefs, {impossible:,} of them impossible: total variation at most "
        f"{apart:.1e}, sums at most {off:.1e} from 1 (0 where impossible), no NaN",
    )


@pytest.mark.parametrize(
    ("goals", "turns"),
    [(1, 100), (2, 100), (500, 3), pytest.param(500, 100, marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("calibration", [PAPER, DEFAULT], ids=["Eq. 1", "default"])
def test_many_goals_and_many_turns_lose_no_digits(goals, turns, calibration, figure) -> None:
    support = (UNSPECIFIED, *(Goal(f"goal {n}") for n in range(goals - 1)))
    apart = off = 0.0
    for scale in (3.0, 1e3, 1e6):
        random = np.random.default_rng(goals + turns)
        table = -scale + random.random((turns, goals)) * min(scale, 3.0)
        found = compare(Belief(support, np.zeros(goals), table, calibration))
        apart, off = max(apart, found[0]), max(off, found[1])
    figure(
        f"{goals} goals, {turns} turns: total variation at most {apart:.1e}, sums {off:.1e} from 1",
    )
    assert apart <= 1e-9
    assert off <= 1e-12
