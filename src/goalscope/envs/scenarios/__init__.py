"""Scenarios with what they call for, and retrieval of those nearest to what a person says.

A small model knows few of them, so the nearest are put into its prompt (retrieval-augmented
generation; Lewis et al., 2020).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import chain
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.nouns import singulars
from goalscope.models.embedding import embedded, group_sums, summed, unit

_WORDS = 0.3  # weight of shared words, beside that of meaning
_FLAT, _LONG = 1.2, 0.75  # k1 and b of BM25 (Robertson & Zaragoza, 2009)


@dataclass(frozen=True, slots=True)
class Scenario:
    """An aim, and what it calls for.

    Attributes:
        id: Its name.
        domain: Such as "grocery".
        aim: In one phrase.
        said: First utterances of people who have it.
        needed: What it cannot do without, the most important first.
        nice: What many people would like.
        unwanted: What the words may suggest although nobody wants it here.
        room: What is in the room, where that matters.
    """

    id: str
    domain: str
    aim: str
    said: tuple[str, ...]
    needed: tuple[str, ...]
    nice: tuple[str, ...] = ()
    unwanted: tuple[str, ...] = ()
    room: str = ""


class Nearest:
    """Finds the scenarios nearest to a text, by meaning and by shared words.

    Args:
        scenarios: Among which to find.
    """

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        self.scenarios = tuple(scenarios)
        texts = [(each.aim, *each.said) for each in scenarios]
        self._owner = np.repeat(np.arange(len(texts)), [len(each) for each in texts])
        sums = summed([text for each in texts for text in each])
        ends = np.cumsum([len(each) for each in texts], dtype=int).tolist()
        wholes = [range(end - len(each), end) for each, end in zip(texts, ends, strict=True)]
        self._parts, self._whole = unit(sums), unit(group_sums(sums, wholes))
        words = [singulars(" ".join(each)) for each in texts]
        sizes = np.array([len(each) for each in words], dtype=int)
        self._ids = {word: id for id, word in enumerate(dict.fromkeys(chain(*words)))}
        self._words = np.fromiter((self._ids[word] for word in chain(*words)), np.int32)
        self._whose = np.repeat(np.arange(len(words)), sizes)
        mean = sizes.sum() / max(1, len(sizes))
        self._norm = _FLAT * (1 - _LONG + _LONG * sizes / max(1.0, mean))

    def __call__(self, text: str, most: int, *, without: str = "") -> list[Scenario]:
        """The `most` nearest scenarios, nearest first; not the one whose id is `without`."""
        if not self.scenarios:
            return []
        vector = embedded([text])[0]
        best = np.full(len(self.scenarios), -1.0)
        np.maximum.at(best, self._owner, self._parts @ vector)
        shared = self._shared(text)
        near = (best + self._whole @ vector) / 2 + _WORDS * shared
        order: list[int] = np.argsort(-near, kind="stable")[: most + 1].tolist()
        found = [self.scenarios[i] for i in order]
        return [each for each in found if each.id != without][:most]

    def _shared(self, text: str) -> Array:
        """[N] words shared with a text, 1 for the most."""
        n = len(self.scenarios)
        found = np.zeros(n)
        for word in dict.fromkeys(singulars(text)):
            if word in self._ids:
                counts = np.bincount(self._whose[self._words == self._ids[word]], minlength=n)
                holds = np.count_nonzero(counts)
                rarity = math.log(1 + (n - holds + 0.5) / (holds + 0.5))
                found += rarity * counts * (_FLAT + 1) / (counts + self._norm)
        return found / max(found.max(initial=0.0), 1e-9)


@cache
def shipped_scenarios(domain: str) -> Nearest:
    """The scenarios that come with goalscope for a domain."""
    folder = files("goalscope.envs.scenarios")
    rows: Iterator[dict[str, Any]] = (
        json.loads(line)
        for file in sorted(folder.iterdir(), key=lambda each: each.name)
        if file.name.endswith(".jsonl")
        for line in file.read_text(encoding="utf-8").splitlines()
    )
    lists = ("said", "needed", "nice", "unwanted")
    found = (row | {name: tuple(row[name]) for name in lists} for row in rows)
    return Nearest([Scenario(**row) for row in found if row["domain"] == domain])
