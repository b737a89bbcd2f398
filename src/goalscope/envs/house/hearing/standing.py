"""What stands of all that was asked for, ruled out and allowed: later words before earlier ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

from goalscope.envs.house.heard import Request
from goalscope.envs.house.hearing.leave import IRREVERSIBLE
from goalscope.envs.house.hearing.orders import Clause
from goalscope.envs.house.hearing.phrases import Phrase
from goalscope.envs.house.hearing.referents import Referents
from goalscope.envs.house.meeting import NEEDS
from goalscope.envs.house.simulator.object_types import object_type

__all__ = ["Standing"]

_RIVALS = {
    **dict.fromkeys(("put", "pick up"), "place"),
    **dict.fromkeys(("open", "close"), "openness"),
    **dict.fromkeys(("turn on", "turn off"), "power"),
    **dict.fromkeys(("fill", "empty"), "liquid"),
    **dict.fromkeys(("clean", "dirty"), "dirt"),
}
"""Of two requests for one thing with one of these words, the later stands."""


@dataclass
class Standing(Referents):
    """What stands, in a scene.

    Attributes:
        wanted: Requests, in their order.
        refused: Pairs of a verb and an object type; see `Hearing.refused`.
        kept_out: Pairs of an object type and the type of a place where it may not be put.
        permitted: For how many things an irreversible verb is allowed, by the verb and the object
            type or the name; 0 stands for all.
        guarded: Pairs of an irreversible verb and an object type for which an order is no leave:
            it was ruled out, or a person wants to be asked first.
    """

    wanted: list[Request] = field(default_factory=list[Request], init=False)
    refused: set[tuple[str, str]] = field(default_factory=set[tuple[str, str]], init=False)
    kept_out: set[tuple[str, str]] = field(default_factory=set[tuple[str, str]], init=False)
    permitted: dict[tuple[str, str], int] = field(
        default_factory=dict[tuple[str, str], int], init=False
    )
    guarded: set[tuple[str, str]] = field(default_factory=set[tuple[str, str]], init=False)

    def drop_leave(self, kinds: Collection[str]) -> None:
        """Take back leave for things of these types."""
        for act, what in list(self.permitted):
            if self.type_of.get(what, what) in kinds:
                del self.permitted[act, what]

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
        self.drop_leave(thing.types)
        return bool(among)

    def limit(self, request: Request) -> None:
        """Let leave be for no more things than were asked for since."""
        for kind in request.object_types if request.number else ():
            most = self.permitted.get((request.verb, kind))
            if most is not None:
                self.permitted[request.verb, kind] = min(most or 99, request.number)

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
            if same and shared and index >= earlier and _moves_on(old, request):
                old = replace(old, passing=True)
            kept.append(old)
        self.wanted = [*kept, request]

    def each_but(self, kept: set[str], back: Request) -> list[Request]:
        """An inverse; where it is for every thing, and some are `kept` by name, one for each."""
        if not back.every or kept.isdisjoint(self.type_of):
            return [back] if back.object_types else []
        return [
            replace(back, object_types=(kind,), name=name, every=False)
            for name, kind in self.type_of.items()
            if kind in back.object_types and name not in kept
        ]

    def ban(self, verb: str, kinds: Sequence[str]) -> None:
        """Rule out as `refuse` does; a later order for what cannot be undone is asked about."""
        acts = [act for act in IRREVERSIBLE if verb in ("", act)]
        self.guarded |= {(act, kind) for act in acts for kind in kinds}
        self.refuse(verb, kinds)

    def refuse(self, verb: str, kinds: Sequence[str]) -> None:
        """Rule out a verb, or with "" any, for these types."""
        self.refused |= {(verb, kind) for kind in kinds}
        self.permitted = {
            (act, what): number
            for (act, what), number in self.permitted.items()
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
                    self._permit_one(order.verb, thing, named)
            named += [thing for thing in order.things if thing.types]
            named += [order.place] if order.place and order.place.types else []

    def _permit_one(self, verb: str, thing: Phrase, named: Sequence[Phrase]) -> None:
        flag = NEEDS[verb]
        if thing.word == "it":
            able = [p for p in named if any(flag in object_type(k).flags for k in p.types)]
            if len({p.types for p in able}) != 1:
                return
            thing = replace(able[-1], every=False)
        kinds = self.fitting(verb, thing.types)
        if thing.group or len(kinds) != 1 or (verb, kinds[0]) in self.guarded:
            return
        if self.refused & {("", kinds[0]), (verb, kinds[0])}:
            return
        few = self.count[kinds[0]] < 2
        if thing.which:
            if name := self.name(kinds, thing):
                self.permitted[verb, name] = 1
        elif few or (not thing.described and (thing.every or thing.number)):
            self.permitted[verb, kinds[0]] = thing.number or (0 if thing.every else 1)


def _moves_on(old: Request, new: Request) -> bool:
    """Whether what one request moves, another of the same words moves again."""
    return (
        old.verb == new.verb == "put"
        and old.every == new.every
        and old.states == new.states
        and old.at == new.at
        and (new.every or not new.number)
        and {*new.object_types} >= {*old.object_types}
    )


def _opposite(value: bool | str) -> bool | str:
    return not value if isinstance(value, bool) else {"Hot": "Cold", "Cold": "Hot"}[value]
