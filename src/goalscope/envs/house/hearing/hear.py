"""What people ask for in a house, what they rule out, and what they allow."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

from goalscope.envs.house.heard import HOME, Hearing, Leave, Request
from goalscope.envs.house.hearing import leave
from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.aims import is_aim
from goalscope.envs.house.hearing.asking_first import acts_to_ask_for, is_only_a_wish
from goalscope.envs.house.hearing.completion import completes
from goalscope.envs.house.hearing.grammar import is_exact, parse, parse_plain
from goalscope.envs.house.hearing.leave import IRREVERSIBLE, ask_permission
from goalscope.envs.house.hearing.misses import Misses
from goalscope.envs.house.hearing.orders import Clause
from goalscope.envs.house.hearing.phrases import Phrase, first_named
from goalscope.envs.house.hearing.referents import TO_SLICES
from goalscope.envs.house.hearing.rewording import amended, normal
from goalscope.envs.house.hearing.sentences import reworded, sentences
from goalscope.envs.house.hearing.undoing import besides_guesses
from goalscope.envs.house.names import names, naming
from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import agrees, evened, kept, lowered
from goalscope.types import TakenBack, Turn

__all__ = ["IRREVERSIBLE", "Hearing", "Leave", "Request", "ask_permission", "completes", "hear"]

_OTHER = re.compile(
    r"(?!i\b|i'd|we\b|let|don't|do not|never)[^?]*(?:\binstead|(?<!not )\bthe other ones?)"
    r"(?: please)?[ .!]*"
)
"""What corrects the last order, if anything can be made of it."""

_NEAR = ("next to", "in front of", "close to", "beside", "near", "under", "above", "behind")

_ABOUT_IT = re.compile(
    r"(?P<lead>(?:(?:no+|nope|not|oops|sorry|wait|actually|rather|i meant?|i said)\b[ ,.!]*+)++)"
    r"(?!(?:some|any)\w*|(?:(?!\?).)*\b(?:am|is|are|was|were|has|have|had|i|we|he|she|they|it"
    r"|want|need|like|love)\b)[^?]*"
    rf"|(?P<to>{'|'.join((*v.INTO, *_NEAR))}) (?P<place>[a-z0-9 ]+?)(?P<end>,? please)?[ .!]*"
    r"|you (?:should(?! be able| find| see)|forgot|missed|put|took|moved|left)\b[^?]*"
)
"""What is said about the last order, as far as its words tell."""

_WHICH = (
    "the a an my our your this that these those one ones other others another wrong both all",
    "and or not of there here please instead",
)
_POINTING = {*" ".join((*v.INTO, *_NEAR, *v.NUMBERS, *_WHICH)).split()}
"""Words that tell, beside names, which thing or place is meant."""

_NOT_THAT = re.compile(
    r"(?<=[.!?;])\s+(?=(?:(?:no|oh|oops|wait|sorry|actually)[ ,]+)*not\b)"
    r"|(?<=[.,!?;])\s+(?=(?:(?:no|oh|oops|wait|sorry|actually)[ ,]+)+(?:i meant? )?the one\b)"
    r"|(?<=[.,!?;])\s+(?=(?:(?:(?:no|oh|oops|wait|sorry|actually)[ ,]+)+(?:i meant? )?|i meant? )"
    r"(?:(?:in|into|on|onto|to) )?(?:the|my|our) \w+(?: (?!and\b)\w+)?(?:,? please)?[ .!]*$)",
    re.IGNORECASE,
)
"""Where words begin that may correct those before them."""

_NO_WAIT = re.compile(r"^(?:no,? wait|wait,? no)\b", re.IGNORECASE)

_AT_PLACE = re.compile(
    r"\b(?:i|we)(?:'ll|'m|'re| will| am| are)(?: (?:be|sit|make|eat|use|have|drink|read|work|wait"
    r"|sitting|making|eating|using|having|drinking|reading|working|waiting))?"
    r"(?: (?:it|them|that|dinner|lunch|breakfast|waiting|sitting|down|over|there))*"
    r" (?:at|on) (?P<place>(?:the|my|our) [a-z0-9 ]+?)(?=[.;!?,]|$)"
)
"""Where a person says that they are, or will use what they ask for."""

_STANDS = ("wanted", "refused", "guarded", "kept_out", "staying", "orders")
"""What words change that are not taken back."""

_IT = frozenset(("it", "that", "this", "them", "those"))
"""Words for what was spoken of last."""

_ELLIPTIC = frozenset(("put", "clean", "slice", "cook", "fill"))
"""Verbs that may stand without saying what: "rinse with water"."""


def hear(
    turns: Sequence[Turn],
    objects: Sequence[Mapping[str, Any]],
    named: Mapping[str, str] | None = None,
    start: Mapping[str, Mapping[str, Any]] | None = None,
) -> Hearing:
    """Read a conversation in its order, in a scene with these objects.

    Args:
        turns: What was asked and said.
        objects: AI2-THOR's metadata of the objects; where they are is read off `start`.
        named: The objects' names by their ids, where they are not those of `names(objects)`.
        start: The objects' metadata at the start, by their ids.
    """
    listener = _Listener(objects, names(objects) if named is None else named, start or {})
    for turn in turns:
        stood = listener.stands() if isinstance(turn, TakenBack) else None
        listener.hear(turn)
        if stood:
            listener.go_back(stood)
    return Hearing(
        tuple(listener.wanted),
        frozenset(listener.refused),
        frozenset(listener.kept_out),
        frozenset(listener.staying),
        tuple(sorted((*leave, number) for leave, number in listener.permitted.items())),
        tuple(request for request in listener.wanted if request in listener.newest),
        tuple(dict.fromkeys(listener.missed)),
        listener.exact,
        tuple(listener.asked),
        listener.stuck,
        listener.undone,
    )


@dataclass
class _Listener(Misses):
    """Takes in one turn after the other.

    Attributes:
        staying: See `Hearing.staying`.
    """

    staying: set[str] = field(default_factory=set[str], init=False)

    def hear(self, turn: Turn) -> None:
        """Take in one turn."""
        self.wanted = [old for old in self.wanted if not old.passing]
        self.newest, self.missed, self.stuck = [], [], False
        self.remember()
        self.former, self.steps = self.steps or self.former, []
        self.elsewhere = "where" in lowered(turn.query)
        if asked := first_named(turn.query, self.count):
            self.last = self.recent = [asked]
        self.queried = asked
        text = self.replied(turn)
        said = lowered(text)
        text = amended(kept(text.replace("\u2019", "'")))
        text = self.keep_asking(reworded(text))
        called_back = bool(said) and not text
        self.exact = called_back or is_exact(text, self.count, repeats=bool(self.order.verb))
        rest, before = besides_guesses(evened(text)), [*self.wanted]
        self.undone = "" if rest is None else "guesses"
        if rest is not None:
            self.exact = True
            self.permitted.clear()
            text = " ".join(each for each in sentences(rest) if not is_remark(each))
        elif leave.takes_back(said):
            self.permitted.clear()
            self.wanted.clear()
        ruled = self.ruled()
        if leave.hesitates(said):
            self.drop_leave(self.spoken_of(text))
        ruled_out = self.keep_whole(said)
        earlier = len(self.wanted)
        first, *others = _NOT_THAT.split(text)
        parts = [first, *(_NO_WAIT.sub("no", each) for each in others)]
        parts = [] if leave.takes_back(said) and is_remark(text) else parts
        exact: list[bool] = []
        for number, part in enumerate(parts):
            exact.append(is_exact(part, self.count, repeats=number > 0))
            named = self.spoken_of(" ".join(parts[:number])) != {*self.type_of.values()}
            if self.newest or not named:  # not for "The apple? No, not in the fridge"
                meant = self.corrected(part, alone=part == text)
                left = not meant or is_exact(meant, self.count, repeats=True)
                exact[-1] = exact[-1] or (number > 0 and left)
                part = meant
            else:
                part = self.elsewhere_than(part)
            left = self.meant_only(part)
            for clause in parse(left, self.count):
                ruled_out |= clause.negated
                earlier = min(earlier, self.take(clause, earlier))
        self.exact = self.exact or (len(exact) > 1 and all(exact))
        self.serve_at(evened(text))
        if leave.doubts(said) and not ruled_out:
            self.permitted.clear()
        self.permit(parse_plain(text, self.count))
        self.asked += self.newest
        silent = not (self.newest or self.missed or self.undone)
        aims = self.exact and is_aim(said.rstrip(" .!")) and v.LATER not in normal(text)
        other = _OTHER.fullmatch(said) or self.is_lost(evened(text), ruled)
        other = self.order.verb and other and not is_remark(text)
        if silent and (aims or other):
            self.exact = False
            self.puzzle(Clause("", said=" ".join(text.split()).rstrip(" .!")))
        ordered = [*self.newest]
        known = self.exact or self.stuck
        if ordered or not (rest is not None or (known and self.wanted == before)):
            self.orders.append(ordered)
        put = {k for old in self.latest for k in (*old.object_types, *old.destination_types)}
        if ordered or self.stuck:
            self.apart = False
        elif not (self.exact or agrees(text)) or (put and put.isdisjoint(self.spoken_of(text))):
            self.apart = True
        self.latest = ordered or ([] if self.apart else self.latest)

    def stands(self) -> dict[str, Any]:
        """A copy of what stands."""
        return {name: copy(getattr(self, name)) for name in _STANDS}

    def go_back(self, stood: Mapping[str, Any]) -> None:
        """Have stand again what stood before; leave that was given is taken back, too."""
        vars(self).update(stood)
        self.permitted.clear()

    def serve_at(self, said: str) -> None:
        """Put what is to be brought, if it is several things, where the person will use it."""
        found = _AT_PLACE.search(said)
        place = self.one_thing(found["place"]) if found else None
        brought = [each for each in self.newest if each.verb == "pick up"]
        if (
            not place
            or sum(max(each.number, 1) for each in brought) < 2
            or "pickupable" in self.flags_of(place)
        ):
            return
        places = self.lift("put in", self.fitting("", place.types), place.group)
        for each in brought if places else ():
            put = replace(each, verb="put", destination_types=places)
            self.newest[self.newest.index(each)] = put
            self.wanted = [put if old == each else old for old in self.wanted]

    def ruled(self) -> object:
        """What stands besides leave, to be compared."""
        return [*self.wanted], {*self.refused}, {*self.kept_out}, {*self.staying}

    def is_lost(self, said: str, ruled: object) -> bool:
        """Whether `said` tells of the last order what nothing was made of.

        Args:
            said: What was said, evened.
            ruled: What stood before.
        """
        found = _ABOUT_IT.fullmatch(said)
        if not found or self.exact or self.apart or ruled != self.ruled():
            return False
        if found["to"]:
            put = self.order.verb == "put" and self.one_thing(found["place"])
            return not self.elsewhere and bool(found["end"] or put)
        lead = found["lead"] or ""
        if lead and "meant" not in lead and not self.is_pointing(said[len(lead) :]):
            return False
        pointed = re.search(r"\b(?:others?|ones?|there|here)\b", said)
        return bool(pointed or first_named(said, self.count))

    def is_pointing(self, said: str) -> bool:
        """Whether all of `said` tells which things and places are meant."""
        words, i = re.findall(r"[a-z0-9']+", said), 0
        while i < len(words):
            named = naming(words, i, self.count)
            if not named and words[i] not in _POINTING and not words[i].isdigit():
                return False
            i = named.end if named else i + 1
        return True

    def replied(self, turn: Turn) -> str:
        """Read a plain yes or no to the question for leave; what else is said is left."""
        verb, name = leave.asked(turn.query) or ("", "")
        kind = self.type_of.get(name, "")
        said = lowered(turn.utterance)
        if not kind:
            return turn.utterance
        rest = leave.assented(said, verb, name, self.count)
        if rest is not None:
            self.permitted[verb, name] = 1
            self.refused -= {(verb, kind), ("", kind)}
            rest = f"{verb} {name}. {rest}"  # it is done whatever the goals would have now
        elif leave.denies(said):
            self.refuse(verb, (kind,))
            if not parse(turn.utterance, self.count):
                self.keep_whole(said)
                return ""
        return turn.utterance if rest is None else rest

    def keep_asking(self, text: str) -> str:
        """Take in what a person wants to be asked about first; what else is said is left."""
        left, here = list[str](), {*self.type_of.values()}
        for sentence in sentences(text):
            said = evened(sentence)
            kinds = self.spoken_of(sentence)
            if re.search(r"\b(?:else|other)\b", said):
                kinds = here - self.spoken_of(text) or here
            self.guarded |= {(act, kind) for act in acts_to_ask_for(said) for kind in kinds}
            if not is_only_a_wish(said) or any(each.things for each in parse(sentence, self.count)):
                left.append(sentence)
        return " ".join(left) if len(left) < len(sentences(text)) else text

    def keep_whole(self, said: str) -> bool:
        """Take in wishes such as "leave it whole"; whether there were any."""
        found = False
        for verbs, things in leave.keeps(said, self.count):
            phrases = [each for thing in things for each in self.meant(thing, "any")]
            kinds = [kind for each in phrases or self.last for kind in each.types]
            for verb in verbs:
                self.ban(verb, kinds)
            self.drop_leave(kinds)
            found = found or bool(kinds)
        return found

    def take(self, clause: Clause, earlier: int) -> int:
        """Let one clause change what stands; `earlier` requests are of earlier utterances."""
        named = clause.aside.types if clause.aside else ()
        there = not named or any({*named} & {*thing.types} for thing in self.acted)
        if clause.verb == "same" and self.order.verb and not self.moves(clause):
            named = [p for p in self.last if p in self.acted] or self.acted
            for order, fresh in self.repeated(clause):
                self.order, self.fresh = order, fresh
                place = clause.place or (order.place if there else None)
                again = replace(order, things=clause.things, place=place)
                self.correct(clause)
                again = replace(again, excluded=(), liquid=again.liquid if again.things else "")
                earlier = min(earlier, self.follow(again, earlier))
            if not clause.corrects:
                self.last = [*(p for p in named if p not in self.last), *self.last]
            return earlier
        if clause.verb == "same":
            clause = replace(clause, verb="put" if clause.place or named else "", excluded=())
        elif clause.verb == self.order.verb:
            self.correct(clause)
        return self.follow(clause, earlier)

    def moves(self, clause: Clause) -> bool:
        """Whether a thing with a place repeats no order, but is to be put there."""
        kinds = [kind for thing in clause.things for kind in thing.types]
        orders = self.repeated(clause) if kinds and (clause.place or clause.aside) else []
        return bool(orders) and not any(self.fitting(each.verb, kinds) for each, _ in orders)

    def follow(self, clause: Clause, earlier: int) -> int:
        """Let a clause change what stands that repeats none."""
        ordered = {kind for old in self.wanted for kind in old.object_types}
        away = any({*thing.types} & ordered for thing in clause.things)
        if clause.alone and not (clause.negated or away):
            clause = replace(clause, verb="any", place=None, negated=True)
        said = clause.things or ((Phrase(word="them"),) if clause.verb in _ELLIPTIC else ())
        if not clause.things and clause.verb == "put" and not clause.place:
            said = ()
        things = [
            self.sliced(found) if clause.verb in TO_SLICES and not phrase.types else found
            for phrase in said
            for found in self.meant(phrase, clause.verb)
        ]
        if aside := clause.verb != "same" and clause.aside:
            things = [self.nearest(each, aside) for each in things]
        home = bool(clause.place and clause.place.word == "home")
        if (
            home
            and self.queried
            and self.recent == [self.queried]
            and any(each.word in _IT for each in said)
        ):
            things = self.acted or things
        if home and all(each.word in _IT and each.number < 2 for each in said):
            several = any(each.word in ("them", "those") and not each.number for each in said)
            things = [
                replace(
                    each, every=several or each.every or each.number > 1, number=0, at=(), states=()
                )
                for each in things
            ]
        self.miss(clause, things)
        if home and not (clause.later or clause.negated):
            every = any(each.word == "everything" for each in said)
            self.undone = self.undone or ("besides" if every else "")
        if clause.place and clause.place.word == "there" and not self.place:
            clause = replace(clause, place=None)
        place = next(iter(self.meant(clause.place, "")), None) if clause.place else None
        if clause.verb == "slice" and clause.place:
            at = place.types if place else ()
            said = tuple(replace(each, at=at) for each in said)
            things = [replace(each, at=at) for each in things]
            clause, place = replace(clause, place=None), None
        if clause.later:
            self.put_off(clause, things)
            self.last = things or self.last
            return len(self.wanted)
        if clause.negated or clause.verb == "put in":
            self.rule_out(clause, said, things, place)
            if clause.things and things:
                self.last, self.recent = things, [*self.recent, *things][-4:]
            return len(self.wanted)
        if any(phrase.which for phrase in clause.excluded):
            self.puzzle(clause)
            return len(self.wanted)
        excluded = {k for phrase in clause.excluded if not phrase.states for k in phrase.types}
        named = {k for each in said if not (each.every or each.group) for k in each.types}
        excluded -= named if excluded > named else set()
        if clause.verb:
            self.order, self.fresh = replace(clause, place=place or clause.place), []
            self.steps.append((self.order, self.fresh))
        for thing in things if clause.verb else ():
            kinds = self.fitting(clause.verb, tuple(k for k in thing.types if k not in excluded))
            kinds = self.lift(clause.verb, kinds, thing.group)
            places = place.types if place else ()
            if place and places != (HOME,):
                places = self.lift("put in", self.fitting("", places), place.group)
            spared = home and bool(excluded) and excluded.issuperset(thing.types)
            if not spared and (not kinds or (clause.place and not places)):
                self.lacking(clause, said, place if kinds else thing)
            if not kinds or (clause.place and not places) or kinds == places:
                continue
            self.kept_out -= {(kind, where) for kind in kinds for where in places}
            moved = {place for new in self.newest for place in new.destination_types}
            lasts = clause.verb in ("slice", "break") and any(each.at for each in said)
            lasts = lasts and moved.isdisjoint(thing.at)
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
                thing.at if lasts or sum(self.count[kind] for kind in kinds) > 1 else (),
            )
            self.add(request, earlier)
            self.fresh.append(request)
            self.newest.append(request)
            self.limit(request)
        if not home:
            self.refused |= {(clause.verb, kind) for kind in excluded}
            self.staying |= excluded if clause.verb == "put" else set()
        if clause.verb:
            self.staying -= {kind for new in self.fresh for kind in new.object_types}
        for thing in (each for each in clause.excluded if each.states):
            for other in self.meant(thing, clause.verb) if thing.types else things:
                self.narrow(replace(other, states=thing.states))
        if clause.things and things:
            self.last = things
            self.acted = things if clause.verb else self.acted
        if place and clause.verb:
            self.recent = [place]
            self.place = place
        self.recent = [*self.recent, *things][-4:] if clause.verb else things or self.recent
        return len(self.wanted)

    def put_off(self, clause: Clause, things: Sequence[Phrase]) -> None:
        """Take in that something is wanted later, and so not now."""
        kinds = {kind for thing in things for kind in thing.types}
        if clause.verb and kinds:
            self.wanted = [
                old
                for old in self.wanted
                if old.verb != clause.verb or not kinds & {*old.object_types}
            ]
            self.drop_leave(kinds)
        elif not any(thing.types for thing in clause.things):
            kinds = {kind for old in self.fresh for kind in old.object_types}
            self.wanted = [old for old in self.wanted if old not in self.fresh]
            self.drop_leave(kinds)

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
        ordered = {kind for old in (*self.wanted, *self.latest) for kind in old.object_types}
        stays = clause.stays or (clause.alone and not ordered.isdisjoint(kinds))
        self.staying = {*self.staying, *kinds} if stays else self.staying - {*kinds}
        for thing in things:
            if not (thing.states and self.narrow(thing)):
                self.ban(verb, thing.types)
        if everything:
            done = (self.newest or self.latest) if any(each.described for each in said) else []
            spared = {k for each in done for k in (*each.object_types, *each.destination_types)}
            self.ban(verb, tuple(kind for kind in self.count if kind not in spared))
