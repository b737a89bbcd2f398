"""What is taken back, and what takes the place of what was asked for last."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from textwrap import shorten

from goalscope.envs.house.heard import HOME, Request
from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.grammar import is_exact, parse_plain
from goalscope.envs.house.hearing.orders import Clause
from goalscope.envs.house.hearing.phrases import Phrase, PhraseReader
from goalscope.envs.house.hearing.undoing import inverse, meant_only, was_done
from goalscope.envs.house.hearing.which import Which
from goalscope.envs.speech import evened

__all__ = ["Corrections"]

_OTHER_PLACE = re.compile(
    r"(?:(?:no|sorry|actually|oh)[ ,]+)*not (?:in |on |into |onto |to )?(?P<no>[a-z0-9 ]+)"
    r"(?:[,.;!]+ ?(?:(?:but|rather|instead|and|it's|i meant?)[ ,]+)*(?:in |on |into |onto |to )?"
    r"(?P<rest>.*?)(?: please| instead)?)?[ .!]*"
)
"""A place that is wrong, and after it the right one or an order."""

_INTO = rf"(?:{'|'.join(v.INTO)}) "
_PLACE = re.compile(
    r"(?P<lead>(?:(?:no+|oops|sorry|wait|actually|ok(?:ay)?|thanks|rather|i meant?|i said"
    r"|(?:yes,? )?but|i(?:'ve| have)? changed my mind|on second thoughts?|i'd prefer(?: it| them)?"
    r"|wrong (?:place|spot)|i wanted (?:it|that|them)"
    r"|(?:it|that|they|those) (?:should (?:be|go)|belongs?|goe?s?))\b"
    rf"[ ,.!;:-]*)*)(?P<by>{_INTO})?(?P<place>[a-z0-9 ]+?)"
    rf"(?:,? (?:and |but )?(?:not|instead of|rather than) (?:{_INTO})?(?P<no>[a-z0-9 ]+?))?"
    r"(?P<end>(?:[ ,]+(?:please|instead|i meant?))*)[ .!]*"
)
"""The right place, and perhaps after it the wrong one."""

_OTHER_THING = re.compile(
    r"(?:(?:no+|nope)[ ,.!]+)+(?P<thing>(?:(?:the|my|an?) )?[a-z0-9 ]+?)(?:,? not [a-z0-9 ]+)?"
    r"(?: please)?[ .!]*"
)
"""Another thing than that of the last order."""

_THERE = frozenset(("there", "in there", "that", "here"))
"""Words for the place of the last put."""

_LONGEST = 120
"""Characters of a correction of a place at most."""

_HOW_MANY = v.NUMBERS.keys() | v.PRONOUNS | {"of"}
"""Words that tell of how many things alone, and not which."""


@dataclass
class Corrections(Which):
    """What stands, where the newest words may correct or undo the last ones.

    Attributes:
        order: The last one, for words that repeat it or name another place.
        steps: The orders of the newest words, each with its requests.
        former: The same of those before that gave orders.
        apart: Whether something else was spoken of since the last order, such as an aim.
        exact: See `Hearing.exact`.
        asked: See `Hearing.asked`.
        undone: See `Hearing.undone`.
        queried: What the agent's last question named first.
        elsewhere: Whether it asked where.
        acted: The things of the last order.
        orders: For each utterance that was no remark, what it asked for; nothing if that was an
            aim.
    """

    order: Clause = field(default=Clause(""), init=False)
    steps: list[tuple[Clause, list[Request]]] = field(
        default_factory=list[tuple[Clause, list[Request]]], init=False
    )
    former: list[tuple[Clause, list[Request]]] = field(
        default_factory=list[tuple[Clause, list[Request]]], init=False
    )
    apart: bool = field(default=False, init=False)
    exact: bool = field(default=False, init=False)
    undone: str = field(default="", init=False)
    queried: Phrase | None = field(default=None, init=False)
    elsewhere: bool = field(default=False, init=False)
    acted: list[Phrase] = field(default_factory=list[Phrase], init=False)
    asked: list[Request] = field(default_factory=list[Request], init=False)
    orders: list[list[Request]] = field(default_factory=list[list[Request]], init=False)

    def corrected(self, text: str, *, alone: bool) -> str:
        """Take in another place for what was put last; what is left to be read is given back.

        "No, on the sofa", "I meant the shelf, not the desk", "not the fridge, the bowl". A plain
        "no, the plate" is given back as the correction that it is.

        Args:
            text: What was said.
            alone: Whether that is all.
        """
        head, _, tail = text.partition(". ")
        first, _, more = re.sub(r",? and (?:then )?", "\n", text, count=1).partition("\n")
        orders = [(first, more)] if any(c.verb for c in parse_plain(more, self.count)) else []
        for part, rest in ((text, ""), (head, tail), *orders):
            said = evened(part)
            left = "" if self.which_one(said) else self._moved_on(said)
            left = self._other_thing(said) if left is None else left
            if left is not None:
                rest = f"{left.rstrip('. ')}. {rest}" if left else rest
                if alone:
                    self.exact = not rest or is_exact(rest, self.count, repeats=True)
                return rest
        return text

    def _moved_on(self, said: str) -> str | None:
        """Take in another place; what else is `said` behind it, None if it names none."""
        found = _OTHER_PLACE.fullmatch(said)
        if found and (last := self._put_last(found["no"])):
            rest = found["rest"] or ""
            yes, no = self.one_thing(rest), self.one_thing(found["no"])
            if yes and "receptacle" in self.flags_of(yes) and self._move(last, yes, no):
                return ""
            if no:
                self.keep_out([kind for old in last for kind in old.object_types], no.types)
                return rest
        found = _PLACE.fullmatch(said) if len(said) <= _LONGEST else None
        place = self.one_thing(found["place"]) if found else None
        if not found or not place or " of " in found["place"]:
            return None
        if not found["by"] and found["place"].split()[0] in v.BASE:
            return None
        last = self._put_last(found["no"] or "", found["by"] or "")
        wrong = self.one_thing(found["no"] or "")
        asked = self.newest or self.latest
        touched = {k for old in asked for k in (*old.object_types, *old.destination_types)}
        if wrong and not last and touched and touched.isdisjoint(wrong.types):
            told = shorten(said.rstrip(" .!"), 80, placeholder=" ...")
            self.missed.append(f"I did not understand: {told}.")
            return ""
        kinds = {kind for old in last for kind in (*old.object_types, *old.destination_types)}
        other = self.queried and kinds.isdisjoint(self.queried.types)
        marked = found["lead"] or found["end"] or not (other or self.elsewhere)
        whole = found["by"] or found["no"] or "pickupable" not in self.flags_of(place)
        if not (found["no"] or (marked and not other)) or not whole:
            return None
        return "" if self._move(last, place, wrong) else None

    def elsewhere_than(self, text: str) -> str:
        """The order in "not on the chair, on the bed", said of a thing that was just named."""
        found = _OTHER_PLACE.fullmatch(evened(text))
        rest = (found["rest"] or "") if found else ""
        no, yes = self.one_thing(found["no"] if found else ""), self.one_thing(rest)
        if not no or not yes or "receptacle" not in self.flags_of(yes):
            return text
        self.keep_out([kind for thing in self.last for kind in thing.types], no.types)
        return f"put them in {rest}"

    def _other_thing(self, said: str) -> str | None:
        """The correction for which a plain "no, the plate" stands; None if `said` is none."""
        found = _OTHER_THING.fullmatch(said) if len(said) <= _LONGEST else None
        thing = self.one_thing(found["thing"]) if found else None
        asked = {kind for each in self.acted for kind in each.types}
        if not found or not thing or (self.queried and asked.isdisjoint(self.queried.types)):
            return None
        if {"other", *v.LIQUIDS} & {*found["thing"].split()} or (self.apart and not self.newest):
            return None
        steps = self.steps or self.former
        vessel = {"receptacle", "pickupable"}
        if vessel <= self.flags_of(thing) and not all(
            vessel <= self.flags_of(p) for p in self.acted
        ):
            return None  # perhaps it is where the last thing should go
        fits = any(self.fitting(order.verb, thing.types) for order, _ in steps)
        return f"actually {said[found.start('thing') :]}" if fits else None

    def _put_last(self, no: str = "", by: str = "") -> list[Request]:
        """What the last orders put to one place: `no`, or the last one if that is not said."""
        last = self.newest or self.latest
        puts = [each for each in last if each.verb == "put"]
        if no and (wrong := self.one_thing(no)):
            for group in (last, *reversed(self.orders)):
                put = [each for each in group if each.verb == "put"]
                if there := [r for r in put if {*wrong.types} & {*r.destination_types}]:
                    return there
            return []
        if not puts or (no and no not in _THERE) or not (no or by or last[-1].verb == "put"):
            return []
        return [each for each in puts if each.destination_types == puts[-1].destination_types]

    def _move(self, last: Sequence[Request], place: Phrase, no: Phrase | None) -> bool:
        """Ask for another place for what was put; whether there is anything to put there."""
        places = self.lift("put in", self.fitting("", place.types), place.group)
        if not last or not places:
            return False
        self.order, self.fresh = Clause("put", place=place), []
        things: list[Phrase] = []
        for old in last:
            kinds = self.lift("put", old.object_types, group=False)
            if no:
                self.keep_out(kinds, [kind for kind in no.types if kind not in places])
            self.kept_out -= {(kind, where) for kind in kinds for where in places}
            number = old.number if old.number > 1 else 0
            new = replace(
                old,
                **{"destination_types": places, "destination_name": self.name(places, place)},
                **{"number": number, "passing": False},
            )
            self.add(new, len(self.wanted))
            self.fresh.append(new)
            which = int(old.name.rpartition(" ")[2]) if old.name else 0
            things.append(
                Phrase(kinds, "", old.every, number, which=which, states=old.states, at=old.at)
            )
        self.newest += self.fresh
        self.steps.append((self.order, self.fresh))
        self.place, self.last, self.acted, self.recent = place, things, things, [place, *things]
        return True

    def meant_only(self, text: str) -> str:
        """Take in "not those, only the laptop" after an order; what it did besides goes back."""
        found = meant_only(evened(text))
        untried = [*self.newest]
        last = untried or (self.orders[-1] if self.orders else [])
        if not found:
            return text
        no, yes = (PhraseReader(re.findall(r"[a-z0-9]+|,", part), self.count) for part in found[:2])
        (things, end), (wrong, _) = yes.things(0), no.things(0)
        asked = {kind for each in last for kind in each.object_types}
        named = {kind for thing in wrong for kind in thing.types}
        clear = end == len(yes.words) and all(thing.is_named for thing in things)
        vague = all(word in _HOW_MANY or word.isdigit() for word in yes.words)
        if not (clear or vague) or named - asked or not (last or (wrong and not named)):
            return text
        self.exact = True
        if vague or not last:
            self.missed.append(f"I did not understand: {shorten(text, 80, placeholder=' ...')}.")
            return ""
        double = len(self.steps or self.former) > 1
        if named and not found[2] and (untried or double or " meant " not in evened(text)):
            return f"actually {found[1]}, not {found[0]}"
        kept = {k for t in things for k in t.types if not (t.described or t.which)} & asked
        several = [old for old in last if old.verb == "put" or old.name or old.every or old.number]
        known = [(old, self.fitting(old.verb, t.types), t) for old in several for t in things]
        names = {self.name(kinds, t) for old, kinds, t in known if {*kinds} & {*old.object_types}}
        more = [old for old in last if not old.name or old.name not in names]
        for each in more:
            stay = tuple(kind for kind in each.object_types if kind in kept)
            ones = [
                replace(each, object_types=(kind,), name=name, every=False, number=0)
                for name in sorted(names - {""})
                if (kind := self.type_of[name]) in each.object_types
            ]
            if kinds := tuple(kind for kind in each.object_types if kind not in kept):
                self.drop_leave(kinds)
                right = [replace(each, object_types=stay)] if stay else []
                self.wanted = [*(old for old in self.wanted if old != each), *right, *ones]
                if untried:
                    self.newest += [*right, *ones]
                else:
                    self.reverse(replace(each, object_types=kinds), ones)
                    still = [r for r in right if not was_done(r, self.objects, self.start)]
                    self.wanted = [old for old in self.wanted if old not in still] + still
                    self.newest += still
        return "" if kept or (more and names - {""}) else f"actually {found[1]}"

    def correct(self, clause: Clause) -> None:
        """Take back the last requests where a clause takes their place; it names other things."""
        named = {kind for thing in clause.things for kind in thing.types}
        if not clause.corrects or not named:
            return
        no = {kind for thing in clause.excluded for kind in thing.types}
        alike = [
            old
            for old in self.wanted
            if old.verb == self.order.verb
            and not named.isdisjoint(old.object_types)
            and (old in self.fresh or old.destination_types != (HOME,))
        ]
        about = [old for old in self.fresh if not no.isdisjoint(old.object_types)]
        wrong = about or alike or self.fresh
        self.wanted = [old for old in self.wanted if old not in wrong]
        every = {k for thing in clause.things if not thing.which for k in thing.types}
        names = {self.name(thing.types, thing) for thing in clause.things} - {""}
        for old in wrong:
            again = old.name in names or every.issuperset(old.object_types)
            if again and inverse(old, self.start) is None:
                continue
            left = tuple(kind for kind in old.object_types if kind not in every)
            other = replace(old, object_types=left or old.object_types)
            if old not in self.newest and was_done(other, self.objects, self.start):
                self.reverse(other)

    def repeated(self, clause: Clause) -> list[tuple[Clause, list[Request]]]:
        """The orders that a thing alone repeats, each with its requests.

        Those about what it takes the place of; else the last one of it, or that suits it.
        """
        steps = self.steps or self.former
        no = {kind for thing in clause.excluded for kind in thing.types}
        about = [each for each in steps if any(no & {*old.object_types} for old in each[1])]
        kinds = [kind for thing in clause.things for kind in thing.types]
        fit = [each for each in steps if self.fitting(each[0].verb, kinds)]
        own = [each for each in fit if any({*kinds} & {*old.object_types} for old in each[1])]
        one = own[-1:] or fit[-1:] or [(self.order, self.fresh)]
        return (about if clause.corrects else []) or one
