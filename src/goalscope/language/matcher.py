"""Finds the thing that a phrase means, among those that are here.

Names that contain the words come first. If several or none do, the nearest in meaning are the
candidates, and the likelihood of the words given each candidate decides, as it does for goals.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from difflib import get_close_matches

import numpy as np

from goalscope.base.nouns import singular, singulars, words
from goalscope.models import LikelihoodModel
from goalscope.models.embedding import embedded
from goalscope.models.scoring import logprobs_of
from goalscope.prompts import render

_CANDIDATES = 8
_LETTERS = 5  # shortest word that is checked for a typo
_NEAR = 0.5  # smallest cosine of a thing whose name lacks the words
_NATS = 8.0  # weight of the cosine beside the log-likelihood
_ALIKE = 0.8  # smallest similarity (difflib) of a typo to a known word


class Matcher:
    """Picks names; an instance is a `goalscope.envs.Pick`.

    Args:
        model: Scores the words given each candidate; None to go by nearness in meaning alone.
        strict: Whether a name must share words with the phrase.
    """

    def __init__(self, model: LikelihoodModel | None = None, *, strict: bool = False) -> None:
        self._model, self._strict = model, strict

    def __call__(self, said: str, names: Sequence[str]) -> str:
        """The name that the words mean; "" if it is none of them. Deterministic."""
        names = [name for name in dict.fromkeys(names) if singulars(name)]
        spoken = mended(said, (word for name in names for word in singulars(name)))
        if not spoken or not names:
            return ""
        held = {name: singulars(name) for name in names}
        if exact := [name for name, own in held.items() if own == spoken]:
            return exact[0]
        named = [name for name, own in held.items() if {*spoken} <= {*own}]
        headed = [name for name in named if held[name][-1] == spoken[-1]]
        if few := headed or named:
            least = min(len(held[name]) for name in few)
            few = [name for name in few if len(held[name]) == least]
            return few[0] if len(few) == 1 else self._likeliest(said, few)
        within = [name for name, own in held.items() if {*own} <= {*spoken}]
        if headed := [name for name in within if held[name][-1] == spoken[-1]]:
            return max(headed, key=lambda name: len(held[name]))
        if self._strict:
            return ""
        vectors = embedded([said, *names])
        nearness = vectors[1:] @ vectors[0]
        order: list[int] = np.argsort(-nearness, kind="stable")[:_CANDIDATES].tolist()
        near = [names[i] for i in order if nearness[i] >= _NEAR]
        return self._likeliest(said, near) if near else ""

    def _likeliest(self, said: str, names: Sequence[str]) -> str:
        """The name with the largest log-likelihood of the words plus weighted cosine."""
        nearness = embedded([said, *names])
        value = _NATS * (nearness[1:] @ nearness[0])
        if self._model and len(names) > 1:
            contexts = [render("name", thing=name) for name in names]
            scores = logprobs_of(self._model, contexts, [said] * len(names))
            value = value + np.array([float(score.sum()) for score in scores])
        return names[int(np.argmax(value))]


def mended(text: str, known: Iterable[str]) -> list[str]:
    """The words of a text in the singular, with typos corrected to `known` words.

    A typo has five letters or more, and its first letter is right.
    """
    names = dict.fromkeys(known)
    return [_meant_by(word, names) for word in words(text)]


def _meant_by(word: str, names: Collection[str]) -> str:
    one = singular(word)
    if one in names or len(word) < _LETTERS:
        return one
    alike = [name for name in names if name[:1] == word[0]]
    for spelled in (one, word):
        if close := get_close_matches(spelled, alike, n=1, cutoff=_ALIKE):
            return close[0]
    return one
