"""The things and places in what people say: noun phrases, lists of them, and what follows them."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace

from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.rewording import normal
from goalscope.envs.house.names import OF_IT, naming
from goalscope.envs.house.simulator.object_types import object_type, object_types

__all__ = ["Phrase", "PhraseReader", "Tail", "first_named"]


_ROW = 40
"""Most things in a row."""

_DESCRIBED = 12
"""Most words before a noun that belong to it."""


@dataclass(frozen=True, slots=True)
class Phrase:
    """A thing as it was said.

    Attributes:
        types: The object types that it may be; none for a pronoun.
        word: The pronoun: "it", "them", "one", "slice", "everything", "water", "there" ...; or
            "unknown" for a thing that the grammar does not know, and for none ("0 eggs").
        every: Whether all such things are meant.
        number: How many; 0 where it was not said.
        group: Whether it was named by a group word, such as "food".
        which: The number in a name of the scene, 2 in "drawer 2"; 0 without one.
        liquid: What it holds: "coffee" in "a cup of coffee".
        states: What it is like, as names and values of AI2-THOR's metadata.
        described: Whether only such of its kind are meant as an adjective or a place tells; or
            those not spoken of yet: "anything else".
        at: Types of the place where it is: "the mug on the table".
        said: The words of what is unknown.
    """

    types: tuple[str, ...] = ()
    word: str = ""
    every: bool = False
    number: int = 0
    group: bool = False
    which: int = 0
    liquid: str = ""
    states: tuple[tuple[str, bool | str], ...] = ()
    described: bool = False
    at: tuple[str, ...] = ()
    said: str = ""

    @property
    def is_named(self) -> bool:
        """Whether it says what is meant: "the plate", "the clean ones"."""
        return bool(self.types or (self.word in ("one", "ones") and self.states))


@dataclass
class Tail:
    """Where to, by which preposition, where from, with what; what is excepted or listed.

    Of two places the first may be where it is: "the mug on the table in the sink".

    `aside` is what it is said to be beside: "next to the sink"; `lost` is a place that the
    grammar does not know.
    """

    into: Phrase | None = None
    by: str = ""
    source: Phrase | None = None
    using: tuple[Phrase, ...] = ()
    excluded: tuple[Phrase, ...] = ()
    liquid: str = ""
    listed: tuple[Phrase, ...] = ()
    aside: Phrase | None = None
    lost: Phrase | None = None


def first_named(text: str, here: Collection[str] = ()) -> Phrase | None:
    """The first thing that `text` names, such as what a question is about."""
    words = re.findall(r"[a-z0-9']+", normal(text))
    named = next(filter(None, (naming(words, i, here) for i in range(len(words)))), None)
    return Phrase(named.types, every=named.plural, group=named.group) if named else None


@dataclass
class PhraseReader:
    """Reads things and places out of words.

    Attributes:
        words: The words of one clause.
        here: Types that are in the scene.
        leftover: Whether a word was met that was not understood, or only guessed.
        rest: Where other things are listed, behind a place; 0 if none are.
    """

    words: list[str]
    here: Collection[str]
    leftover: bool = field(default=False, init=False)
    rest: int = field(default=0, init=False)
    _read: dict[int, tuple[Phrase | None, int, bool]] = field(
        default_factory=dict[int, tuple[Phrase | None, int, bool]], init=False
    )

    def reread(self, words: list[str]) -> None:
        """Go on with other words."""
        self.words, self._read = words, {}

    def at(self, i: int) -> str:
        """The word at `i`, empty behind the last."""
        return self.words[i] if i < len(self.words) else ""

    def said_at(self, i: int, said: Collection[str]) -> tuple[str, int]:
        """Which of some phrases stands at `i`, and where it ends."""
        word = self.at(i)
        for phrase in said:
            if not phrase.startswith(word):
                continue
            end = i + phrase.count(" ") + 1
            if " ".join(self.words[i:end]) == phrase:
                return phrase, end
        return "", i

    def places(self, i: int) -> tuple[Phrase | None, str, int]:
        """A place with its preposition at `i`."""
        said, end = self.said_at(i, v.THERE)
        if said:
            return Phrase(word="there"), "in", end
        for said in v.INTO:
            _, start = self.said_at(i, (said,))
            if start == i:
                continue
            place, end = self.thing(start)
            if place:
                return place, said, end
            if self.at(start) in ("me", "us", "half"):
                return None, "", start + 1
        return None, "", i

    def tail(self, i: int, *, listed: bool = False) -> Tail:
        """What follows the things, up to where other things are listed."""
        tail = Tail()
        while i < len(self.words):
            before = i
            after = self.joints(i)
            if tail.into and after > i and self.at(after) == "everything":
                self.rest = i
                break
            if (after > i or (listed and not tail.listed)) and not self.preposition(after):
                things, end = self.things(after)
                new = after > i and any(thing.word == "unknown" for thing in things)
                if new or any(thing.is_named for thing in things):
                    if not (listed and not tail.listed):
                        self.rest = i
                        break
                    tail.listed, i = things, end
                    continue
            said, start = self.said_at(i, (*v.EXCEPT, *v.ASIDE))
            if i != (there := self.said_at(i, v.THERE)[1]) and self.at(there - 1) != "there":
                said = ""
            if said in v.EXCEPT and self.preposition(start):
                i = self.beyond_places(start)
            elif said in v.EXCEPT:
                more, end = self.things(start, refused=True)
                tail.excluded += more
                i = max(end, start)
            elif said:
                away = said in ("from", "out of", "off")
                aside, end = self.things(start, single=said not in ("with", "using", "of"))
                if away and aside:
                    tail.source = aside[0]
                if said in ("with", "of", "using") and self.at(end - 1) in v.LIQUIDS:
                    tail.liquid = self.at(end - 1)
                elif said == "with":
                    tail.using = aside
                elif not away and said not in ("of", "using"):
                    tail.aside = next(iter(aside), Phrase(word="unknown"))
                self.leftover |= not aside or aside[0].word == "unknown"
                i = max(end, start)
            else:
                place, said, i = self.places(i)
                if place and place.word == "unknown":
                    self.leftover, tail.lost = True, place
                if place and place.word != "unknown":
                    first = tail.into
                    if first and first.types and _leads_on(first, tail.by, place, said):
                        tail.source = first
                    if first is None or first.word == "there" or tail.source is first:
                        tail.into, tail.by = place, said
            if i == before:
                if self.words[i : i + 2] == ["for", "me"]:
                    i += 1
                elif self.at(i) not in v.TAIL and self.at(i) != ",":
                    self.leftover = True
                i += 1
        return tail

    def beyond_places(self, i: int) -> int:
        """Where places at `i` end, whatever they are: "in the freezer or on the table"."""
        while True:
            i = self.said_at(i, (*v.ASIDE, *v.INTO))[1]
            while self.at(i) and self.at(i) not in v.BREAKS and not self.preposition(i):
                i += 1
            if self.at(i) not in ("or", "nor") or not self.preposition(i + 1):
                return i
            i += 1

    def preposition(self, i: int) -> bool:
        """Whether a preposition stands at `i`."""
        return bool(self.said_at(i, (*v.EXCEPT, *v.ASIDE, *v.INTO))[0])

    def joints(self, i: int, *, refused: bool = False) -> int:
        """Where what stands between the things of a list ends."""
        while self.at(i) in v.JOINTS or (refused and self.at(i) in ("not", "nor", "either")):
            i += 1
        return i

    def things(
        self, i: int, *, refused: bool = False, single: bool = False
    ) -> tuple[tuple[Phrase, ...], int]:
        """Things in a row: "the apple, the egg and a mug"; "or" makes one of several."""
        found: list[Phrase] = []
        if self.at(i) == "both":
            first, end = self.thing(i + 1)
            i += bool(first and not first.every and self.at(end) == "and")
        thing, end = self.thing(i)
        either = False
        while thing and len(found) < _ROW:
            if either and found[-1].types and thing.types:
                found[-1] = replace(found[-1], types=(*found[-1].types, *thing.types))
            else:
                found.append(thing)
            after = self.joints(end, refused=refused)
            word = self.at(end)
            if after == end and not single and (word in v.ARTICLES or word.isdigit()):
                thing, end = self.thing(end)
                self.leftover |= thing is not None
                continue
            either = "or" in self.words[end:after] and not refused
            bare = refused and self.words[end:after] == [","]
            if single or bare or after == end or {*self.words[end:after]} <= {"too", "please"}:
                break
            thing, after = (None, end) if self.preposition(after) else self.thing(after)
            end = after if thing else end
        return tuple(found), end

    def thing(self, i: int) -> tuple[Phrase | None, int]:
        """One thing with what determines it, or a pronoun."""
        if i not in self._read:
            before, self.leftover = self.leftover, False
            self._read[i] = (*self._thing(i), self.leftover)
            self.leftover = before
        found, end, leftover = self._read[i]
        self.leftover |= leftover
        return found, end

    def _thing(self, i: int) -> tuple[Phrase | None, int]:
        start, every, number, zero = i, False, 0, False
        states: dict[str, bool | str] = {}
        while i < min(len(self.words), start + _DESCRIBED):
            word = self.at(i)
            found, end = self.noun(i)
            known = word in v.DETERMINERS | v.FILLERS | v.PRONOUNS or word in v.NUMBERS
            if word == "no" and self.at(i + 1) not in v.DETERMINERS:
                known = zero = True
            if not (found or known or word.isdigit() or i == start or self.at(i - 1) in v.PLAIN):
                found, end = self.unknown(i)
            if found and zero:
                return Phrase(word="unknown"), end
            if found:
                every = every or (found.every and not number)
                states = states if found.types or found.word in ("one", "them") else {}
                number = max(found.number, 0) if found.number else number
                said = tuple(sorted(states.items()))
                if every and "some" in self.words[start:i] and not found.group:
                    every, number = False, number or 2
                described = not v.CHOOSING.isdisjoint(self.words[start:i])
                found = replace(found, every=every, number=number, states=said)
                return replace(found, described=described or found.described), end
            if word in v.NUMBERS or word.isdigit():
                number = v.NUMBERS[word] if word in v.NUMBERS else min(int(word), 99)
                zero = zero or not number
            elif not known:
                break
            if word in v.QUALITIES:
                states |= [v.QUALITIES[word]]
            every = every or word in v.EACH
            i += 1
        said = self.words[start:i]
        word = next((w for w in reversed(said) if w in v.PRONOUNS), "")
        if word and (zero or ("other" in said and word in ("one", "ones"))):
            return Phrase(word="unknown"), i
        if word:
            number = 0 if word == "it" else number
            states = states if word in ("one", "ones", "them") else {}
            return Phrase((), word, every, number, states=tuple(sorted(states.items()))), i
        return None, start

    def noun(self, i: int) -> tuple[Phrase | None, int]:
        """A noun that names types, a slice, a lid, a liquid, or a vague word such as "things"."""
        word = self.at(i)
        if named := naming(self.words, i, self.here):
            end = named.end
            self.leftover |= named.guessed
            if re.fullmatch(r"[1-9]\d{0,2}", self.at(end)) and not self.noun(end + 1)[0]:
                which = int(self.at(end))
                return Phrase(named.types, "", named.plural, 0, named.group, which), end + 1
            liquid = ""
            if self.at(end) == "of":
                inner, inner_end = self.thing(end + 1)
                if inner and any(kind.endswith("Sliced") for kind in inner.types):
                    return replace(inner, number=inner.number or -1), inner_end
                if self.at(end + 1) in v.LIQUIDS:
                    liquid, end = self.at(end + 1), end + 2
            return Phrase(named.types, "", named.plural, 0, named.group, liquid=liquid), end
        if word in v.SLICES:
            whole, end = self.thing(i + 2) if self.at(i + 1) == "of" else (None, i + 1)
            if not whole or not whole.types:
                return Phrase(word="slice", every=word.endswith("s")), max(end, i + 1)
            sliced = (f"{kind.removesuffix('Sliced')}Sliced" for kind in whole.types)
            return Phrase(tuple(t for t in sliced if t in object_types()) or whole.types), end
        if word in v.LIDS:
            whole, end = self.thing(i + 2) if self.at(i + 1) == "of" else (None, i + 1)
            return whole or Phrase(word="it"), max(end, i + 1)
        if word == "coffee" and self.at(i + 1) not in OF_IT:
            return Phrase(("Mug", "Cup"), liquid="coffee"), i + 1
        if word == "water":
            return Phrase(word="water", liquid="water"), i + 1
        if word in v.VAGUE:
            owned = self.at(i - 1) in ("my", "your", "our", "his", "her", "their") and i
            vague = "everything" if word in ("everything", "anything", "nothing") else "them"
            other = self.at(i + 1) == "else"
            word = "unknown" if owned else vague
            return Phrase(word=word, group=vague == "them", described=other), i + 1 + other
        return None, i

    def unknown(self, i: int) -> tuple[Phrase | None, int]:
        """A noun after a determiner that is not in the vocabulary, or is behind such a word."""
        end = i
        while end < min(i + 3, len(self.words)) and not (
            self.at(end) in v.STOPS or self.preposition(end) or self.at(end) in v.ING
        ):
            end += 1
            if self.noun(end)[0] and self.at(end) not in v.VAGUE:
                self.leftover = True
                return self.noun(end)
        if end > i and self.at(end) in v.VAGUE:
            end += 1
        elif end > i and self.at(end) == "of":
            inner, inner_end = self.thing(end + 1)
            if inner and inner.types:
                self.leftover = True
                return inner, inner_end
        said = " ".join(self.words[i:end])
        return (Phrase(word="unknown", said=said), end) if end > i else (None, i)


def _leads_on(first: Phrase, by: str, second: Phrase, said: str) -> bool:
    """Whether of two places the first is where a thing is, and the second where it goes."""
    if by not in ("in", "on", "at", "inside", "on top of"):
        return False
    if said not in ("in", "on", "at", "inside", "on top of"):
        return True
    if not second.types or ({*first.types} & _PARTS and {*second.types} & _WHOLES):
        return False
    return not any("pickupable" in object_type(kind).flags for kind in first.types) and not (
        {*first.types} <= _ON_TOP and {*second.types} & _TOPS
    )


_PARTS = frozenset(("Drawer", "Shelf", "Cabinet", "SinkBasin"))
_WHOLES = frozenset(("Desk", "Dresser", "SideTable", "ShelvingUnit", "TVStand", "Sink"))
_ON_TOP = frozenset(("Microwave", "CoffeeMachine", "Toaster", "Sink", "SinkBasin"))
_TOPS = frozenset(("CounterTop", "Desk", "DiningTable", "SideTable", "Shelf"))
