"""Probabilities that mean what they say, on dialogues that nobody fitted anything to."""

import numpy as np
import pytest

from goalscope.base.stats import bootstrap_mean, reliability, scores
from goalscope.belief.belief import log_posteriors
from goalscope.belief.calibration import PAPER
from goalscope.experiment.fit_calibration import Tables, fit_calibration
from test_calibrating import some


@pytest.mark.parametrize("factor", [0.3, 1.0, 4.0])
def test_what_was_fitted_is_no_worse_on_others_and_better_than_no_belief(
    factor: float, figure
) -> None:
    """People whose words count `factor` times as much as Eq. 1 has it."""
    made = fit_calibration(some(200, factor=factor))
    others = some(300, seed=9, factor=factor)
    tables = Tables(others)
    fitted, plain = (float(tables.losses(tables.believe(way)).mean()) for way in (made, PAPER))
    assert fitted <= plain + 0.01
    width = others[0].goals.shape[1]
    last = [
        log_posteriors(np.zeros(width), each.goals, np.ones(width, dtype=bool), made)[-1]
        for each in others
    ]
    own = [scores(row, each.truths[-1]) for row, each in zip(last, others, strict=True)]
    even = scores(np.full(width, -np.log(width)), 0)
    for field in ("log_loss", "brier"):
        gains = bootstrap_mean([getattr(even, field) - getattr(each, field) for each in own])
        assert gains is not None
        assert gains.low > 0
    error = reliability([float(np.exp(row.max())) for row in last], [each.top1 for each in own])
    assert error.ece <= error.band.high
    figure(
        f"300 dialogues: log-loss {fitted:.3f} fitted, {plain:.3f} by Eq. 1; calibration error "
        f"{error.ece:.3f}, that of a perfect forecaster up to {error.band.high:.3f}",
    )
