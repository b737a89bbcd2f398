"""Baselines that are fitted on dialogues with known goals, as an adapter is.

They need no language model. Each scores all goals of a case by all that the person has said so far.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.inputs import shown
from goalscope.base.stats import log_softmax
from goalscope.base.types import Goal, InvalidInputError, Turn, pluralize
from goalscope.datasets.case import Case, case_to_json
from goalscope.datasets.goal_sets import chance
from goalscope.datasets.sources import read_source
from goalscope.experiment.baselines import TEMPERATURES, needed, so_far, temperature_losses
from goalscope.models.embedding import embedded

Features = Callable[[Sequence[str]], Any]
"""[N, F] features of texts, dense or sparse."""

Score = Callable[[Sequence[str], Sequence[str]], Array]
"""[T, G] how well each of G goals explains each of T texts, in any unit."""

HELD_OUT = 5
"""One in so many groups of dialogues is held out to choose a setting and a temperature."""

EM_STEPS = 5
FEATURES = 1000
"""Number of words, and of words and pairs of words in goals, that a regression knows."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """A fitted baseline; its temperature makes probabilities of its scores."""

    score: Score
    temperature: float

    def __call__(self, goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
        """[T, G] log-probabilities of the goals after each turn, in nats."""
        table = self.score([goal.text for goal in goals], so_far(turns))
        return log_softmax(table / self.temperature)


@cache
def training_cases(sources: tuple[str, ...], folder: str | None) -> tuple[Case, ...]:
    """The cases of sources of dialogues; see `read_source`."""
    where = Path(folder) if folder else None
    return tuple(case for name in sources for case in read_source(name, where).cases)


def cases_digest(cases: Sequence[Case]) -> str:
    """A short hash of cases."""
    text = json.dumps([case_to_json(case) for case in cases])
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def check_unseen(judged: Sequence[Case], training: Sequence[Case]) -> None:
    """Refuse to fit a baseline on a dialogue that is to judge it.

    Raises:
        InvalidInputError: The same words are in both, but for case and spaces.
    """
    learned = {_said(case) for case in training}
    if both := [case.id for case in judged if _said(case) in learned]:
        raise InvalidInputError(
            f"{pluralize(len(both), 'dialogue')} to be judged would also fit the baselines, for "
            f"example {shown(both[0])}. Fit on another split, or on a slice such as "
            "teach:train[100:] that leaves out what is judged."
        )


def _said(case: Case) -> str:
    return " ".join(" ".join(turn.utterance for turn in case.turns).casefold().split())


def fitted_on(sources: Sequence[str], folder: str | None, sha256: str) -> Mapping[str, Fitted]:
    """The baselines fitted on sources of dialogues, once in a process.

    Raises:
        InvalidInputError: The dialogues do not have this hash.
    """
    found, baselines = _fitted_on(tuple(sources), folder)
    if found != sha256:
        raise InvalidInputError(
            f"The dialogues of {', '.join(sources)} have changed since the experiment was planned. "
            "Run it again to plan with what they are now."
        )
    return baselines


@cache
def _fitted_on(sources: tuple[str, ...], folder: str | None) -> tuple[str, dict[str, Fitted]]:
    cases = training_cases(sources, folder)
    return cases_digest(cases), fit_baselines(cases)


def fit_baselines(cases: Sequence[Case]) -> dict[str, Fitted]:
    """Fit each of `FITTED_METHODS` on what people want in the end; the order does not matter.

    Raises:
        InvalidInputError: The cases have a single group, or no words.
    """
    cases = sorted((case for case in cases if case.truth is not None), key=repr)
    groups = sorted({case.group for case in cases})
    if len(groups) < 2:
        raise InvalidInputError(
            "Baselines are fitted on dialogues of one group, and their temperature on those of "
            "another, but all of these are in one group. Add dialogues of another group."
        )
    chance(0, "held out").shuffle(groups)
    held_out = {*groups[: -(-len(groups) // HELD_OUT)]}
    train = [case for case in cases if case.group not in held_out]
    if not all(re.search(r"\w", "".join(texts)) for texts in zip(*_pairs(train), strict=True)):
        raise InvalidInputError("The dialogues to fit on, or their goals, have no words.")
    judging = [case for case in cases if case.group in held_out]
    found: dict[str, Fitted] = {}
    for name, (method, settings) in FITTED_METHODS.items():
        tried = [(*_temperature(method(train, each), judging), each) for each in settings]
        _, temperature, setting = min(tried)
        found[name] = Fitted(method(cases, setting), temperature)
    return found


def _temperature(score: Score, cases: Sequence[Case]) -> tuple[float, float]:
    """The least log-loss over all turns, in nats, and the highest temperature that has it."""
    losses = np.zeros(len(TEMPERATURES))
    for case in cases:
        table = score([goal.text for goal in case.goals], so_far(case.turns))
        losses += temperature_losses(table, case.each_truth)
    least = float(losses.min())
    same = np.isclose(losses, least, rtol=1e-9)
    return least, float(TEMPERATURES[same].max())


def unigram(cases: Sequence[Case], background: float) -> Score:
    """P(words | goal), word by word, where a word of the goal draws each word that is said.

    P(w | g) = b P(w) + (1 - b) mean over v in g of P(w | v), with P(w | v) fitted by EM: Model 1 of
    Brown et al. (1993). Words that nobody said in training count for nothing.

    Args:
        cases: For training.
        background: b.
    """
    said: dict[str, list[str]] = {}
    for text, goal in _pairs(cases):
        said.setdefault(goal, []).append(text)
    words, parts = _counter(), _counter(binary=True)
    counts = words.fit_transform(map("\n".join, said.values()))
    member = _shares(parts.fit_transform(said))
    overall: Array = np.asarray(counts.sum(0)).ravel() / counts.sum()
    drawn = np.tile(overall, (member.shape[1], 1))

    def mixed(member: Any) -> Array:
        rest = 1 - (1 - background) * np.asarray(member.sum(1))
        return rest.reshape(-1, 1) * overall + (1 - background) * (member @ drawn)

    for _ in range(EM_STEPS):
        expected = drawn * (member.T @ counts.multiply(1 / mixed(member))).toarray()
        total = expected.sum(1, keepdims=True)
        np.divide(expected, total, out=drawn, where=total > 0)

    def score(goals: Sequence[str], texts: Sequence[str]) -> Array:
        return words.transform(texts) @ np.log(mixed(_shares(parts.transform(goals)))).T

    return score


def neighbours(cases: Sequence[Case], k: float) -> Score:
    """How like the goals of the k dialogues with the most similar words are, by TF-IDF."""
    texts, goals = zip(*_pairs(cases), strict=True)
    said, wanted = _tfidf(texts), _tfidf(goals, (1, 2))
    known, aims = said(texts), wanted(goals)

    def score(goals: Sequence[str], texts: Sequence[str]) -> Array:
        near: Array = (said(texts) @ known.T).toarray()
        nearest = np.argsort(-near, axis=1, kind="stable")[:, : int(k)]
        weight = np.take_along_axis(near, nearest, 1)
        likeness: Array = (aims @ wanted(goals).T).toarray()[nearest]
        total = np.maximum(weight.sum(1), np.finfo(float).tiny)
        return np.einsum("tk,tkg->tg", weight, likeness) / total[:, None]

    return score


def tfidf_regression(cases: Sequence[Case], penalty: float) -> Score:
    """Conditional logistic regression on TF-IDF of words and goals; see `_regression`."""
    texts, _ = zip(*_pairs(cases), strict=True)
    said = _tfidf(texts, max_features=FEATURES)
    wanted = _tfidf(_goals(cases), (1, 2), max_features=FEATURES)
    return _regression(cases, penalty, said, wanted)


def vector_regression(cases: Sequence[Case], penalty: float) -> Score:
    """Conditional logistic regression on static vectors; see `_regression`."""
    return _regression(cases, penalty, embedded, embedded)


def _regression(cases: Sequence[Case], penalty: float, said: Features, wanted: Features) -> Score:
    """Choose among the goals of a case by a x w(text) . w(goal) + s(text) . B w(goal).

    a and B maximise the mean log-probability of the true goals after one turn of each case, drawn
    at random, less penalty / 2N x |B|^2.

    Args:
        cases: N for training.
        penalty: Of B.
        said: s.
        wanted: w.
    """
    texts = [chance(n, case.id).choice(so_far(case.turns)) for n, case in enumerate(cases)]
    goals = {goal: n for n, goal in enumerate(_goals(cases))}
    table, own = wanted([*goals]), said(texts)
    blocks = [table[[goals[goal.text] for goal in case.goals]] for case in cases]
    cosines = [block @ row for block, row in zip(blocks, _dense(wanted(texts)), strict=True)]
    truths = [case.goals.index(case.true_goal) for case in cases]
    shape = own.shape[1], table.shape[1]

    def objective(parameters: Array) -> tuple[float, Array]:
        weight, matrix = parameters[0], parameters[1:].reshape(shape)
        loss, slope = 0.0, 0.0
        rows = own @ matrix
        for n, (block, cosine, truth) in enumerate(zip(blocks, cosines, truths, strict=True)):
            belief = log_softmax(block @ rows[n] + weight * cosine)
            loss -= belief[truth]
            error = np.exp(belief)
            error[truth] -= 1
            slope += error @ cosine
            rows[n] = block.T @ error
        gradient = own.T @ rows + penalty * matrix
        loss += penalty / 2 * np.vdot(matrix, matrix)
        return float(loss) / len(cases), np.append(slope, gradient) / len(cases)

    found = needed("scipy.optimize").minimize(
        objective,
        np.append(1.0, np.zeros(shape)),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": 60, "maxcor": 5},
    )
    weight, matrix = found.x[0], found.x[1:].reshape(shape)

    def score(goals: Sequence[str], texts: Sequence[str]) -> Array:
        aims = _dense(wanted(goals))
        return (weight * _dense(wanted(texts)) + said(texts) @ matrix) @ aims.T

    return score


FITTED_METHODS: Mapping[str, tuple[Callable[[Sequence[Case], float], Score], Sequence[float]]] = {
    "unigram": (unigram, (0.1, 0.3, 0.5, 0.7)),
    "kNN": (neighbours, (5, 10, 20, 40)),
    "TF-IDF fitted": (tfidf_regression, (0.01, 0.1, 1.0)),
    "vectors fitted": (vector_regression, (0.01, 0.1, 1.0)),
}
"""The methods by their names in tables, with the settings to choose from."""


def _pairs(cases: Sequence[Case]) -> list[tuple[str, str]]:
    """All words and the goal of each dialogue, once, in however many cases it is."""
    found = {
        (case.group, case.id, so_far(case.turns)[-1], case.true_goal.text): None for case in cases
    }
    return [(text, goal) for *_, text, goal in found]


def _goals(cases: Sequence[Case]) -> list[str]:
    return sorted({goal.text for case in cases for goal in case.goals})


def _counter(**options: Any) -> Any:
    return needed("sklearn.feature_extraction.text").CountVectorizer(
        token_pattern=r"\w+", **options
    )


def _shares(counts: Any) -> Any:
    """The rows of a sparse matrix, so that each sums to 1; zero stays zero."""
    return needed("sklearn.preprocessing").normalize(counts, "l1")


def _tfidf(texts: Sequence[str], ngram_range: tuple[int, int] = (1, 1), **options: Any) -> Features:
    vectorizer = needed("sklearn.feature_extraction.text").TfidfVectorizer(
        token_pattern=r"\w+", sublinear_tf=True, ngram_range=ngram_range, **options
    )
    return vectorizer.fit(texts).transform


def _dense(matrix: Any) -> Array:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, np.float64)
