"""What people's words refer to in a scene: "it", "both", "the slices", "everything there"."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from goalscope.envs.house.heard import HOME, Request
from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.phrases import Phrase, PhraseReader
from goalscope.envs.house.meeting import NEEDS, stood_on
from goalscope.envs.house.names import naming, readable
from goalscope.envs.house.simulator.object_types import FLAGS, object_type, object_types
from goalscope.envs.house.simulator.slices import pieces

__all__ = ["TO_SLICES", "Referents"]

_FREE = frozenset(("moveable", "pickupable"))
"""What may be pushed and pulled has one of these flags."""

_SWITCHES = {
    "StoveBurner": "StoveKnob",
    **dict.fromkeys(("Sink", "SinkBasin", "Bathtub", "BathtubBasin"), "Faucet"),
}
"""What is turned where a person speaks of turning these on or off."""

TO_SLICES = frozenset(("put", "pick up", "cook"))
"""What is done to slices where a person says "slice the bread, and ... it"."""


@dataclass
class Referents:
    """What is in a scene, and what was spoken of last.

    Attributes:
        objects: AI2-THOR's metadata of the objects.
        named: The objects' names by their ids.
        start: The objects' metadata at the start, by their ids.
        count: How many there are of each type.
        type_of: Types by name.
        flags: Affordances by type.
        place: The place that was spoken of last.
        last: The things that were spoken of last.
        recent: The same, with places and some that were spoken of before.
        earlier: What had been spoken of last, and recently, when the newest words came.
        newest: Requests of the newest words.
    """

    objects: Sequence[Mapping[str, Any]]
    named: Mapping[str, str]
    start: Mapping[str, Mapping[str, Any]]
    place: Phrase | None = field(default=None, init=False)
    last: list[Phrase] = field(default_factory=list[Phrase], init=False)
    recent: list[Phrase] = field(default_factory=list[Phrase], init=False)
    earlier: tuple[list[Phrase], list[Phrase]] = field(default=([], []), init=False)
    newest: list[Request] = field(default_factory=list[Request], init=False)

    def __post_init__(self) -> None:
        self.count = Counter(str(o["objectType"]) for o in self.objects)
        types = {str(o["objectId"]): str(o["objectType"]) for o in self.objects}
        self.type_of = {name: types[own] for own, name in self.named.items() if own in types}
        self.flags = {kind: set(object_type(kind).flags) for kind in self.count}
        for each in self.objects:
            self.flags[str(each["objectType"])] |= {flag for flag in FLAGS if each.get(flag)}

    def remember(self) -> None:
        """Have in mind again what words before the newest spoke of."""
        last, recent = self.earlier
        self.last = self.last or last
        self.recent = [*(each for each in recent if each not in self.recent), *self.recent]
        self.earlier = self.last, self.recent

    def forget(self) -> None:
        """Leave only what the newest words spoke of themselves."""
        last, recent = self.earlier
        self.last = [each for each in self.last if each not in last]
        self.recent = [each for each in self.recent if each not in recent]

    def meant(self, phrase: Phrase, verb: str) -> list[Phrase]:
        """The phrases with types for which a phrase stands; "it" must suit the verb."""
        if phrase.types:
            return [phrase]
        all_there = phrase.word == "everything" or (phrase.word == "them" and phrase.group)
        if all_there and phrase.at:
            on = [own for own in self.start if {*phrase.at} & stood_on(own, self.start)]
            kinds = dict.fromkeys(str(self.start[own]["objectType"]) for own in on)
            return [replace(phrase, types=tuple(kinds), every=True, group=True)] if kinds else []
        if phrase.word == "home":
            return [replace(phrase, types=(HOME,))]
        if phrase.word == "everything" and (phrase.every or verb in ("close", "turn off", "clean")):
            kinds = tuple(kind for kind, flags in self.flags.items() if _suits(verb, flags))
            return [replace(phrase, types=kinds, every=True, group=True)] if kinds else []
        if phrase.word in ("everything", "water", "unknown"):
            return []
        if phrase.word == "there":
            return [self.place] if self.place else []
        if phrase.word == "slice":
            whole = [k.removesuffix("Sliced") for last in self.last for k in last.types]
            kinds = tuple(f"{k}Sliced" for k in whole if f"{k}Sliced" in object_types())
            return [replace(phrase, types=kinds, word="")] if kinds else []
        if phrase.word in ("it", "this", "that"):
            able = [
                p for p in self.recent if any(_suits(verb, object_type(k).flags) for k in p.types)
            ]
            return [
                each if each.number > 1 else replace(each, number=0)
                for each in (able or self.last)[-1:]
            ]
        if phrase.word == "both" and len(self.last) < 2 and not any(p.every for p in self.last):
            return self.recent[-2:]
        return [
            replace(
                last,
                every=phrase.every or (last.every and phrase.word != "one"),
                number=(0 if last.which else phrase.number)
                or (1 if phrase.word == "one" else last.number),
                states=phrase.states or last.states,
            )
            for last in self.last
        ]

    def nearest(self, thing: Phrase, aside: Phrase) -> Phrase:
        """Of several things the one that stood nearest to another at the start."""
        one = not (thing.which or thing.every or thing.number > 1)
        alike = self._standing(thing.types) if one else []
        pairs = [(own, other) for own in alike for other in self._standing(aside.types)]
        if len(alike) < 2 or not pairs:
            return thing
        own, _ = min(pairs, key=lambda pair: self._distance(*pair))
        number = self.named[own].rpartition(" ")[2]
        kind = str(self.start[own]["objectType"])
        return replace(thing, types=(kind,), which=int(number) if number.isdigit() else 0)

    def _standing(self, kinds: Collection[str]) -> list[str]:
        """Ids of what was here of these types at the start, and is."""
        return [
            own
            for own, each in self.start.items()
            if each["objectType"] in kinds and own in self.named
        ]

    def _distance(self, one: str, other: str) -> float:
        """Metres between two things at the start."""
        here, there = (self.start[own]["position"] for own in (one, other))
        return math.dist([here[axis] for axis in "xyz"], [there[axis] for axis in "xyz"])

    def sliced(self, thing: Phrase) -> Phrase:
        """The slices of a thing that the same words have sliced; any other as it is."""
        cut = self.cut()
        kinds = tuple(cut[kind] for kind in thing.types if kind in cut)
        return replace(thing, types=kinds, every=True, number=0, states=()) if kinds else thing

    def cut(self) -> dict[str, str]:
        """The types that the same words have sliced or cracked, and those of their pieces."""
        cut = (k for new in self.newest if new.verb in v.CUTTING for k in new.object_types)
        return {kind: pieces(kind) for kind in cut if pieces(kind)}

    def fitting(self, verb: str, kinds: Sequence[str]) -> tuple[str, ...]:
        """Those of `kinds` that are here, or may come of what is, and that suit the verb."""
        if verb in ("turn on", "turn off"):
            kinds = tuple(_SWITCHES.get(kind, kind) for kind in kinds)
        known = {*self.count, *self.cut().values()}
        here = [k for k in kinds if k in known or k.removesuffix("Sliced") in known]
        fit = [k for k in here if _suits(verb, self.flags.get(k) or object_type(k).flags)]
        if verb == "cook" and not fit:
            fit = [pieces(k) for k in here if "cookable" in object_type(pieces(k)).flags]
        return tuple(dict.fromkeys(fit or (here if verb == "use up" else ())))

    def name(self, kinds: Sequence[str], phrase: Phrase) -> str:
        """The scene's name for a numbered phrase, where there is one."""
        said = (f"{readable(kind)} {phrase.which}" for kind in kinds if phrase.which)
        return next((name for name in said if name in self.type_of), "")

    def flags_of(self, phrase: Phrase) -> set[str]:
        """The affordances of what a phrase may mean."""
        return {f for k in phrase.types for f in self.flags.get(k) or object_type(k).flags}

    def one_thing(self, text: str) -> Phrase | None:
        """The thing that is all that `text` names."""
        reader = PhraseReader(text.split(), self.count)
        thing, end = reader.thing(0)
        return thing if thing and thing.types and end == len(reader.words) else None

    def spoken_of(self, text: str) -> set[str]:
        """The types that are named in `text`; without any, all."""
        words = re.findall(r"[a-z0-9']+", text.casefold())
        named = (naming(words, i, self.count) for i in range(len(words)))
        return {kind for each in named if each for kind in each.types} or {*self.type_of.values()}


def _suits(verb: str, flags: Collection[str]) -> bool:
    if verb in ("push", "pull"):
        return not _FREE.isdisjoint(flags)
    return NEEDS.get(verb, "") in flags
