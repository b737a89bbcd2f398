"""Which of the things that are here a person's words mean.

Names that hold the words come first; where several or none do, those nearest in meaning are the
candidates, and the likelihood of the words given each of them decides, as it does for goals.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

import numpy as np

from goalscope.models import LikelihoodModel
from goalscope.models.embedding import embedded
from goalscope.models.scoring import logprobs_of
from goalscope.prompts import render
from goalscope.words import singulars

__all__ = ["Picker", "mended"]

_CANDIDATES = 8
_LETTERS = 5  # of a word that may be a slip
_NEAR = 0.5  # cosine from which on a thing may be meant by words that its name lacks
_NATS = 8.0  # that a cosine of 1 counts for, beside the likelihood
_ALIKE = 0.8  # share of letters in common, from which on a word is a slip of another


class Picker:
    """Picks names; an instance is a `goalscope.envs.Pick`.

    Args:
        model: Scores the words given each candidate; None where nearness in meaning shall do.
    """

    def __init__(self, model: LikelihoodModel | None = None) -> None:
        self._model = model

    def __call__(self, said: str, names: Sequence[str]) -> str:
        """The name that the words mean; "" where it is none of them.

        The same words and names always give the same one.
        """
        names = list(dict.fromkeys(names))
        words = mended(singulars(said), (word for name in names for word in singulars(name)))
        if not words or not names:
            return ""
        held = {name: singulars(name) for name in names}
        if exact := [name for name, own in held.items() if own == words]:
            return exact[0]
        named = [name for name, own in held.items() if {*words} <= {*own}]
        headed = [name for name in named if held[name][-1] == words[-1]]
        if few := headed or named:
            least = min(len(held[name]) for name in few)
            few = [name for name in few if len(held[name]) == least]
            return few[0] if len(few) == 1 else self._likeliest(said, few)
        within = [name for name, own in held.items() if {*own} <= {*words}]
        if headed := [name for name in within if held[name][-1] == words[-1]]:
            return max(headed, key=lambda name: len(held[name]))
        vectors = embedded([said, *names])
        nearness = vectors[1:] @ vectors[0]
        order: list[int] = np.argsort(-nearness, kind="stable")[:_CANDIDATES].tolist()
        near = [names[i] for i in order if nearness[i] >= _NEAR]
        return self._likeliest(said, near) if near else ""

    def _likeliest(self, said: str, names: Sequence[str]) -> str:
        """The name under which the words are likeliest; nearness in meaning counts as nats, too."""
        nearness = embedded([said, *names])
        value = _NATS * (nearness[1:] @ nearness[0])
        if self._model and len(names) > 1:
            contexts = [render("name", thing=name) for name in names]
            scores = logprobs_of(self._model, contexts, [said] * len(names))
            value = value + np.array([float(score.sum()) for score in scores])
        return names[int(np.argmax(value))]


def mended(words: Sequence[str], known: Iterable[str]) -> list[str]:
    """Words in the singular, slips of the pen in them mended by those that are `known`.

    A slip has five letters or more, and the first of them is right.
    """
    names = dict.fromkeys(known)
    return [
        word if word in names or len(word) < _LETTERS else _meant_by(word, names) for word in words
    ]


def _meant_by(word: str, names: Iterable[str]) -> str:
    alike = [name for name in names if name[:1] == word[0]]
    return next(iter(get_close_matches(word, alike, n=1, cutoff=_ALIKE)), word)
