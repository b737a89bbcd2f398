"""Baselines of goal inference: similarity of words or meaning, and a model that is asked."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.base.optional_packages import package
from goalscope.base.types import Goal, GoalscopeError, Turn
from goalscope.models import Generator
from goalscope.models.embedding import embedded
from goalscope.prompts import render

Array = npt.NDArray[np.float64]

_STOPWORDS = frozenset({
    "a", "an", "and", "are", "as", "at", "be", "been", "being", "but", "by", "did", "do",
    "does", "for", "from", "had", "has", "have", "he", "her", "his", "how", "i", "if", "in",
    "into", "is", "it", "its", "more", "most", "no", "not", "of", "on", "or", "she", "so",
    "than", "that", "the", "their", "them", "then", "there", "these", "they", "this", "those",
    "to", "was", "we", "were", "what", "when", "where", "which", "who", "why", "will", "with",
    "you", "your",
})  # fmt: skip


def overlap(text: str, others: Sequence[str]) -> Array:
    """[N] share of words, of two texts' together, that are in both (Jaccard); stopwords out."""
    own = _words(text) - _STOPWORDS
    sets = [_words(other) - _STOPWORDS for other in others]
    return np.array([len(own & each) / max(1, len(own | each)) for each in sets], np.float64)


def tfidf(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] cosines of each goal with all that the person has said so far."""
    text: Any = _needed("sklearn.feature_extraction.text")
    vectorizer = text.TfidfVectorizer()
    try:
        matrix = vectorizer.fit_transform([goal.text for goal in goals])
    except ValueError:  # no goal has a word
        return np.zeros((len(turns), len(goals)))
    said = vectorizer.transform(_so_far(turns))
    return np.asarray((said @ matrix.T).toarray(), np.float64)


def bm25(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] BM25 of each goal, with all that the person has said so far as the query."""
    bm25s: Any = _needed("bm25s")
    logging.getLogger("bm25s").setLevel(logging.WARNING)
    words = [re.findall(r"\w+", goal.text.lower()) or ["?"] for goal in goals]
    index = bm25s.BM25()
    index.index(words, show_progress=False)
    known = {word for each in words for word in each}
    rows = np.zeros((len(turns), len(goals)))
    for row, text in enumerate(_so_far(turns)):
        asked = [word for word in re.findall(r"\w+", text.lower()) if word in known]
        if asked:
            rows[row] = index.get_scores(asked)
    return rows


def embedding(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] cosines of static sentence embeddings: each goal with all words so far."""
    said = embedded(_so_far(turns)).astype(np.float64)
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
    answers: list[dict[str, float | None]] = []
    for t in range(len(turns)):
        answer: dict[str, float | None] = {"goal": None, "sure": None}
        for start in range(t + 1):
            prompt = render("outright", goals=goals, turns=turns[start : t + 1])
            if model.count_tokens(prompt) + 40 <= model.context_size:
                reply = model.generate(prompt, max_tokens=40, schema=schema)
                answer = _read(reply.text, numbers)
                break
        answers.append(answer)
    return answers


def _read(text: str, numbers: Sequence[str]) -> dict[str, float | None]:
    try:
        given = json.loads(text)
        goal, sure = numbers.index(str(given["goal"])), float(str(given["sure"]).rstrip("%")) / 100
    except (ValueError, LookupError, TypeError):
        return {"goal": None, "sure": None}
    return {"goal": goal, "sure": sure} if 0 <= sure <= 1 else {"goal": None, "sure": None}


def _so_far(turns: Sequence[Turn]) -> list[str]:
    words = [turn.utterance for turn in turns]
    return ["\n".join(words[: t + 1]) for t in range(len(words))]


def _words(text: str) -> set[str]:
    return set(re.findall(r"\w+", text.lower()))


def _needed(module: str) -> Any:
    return package(module, "The baselines need", GoalscopeError)
