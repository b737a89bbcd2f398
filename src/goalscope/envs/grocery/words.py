"""Words of item names and of what people say: splitting, singulars, head nouns, questions."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from functools import lru_cache

__all__ = [
    "NO_GOODS",
    "asks",
    "contains",
    "head_nouns",
    "head_words",
    "made",
    "sentences",
    "singular",
    "singulars",
    "spans",
    "words",
]

_WORD = re.compile(r"[^\W_]+(?:['\u2019][^\W_]+)?")
_ASIDE = re.compile(r",|\(|:|;|\s[-\u2013\u2014|]\s|\s(?:with|in|for|of|from)\s", re.IGNORECASE)
_MEASURE = re.compile(
    r"\d.*|x|g|kg|mg|lb|lbs|oz|fl|ml|cl|l|ct|count|pk|pack|packs|pc|pcs|piece|pieces|inch|gallon"
    r"|each|assorted"
)
_IRREGULAR = {
    "kiwis": "kiwi",
    "zucchinis": "zucchini",
    "chilis": "chili",
    "paninis": "panini",
    "leaves": "leaf",
    "loaves": "loaf",
    "halves": "half",
    "knives": "knife",
    "cookies": "cookie",
    "brownies": "brownie",
    "smoothies": "smoothie",
    "pies": "pie",
    "veggies": "veggie",
    "potatoes": "potato",
    "tomatoes": "tomato",
    "mangoes": "mango",
    "avocadoes": "avocado",
    "chillies": "chilli",
    "chilies": "chilli",
    "chili": "chilli",
    "yoghurt": "yogurt",
    "wholewheat": "wheat",
    "quiches": "quiche",
    "brioches": "brioche",
    "ceviches": "ceviche",
}
_MADE = re.compile(
    r"\b(?!(?:baking|cooking) (?:powder|soda|oil|spray|chocolate|fat|wine|paper|parchment|sheet"
    r"|tray|tin|pan|dish|cup))(?:bak|mak|cook|prepar)(?:e|es|ing|s)?(?! sure\b)"
    r"((?: (?!(?:with|without|using|and|or|from|out|for|of|in|on|at|to|by|as|but|so|because|that"
    r"|this|which|who|when|while|tonight|today|tomorrow|now|soon|later|please|together|myself"
    r"|ourselves)\b)[\w'-]+){1,7})"
)
_POLITE = "(?:please |also |kindly |just |actually |maybe |perhaps |possibly |only )*"
_ADD = f"{_POLITE}(?:add|get|buy|put|include|order|find|bring|give|like|mind)"
_CHANGE = (
    rf"(?:{_ADD}|{_POLITE}(?:have|do|take|throw|pick|remove|delete"
    r"|drop|ditch|discard|lose|leave|skip|swap|exchange|switch|trade|replace|substitute|change|set"
    r"|reduce|increase|make|keep|empty|clear|start|be able|use|try|see|go))"
)
NO_GOODS = (
    "(?:chance|way|ideas?|luck|thoughts?|more|other|others|one|of|discounts?|offers?|deals?|news|tips?"
    "|recommendations?|suggestions?|questions?|problems?|thing|kind|sort)"
)
"""What is no thing of a shop in "any ideas?"."""
_QUESTION = re.compile(
    r"\W*(?:(?:and|so|but|oh|ok|okay|hi|hello|hey|also|well|then)\W+)*"
    r"(?:(?:do(?! you (?:mind|think (?:i|we|you) (?:can|could))\b)|does|did"
    r"|is(?! it possible to\b)|are|was|were|has|have"
    rf"|(?:should|shall)(?! \w+ {_ADD}\b)|would(?! \w+ {_CHANGE}\b| it be possible to\b)"
    rf"|(?:can|could|may|might)(?= (?:i|we) (?!{_CHANGE}\b)))"
    r" (?:you|i|we|they|there|he|she|it|the|these|those|this|that|any(?:thing|one)?|everything"
    r"|all)\b|(?:is|are|was|were) (?:both|some|most|my|our|your)\b"
    rf"|(?:got )?any (?!{NO_GOODS}\b)[^.;!?]*\?"
    r"|(?:what|how)(?! about\b)\b.*\?|(?:which|where|who|when|why)\b.*\?)"
)


def words(text: str) -> list[str]:
    """The words of `text` in lower case, without possessive endings."""
    return [word for word, _, _ in spans(text.lower())]


def spans(text: str) -> Iterator[tuple[str, int, int]]:
    """The words of lower-case `text` without possessive endings; where each begins and ends."""
    for match in _WORD.finditer(text):
        yield match[0].replace("\u2019", "'").removesuffix("'s"), match.start(), match.end()


def singular(word: str) -> str:
    """A lower-case English word without its plural ending; equal for both numbers of a word."""
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    if len(word) < 4 or word.endswith(("ss", "us", "is")) or not word.endswith("s"):
        return word
    if word.endswith("ies"):
        return word[:-3] + "y"
    if word.endswith(("sses", "shes", "ches", "xes", "zzes", "tzes")):
        return word[:-2]
    return _IRREGULAR.get(word[:-1], word[:-1])


def singulars(text: str) -> list[str]:
    """The words of `text`, each in the singular."""
    return [*_singulars(text)]


@lru_cache(maxsize=8192)
def _singulars(text: str) -> tuple[str, ...]:
    return tuple(singular(word) for word in words(text))


def contains(text: Collection[str], term: Collection[str]) -> bool:
    """Whether every word of `term` is among the words of `text` (both from `singulars`)."""
    return bool(term) and all(word in text for word in term)


def sentences(text: str) -> list[str]:
    """The sentences of `text` with their marks; a point within a number ends none."""
    return [s for s in re.split(r"(?<=[;!?])|(?<=\.)(?=\s)|[\n:]", text) if _WORD.search(s)]


def asks(sentence: str) -> bool:
    """Whether a sentence, in lower case, is a question, as about stock or prices, and no order."""
    return bool(_QUESTION.match(sentence))


def made(text: str) -> list[str]:
    """What a person says, in lower case, that they make: "bake a cake with nuts" gives "a cake"."""
    return [found.strip() for found in _MADE.findall(text)]


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
