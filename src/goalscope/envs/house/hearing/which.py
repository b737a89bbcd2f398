"""Which one of several things was meant: "the one on the desk", "no, the other book"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from goalscope.envs.house.heard import Request
from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.leave import IRREVERSIBLE
from goalscope.envs.house.hearing.phrases import Phrase
from goalscope.envs.house.hearing.standing import Standing
from goalscope.envs.house.hearing.undoing import inverse, was_done
from goalscope.envs.house.meeting import stood_on
from goalscope.envs.house.names import readable, the

__all__ = ["Which"]

_THAT_ONE = re.compile(
    r"(?:(?:no+|nope|sorry|oops|wait|actually|rather|i meant?|(?:but )?not that (?:one|[a-z]+)"
    r"|(?:that's |that is |that was )?(?:the )?wrong (?:one|[a-z]+)|take|use)[ ,.;:!]+)+"
    r"the (?P<thing>[a-z]+(?: [a-z]+)?) (?:(?:that|which)(?:'s| is| was) )?"
    rf"(?:from|at|{'|'.join(v.INTO)}) (?P<place>[a-z0-9 ]+?)(?:,? (?:please|instead))*[ .!]*"
)
"""Another thing of the same kind, by where it is: "not that book, the one on the desk"."""

_NOT_THAT_ONE = re.compile(
    r"(?:(?:no|but|oh|wait|sorry|actually)[ ,.!]+)*(?:not|except|leave) the ones?"
    rf" (?:(?:that|which)(?:'s| is| are| was| were) )?(?:from|at|{'|'.join(v.INTO)})"
    r" (?P<place>[a-z0-9 ]+?)(?:,? please)?[ .!]*"
)
"""Which of several things is left out: "not the one on the desk"."""

_NOT_THIS = re.compile(
    r"(?:(?:no|but|oh|wait|sorry|actually)[ ,.!]+)*(?:not|(?:(?:all|everything|all of them) )?"
    r"(?:except(?: for)?|apart from)|(?:all|everything|all of them) but)"
    r" (?P<thing>(?:the|my) [a-z0-9 ]+?|[a-z ]+ \d+)(?:,? please)?[ .!]*"
)
"""The same by its name: "all but the desk lamp"."""

_OTHER_TOO = re.compile(
    r"(?=.*\b(?:and|also|too|as well)\b)(?:(?:and|now|also|please|yes|ok(?:ay)?)[ ,]+)*"
    r"the other (?P<thing>[a-z]+)(?:,? (?:too|also|as well|please))*[ .!]*"
)
"""One more of what was ordered last: "the other pillow, too"."""

_THE_OTHER = re.compile(
    r"(?:(?:no+|nope|sorry|oops|wait|actually|rather|i meant?|take|use"
    r"|(?:but )?not (?:that|this) (?:one|[a-z]+)"
    r"|(?:that's |that is |that was )?(?:the )?wrong (?:one|[a-z]+))[ ,.;:!]+)+"
    r"the other (?P<thing>[a-z]+)(?:,? (?:please|instead))*[ .!]*"
)
"""The other of two things in the place of what was taken: "no, the other book"."""

_LONGEST = 120
"""Characters of what tells which thing is meant at most."""


@dataclass
class Which(Standing):
    """What stands, where the newest words may tell which thing the last order was about.

    Attributes:
        fresh: The requests of the last order.
        latest: What was asked for last; nothing once something else was spoken of.
        missed: See `Hearing.missed`.
    """

    fresh: list[Request] = field(default_factory=list[Request], init=False)
    latest: list[Request] = field(default_factory=list[Request], init=False)
    missed: list[str] = field(default_factory=list[str], init=False)

    def reverse(self, request: Request, stood: Sequence[Request] = ()) -> None:
        """Ask for the inverse of a request; where it has none and was met, keep that as missed.

        What requests that `stood` before ask for by name stays as it is.
        """
        back = inverse(request, self.start)
        if back is None:
            if not was_done(request, self.objects, self.start):
                return
            name = the(readable(request.object_types[0]))
            self.missed.append(f"I cannot undo that: {request.verb} {name}.")
            return
        earlier, act = len(self.wanted), (request.verb, request.destination_types)
        kept = {old.name for old in stood if (old.verb, old.destination_types) == act}
        for part in self.each_but(kept, back):
            self.newest.append(part)
            self.add(part, earlier)

    def which_one(self, said: str) -> bool:
        """Take in which one of several things was meant by the last order; whether `said` tells."""
        takes = (self._that_one, self._the_other, self._other_too, self._all_but)
        return len(said) <= _LONGEST and any(take(said) for take in takes)

    def _that_one(self, said: str) -> bool:
        """Take in which of several things was meant; whether `said` tells by its place."""
        found = _THAT_ONE.fullmatch(said)
        last = (self.newest or self.latest)[-1:]
        place = self.one_thing(found["place"]) if found else None
        if not found or not place or not last or not inverse(last[0], self.start):
            return False
        (old,) = last
        thing = None if found["thing"] == "one" else self.one_thing(found["thing"])
        named = thing.types if thing else old.object_types if found["thing"] == "one" else ()
        kinds = tuple(kind for kind in old.object_types if kind in named)
        there = [
            each
            for own, each in self.start.items()
            if each["objectType"] in kinds and {*place.types} & stood_on(own, self.start)
        ]
        if not there or old.every or old.number > 1 or sum(self.count[kind] for kind in kinds) < 2:
            return False
        self.wanted = [each for each in self.wanted if each != old]
        new = replace(old, object_types=kinds, name="", states=(), at=place.types)
        if old in self.newest:
            self.newest.remove(old)
        elif was_done(old, self.objects, self.start):
            self.reverse(old)
        self.wanted.append(new)
        self.newest.append(new)
        self.fresh = [new]
        return True

    def _the_other(self, said: str) -> bool:
        """Take in that the other one of two things was meant; whether `said` tells that."""
        found = _THE_OTHER.fullmatch(said)
        last = self.latest[-1:] if not self.newest else []
        if not found or not last or last[0].at:
            return False
        (old,) = last
        if old.number > 1 or (old.every and not old.number):
            return False
        old = replace(old, every=False, number=0)
        thing = None if found["thing"] == "one" else self.one_thing(found["thing"])
        named = thing.types if thing else old.object_types if found["thing"] == "one" else ()
        kinds = [kind for kind in old.object_types if kind in named]
        if thing and not kinds:
            return self._other_spot(old, thing)
        alike = {name: kind for name, kind in self.type_of.items() if kind in kinds}
        ones = [replace(old, object_types=(alike[name],), name=name) for name in alike]
        known = {
            name: [each for each in self.objects if self.named.get(each["objectId"]) == name]
            for name in alike
        }
        done = [one for one in ones if was_done(one, known[one.name], self.start)]
        if len(ones) != 2 or len(done) != 1 or inverse(done[0], self.start) is None:
            return False
        (new,) = (one for one in ones if one not in done)
        self.wanted = [each for each in self.wanted if each != last[0]]
        self.reverse(done[0])
        self.wanted.append(new)
        self.newest.append(new)
        self.fresh = [new]
        return True

    def _other_spot(self, old: Request, place: Phrase) -> bool:
        """Take in that what was put is to go to the other of two places; whether it can."""
        spots = {
            name: kind
            for name, kind in self.type_of.items()
            if kind in place.types and kind in old.destination_types
        }
        moved = [each for each in self.objects if was_done(old, [each], self.start)]
        there = {self.named.get(own) for each in moved for own in each["parentReceptacles"]}
        used = there & spots.keys()
        if old.verb != "put" or len(spots) != 2 or len(used) != 1 or len(moved) != 1:
            return False
        (name,) = spots.keys() - used
        kind, own = moved[0]["objectType"], self.named[moved[0]["objectId"]]
        new = replace(
            old,
            **{"object_types": (kind,), "name": own},
            **{"destination_types": (spots[name],), "destination_name": name},
        )
        self.wanted = [each for each in self.wanted if each != self.latest[-1]]
        self.wanted.append(new)
        self.newest.append(new)
        self.fresh = [new]
        return True

    def _other_too(self, said: str) -> bool:
        """Take in that one more is meant of what was ordered last; whether `said` tells that."""
        found = _OTHER_TOO.fullmatch(said)
        last = (self.newest or self.latest)[-1:]
        if not found or not last or last[0].every or last[0].verb in IRREVERSIBLE:
            return False
        (old,) = last
        thing = None if found["thing"] == "one" else self.one_thing(found["thing"])
        named = thing.types if thing else old.object_types if found["thing"] == "one" else ()
        number = max(old.number, 1) + 1
        alike = [name for name, kind in self.type_of.items() if kind in old.object_types]
        if not {*named} & {*old.object_types} or old.at or len(alike) < number:
            return False
        if old.name and len(alike) > 2:
            return False
        if old.name:
            (other,) = {*alike} - {old.name}
            new = replace(old, name=other)
            self.wanted.append(new)
        else:
            new = replace(old, number=number)
            self.wanted = [new if each == old else each for each in self.wanted]
        self.newest.append(new)
        self.fresh = [new]
        return True

    def _all_but(self, said: str) -> bool:
        """Take in which of all the things is to go back; whether `said` tells that."""
        found = _NOT_THAT_ONE.fullmatch(said) or _NOT_THIS.fullmatch(said)
        last = (self.newest or self.latest)[-1:]
        named = self.one_thing(found[1]) if found else None
        if not found or not named or not last or last[0].at:
            return False
        (old,) = last
        known = ((own, self.named[own]) for own in self.start if own in self.named)
        alike = [(own, name) for own, name in known if self.type_of[name] in old.object_types]
        if found.re is _NOT_THIS:
            one = self.name(named.types, named)
            there = [n for _, n in alike if (n == one if one else self.type_of[n] in named.types)]
        else:
            there = [name for own, name in alike if {*named.types} & stood_on(own, self.start)]
        if not there or len(there) == len(alike) or not (old.every or old.number > 1):
            return False
        ones = {
            name: replace(old, object_types=(self.type_of[name],), name=name, every=False, number=0)
            for _, name in alike
        }
        spared = [inverse(ones[name], self.start) for name in there]
        if None in spared:
            return False
        self.wanted = [each for each in self.wanted if each != old]
        untried = old in self.newest
        self.newest = [each for each in self.newest if each != old]
        kept = [one for name, one in ones.items() if name not in there]
        self.wanted += kept
        if untried:
            self.newest += kept
        else:
            back = [each for each in spared if each and each.object_types]
            self.wanted += back
            self.newest += back
        return True
