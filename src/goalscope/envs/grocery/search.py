"""Search by meaning: full text, word embeddings and head nouns, fused by reciprocal rank."""

from __future__ import annotations

import sqlite3
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from functools import cached_property
from importlib.resources import files

import numpy as np

from goalscope.base.arrays import Floats
from goalscope.base.inputs import read_table
from goalscope.base.nouns import head_nouns, head_words, singular, singulars, words
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.language.matcher import mended
from goalscope.models.embedding import embedded

WORDS = read_table(files("goalscope.envs.grocery") / "data" / "words.toml")
"""What people call things, and words that say little; its comments say which."""


_DEPTH = 100  # items that each ranking contributes to the fusion
_RANK_OFFSET = 20.0  # the k of reciprocal rank fusion: a place counts 1 / (k + place)
_CATEGORY_WEIGHT = 0.06  # of a category among the best items, against 1 / k for a first place
_CATEGORY_NEARNESS = 0.5  # weight of a generic name's category, against the name itself
_MOST_KINDS = 800  # generic names kept, the most frequent first

_QUALITIES = frozenset(WORDS["qualities"].split())
_EMPTY = frozenset(WORDS["empty"].split())
LABELS = frozenset(WORDS["labels"].split())
OF_ITS_OWN = frozenset(WORDS["own"].split())


class Search:
    """Finds items of one catalogue by what is meant; deterministic and offline.

    The index is built at first use.
    """

    def __init__(self, catalogue: Catalogue) -> None:
        self._items = catalogue.items

    def search(self, text: str, limit: int) -> list[Item]:
        """The items nearest in meaning to `text`, best first, at most `limit`."""
        said = singulars(text)
        if not said or limit < 1:
            return []
        nearness = _nearness(self._vectors, text)
        terms = " OR ".join(f'"{word}"' for word in dict.fromkeys(words(text)[:32]))
        matches = self._index.execute(
            "SELECT rowid FROM names WHERE names MATCH ? AND rank MATCH 'bm25(1.0, 0.3)' "
            "ORDER BY rank LIMIT ?",
            (terms, _DEPTH),
        )
        headed = sorted(  # items that are what the last word says, best covered by the words first
            (sum(word not in self._words[i] for word in said), -float(nearness[i]), i)
            for i in self._heads.get(said[-1], ())
        )
        near: list[int] = np.argsort(-nearness, kind="stable").tolist()
        rankings = ([i for (i,) in matches], near, [i for *_, i in headed])
        scores: defaultdict[int, float] = defaultdict(float)
        for ranking in rankings:
            for place, index in enumerate(ranking[:_DEPTH], start=1):
                scores[index] += 1 / (_RANK_OFFSET + place)
        best = sorted(scores, key=lambda i: (-scores[i], i))[:20]
        shares: defaultdict[str, float] = defaultdict(float)
        whole = sum(scores[i] for i in best)
        for index in best:
            shares[self._items[index].category] += scores[index] / whole
        for index in scores:
            scores[index] += _CATEGORY_WEIGHT * shares[self._items[index].category]
        return [self._items[i] for i in sorted(scores, key=lambda i: (-scores[i], i))[:limit]]

    def spellings(self, phrase: str) -> Iterator[str]:
        """`phrase` as said, then in the shop's words; last, what a bottle of it holds.

        In the shop's words, it is first as it is, then without words that name nothing, then with
        slips of the pen mended.
        """
        yield phrase
        found, rest = list[str](), phrase
        while rest:
            said = self.translated(rest)
            right = self.translated(" ".join(mended(rest, self._holding)))
            found += [said, *(self.translated(self.pruned(text)) for text in (said, right))]
            rest = rest.partition(" of ")[2]
        yield from dict.fromkeys(text for text in found if text != phrase)

    def translated(self, text: str) -> str:
        """`text` in the words of the catalogue: "crisps" as "potato chips"."""
        longest = max(map(len, self._synonyms), default=0)
        rest, said = singulars(text), list[str]()
        while rest:
            sizes = range(min(longest, len(rest)), 0, -1)
            size = next((size for size in sizes if (*rest[:size],) in self._synonyms), 0)
            said.append(self._synonyms[(*rest[:size],)] if size else rest[0])
            rest = rest[size or 1 :]
        return " ".join(said)

    def pruned(self, phrase: str) -> str:
        """`phrase` without words that name nothing: "real parmesan", "salt n vinegar"."""
        said = singulars(phrase)
        empty = {word for word in said if len(word) <= 2 and word not in self._holding}
        return " ".join(word for word in said if word not in empty | _EMPTY)

    def named(self, phrase: str) -> list[Item]:
        """All items whose names hold every word of `phrase`."""
        said = singulars(phrase)
        common = self._holding.get(said[0], set[int]()) if said else set[int]()
        for word in said[1:]:
            common = common & self._holding.get(word, set[int]())
        return [self._items[place] for place in sorted(common)]

    def ending(self, phrase: str) -> list[Item]:
        """Items with whose whole name `phrase` ends: "white granulated sugar".

        Before a name of one word stand mere qualities: dates for "fresh dates", but no steak for a
        "unicorn steak". No word of a label does, since "vegan" is meant where it is said.
        """
        said, found = singulars(phrase), list[Item]()
        for item in [self._items[i] for i in self._heads.get(said[-1], ())] if said else ():
            size = len(singulars(item.name))
            before, ends = {*said[:-size]}, said[-size:] == singulars(item.name)
            if ends and (size > 1 or before <= _QUALITIES) and not before & LABELS:
                found.append(item)
        return found

    def plainness(self, item: Item, phrase: str) -> tuple[int, int, int, int]:
        """How plainly the item is `phrase`, the plainest least.

        By its labels, by how many words of its name are other things (garlic in a bread), by how
        many it has, and by how many are no mere qualities.
        """
        others = set(singulars(item.name)) - set(singulars(phrase))
        things = sum(word in self._heads for word in others)
        return len(others & LABELS), things, len(words(item.name)), len(others - _QUALITIES)

    def kinds(self, text: str, limit: int) -> list[str]:
        """Generic names such as "flour" that may serve `text`, nearest first.

        They are the endings of the catalogue's own names, so that each leads to items.
        """
        names, vectors = self._kinds
        if not names or not words(text) or limit < 1:
            return []
        near: list[int] = np.argsort(-_nearness(vectors, text), kind="stable").tolist()
        return [names[i] for i in near[:limit]]

    @cached_property
    def _synonyms(self) -> dict[tuple[str, ...], str]:
        """For each name of which the shop has nothing, another one of which it has something."""
        known: dict[tuple[str, ...], str] = {}
        for line in WORDS["same"]:
            names = line.split(", ")
            there = next((name for name in reversed(names) if self.named(name)), "")
            known |= {
                (*singulars(name),): there
                for name in names
                if there and (name in OF_ITS_OWN or not self.named(name))
            }
        return known

    @cached_property
    def _words(self) -> list[frozenset[str]]:
        return [frozenset(singulars(item.name)) for item in self._items]

    @cached_property
    def _holding(self) -> dict[str, set[int]]:
        """For each word, the places of the items whose names hold it."""
        places: defaultdict[str, set[int]] = defaultdict(set)
        for index, held in enumerate(self._words):
            for word in held:
                places[word].add(index)
        return dict(places)

    @cached_property
    def _heads(self) -> dict[str, list[int]]:
        """For each head noun, the places of the items that may be it."""
        heads: defaultdict[str, list[int]] = defaultdict(list)
        for index, item in enumerate(self._items):
            for part in dict.fromkeys(singular(w) for w in head_nouns(item.name)):
                heads[part].append(index)
        return dict(heads)

    @cached_property
    def _kinds(self) -> tuple[list[str], Floats]:
        """The generic names, and their vectors drawn towards those of their categories."""
        counts: Counter[str] = Counter()
        spelled: defaultdict[str, Counter[str]] = defaultdict(Counter)
        categories: defaultdict[str, Counter[str]] = defaultdict(Counter)
        for item in self._items:
            for phrase in _endings(item.name):
                kind = " ".join(singular(word) for word in phrase.split())
                counts[kind] += 1
                spelled[kind][phrase] += 1
                categories[kind][item.category] += 1
        kept = sorted(counts, key=lambda kind: (-counts[kind], kind))[:_MOST_KINDS]
        names = [spelled[kind].most_common(1)[0][0] for kind in kept]
        usual = [categories[kind].most_common(1)[0][0] or "groceries" for kind in kept]
        drawn = embedded(names) + _CATEGORY_NEARNESS * embedded(usual)
        return names, drawn.astype(np.float32)

    @cached_property
    def _index(self) -> sqlite3.Connection:
        """Full text of names and categories, for all threads."""
        index = sqlite3.connect(":memory:", check_same_thread=False)
        index.execute("CREATE VIRTUAL TABLE names USING fts5(name, category, tokenize='porter')")
        index.executemany(
            "INSERT INTO names (rowid, name, category) VALUES (?, ?, ?)",
            ((i, item.name, item.category) for i, item in enumerate(self._items)),
        )
        index.commit()
        return index

    @cached_property
    def _vectors(self) -> Floats:
        """float32, items x 256, each row of length one."""
        return embedded([item.name for item in self._items])


def _endings(name: str) -> Iterable[str]:
    """The last word of a name, and its last two where the first of them is no mere quality."""
    head = [word for word in head_words(name) if not word.isdigit()]
    if head and head[-1] not in _QUALITIES and len(head[-1]) > 2:
        yield head[-1]
        if len(head) > 1 and head[-2] not in _QUALITIES and len(head[-2]) > 2:
            yield f"{head[-2]} {head[-1]}"


def _nearness(vectors: Floats, text: str) -> Floats:
    """Cosines; without BLAS, whose threads cost more than they save where cores are busy."""
    return np.einsum("ij,j->i", vectors, embedded([text])[0])
