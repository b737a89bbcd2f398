"""Exact names of items within what a person says, whatever words and marks such a name holds."""

from __future__ import annotations

import re
from collections.abc import Iterable

from goalscope.envs.grocery.words import head_words, spans, words

__all__ = ["Names"]

_SIGN = "\u01c1"  # a letter to a regular expression, and nothing that people type
_LIST = re.compile(r"[,;:!?\n]|\.\s")
_HIDDEN = re.compile(rf"{_SIGN}(\d+)")


class Names:
    """Hides exact names from a grammar: each becomes one word without a meaning, and back."""

    def __init__(self, names: Iterable[str]) -> None:
        """Know `names`; those of one plain word need no hiding."""
        self._names = [" ".join(name.casefold().split()) for name in names]
        self._exact = set(self._names)
        self._places: dict[tuple[str, ...], list[int]] = {}
        for place, name in enumerate(self._names):
            told = tuple(words(name))
            if len(told) > 1 or (told and told[0] != name):
                self._places.setdefault(told, []).append(place)
        self._longest = max(map(len, self._places), default=0)

    def __contains__(self, phrase: str) -> bool:
        """Whether `phrase`, in lower case, is a name."""
        return phrase in self._exact

    def hidden(self, text: str) -> str:
        """`text`, in lower case, with a sign for each name, the longest where several fit."""
        text = text.replace(_SIGN, " ").casefold().replace("\u2019", "'")
        found = list(spans(text))
        parts: list[str] = []
        start = i = 0
        while i < len(found):
            for length in range(min(self._longest, len(found) - i), 0, -1):
                told = tuple(word for word, _, _ in found[i : i + length])
                if places := self._places.get(told):
                    begin, end = found[i][1], found[i + length - 1][2]
                    exact = [p for p in places if text.startswith(self._names[p], begin)]
                    if not exact and _LIST.search(text, begin, end):
                        continue  # "rice, noodles" are two things
                    place = max(exact, key=lambda p: len(self._names[p]), default=places[0])
                    if exact:
                        end = max(end, begin + len(self._names[place]))
                    parts += [text[start:begin], f"{_SIGN}{place}"]
                    start, i = end, i + length - 1
                    break
            i += 1
        return "".join([*parts, text[start:]])

    def brief(self, text: str) -> str:
        """`text` with the last two words of each name's head: what kind of thing it is."""
        return _HIDDEN.sub(lambda m: " ".join(head_words(self._names[int(m[1])])[-2:]), text)

    def shown(self, text: str) -> str:
        """`text` with the names again, in lower case."""
        return _HIDDEN.sub(lambda match: self._names[int(match[1])], text)
