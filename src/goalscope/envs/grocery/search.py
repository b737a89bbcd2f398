"""Search by meaning: full text, word embeddings and head nouns, fused by reciprocal rank."""

from __future__ import annotations

import os
import sqlite3
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import platformdirs

from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.synonyms import translator
from goalscope.models.embedding import embedded
from goalscope.picking import mended
from goalscope.words import (
    head_nouns,
    head_words,
    singular,
    singulars,
    words,
)

__all__ = ["Search"]

_Vectors = npt.NDArray[np.float32]

_FORMAT = 1
"""Part of the cache's file name; raise it when what is kept changes."""

_DEPTH = 100
"""How many items each ranking contributes to the fusion."""

_RANK_OFFSET = 20.0
"""The k of reciprocal rank fusion: a place counts 1 / (k + place)."""

_CATEGORY_WEIGHT = 0.06
"""Weight of an item's category among the best items, against 1 / k for a first place."""

_CATEGORY_NEARNESS = 0.5
"""Weight of the nearness of a generic name's category, against that of the name itself."""

_MOST_KINDS = 800
"""Generic names kept, the most frequent first."""

_QUALITIES = frozenset({
    "organic", "fresh", "large", "medium", "small", "extra", "pure", "natural", "classic",
    "original", "premium", "mini", "light", "low", "free", "fat", "reduced", "sodium", "unsalted",
    "salted", "whole", "mixed", "plain", "fine", "gluten", "dairy", "sugar", "and", "&", "the",
    "ready", "raw", "frozen", "dried", "value", "family", "size", "style", "big", "no", "added",
    "vegan", "real", "best", "new", "a", "can",
})  # fmt: skip
"""Words that say which one but not what it is, so that no generic name begins with them."""

_EMPTY = frozenset({
    "a", "an", "and", "any", "best", "big", "cheap", "cheapest", "decent", "favourite", "favorite",
    "few", "for", "from", "good", "large", "little", "lovely", "nice", "normal", "of", "ordinary",
    "other", "proper", "real", "regular", "small", "some", "standard", "tasty", "the", "default",
    "with",
})  # fmt: skip
"""Words of a phrase that tell nothing of which thing is meant, if no name here holds them all."""

_LABELS = frozenset({
    "vegan", "free", "organic", "diet", "decaf", "plant", "halal", "kosher", "low", "reduced",
})  # fmt: skip
"""Words of labels, for people who ask for them: "gluten-free", "plant-based"."""


class Search:
    """Finds items of one catalogue by what is meant; deterministic and offline.

    The index is built at first use and kept in the user's cache folder.
    """

    def __init__(self, catalogue: Catalogue, *, cache_dir: Path | None = None) -> None:
        """Search `catalogue`, keeping the index in `cache_dir` (the user's cache by default)."""
        self._catalogue = catalogue
        self._cache_dir = cache_dir or platformdirs.user_cache_path("goalscope")

    def search(self, text: str, limit: int) -> list[Item]:
        """The items nearest in meaning to `text`, best first, at most `limit`."""
        query = singulars(text)
        if not query or limit < 1:
            return []
        nearness = _nearness(self._vectors, embedded([text])[0])
        near = _top(nearness, _DEPTH)
        scores: defaultdict[int, float] = defaultdict(float)
        for ranking in (self._by_words(text), near, self._by_head(query, nearness)):
            for place, index in enumerate(ranking, start=1):
                scores[index] += 1 / (_RANK_OFFSET + place)
        items = self._catalogue.items
        best = sorted(scores, key=lambda i: (-scores[i], i))[:20]
        shares: defaultdict[str, float] = defaultdict(float)
        whole = sum(scores[i] for i in best)
        for index in best:
            shares[items[index].category] += scores[index] / whole
        for index in scores:
            scores[index] += _CATEGORY_WEIGHT * shares[items[index].category]
        return [items[i] for i in sorted(scores, key=lambda i: (-scores[i], i))[:limit]]

    def translated(self, text: str) -> str:
        """`text` in the words of the catalogue: "crisps" as "potato chips"."""
        return self._translate(text)

    def mended(self, phrase: str) -> str:
        """`phrase` in the singular, slips of the pen mended by words of the items' names."""
        return " ".join(mended(phrase, self._holding))

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
        return [self._catalogue.items[place] for place in sorted(common)]

    def ending(self, phrase: str) -> list[Item]:
        """Items with whose whole name `phrase` ends: "white granulated sugar".

        Before a name of one word stand mere qualities: dates for "fresh dates", but no steak for a
        "unicorn steak". No word of a label does, since "vegan" is meant where it is said.
        """
        said = singulars(phrase)
        items = [self._catalogue.items[i] for i in self._heads.get(said[-1], ())] if said else []
        sizes = {item: len(singulars(item.name)) for item in items}
        return [
            item
            for item, size in sizes.items()
            if said[-size:] == singulars(item.name)
            and (size > 1 or {*said[:-1]} <= _QUALITIES)
            and not {*said[:-size]} & _LABELS
        ]

    def labels(self, item: Item, phrase: str) -> int:
        """How many words of the item's name, and not of `phrase`, label it for a diet."""
        return len(_LABELS & {*singulars(item.name)} - {*singulars(phrase)})

    def plainness(self, item: Item, phrase: str) -> tuple[int, int, int, int]:
        """How plainly the item is `phrase`, the plainest least.

        By its labels, by how many words of its name are other things (garlic in a bread), by how
        many it has, and by how many are no mere qualities.
        """
        others = set(singulars(item.name)) - set(singulars(phrase))
        things = sum(word in self._heads for word in others)
        labels = self.labels(item, phrase)
        return labels, things, len(words(item.name)), len(others - _QUALITIES)

    def kinds(self, text: str, limit: int) -> list[str]:
        """Generic names such as "flour" that may serve `text`, nearest first.

        They are the endings of the catalogue's own names, so that each leads to items.
        """
        names, vectors = self._kinds
        if not names or not words(text) or limit < 1:
            return []
        meant = embedded([text])[0]
        nearness = _nearness(vectors, meant)
        return [names[i] for i in _top(nearness, limit)]

    def _by_words(self, text: str) -> list[int]:
        terms = " OR ".join(f'"{word}"' for word in dict.fromkeys(words(text)[:32]))
        rows = self._index.execute(
            "SELECT rowid FROM names WHERE names MATCH ? AND rank MATCH 'bm25(1.0, 0.3)' "
            "ORDER BY rank LIMIT ?",
            (terms, _DEPTH),
        )
        return [row[0] for row in rows]

    def _by_head(self, query: Sequence[str], nearness: _Vectors) -> list[int]:
        """Items that are what the query's last word says, best covered by the query first."""

        def order(index: int) -> tuple[int, float, int]:
            missing = sum(word not in self._words[index] for word in query)
            return missing, -float(nearness[index]), index

        return sorted(self._heads.get(query[-1], ()), key=order)[:_DEPTH]

    @cached_property
    def _translate(self) -> Callable[[str], str]:
        return translator(lambda name: bool(self.named(name)))

    @cached_property
    def _words(self) -> list[frozenset[str]]:
        return [frozenset(singulars(item.name)) for item in self._catalogue.items]

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
        for index, item in enumerate(self._catalogue.items):
            for part in dict.fromkeys(singular(w) for w in head_nouns(item.name)):
                heads[part].append(index)
        return dict(heads)

    @cached_property
    def _kinds(self) -> tuple[list[str], _Vectors]:
        """The generic names, and their vectors drawn towards those of their categories."""
        counts: Counter[str] = Counter()
        spelled: defaultdict[str, Counter[str]] = defaultdict(Counter)
        categories: defaultdict[str, Counter[str]] = defaultdict(Counter)
        for item in self._catalogue.items:
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
        return _opened(self._cache_dir, self._catalogue)

    @cached_property
    def _vectors(self) -> _Vectors:
        """float32, items x 256, each row of length one."""
        blob = self._index.execute("SELECT data FROM vectors").fetchone()[0]
        return np.frombuffer(blob, dtype=np.float32).reshape(len(self._catalogue), -1)


def _endings(name: str) -> Iterable[str]:
    """The last word of a name, and its last two where the first of them is no mere quality."""
    head = [word for word in head_words(name) if not word.isdigit()]
    if head and head[-1] not in _QUALITIES and len(head[-1]) > 2:
        yield head[-1]
        if len(head) > 1 and head[-2] not in _QUALITIES and len(head[-2]) > 2:
            yield f"{head[-2]} {head[-1]}"


def _nearness(vectors: _Vectors, vector: _Vectors) -> _Vectors:
    """Cosines; without BLAS, whose threads cost more than they save where cores are busy."""
    return np.einsum("ij,j->i", vectors, vector)


def _top(values: _Vectors, limit: int) -> list[int]:
    """Places of the largest values, largest first; equal values in their order."""
    limit = min(limit, len(values))
    edge = np.partition(values, -limit)[-limit]
    places = np.flatnonzero(values >= edge)
    return [int(i) for i in places[np.argsort(-values[places], kind="stable")][:limit]]


def _opened(folder: Path, catalogue: Catalogue) -> sqlite3.Connection:
    """The kept index of `catalogue`, for all threads; built where there is none to be read."""
    path = folder / f"grocery-{_FORMAT}-{catalogue.fingerprint}.sqlite"
    try:
        address = f"{path.absolute().as_uri()}?mode=ro"
        kept = sqlite3.connect(address, uri=True, check_same_thread=False)
        size = kept.execute("SELECT length(data) FROM vectors").fetchone()[0]
        count = kept.execute("SELECT count(*) FROM names").fetchone()[0]
        if count == len(catalogue) and size and size % (4 * count) == 0:
            return kept
        kept.close()
    except (sqlite3.Error, TypeError):
        pass
    built = sqlite3.connect(":memory:", check_same_thread=False)
    _fill(built, catalogue)
    _keep(built, path)
    return built


def _fill(index: sqlite3.Connection, catalogue: Catalogue) -> None:
    index.execute("CREATE VIRTUAL TABLE names USING fts5(name, category, tokenize='porter')")
    index.execute("CREATE TABLE vectors (data BLOB)")
    index.executemany(
        "INSERT INTO names (rowid, name, category) VALUES (?, ?, ?)",
        ((i, item.name, item.category) for i, item in enumerate(catalogue.items)),
    )
    vectors = embedded([item.name for item in catalogue.items])
    index.execute("INSERT INTO vectors VALUES (?)", (vectors.tobytes(),))
    index.commit()


def _keep(index: sqlite3.Connection, path: Path) -> None:
    """Write `index` to `path` all at once; a folder that cannot be written costs only time."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, suffix=".partial")
        os.close(handle)
        try:
            with closing(sqlite3.connect(name)) as file:
                index.backup(file)
            os.replace(name, path)
        finally:
            Path(name).unlink(missing_ok=True)
    except (OSError, sqlite3.Error):
        return
