"""Predictors of a dialogue's goal: beliefs from evidence, similarity or a model's answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.belief.belief import log_posteriors
from goalscope.belief.calibration import Calibration
from goalscope.experiment.baselines import overlap
from goalscope.experiment.summary import Measured

__all__ = [
    "AS_IN_PAPER",
    "FITTED_FROM",
    "FOLDS",
    "GOALSCOPE",
    "GOALS_ALONE",
    "MOST_SURE",
    "OUTRIGHT",
    "PREDICTORS",
    "SEEN",
    "SIMILARITIES",
    "UNIFORM",
    "among_goals",
    "beside_unspecified",
    "fitted_temperatures",
    "likeness",
    "log_softmax",
    "outright_belief",
    "role_play",
]

Array = npt.NDArray[np.float64]

GOALSCOPE = "goalscope"
"""With the calibration known at the time of the measurement."""

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

SEEN = {True: "goalscope, goal seen", False: "goalscope, goal unseen"}
"""goalscope where its adapter was fitted on the true goal's text, and where it was not."""

PREDICTORS = (GOALSCOPE, AS_IN_PAPER, *SEEN.values(), UNIFORM, GOALS_ALONE, *SIMILARITIES, OUTRIGHT)
"""All predictors, in the order of the tables."""

FOLDS = 5
"""Number of folds for cross-fitting temperatures."""

FITTED_FROM = 20
"""Minimum number of groups for fitting a temperature.

With fewer, all predictions are often right, so the best temperature is 0 and the first wrong one
has an unbounded loss.
"""

TEMPERATURES = np.geomspace(1e-3, 1e2, 51)
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
    return among_goals(np.array(result["role-play"], dtype=np.float64), calibration)


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
    losses = np.array([_losses(cell, table) for cell, table in cells])
    best = [float(TEMPERATURES[(losses[fold != k].sum(axis=0)).argmin()]) for k in range(FOLDS)]
    return [best[k] for k in fold]


def _losses(cell: Measured, table: Array) -> Array:
    """[temperatures] log-loss of a dialogue, summed over its turns."""
    beliefs = log_softmax(table / TEMPERATURES[:, None, None])
    return -beliefs[:, :, cell[0]["case"]["truth"]].sum(axis=1)


def log_softmax(values: Array) -> Array:
    """[..., G] normalised log-probabilities in nats."""
    shifted = values - values.max(axis=-1, keepdims=True)
    return shifted - np.log(np.exp(shifted).sum(axis=-1, keepdims=True))
