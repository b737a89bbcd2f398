"""Answers to a person's questions about the house, read off the metadata."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

from goalscope.envs.house.names import are, names, naming, the
from goalscope.envs.house.simulator.properties import ACTS
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.speech import LEAD, evened

__all__ = ["ABLE", "answered", "asks_what_was_done", "resolved"]

_NAMED = 5
"""Things that an answer names at most."""

_STATES: dict[str, tuple[str, bool]] = {
    **{"open": ("isOpen", True), "closed": ("isOpen", False), "shut": ("isOpen", False)},
    **{"on": ("isToggled", True), "off": ("isToggled", False), "broken": ("isBroken", True)},
    **{"sliced": ("isSliced", True), "cut": ("isSliced", True), "cooked": ("isCooked", True)},
    **{"dirty": ("isDirty", True), "clean": ("isDirty", False), "used up": ("isUsedUp", True)},
    **{"filled": ("isFilledWithLiquid", True), "full": ("isFilledWithLiquid", True)},
}
_ENDS = frozenset(("isSliced", "isBroken"))
"""States that what is no longer whole may be asked about."""

_STATE = re.compile(
    rf"{LEAD}(?:is|are) (.+?) (?:already |still |now )?({'|'.join(_STATES)})(?: now)?"
)
_WHICH = re.compile(
    rf"{LEAD}(?:(?:which|what)(?: of the)? (.+?) (?:is|are)|(?:(?:is|are) )?(any ?thing|something))"
    rf" (?:already |still |now )?({'|'.join(_STATES)})(?: now)?"
)
_WHERE = re.compile(
    rf"{LEAD}where(?: (?:did|have) (?:i|we) (?:leave|left|put|lose|lost)"
    r"| (?:can|do|could) (?:i|we|you) (?:find|see|keep)|'s|'re| is| are"
    r"| (?:did|have) you (?:just )?(?:put|leave|left|placed?|moved?|set|stowed?|take|taken))? (.+?)"
    r"(?: (?:is|are|now))?"
)
_HOLDING = re.compile(
    rf"{LEAD}(?:what (?:are you|do you) (?:hold|carry|have)(?:ing)?(?: (?:in your hands?|now))?"
    r"|what(?:'s| is) in your hands?|are you (?:holding|carrying) (?:something|anything))"
)
_INSIDE = re.compile(
    rf"{LEAD}what(?:'s| is| are| do you see| do you have| can you see| things are)?"
    r" (?:there )?(?:in|inside|on|on top of|inside of) (.+?)(?: now)?"
)
_PLACED = re.compile(
    rf"{LEAD}(?:is|are) (?:there )?(.+?) (?:already |still |now )?(?:in|inside|on|on top of) (.+)"
)
_COUNT = re.compile(
    rf"{LEAD}how many (.+?)(?: (?:are|do) (?:there|you see|you have|we have|left))?"
    r"(?: (?:here|left))?"
)
_HAVE = re.compile(
    rf"{LEAD}(?:(?:do|can) (?:you|we) (?:have|see|find)|have (?:you|we) (?:got|seen|found)"
    r"|is there|are there) (.+?)(?: (?:here|there|left|anywhere"
    r"|in the (?:house|home|room|kitchen)))*"
)
_ALSO = re.compile(
    r"(?:ok(?:ay)?[ ,]+)?(?:and|what about|how about)(?: what about)? (?P<thing>(?:the|my|our|your)"
    r" [a-z0-9' ]+?) ?\?"
)
"""Asks the last question of another thing: "and the bowl?"."""
_IT = re.compile(r"\b(?:it|they|them|that|those)\b")
_ABLE = re.compile(
    rf"{LEAD}(?:what (?:else )?(?:can|could) you (?:do|help with)"
    r"(?: (?:for (?:me|us)|here))?"
    r"|what are you able to do|how can you help(?: (?:me|us))?|help)"
)
_DONE = re.compile(
    rf"{LEAD}what (?:all )?(?:(?:did|have) you (?:just |already )?(?:do|done|changed?|moved?)"
    r"|(?:has|have|was|is|'s) (?:been )?(?:changed|moved|done))(?: so far| here| just now| now"
    r"| (?:with|to) (?P<thing>.{1,60}))?"
)
ABLE = (
    "I can fetch things and put them elsewhere, open and close, turn on and off, clean, fill and "
    "empty; slicing, cooking and breaking only if you ask for it."
)
"""What the robot says that it can do."""

_INNER = frozenset({
    "Bathtub", "BathtubBasin", "Bowl", "Box", "Cup", "GarbageCan", "Mug", "Pan", "Pot", "Sink",
    "SinkBasin",
})  # fmt: skip
"""Receptacles that things are in, besides those that open."""

Object = Mapping[str, Any]


def asks_what_was_done(question: str) -> str | None:
    """What "What did you do with the towel?" asks about, "" for all; None for other questions."""
    found = _DONE.fullmatch(evened(question)[:300].rstrip(" ?!."))
    return None if found is None else found["thing"] or ""


def resolved(question: str, said: Sequence[str], here: Collection[str]) -> Iterator[str]:
    """What a question may mean by "it", or by "and the bowl?", likeliest first.

    Args:
        question: What is asked.
        said: What the person said before, the newest last.
        here: Object types that are in the scene.
    """
    text = evened(question)[:300]
    asked = (evened(each)[:300] for each in reversed(said))
    before = next((each for each in asked if not _ALSO.fullmatch(each)), "")
    if (found := _ALSO.fullmatch(text)) and before.endswith("?"):
        for start, end in _named(before, here)[:1]:
            ahead = re.sub(r"\b(?:the|my|our|your|an?|any|some) $", "", before[:start])
            yield f"{ahead}{found['thing']}{before[end:]}"
    if _IT.search(text) and not _named(text, here):
        for each in reversed([evened(each)[:300] for each in said]):
            if spans := _named(each, here):
                yield from (_IT.sub(f"the {each[i:j]}", text, count=1) for i, j in spans)
                return


def _named(text: str, here: Collection[str]) -> list[tuple[int, int]]:
    """Where things are named in `text`."""
    found: list[tuple[int, int]] = []
    words = [*re.finditer(r"[a-z0-9']+", text)]
    i = 0
    while i < len(words):
        named = naming([each[0] for each in words], i, here)
        if named and not named.guessed:
            found.append((words[i].start(), words[named.end - 1].end()))
        i = named.end if named else i + 1
    return found


def answered(
    question: str, objects: Sequence[Object], named: Mapping[str, str] | None = None
) -> str | None:
    """The answer to `question`, or None where it is no question about these objects.

    `named` gives the objects' names by their ids, where they are not those of `names(objects)`.
    """
    text = evened(question)[:300].rstrip(" ?!.")
    house = _House(objects, names(objects) if named is None else named)
    if _HOLDING.fullmatch(text):
        return house.holding()
    if _ABLE.fullmatch(text):
        return ABLE
    asks: list[tuple[re.Pattern[str], Callable[..., str | None]]] = [
        *(
            (_WHICH, house.which),
            (_STATE, house.state),
            (_INSIDE, house.inside),
            (_PLACED, house.placed),
        ),
        *((_COUNT, house.count), (_WHERE, house.where), (_HAVE, house.where)),
    ]
    for pattern, reply in asks:
        match = pattern.fullmatch(text)
        said = reply(*filter(None, match.groups())) if match else None
        if said:
            return said
    return None


class _House:
    def __init__(self, objects: Sequence[Object], named: Mapping[str, str]) -> None:
        self.objects = {str(o["objectId"]): o for o in objects if str(o["objectId"]) in named}
        self.names = named

    def called(self, term: str) -> list[Object] | None:
        """The whole objects that `term` names; None where it is no name of a thing."""
        found = self.ever_called(term)
        return None if found is None else [o for o in found if _is_there(o)]

    def ever_called(self, term: str) -> list[Object] | None:
        """The objects that `term` names, also those in slices or in pieces."""
        words = re.findall(r"[a-z0-9']+", term)
        while words and words[0] in ("the", "a", "an", "any", "some", "my", "our", "your", "all"):
            del words[0]
        by_name = [
            o for i, o in self.objects.items() if self.names[i].casefold() == " ".join(words)
        ]
        if any(map(_is_there, by_name)):
            return by_name
        named = naming(words, 0, {str(o["objectType"]) for o in self.objects.values()})
        if not named or named.end != len(words):
            return None
        return [o for o in self.objects.values() if o["objectType"] in named.types]

    def place(self, thing: Object) -> str:
        """Where a thing is, in words."""
        if thing.get("isPickedUp"):
            return "in my hand"
        around = [
            self.objects[p] for p in thing.get("parentReceptacles") or () if p in self.objects
        ]
        if not around:
            return "in the room"
        inner = next((o for o in around if _holds_inside(o)), around[0])
        name = self.names[str(inner["objectId"])]
        return f"{'in' if _holds_inside(inner) else 'on'} {the(name)}"

    def listed(self, things: Sequence[Object]) -> str:
        shown = sorted(self.names[str(o["objectId"])] for o in things)[:_NAMED]
        rest = len(things) - len(shown)
        return ", ".join(shown) + (f", and {rest} more" if rest > 0 else "")

    def holding(self) -> str:
        held = [o for o in self.objects.values() if o.get("isPickedUp")]
        return f"I am holding: {self.listed(held)}." if held else "I am holding nothing."

    def where(self, term: str) -> str | None:
        things = self.called(term)
        if things is None:
            return None
        if not things:
            gone = [
                f"{the(name)} {are(name)} {_fate(o)}"
                for o in self.ever_called(term) or ()
                if (name := self.names[str(o["objectId"])])
            ]
            text = "; ".join(sorted(gone)[:_NAMED]) or "I see no such thing here"
            return f"{text[0].upper()}{text[1:]}."
        places = {self.names[str(o["objectId"])]: self.place(o) for o in things}
        said = [f"{the(name)} {are(name)} {places[name]}" for name in sorted(places)[:_NAMED]]
        rest = len(things) - len(said)
        text = "; ".join(said) + (f"; and {rest} more." if rest > 0 else ".")
        return text[0].upper() + text[1:]

    def state(self, term: str, state: str) -> str | None:
        flag, value = _STATES[state]
        things = self.ever_called(term) if flag in _ENDS else self.called(term)
        things = [o for o in things or () if o.get(flag) is not None]
        if not things:
            return None
        if len(things) == 1:
            return "Yes." if bool(things[0][flag]) is value else "No."
        met = [o for o in things if bool(o[flag]) is value]
        return f"Yes: {self.listed(met)}." if met else "No."

    def which(self, term: str, state: str) -> str | None:
        flag, value = _STATES[state]
        needs = next((needs for needs, own, _ in ACTS.values() if own == flag), "")
        every = re.fullmatch(r"(?:any|some) ?thing", term)
        things = [*self.objects.values()] if every else self.called(term)
        able = [o for o in things or () if o.get(flag) is not None and o.get(needs, True)]
        met = self.listed([o for o in able if bool(o[flag]) is value])
        return (f"{met[:1].upper()}{met[1:]}." if met else "None.") if able else None

    def inside(self, term: str) -> str | None:
        places = [o for o in self.called(term) or () if o.get("receptacle")]
        if not places:
            return None
        ids = {str(o["objectId"]) for o in places}
        held = [
            o
            for o in self.objects.values()
            if ids & {*(o.get("parentReceptacles") or ())} and _is_there(o)
        ]
        return f"There: {self.listed(held)}." if held else "Nothing."

    def placed(self, term: str, place: str) -> str | None:
        things, places = self.called(term), self.called(place)
        if things is None or not places or not any(o.get("receptacle") for o in places):
            return None
        ids = {str(o["objectId"]) for o in places}
        there = [o for o in things if ids & {*(o.get("parentReceptacles") or ())}]
        return f"Yes: {self.listed(there)}." if there else "No."

    def count(self, term: str) -> str | None:
        things = self.called(term)
        return None if things is None else f"{len(things)}."


def _is_there(thing: Object) -> bool:
    return is_whole({"isSliced": False, "isBroken": False, "pickupable": False, **thing})


def _fate(thing: Object) -> str:
    return "sliced" if thing.get("isSliced") else "broken"


def _holds_inside(thing: Object) -> bool:
    return bool(thing.get("openable")) or thing.get("objectType") in _INNER
