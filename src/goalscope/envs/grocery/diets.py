"""The restrictions that the shop knows, and what labels say of them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files

from goalscope.base.inputs import read_table
from goalscope.base.nouns import singulars

_LETTERS = str.maketrans({"ß": "ss", "æ": "ae", "œ": "oe", "ø": "o", "ł": "l", "đ": "d"})
_FREE = re.compile(r"(?<=\w{3})(?:free|frei)\b", re.IGNORECASE)
_BETWEEN = re.compile(r"[,;|]")
_CROSS = re.compile("[\u00d7\u2715-\u2718\u274c\u274e\U0001f6ab]")
"""Marks that deny what stands beside them."""
_MEASURE = re.compile(
    r"\d.*|x|g|kg|mg|lb|oz|fl|ml|cl|l|ltr|litre|liter|gram|ct|count|pk|pc|piece|each"
)


@dataclass(frozen=True, slots=True)
class Diet:
    """One restriction; its phrases are in the singular, with commas between.

    Attributes:
        harmless: Phrases in an item's name that make it fit.
        violating: Phrases that make an item violate it; only a label makes an item fit where this
            is empty.
        avoided: What a person who follows it avoids, as in "no wheat".
        allergens: What else an allergy names it by, as in "allergic to almonds".
        named: Other names of the diet, and of those who follow it.
        labels: All names of it on labels, its own and these among them.
        absent: What a label may say is not in an item that fits, as in "no nuts".
        saving: Phrases to pass over before looking for the others.
        known: Names of things that fit, besides the plain ones (see `is_plain`).
        implied: Other restrictions: what fits one of them fits this, as vegan is dairy-free.
        guessed: The stricter restriction that guesses keep to.
    """

    harmless: str
    violating: str = ""
    avoided: str = ""
    allergens: str = ""
    named: str = ""
    labels: str = ""
    absent: str = ""
    saving: str = ""
    known: str = ""
    implied: frozenset[str] = frozenset()
    guessed: str = ""


@dataclass(frozen=True, slots=True)
class Claims:
    """What labels say of restrictions, by their names in `DIETS`.

    Attributes:
        fits: The item fits them: "suitable for vegans".
        violates: It does not: "contains milk", "non-veg".
        hints: A label gives reason to think so, where no other says that it fits: "milk", or
            "contains milk", of something that may be free of lactose.
    """

    fits: frozenset[str] = frozenset()
    violates: frozenset[str] = frozenset()
    hints: frozenset[str] = frozenset()

    def __or__(self, other: Claims) -> Claims:
        """What either of two labels says."""
        return Claims(
            self.fits | other.fits, self.violates | other.violates, self.hints | other.hints
        )


def folded(text: str) -> list[str]:
    """The words of a text in the singular, without accents; "glutenfree" are two."""
    spread = unicodedata.normalize("NFKD", text.casefold().translate(_LETTERS))
    bare = "".join(letter for letter in spread if not unicodedata.combining(letter))
    return singulars(_FREE.sub(" free", bare))


def phrases(listed: str) -> list[str]:
    """The listed phrases, folded."""
    return [phrase for each in listed.split(",") if (phrase := " ".join(folded(each)))]


@cache
def finder(listed: str) -> re.Pattern[str]:
    """Finds any of the listed phrases as adjacent folded words, the longest first; none in ""."""
    either = "|".join(map(re.escape, sorted(phrases(listed), key=len, reverse=True))) or "(?!)"
    return re.compile(rf"(?<!\S)(?:{either})(?!\S)")


_TABLES = read_table(files("goalscope.envs.grocery") / "data" / "diets.toml")


def _read_diets() -> dict[str, Diet]:
    lists: dict[str, str] = {}
    for name, listed in _TABLES["lists"].items():
        lists[name] = listed.format(**lists)
    diets: dict[str, Diet] = {}
    for name, table in _TABLES["diets"].items():
        given: dict[str, str] = {key: text.format(**lists) for key, text in table.items()}
        implied = frozenset(filter(None, given.pop("implied", "").split(", ")))
        labels = ", ".join((name, given.get("named", ""), given.get("labels", "")))
        diets[name] = Diet(**{**given, "labels": labels}, implied=implied)
    return diets


DIETS = _read_diets()
"""The restrictions by name."""

_PLAIN, _SIDE = _TABLES["plain"]["names"], _TABLES["plain"]["side"]
_BESIDE = frozenset(folded(_TABLES["plain"]["beside"]))
_NOT, _PRESENT, _FILL = (
    frozenset(folded(_TABLES["labels"][key])) for key in ("lacking", "holding", "mere")
)
_LACKING = _NOT | {"free"}
_APART = _TABLES["labels"]["apart"]
_OFFERS = frozenset({"option"})  # which is to be had, perhaps of another item
_SMALL = _LACKING | _PRESENT | _FILL
_ABSENT = ",".join(diet.absent for diet in DIETS.values() if diet.absent)
_CLAIMS = ",".join((*(diet.labels for diet in DIETS.values()), _ABSENT))


@lru_cache(maxsize=65536)
def is_plain(name: str, known: str = "") -> bool:
    """Whether a name says all that its thing contains, as "Organic Bananas, 1 kg" does: one thing.

    Args:
        name: Of an item.
        known: Further names of such things, with commas between.
    """
    said = " ".join(word for word in folded(name) if not _MEASURE.fullmatch(word))
    rest, found = finder(f"{_PLAIN}, {known}").subn(" ", said)
    if not found:
        rest, found = finder(_SIDE).subn(" ", said)
    return found == 1 and _BESIDE.issuperset(finder(_SIDE).sub(" ", rest).split())


@lru_cache(maxsize=16384)
def read_label(text: str, *, is_name: bool = False) -> Claims:
    """What a label such as "GF", "contains: milk, soy", "no nuts" or "non-veg" says.

    A label claims that an item fits only if it says nothing else: "vegan recipe" and "vegan?" claim
    nothing. A name, such as "Vegan Butter", has other words.
    """
    claims = Claims()
    leading = frozenset[str]()
    for part in _BETWEEN.split(_CROSS.sub(" no ", text)):
        said = folded(part)
        polarity = (_LACKING | _PRESENT).intersection(said)
        leading = polarity.intersection(said[:1]) or leading
        said = [*(() if polarity else leading), *said]
        claims |= _read(said, is_sure="?" not in part, is_name=is_name)
    violates, hints = (
        names.union(*(DIETS[name].implied for name in names))  # not dairy-free, hence not vegan
        for names in (claims.violates, claims.hints)
    )
    return Claims(claims.fits, violates, hints)


def diet_named(text: str) -> str:
    """The restriction of which a text is nothing but a name; "" if it is none."""
    bare = " ".join(word for word in folded(text) if word not in _FILL)
    return next((name for name, diet in DIETS.items() if bare in phrases(diet.labels)), "")


def _read(said: Sequence[str], *, is_sure: bool, is_name: bool) -> Claims:
    """What one part of a label says."""
    text = finder(_APART).sub("", " ".join(said)).strip()
    rest = finder(_CLAIMS).sub(" ", text).split()
    others = [word for word in rest if word not in _FILL | {"free"} or word in _OFFERS]
    is_alone = is_name or (is_sure and all(word.isdigit() for word in others))
    bare = " ".join(word for word in said if word not in _SMALL and not word.isdigit())
    is_twice = "free" in said and not _NOT.isdisjoint(said)
    is_absent = bool(_LACKING.intersection(said)) and not finder(_ABSENT).sub("", bare).strip()
    claimed: dict[str, set[str]] = {"fits": set(), "violates": set(), "hints": set()}
    for name, diet in DIETS.items():
        ruled_out = f"{diet.avoided}, {diet.allergens}"
        saved = finder(diet.saving).sub("|", text)
        if own := finder(diet.labels).search(saved):
            before = [word for word in saved[: own.start()].split() if word not in _FILL]
            after = [word for word in saved[own.end() :].split() if word not in _FILL]
            if _NOT.intersection(before[-1:]) or (not is_name and _NOT.intersection(after[:1])):
                claimed["violates"].add(name)
            elif is_alone and not _PRESENT.intersection(before):
                claimed["fits"].add(name)
        elif is_absent and not is_twice and is_sure:
            claimed["fits"].update([name] if finder(diet.absent).search(bare) else [])
        elif _LACKING.intersection(said):
            continue
        elif _PRESENT.intersection(said):
            held = finder(diet.saving).sub("|", bare)
            named = ruled_out if diet.avoided else diet.violating
            if finder(named).search(held):
                claimed["violates"].add(name)
            elif finder(diet.violating).search(held):
                claimed["hints"].add(name)
        elif bare in phrases(f"{ruled_out}, {diet.absent}"):
            claimed["hints"].add(name)
    return Claims(**{key: frozenset(names) for key, names in claimed.items()})
