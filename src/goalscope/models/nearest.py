"""Find the things whose texts are nearest to another, by meaning and by shared words."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import chain
from operator import attrgetter
from typing import Generic, TypeVar

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.nouns import singulars
from goalscope.models.embedding import embedded, group_sums, summed, unit

T = TypeVar("T")

_WORDS = 0.3  # weight of shared words, beside that of meaning
_FLAT, _LONG = 1.2, 0.75  # k1 and b of BM25 (Robertson & Zaragoza, 2009)


class Nearest(Generic[T]):
    """Finds the things nearest to a text, by meaning and by shared words.

    Args:
        things: Among which to find.
        texts: The texts that stand for one of them; by default, those that it names.
    """

    def __init__(
        self, things: Sequence[T], texts: Callable[[T], Sequence[str]] = attrgetter("texts")
    ) -> None:
        self.things = tuple(things)
        parts = [*map(texts, things)]
        self._owner = np.repeat(np.arange(len(parts)), [len(each) for each in parts])
        sums = summed([text for each in parts for text in each])
        ends = np.cumsum([len(each) for each in parts], dtype=int).tolist()
        wholes = [range(end - len(each), end) for each, end in zip(parts, ends, strict=True)]
        self._parts, self._whole = unit(sums), unit(group_sums(sums, wholes))
        words = [singulars(" ".join(each)) for each in parts]
        sizes = np.array([len(each) for each in words], dtype=int)
        self._ids = {word: id for id, word in enumerate(dict.fromkeys(chain(*words)))}
        self._words = np.fromiter((self._ids[word] for word in chain(*words)), np.int32)
        self._whose = np.repeat(np.arange(len(words)), sizes)
        mean = sizes.sum() / max(1, len(sizes))
        self._norm = _FLAT * (1 - _LONG + _LONG * sizes / max(1.0, mean))

    def __call__(self, text: str, most: int, *, without: T | None = None) -> list[T]:
        """The `most` nearest things, nearest first; not the one that is `without`."""
        if not self.things:
            return []
        vector = embedded([text])[0]
        best = np.full(len(self.things), -1.0)
        np.maximum.at(best, self._owner, self._parts @ vector)
        shared = self._shared(text)
        near = (best + self._whole @ vector) / 2 + _WORDS * shared
        order: list[int] = np.argsort(-near, kind="stable")[: most + 1].tolist()
        found = [self.things[i] for i in order]
        return [each for each in found if each != without][:most]

    def _shared(self, text: str) -> Array:
        """[N] words shared with a text, 1 for the most."""
        n = len(self.things)
        found = np.zeros(n)
        for word in dict.fromkeys(singulars(text)):
            if word in self._ids:
                counts = np.bincount(self._whose[self._words == self._ids[word]], minlength=n)
                holds = np.count_nonzero(counts)
                rarity = math.log(1 + (n - holds + 0.5) / (holds + 0.5))
                found += rarity * counts * (_FLAT + 1) / (counts + self._norm)
        return found / max(found.max(initial=0.0), 1e-9)
