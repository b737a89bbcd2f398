"""Baselines that are fitted on nothing: similarity of words or meaning, a model that is asked."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Sequence
from string import ascii_uppercase
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.optional_packages import package
from goalscope.base.stats import log_softmax
from goalscope.base.types import Goal, GoalscopeError, Message, Turn
from goalscope.models import Generator, LanguageModel, LikelihoodModel
from goalscope.models.embedding import embedded
from goalscope.prompts import render

TEMPERATURES = np.geomspace(1e-3, 1e2, 51)

_STOPWORDS = frozenset({
    "a", "an", "and", "are", "as", "at", "be", "been", "being", "but", "by", "did", "do",
    "does", "for", "from", "had", "has", "have", "he", "her", "his", "how", "i", "if", "in",
    "into", "is", "it", "its", "more", "most", "no", "not", "of", "on", "or", "she", "so",
    "than", "that", "the", "their", "them", "then", "there", "these", "they", "this", "those",
    "to", "was", "we", "were", "what", "when", "where", "which", "who", "why", "will", "with",
    "you", "your",
})  # fmt: skip


def temperature_losses(table: Array, truths: Sequence[int | None]) -> Array:
    """[temperatures] log-loss of the true goals in nats, summed over the turns of [T, G] scores.

    Turns whose true goal is not listed (None) do not count.
    """
    beliefs = log_softmax(table / TEMPERATURES[:, None, None])
    losses = np.zeros(len(TEMPERATURES))
    for turn, truth in enumerate(truths):
        if truth is not None:
            losses -= beliefs[:, turn, truth]
    return losses


def overlap(text: str, others: Sequence[str]) -> Array:
    """[N] share of words, of two texts' together, that are in both (Jaccard); stopwords out."""
    own = _words(text) - _STOPWORDS
    sets = [_words(other) - _STOPWORDS for other in others]
    return np.array([len(own & each) / max(1, len(own | each)) for each in sets], np.float64)


def tfidf(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] cosines of each goal with all that the person has said so far."""
    text: Any = needed("sklearn.feature_extraction.text")
    vectorizer = text.TfidfVectorizer()
    try:
        matrix = vectorizer.fit_transform([goal.text for goal in goals])
    except ValueError:  # no goal has a word
        return np.zeros((len(turns), len(goals)))
    said = vectorizer.transform(so_far(turns))
    return np.asarray((said @ matrix.T).toarray(), np.float64)


def bm25(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] BM25 of each goal, with all that the person has said so far as the query."""
    bm25s: Any = needed("bm25s")
    logging.getLogger("bm25s").setLevel(logging.WARNING)
    words = [re.findall(r"\w+", goal.text.lower()) or ["?"] for goal in goals]
    index = bm25s.BM25()
    index.index(words, show_progress=False)
    known = {word for each in words for word in each}
    rows = np.zeros((len(turns), len(goals)))
    for row, text in enumerate(so_far(turns)):
        asked = [word for word in re.findall(r"\w+", text.lower()) if word in known]
        if asked:
            rows[row] = index.get_scores(asked)
    return rows


def embedding(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] cosines of static sentence embeddings: each goal with all words so far."""
    said = embedded(so_far(turns)).astype(np.float64)
    return said @ embedded([goal.text for goal in goals]).astype(np.float64).T


def outright(
    model: Generator, goals: Sequence[Goal], turns: Sequence[Turn]
) -> list[dict[str, float | None]]:
    """What the model answers after each turn to "which of these is the goal? how sure are you?".

    Returns:
        One for each turn: index of the `goal`, and how `sure` (0 to 1); both None where the answer
        could not be read, or the goals leave no room for it.
    """
    numbers = [str(i + 1) for i in range(len(goals))]
    schema = {
        "type": "object",
        "properties": {
            "goal": {"enum": numbers},
            "sure": {"enum": [f"{percent}%" for percent in range(0, 101, 5)]},
        },
        "required": ["goal", "sure"],
        "additionalProperties": False,
    }
    prompts = _asked(model, goals, turns, names=numbers, room=40)
    return [
        _read(model.generate(prompt, max_tokens=40, schema=schema).text if prompt else "", numbers)
        for prompt in prompts
    ]


def outright_letters(
    model: LikelihoodModel, goals: Sequence[Goal], turns: Sequence[Turn]
) -> list[list[float]] | None:
    """[T, G] log-probabilities of each goal's letter, as the model's answer to "which is it?".

    Uniform after a turn if the goals leave no room for it; None if there are more goals than
    letters.
    """
    if len(goals) > len(ascii_uppercase):
        return None
    letters = ascii_uppercase[: len(goals)]
    rows = [
        [row.sum() for row in model.token_logprobs([prompt] * len(goals), letters)]
        if prompt
        else [0.0] * len(goals)
        for prompt in _asked(model, goals, turns, names=letters, room=4)
    ]
    return log_softmax(np.array(rows, np.float64)).tolist()


def _asked(
    model: LanguageModel,
    goals: Sequence[Goal],
    turns: Sequence[Turn],
    *,
    names: Sequence[str],
    room: int,
) -> list[list[Message] | None]:
    """The prompt after each turn, which loses its oldest turns to leave room for the answer.

    None if the goals alone leave no room.
    """
    prompts: list[list[Message] | None] = []
    for t in range(len(turns)):
        for start in range(t + 1):
            prompt = render("outright", goals=goals, names=names, turns=turns[start : t + 1])
            if model.count_tokens(prompt) + room <= model.context_size:
                prompts.append(prompt)
                break
        else:
            prompts.append(None)
    return prompts


def _read(text: str, numbers: Sequence[str]) -> dict[str, float | None]:
    try:
        given = json.loads(text)
        goal, sure = numbers.index(str(given["goal"])), float(str(given["sure"]).rstrip("%")) / 100
    except (ValueError, LookupError, TypeError):
        return {"goal": None, "sure": None}
    return {"goal": goal, "sure": sure} if 0 <= sure <= 1 else {"goal": None, "sure": None}


def so_far(turns: Sequence[Turn]) -> list[str]:
    """All that the person has said after each turn."""
    words = [turn.utterance for turn in turns]
    return ["\n".join(words[: t + 1]) for t in range(len(words))]


def _words(text: str) -> set[str]:
    return set(re.findall(r"\w+", text.lower()))


def needed(module: str) -> Any:
    """A module of the optional packages.

    Raises:
        GoalscopeError: Its package is missing.
    """
    return package(module, "The baselines need", GoalscopeError)
