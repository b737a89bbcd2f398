"""What people ask for in a house, what they rule out, and what they allow."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from goalscope.envs.house.completion import completes, is_glad
from goalscope.envs.house.grammar import Clause, parse, parse_plain
from goalscope.envs.house.names import names, readable, the
from goalscope.envs.house.object_types import FLAGS, object_type, object_types
from goalscope.envs.house.phrases import Phrase, first_named
from goalscope.types import Turn

__all__ = ["IRREVERSIBLE", "Hearing", "Request", "ask_permission", "completes", "hear"]

IRREVERSIBLE = ("break", "slice", "use up", "cook")
"""What nobody can undo, so that it needs leave."""

_NEEDS = {
    **{"open": "openable", "close": "openable", "turn on": "toggleable", "turn off": "toggleable"},
    **{"slice": "sliceable", "cook": "cookable", "break": "breakable", "use up": "canBeUsedUp"},
    **{"fill": "canFillWithLiquid", "empty": "canFillWithLiquid", "clean": "dirtyable"},
    **{"dirty": "dirtyable", "put": "pickupable", "pick up": "pickupable"},
}
_SWITCHES = {
    "StoveBurner": "StoveKnob",
    **dict.fromkeys(("Sink", "SinkBasin", "Bathtub", "BathtubBasin"), "Faucet"),
}
"""What is turned where a person speaks of turning these on or off."""

_RIVALS = {
    **dict.fromkeys(("put", "pick up"), "place"),
    **dict.fromkeys(("open", "close"), "openness"),
    **dict.fromkeys(("turn on", "turn off"), "power"),
    **dict.fromkeys(("fill", "empty"), "liquid"),
    **dict.fromkeys(("clean", "dirty"), "dirt"),
}
"""Of two requests for one thing with one of these words, the later stands."""

_ELLIPTIC = frozenset(("put", "clean", "slice", "cook", "fill"))
"""Verbs that may stand without saying what: "rinse with water"."""

_PERMISSION = re.compile(r"May I (break|slice|use up|cook) (?:the )?([A-Za-z0-9 ]+)\?$")
_ASSENT = (
    r"(?:yes|yeah|yep|yup|sure|ok(?:ay)?|of course|go ahead|please do|please|do it|you may"
    r"|certainly|absolutely|by all means|fine|that'?s (?:fine|ok|okay)|thanks|thank you|VERB"
    r" (?:it|(?:the )?NAME))"
)
_DENIAL = re.compile(
    r"(?!yes|yeah|sure|ok|go ahead|of course)(?:no\b(?! problem)|nope|nah|not|never|stop|wait"
    r"|leave|keep)\b|(?!yes|yeah|sure|ok|go ahead|of course).*(?:n't\b|\bnot\b|\bnever\b)"
)
_TAKES_BACK = re.compile(
    r"(?:^|[.!?;,]\s*)(?:(?:actually|oh|ok|okay|please|no)[ ,]+)*(?:never ?mind|forget (?:it"
    r"|that|about (?:it|that|everything))|cancel\b|stop\b(?! \w+ing)|scratch that|undo that"
    r"|leave it(?!\s+(?:on|in))|i(?:'ve| have)? changed my mind|on second thoughts?|hold on"
    r"|wait\b|(?:i(?:'m| am|'m just| was))? ?(?:just )?(?:kidding|joking))"
)
_NEGATIVE = re.compile(r"n't\b|\b(?:not|never|no|nothing|dont|without|nope)\b")


@dataclass(frozen=True, slots=True)
class Request:
    """Something asked for outright.

    Attributes:
        verb: "put", "pick up", "open", "close", "turn on", "turn off", "slice", "cook", "break",
            "fill", "empty", "clean", "dirty", "push", "pull" or "use up".
        object_types: What to do it to: one of these types, or all of them where `every` is set.
        destination_types: For "put": one of these types; empty where no place was named.
        every: Whether every such thing is meant.
        number: How many are meant; 0 where it was not said.
        liquid: For "fill": "water", "coffee", "wine", or "" where it was not said.
        name: The thing's own name in the scene, where that was said: "drawer 2".
        destination_name: The same of the place.
        states: Which of several things of the type is meant, by names and values of AI2-THOR's
            metadata: ("isDirty", True), ("temperature", "Hot").
    """

    verb: str
    object_types: tuple[str, ...]
    destination_types: tuple[str, ...] = ()
    every: bool = False
    number: int = 0
    liquid: str = ""
    name: str = ""
    destination_name: str = ""
    states: tuple[tuple[str, bool | str], ...] = ()


@dataclass(frozen=True, slots=True)
class Hearing:
    """What a person's words come to, later words before earlier ones.

    Attributes:
        wanted: What is asked for, in its order.
        refused: Pairs of verb and object type that are ruled out; the verb "" stands for
            anything done to it, and "put in" for putting things there.
        kept_out: Pairs of an object type and the type of a place where it may not be put.
        permitted: Pairs of an irreversible verb and an object type, or a name in the scene.
    """

    wanted: tuple[Request, ...] = ()
    refused: frozenset[tuple[str, str]] = frozenset()
    kept_out: frozenset[tuple[str, str]] = frozenset()
    permitted: frozenset[tuple[str, str]] = frozenset()

    def permits(self, verb: str, object_type: str, name: str = "") -> bool:
        """Whether the person asked in plain words for this act, or said yes to it."""
        asked = (verb, object_type) in self.permitted or (verb, name) in self.permitted
        return asked and not self.refuses(verb, object_type)

    def refuses(self, verb: str, object_type: str, place_type: str = "") -> bool:
        """Whether the person ruled out this act on things of this type, or for a put this place."""
        ruled = {("", object_type), (verb, object_type), ("put in", place_type)} & self.refused
        return bool(ruled) or (object_type, place_type) in self.kept_out


def ask_permission(verb: str, name: str) -> str:
    """The question to which a plain yes permits `verb` for the thing of this name."""
    return f"May I {verb} {the(name)}?"


def hear(turns: Sequence[Turn], objects: Sequence[Mapping[str, Any]]) -> Hearing:
    """Read a conversation in its order, in a scene with these objects."""
    listener = _Listener(objects)
    for turn in turns:
        listener.hear(turn)
    return Hearing(
        tuple(listener.wanted),
        frozenset(listener.refused),
        frozenset(listener.kept_out),
        frozenset(listener.permitted),
    )


class _Listener:
    def __init__(self, objects: Sequence[Mapping[str, Any]]) -> None:
        self.count = Counter(str(o["objectType"]) for o in objects)
        named = names(objects)
        self.type_of = {named[str(o["objectId"])]: str(o["objectType"]) for o in objects}
        self.flags = {kind: set(object_type(kind).flags) for kind in self.count}
        for each in objects:
            self.flags[str(each["objectType"])] |= {flag for flag in FLAGS if each.get(flag)}
        self.wanted: list[Request] = []
        self.refused: set[tuple[str, str]] = set()
        self.kept_out: set[tuple[str, str]] = set()
        self.permitted: set[tuple[str, str]] = set()
        self.order = Clause("")
        self.place: Phrase | None = None
        self.fresh: list[Request] = []
        self.last: list[Phrase] = []
        self.recent: list[Phrase] = []

    def hear(self, turn: Turn) -> None:
        """Take in one turn."""
        text = turn.utterance
        if self.replied(turn):
            return
        if asked := first_named(turn.query, self.count):
            self.last = self.recent = [asked]
        said = " ".join(text.casefold().replace("\u2019", "'").split())
        if _TAKES_BACK.search(said):
            self.permitted.clear()
            self.wanted.clear()
        earlier = len(self.wanted)
        ruled_out = False
        for clause in parse(text, self.count):
            ruled_out |= clause.negated
            earlier = min(earlier, self.take(clause, earlier))
        if _NEGATIVE.search(said) and not ruled_out and not is_glad(said):
            self.permitted.clear()
        self.permit(parse_plain(text, self.count))

    def replied(self, turn: Turn) -> bool:
        """Read a plain yes or no to the question for leave."""
        asked = _PERMISSION.search(turn.query.strip())
        if not asked or asked[2] not in self.type_of:
            return False
        verb, name = asked[1], asked[2]
        kind = self.type_of[name]
        said = " ".join(turn.utterance.casefold().replace("\u2019", "'").split()).strip(" .!")
        yes = _ASSENT.replace("VERB", verb).replace("NAME", re.escape(name.casefold()))
        if re.fullmatch(rf"{yes}(?:[ ,.!]+{yes})*", said) and said not in ("please", "thanks"):
            self.permitted.add((verb, name))
            if name == readable(kind):
                self.permitted.add((verb, kind))
            self.refused -= {(verb, kind), ("", kind)}
            return True
        if _DENIAL.match(said):
            self.refuse(verb, (kind,))
            self.last = self.recent = [Phrase((kind,))]
            return not parse(turn.utterance, self.count)
        return False

    def take(self, clause: Clause, earlier: int) -> int:
        """Let one clause change what stands; `earlier` requests are of earlier utterances."""
        if clause.verb == "same" and not self.order.verb:
            clause = replace(clause, verb="put" if clause.place else "")
        elif clause.verb == "same":
            again = replace(
                self.order, things=clause.things, place=clause.place or self.order.place
            )
            if clause.corrects:
                self.wanted = [old for old in self.wanted if old not in self.fresh]
            clause = replace(again, excluded=(), liquid=again.liquid if again.things else "")
        said = clause.things or ((Phrase(word="them"),) if clause.verb in _ELLIPTIC else ())
        if not clause.things and clause.verb == "put" and not clause.place:
            said = ()
        things = [found for phrase in said for found in self.meant(phrase, clause.verb)]
        if clause.place and clause.place.word == "there" and not self.place:
            clause = replace(clause, place=None)
        place = next(iter(self.meant(clause.place, "")), None) if clause.place else None
        if clause.negated or clause.verb == "put in":
            self.rule_out(clause, said, things, place)
            self.last = things if clause.things and things else self.last
            return len(self.wanted)
        excluded = {k for phrase in clause.excluded if not phrase.states for k in phrase.types}
        if clause.verb:
            self.order, self.fresh = replace(clause, place=place or clause.place), []
        for thing in things if clause.verb else ():
            kinds = self.fitting(clause.verb, tuple(k for k in thing.types if k not in excluded))
            kinds = self.lift(clause.verb, kinds, thing.group)
            places = self.fitting("", place.types) if place else ()
            places = self.lift("put in", places, place.group) if place else ()
            if not kinds or (clause.place and not places) or kinds == places:
                continue
            self.kept_out -= {(kind, where) for kind in kinds for where in places}
            request = Request(
                clause.verb,
                kinds,
                places,
                thing.every,
                thing.number,
                clause.liquid or (thing.liquid if clause.verb == "fill" else ""),
                self.name(kinds, thing),
                self.name(places, place) if place else "",
                thing.states if sum(self.count[kind] for kind in kinds) > 1 else (),
            )
            self.add(request, earlier)
            self.fresh.append(request)
        self.refused |= {(clause.verb, kind) for kind in excluded}
        for thing in (each for each in clause.excluded if each.states):
            for other in self.meant(thing, clause.verb) if thing.types else things:
                self.narrow(replace(other, states=thing.states))
        if clause.things and things:
            self.last = things
        if place and clause.verb:
            self.recent = [place]
            self.place = place
        self.recent = [*self.recent, *things][-4:] if clause.verb else things or self.recent
        return len(self.wanted)

    def rule_out(
        self, clause: Clause, said: Sequence[Phrase], things: Sequence[Phrase], place: Phrase | None
    ) -> None:
        """Take in a refusal of things, of a place, or of these things in that place."""
        everything = any(phrase.word == "everything" for phrase in said)
        kinds = [kind for thing in things for kind in thing.types]
        if clause.verb == "put in" and not said:
            kinds = [kind for last in self.last for kind in last.types]
        if place and not everything and kinds and clause.verb in ("put", "put in"):
            self.keep_out(kinds, place.types)
            return
        if clause.verb == "put in" or (place and everything and clause.verb == "put"):
            self.refuse("put in", place.types if place else ())
            return
        verb = "" if clause.verb == "any" else clause.verb
        for thing in things:
            if not (thing.states and self.narrow(thing)):
                self.refuse(verb, thing.types)
        if everything:
            self.refuse(verb, tuple(self.count))

    def keep_out(self, kinds: Sequence[str], places: Sequence[str]) -> None:
        """Rule these places out for things of these types, also where they were asked for."""
        self.kept_out |= {(kind, place) for kind in kinds for place in places}
        kept: list[Request] = []
        for old in self.wanted:
            left = tuple(place for place in old.destination_types if place not in places)
            free = tuple(kind for kind in old.object_types if kind not in kinds)
            if len(free) == len(old.object_types) or len(left) == len(old.destination_types):
                kept.append(old)
            elif left:
                kept.append(replace(old, destination_types=left))
            elif free:
                kept.append(replace(old, object_types=free))
        self.wanted = kept

    def narrow(self, thing: Phrase) -> bool:
        """Take things in a refused state out of the requests for their type, if there are any."""
        among = [old for old in self.wanted if {*old.object_types} & {*thing.types}]
        other = tuple((name, _opposite(value)) for name, value in thing.states)
        self.wanted = [
            replace(old, states=tuple(sorted({**dict(old.states), **dict(other)}.items())))
            if old in among and sum(self.count[kind] for kind in old.object_types) > 1
            else old
            for old in self.wanted
        ]
        return bool(among)

    def meant(self, phrase: Phrase, verb: str) -> list[Phrase]:
        """The phrases with types for which a phrase stands; "it" must suit the verb."""
        if phrase.types:
            return [phrase]
        if phrase.word in ("everything", "water", "unknown"):
            return []
        if phrase.word == "there":
            return [self.place] if self.place else []
        if phrase.word == "slice":
            whole = [k.removesuffix("Sliced") for last in self.last for k in last.types]
            kinds = tuple(f"{k}Sliced" for k in whole if f"{k}Sliced" in object_types())
            return [replace(phrase, types=kinds, word="")] if kinds else []
        if phrase.word in ("it", "this", "that"):
            flag = _NEEDS.get(verb, "receptacle" if not verb else "")
            able = [p for p in self.recent if any(flag in object_type(k).flags for k in p.types)]
            return (able or self.last)[-1:]
        return [
            replace(
                last,
                every=phrase.every or (last.every and phrase.word != "one"),
                number=phrase.number or (1 if phrase.word == "one" else last.number),
                states=phrase.states or last.states,
            )
            for last in self.last
        ]

    def fitting(self, verb: str, kinds: Sequence[str]) -> tuple[str, ...]:
        """Those of `kinds` that are here, or may come of what is, and that suit the verb."""
        if verb in ("turn on", "turn off"):
            kinds = tuple(_SWITCHES.get(kind, kind) for kind in kinds)
        here = [k for k in kinds if k in self.count or k.removesuffix("Sliced") in self.count]
        flag = _NEEDS.get(verb, "receptacle" if not verb else "")
        fit = [k for k in here if flag in (self.flags.get(k) or object_type(k).flags)]
        if verb == "cook" and not fit:
            fit = [f"{k}Sliced" for k in here if flag in object_type(f"{k}Sliced").flags]
        return tuple(dict.fromkeys(fit or (here if verb == "use up" else ())))

    def lift(self, verb: str, kinds: tuple[str, ...], group: bool) -> tuple[str, ...]:
        """`kinds` without refused ones; where all are, and were named, they no longer are."""
        verbs = ("put", "pick up") if verb in ("put", "pick up") else (verb,)
        ruled = {(v, k) for v in ("", *verbs) for k in kinds} & self.refused
        free = tuple(k for k in kinds if not any(k == refused for _, refused in ruled))
        if free or group:
            return free
        self.refused -= ruled
        return kinds

    def add(self, request: Request, earlier: int) -> None:
        """Add a request; what it contradicts or repeats makes way."""
        rival = _RIVALS.get(request.verb, request.verb)
        kept: list[Request] = []
        for index, old in enumerate(self.wanted):
            same = _RIVALS.get(old.verb, old.verb) == rival and old.name == request.name
            shared = set(old.object_types) & set(request.object_types)
            again = (old.verb, old.destination_types) == (request.verb, request.destination_types)
            if old.states and request.states and old.states != request.states:
                same = same and index < earlier and old.verb == request.verb and again
            if same and shared and (index < earlier or old.verb != request.verb or again):
                rest = tuple(k for k in old.object_types if k not in shared)
                if not old.every or not rest:
                    continue
                old = replace(old, object_types=rest)
            kept.append(old)
        self.wanted = [*kept, request]

    def refuse(self, verb: str, kinds: Sequence[str]) -> None:
        """Rule out a verb, or with "" any, for these types."""
        self.refused |= {(verb, kind) for kind in kinds}
        self.permitted = {
            (act, what)
            for act, what in self.permitted
            if verb not in ("", act) or self.type_of.get(what, what) not in kinds
        }
        kept: list[Request] = []
        for old in self.wanted:
            types, places = old.object_types, old.destination_types
            if verb in ("", old.verb):
                types = tuple(kind for kind in types if kind not in kinds)
            if verb in ("", "put in"):
                places = tuple(kind for kind in places if kind not in kinds)
            if types and bool(places) == bool(old.destination_types):
                kept.append(replace(old, object_types=types, destination_types=places))
        self.wanted = kept

    def permit(self, orders: Sequence[Clause]) -> None:
        """Take leave for irreversible acts out of plain orders, where one type is meant."""
        named: list[Phrase] = []
        for order in orders:
            for thing in order.things:
                if order.verb in IRREVERSIBLE:
                    self.permit_one(order.verb, thing, named)
            named += [thing for thing in order.things if thing.types]
            named += [order.place] if order.place and order.place.types else []

    def permit_one(self, verb: str, thing: Phrase, named: Sequence[Phrase]) -> None:
        flag = _NEEDS[verb]
        if thing.word == "it":
            able = [p for p in named if any(flag in object_type(k).flags for k in p.types)]
            if len({p.types for p in able}) != 1:
                return
            thing = able[-1]
        kinds = self.fitting(verb, thing.types)
        if thing.group or len(kinds) != 1 or self.refused & {("", kinds[0]), (verb, kinds[0])}:
            return
        if thing.which:
            if name := self.name(kinds, thing):
                self.permitted.add((verb, name))
        elif self.count[kinds[0]] < 2 or thing.every or thing.number:
            self.permitted.add((verb, kinds[0]))

    def name(self, kinds: Sequence[str], phrase: Phrase) -> str:
        """The scene's name for a numbered phrase, where there is one."""
        said = (f"{readable(kind)} {phrase.which}" for kind in kinds if phrase.which)
        return next((name for name in said if name in self.type_of), "")


def _opposite(value: bool | str) -> bool | str:
    return not value if isinstance(value, bool) else {"Hot": "Cold", "Cold": "Hot"}[value]
