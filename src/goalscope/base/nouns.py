"""Words of names: splitting, singulars, head nouns."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from functools import lru_cache

from goalscope.base.text import plain

_MARKS = (  # of vowels and accents, from the Latin to the Khmer script, and joiners
    "\u0300-\u036f\u0483-\u0487\u0591-\u05bd\u05bf-\u05c7\u0610-\u061a\u064b-\u065f\u0670\u06d6-\u06ed"
    "\u0900-\u0963\u0966-\u0df3\u0e31-\u0e4e\u0eb1-\u0ece\u0f18-\u0fbc\u102b-\u1049\u1056-\u109d\u17b4-\u17d3"
    "\u200c\u200d"
)
_LETTERS = rf"[^\W_](?:[^\W_]|[{_MARKS}])*"
_WORD = re.compile(rf"{_LETTERS}(?:['\u2019]{_LETTERS})?")
_ASIDE = re.compile(r",|\(|:|;|\s[-\u2013\u2014|]\s|\s(?:with|in|for|of|from)\s", re.IGNORECASE)
_MEASURE = re.compile(
    r"\d.*|x|g|kg|mg|lb|lbs|oz|fl|ml|cl|l|ct|count|pk|pack|packs|pc|pcs|piece|pieces|inch|gallon"
    r"|each|assorted"
)
_ONLY_S = {
    "kiwis", "zucchinis", "paninis", "cookies", "brownies", "smoothies", "pies", "veggies",
    "quiches", "brioches", "ceviches",
}  # fmt: skip
"""Plurals that end like others, but lose only their last letter."""

_IRREGULAR = {
    "leaves": "leaf", "loaves": "loaf", "halves": "half", "knives": "knife", "potatoes": "potato",
    "tomatoes": "tomato", "mangoes": "mango", "avocadoes": "avocado", "chillies": "chilli",
    "chilies": "chilli", "chilis": "chilli", "chili": "chilli", "yoghurt": "yogurt",
    "wholewheat": "wheat",
}  # fmt: skip


def words(text: str) -> list[str]:
    """The words of `text` in lower case, without possessive endings."""
    return [word for word, _, _ in spans(plain(text).lower())]


def spans(text: str) -> Iterator[tuple[str, int, int]]:
    """The words of lower-case `text` without possessive endings; where each begins and ends."""
    for match in _WORD.finditer(text):
        yield match[0].replace("\u2019", "'").removesuffix("'s"), match.start(), match.end()


def singular(word: str) -> str:
    """A lower-case English word without its plural ending; equal for both numbers of a word."""
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    if word in _ONLY_S:
        return word[:-1]
    if len(word) < 4 or word.endswith(("ss", "us", "is")) or not word.endswith("s"):
        return word
    if word.endswith("ies"):
        return word[:-3] + "y"
    if word.endswith(("sses", "shes", "ches", "xes", "zzes", "tzes")):
        return word[:-2]
    return _IRREGULAR.get(word[:-1], word[:-1])


def singulars(text: str) -> list[str]:
    """The words of `text` in the singular."""
    return [*_singulars(text)]


@lru_cache(maxsize=8192)
def _singulars(text: str) -> tuple[str, ...]:
    parts = (_singulars_without_spaces(part) for part in plain(text).lower().split())
    return tuple(word for words in parts for word in words)


@lru_cache(maxsize=32768)
def _singulars_without_spaces(part: str) -> tuple[str, ...]:
    return tuple(singular(word) for word, _, _ in spans(part))


def contains(text: Collection[str], term: Collection[str]) -> bool:
    """Whether every word of `term` is among the words of `text` (both from `singulars`)."""
    return bool(term) and all(word in text for word in term)


def names(phrase: str, thing: str) -> bool:
    """Whether a phrase names the thing, or a kind of it: rye bread is a kind of bread."""
    return contains(singulars(phrase), singulars(thing))


def head_words(name: str) -> list[str]:
    """The words of `name` up to its head noun, without measures and afterthoughts.

    `head_words("Bread Flour, Strong, 1 kg")` is `["bread", "flour"]`: the last word says what
    the thing is.
    """
    for part in _ASIDE.split(name):
        found = words(part)
        while found and _MEASURE.fullmatch(found[-1]):
            found.pop()
        if found:
            return found
    return words(name)


def head_nouns(name: str) -> list[str]:
    """The last words of a name's first two parts; shops put a brand or the thing itself first.

    `head_nouns("Clabber Girl, Baking Powder, 4 lbs")` is `["girl", "powder"]`.
    """
    parts = (head_words(part) for part in _ASIDE.split(name)[:2] if words(part))
    return [found[-1] for found in parts if found]
