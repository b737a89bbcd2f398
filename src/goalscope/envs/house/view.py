"""The house in words: names of things, places and changes."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import count
from typing import Any

from goalscope.base.types import Action
from goalscope.envs.house.simulator.object_types import ACTS, object_types
from goalscope.envs.house.simulator.state import innermost, is_whole

_UNKNOWN = "unknown thing"
"""What a thing of an unknown type is called: its type may be anyone's words."""

STATES = (
    ("isOpen", "open"), ("isToggled", "on"), ("isSliced", "sliced"), ("isCooked", "cooked"),
    ("isBroken", "broken"), ("isDirty", "dirty"), ("isUsedUp", "used up"),
)  # fmt: skip
_SHOWN_STATES = (
    ("isOpen", "open"), ("isToggled", "on"), ("isDirty", "dirty"), ("isFilledWithLiquid", "filled"),
)  # fmt: skip
ENDED = {"isOpen": "closed", "isToggled": "off", "isDirty": "clean"}
_INSIDE = frozenset(
    {"BathtubBasin", "Bowl", "Cup", "GarbageCan", "Mug", "Pot", "Sink", "SinkBasin"}
)

_SHOWN = 3
"""Most things that one sentence names."""


class View:
    """What is where now, by names that stay through an episode.

    Args:
        metadata: AI2-THOR's, of the present state.
        named: Names that were given before; what is new, such as slices, gets one.
    """

    def __init__(self, metadata: Mapping[str, Any], named: Mapping[str, str] | None = None) -> None:
        self.metadata = metadata
        self.objects: list[dict[str, Any]] = metadata["objects"]
        self.table = {each["objectId"]: each for each in self.objects}
        self.names = names(self.objects, named)
        self._ids = {name: own for own, name in self.names.items()}

    @property
    def held(self) -> str:
        """The id of what the hand holds; empty if it holds nothing."""
        held = self.metadata["inventoryObjects"]
        return held[0]["objectId"] if held else ""

    def id(self, name: str) -> str:
        """The object of this name; empty if there is none."""
        return self._ids.get(name, "") if type(name) is str else ""

    def type_of(self, name: str) -> str:
        """The object type of a name; empty if there is no such thing."""
        own = self.id(name)
        return self.table[own]["objectType"] if own else ""

    def place(self, thing: Mapping[str, Any]) -> str:
        """The name of what the thing is on or in: the innermost, and the floor last."""
        own = innermost(thing, self.table)
        return self.names[own] if own else ""

    def phrase(self, action: Action) -> str:
        """The action in words, with generic names: "put the egg in the fridge"."""
        target, place = (
            readable(self.type_of(name)) if self.id(name) else name
            for name in (action.target, action.destination)
        )
        words = f"{action.name} the {target}"
        return f"{words} {self.in_or_on(action.destination)} the {place}" if place else words

    def told(self, own: str, was: Mapping[str, Any]) -> str:
        """What is new of the object, in a sentence without its full stop: "The mug is clean".

        Args:
            own: The object's id.
            was: Its metadata before. Where nothing is new, the sentence says where it is.
        """
        thing, name = self.table[own], the(self.names[own])
        new = self._new_states(thing, was)
        if not new or (is_whole(thing) and self.where(thing) != self.where(was)):
            new.append(self.where(thing))
        return f"{name[:1].upper()}{name[1:]} {are(name)} {', '.join(new)}"

    def _new_states(self, thing: Mapping[str, Any], was: Mapping[str, Any]) -> list[str]:
        """The states that a thing was not in before: "open", "filled with water"."""
        new = [
            word if thing[key] else ENDED.get(key, f"no longer {word}")
            for key, word in STATES
            if thing[key] != was[key]
        ]
        if any(thing[key] != was[key] for key in ("isFilledWithLiquid", "fillLiquid")):
            liquid = thing["fillLiquid"] or "a liquid"
            new.append(f"filled with {liquid}" if thing["isFilledWithLiquid"] else "empty")
        return new

    def is_so(self, verb: str, things: Sequence[str]) -> str:
        """A sentence that tells that `verb` has nothing to do for the things of these ids."""
        groups: defaultdict[str, list[str]] = defaultdict(list)
        for own in things if verb not in ACTS else ():
            groups[self.where(self.table[own])].append(own)
        if len(groups) > 1:
            return " ".join(self.is_so(verb, group) for group in groups.values())
        state = next(iter(groups), "")
        if verb in ACTS:
            _, key, value = ACTS[verb]
            state = dict(STATES).get(key, "filled") if value else ENDED.get(key, "empty")
        told = [the(self.names[own]) for own in things[:_SHOWN]]
        more = f", and {len(things) - _SHOWN} more" if len(things) > _SHOWN else ""
        verb = are(told[0]) if len(things) == 1 else "are"
        text = f"{', '.join(told)}{more} {verb} {state} already."
        return f"{text[0].upper()}{text[1:]}"

    def changes(self, start: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
        """Ids of what is not as it was at the start, and texts; a piece where it left the rest."""
        for own, thing in self.table.items():
            was = start.get(own)
            whole = was or start.get(own.rpartition("|")[0])
            new = self._new_states(thing, was) if was else ["cooked"] * thing["isCooked"]
            is_apart = is_whole(thing) if was else self._is_scattered(own)
            if whole and is_apart and self.where(thing) != self.where(whole):
                new.append(f"now {self.where(thing)}")
            if new:
                yield own, f"{self.names[own]}: {', '.join(new)}"

    def here(self, start: Mapping[str, Mapping[str, Any]]) -> str:
        """What a reader is shown, such as "holds: mug; open: fridge; several: egg 1-3"."""
        shown: dict[str, list[str]] = {"holds": [self.names[self.held]] if self.held else []}
        for key, word in _SHOWN_STATES:
            shown[word] = [self.names[own] for own, thing in self.table.items() if thing[key]]
        shown["changed"] = [text.replace(": ", " ", 1) for _, text in self.changes(start)]
        alike = Counter(
            name.rpartition(" ")[0] for name in self.names.values() if name[-1].isdigit()
        )
        shown["several"] = [f"{kind} 1-{count}" for kind, count in alike.items() if count > 1]
        told = (f"{key}: {', '.join(names)}" for key, names in shown.items() if names)
        return "; ".join(told) or "nothing"

    def where(self, thing: Mapping[str, Any]) -> str:
        """Where the thing is, in words: "in the fridge"."""
        if thing["isPickedUp"]:
            return "in the robot's hand"
        name = self.place(thing)
        return f"{self.in_or_on(name)} {the(name)}" if name else "in its place"

    def _is_scattered(self, piece: str) -> bool:
        """Whether what a thing was cut into is not all in one place."""
        whole = piece.rpartition("|")[0]
        pieces = (each for own, each in self.table.items() if own.rpartition("|")[0] == whole)
        return len({*map(self.where, pieces)}) > 1

    def in_or_on(self, name: str) -> str:
        """The preposition for what is at the place of this name."""
        place = self.table.get(self.id(name))
        inside = place is not None and (place["openable"] or place["objectType"] in _INSIDE)
        return "in" if inside else "on"


def readable(object_type: str) -> str:
    """What to call a thing of this type; of a type that is not known, "unknown thing"."""
    return called(object_type)[0]


def called(object_type: str) -> tuple[str, ...]:
    """All that a thing of this type is called, the usual name first."""
    known = object_types().get(object_type)
    if known is None:
        return (_UNKNOWN,)
    if known.names:
        return known.names
    if object_type.endswith("Sliced"):
        whole = readable(object_type.removesuffix("Sliced"))
        forms = (f"slice of {whole}", f"{whole} slice", f"sliced {whole}", f"piece of {whole}")
        return (*forms, "toast") if whole == "bread" else forms
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+", object_type)
    words = [part if part.isupper() and 1 < len(part) < 4 else part.lower() for part in parts]
    return (" ".join(words),)


def names(
    objects: Iterable[Mapping[str, Any]], before: Mapping[str, str] | None = None
) -> dict[str, str]:
    """Object ids and their names in this scene: "egg", or "egg 1" and "egg 2", no name twice.

    Args:
        objects: AI2-THOR's metadata.
        before: Names that were given before; what is new beside them always gets a number.
    """
    before = before or {}
    kinds = {each["objectId"]: readable(each["objectType"]) for each in objects}
    given = {own: before[own] for own in kinds if own in before}
    taken = {name.casefold() for name in given.values()}
    alike = Counter(kind.casefold() for kind in kinds.values())
    numbers: defaultdict[str, count[int]] = defaultdict(lambda: count(1))
    for own in kinds if before else sorted(kinds):
        if own not in given:
            name = kind = kinds[own]
            if before or alike[kind.casefold()] > 1:
                numbered = (f"{kind} {number}" for number in numbers[kind.casefold()])
                name = next(name for name in numbered if name.casefold() not in taken)
            given[own] = name
            taken.add(name.casefold())
    return given


def the(name: str) -> str:
    """A name in a sentence: "the egg", but "drawer 2"."""
    return name if name[-1:].isdigit() else f"the {name}"


def are(name: str) -> str:
    """The verb after a name: "is", but "are" after "the keys"."""
    word = name.rstrip(" 0123456789")
    return "are" if word.endswith("s") and not word.endswith("ss") else "is"
