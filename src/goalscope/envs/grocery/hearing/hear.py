"""What stands after all that a person has said: what they ask for, and what they rule out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal
from functools import lru_cache
from typing import Literal

from goalscope.envs.grocery.amounts import Request
from goalscope.envs.grocery.heard import Hearing, kind_of
from goalscope.envs.grocery.hearing.correcting import QUALITY
from goalscope.envs.grocery.hearing.diets import diet, hinted, implied, is_diet, label, of_some
from goalscope.envs.grocery.hearing.labelling import unsafe
from goalscope.envs.grocery.hearing.limits import budget, guesses, wants_ideas
from goalscope.envs.grocery.hearing.orders import besides_buying, states_aim
from goalscope.envs.grocery.hearing.phrases import SAME, SAME_ALL, SAME_ONE, SAME_TWO
from goalscope.envs.grocery.hearing.requests import (
    Refusal,
    clears,
    kept,
    removed,
    spared,
    unwanted,
    wanted,
)
from goalscope.envs.grocery.hearing.rewording import Said, heard
from goalscope.envs.grocery.hearing.unasked import unasked
from goalscope.envs.grocery.names import Names
from goalscope.envs.grocery.words import asks, contains, singulars
from goalscope.envs.remarks import asks_why, is_remark
from goalscope.envs.speech import evened

__all__ = ["hear"]

_NO_NAMES = Names(())
_PIECES = 6
"""From so many on, a number that changes another is of pieces."""
_AGAIN = re.compile(r"\b(?:back|again)\b")
_PUT_BACK = re.compile(r"\b(?:put|place|stick|pop|bring)\b.*\bback\b")
_WHICH = re.compile(r"(.+) ones?")
"""Says which of the things spoken of last is meant: "the frozen ones"."""
_KIND = "(?:flavou?r|kind|brand|type|sort|variety|version|colou?r|size)s?"
_OTHER = re.compile(
    r"(?:(?:no|nope|nah|sorry|actually|then|so|oh|ok|okay|please|but|wait|i(?:'d)? (?:want|like"
    r"|prefer|meant?)|(?:get|give) (?:me|us)|make it)[ ,.!]+)*+"
    rf"(?:(?:(?:the other|an? (?:different|other|new)) (?:ones?|{_KIND})|another {_KIND})"
    r"|not (?:that|this|those|these)(?: ones?)?)(?:,? (?:please|instead|then|thanks))*[ .!]*"
)
"""Says that something else is meant, and not what."""
_ALLERGIC_TO = re.compile(
    r"\b(?:allergic|intolerant) (?:to|of) (?!(?:it|that|this|them|those|these)\b)"
    r"([\w-]+(?: (?!and\b|or\b)[\w-]+)?(?:(?:, [\w-]+){0,4},? (?:and|or) [\w-]+)?)"
)
"""What somebody is said to be allergic to."""
_HARMLESS = re.compile(
    r"(?:\b(?:not|no longer|nobody|no ?one)|n't)(?: [\w']+){0,3} (?:allergic|intolerant)\b"
    r"|\b(?:outgrew|outgrown)\b|\b(?:forget|never ?mind)\b.*\ballerg"
)
"""Takes back that something harms."""
_ANY = frozenset({
    "usual", "normal", "first", "last", "same", "other", "new", "old", "next", "cheap", "cheaper",
    "cheapest", "bigger", "biggest", "smaller", "smallest", "better", "best", "nicer", "right",
})  # fmt: skip
"""Words that tell no kinds of things apart."""
_UNWANTED = re.compile(
    r"\b(?:don't|do not|didn't|did not|never) (?:want|need|like)(?:ed)? (?:any of )?"
    rf"(?:it|that|this|them|those|these|{SAME}|{SAME_ALL})(?=[.,;!?]|$)"
)
"""After a question why a thing is there: away with what was guessed."""
_UNNEEDED = re.compile(
    r"\b(?:remove|delete|drop|take out|get rid of|leave out)"
    r" (?:anything|everything|whatever|what|all|things|stuff)(?: that| which)?"
    r" (?:(?:i|we) (?:don't|do not|won't|will not)(?: really| actually)? need"
    r"|(?:is|are|'s)(?:n't| not) (?:really )?(?:needed|necessary|required))\b"
)
"""Leaves it open what is to go."""
_THOSE = re.compile(
    rf"\W*(?:and |so |please )*(?:remove|delete|drop|take) (?:{SAME_ALL}|{SAME_TWO})\b.*"
)
"""After words about what was guessed: away with that, too."""
_POINTS = re.compile(r"\b(?:it|them|that|those|these|both)\b")
_LEAVES_SOME = re.compile(r"\b(?:except|but|apart from|other than|besides|keep|unless|if)\b")
"""Leaves something of all in its place."""
_SPARED = re.compile(r"\b(?:keep|leave|not|no)\b[^,.;!?]*")
_BESIDES = re.compile(
    r"^\W*(?:and|also|plus)\b|\b(?:too|also|as well|besides)\b"
    r"|\band (?:an?|one|two|some|\d+) [\w-]+(?: [\w-]+)? ones?\b"
)


def hear(utterances: Sequence[str], names: Names | None = None) -> Hearing:
    """Read utterances in their order; a word taken back counts no more.

    Args:
        utterances: What the person said, the newest last.
        names: Of the shop's items, which are then heard whole.
    """
    return _hear(tuple(utterances), names or _NO_NAMES)


@lru_cache(maxsize=64)
def _hear(utterances: tuple[str, ...], names: Names) -> Hearing:
    listener = _Listener(names)
    for number, utterance in enumerate(utterances, start=1):
        listener.hear(utterance, newest=number == len(utterances))
    asked = listener.asked
    return Hearing(
        wanted=tuple(asked.values()),
        newest=tuple(each for phrase, each in asked.items() if phrase in listener.named),
        removed=tuple(listener.removed),
        unclear=listener.unclear,
        spared=tuple(listener.spared),
        refused=tuple(listener.refused),
        harmful=tuple(listener.harmful),
        dropped=tuple(listener.dropped),
        lessened=tuple(listener.lessened),
        diets=listener.diets,
        strict=listener.strict & listener.diets,
        food=frozenset(),
        words=". ".join(utterances).casefold(),
        empties=listener.empties,
        unasked=listener.unasked,
        some=listener.some,
        hinted=listener.hinted,
        guesses=listener.guesses and not listener.tidied,
        budget=listener.budget,
        kept=tuple(listener.kept),
        again=bool(utterances) and bool(_AGAIN.search(utterances[-1].casefold())),
    )


class _Listener:
    """What stands so far.

    Attributes:
        asked: Requests by their phrases; `earlier` are those before the newest utterance.
        refused: Phrases in their order; so are `dropped` and `lessened`.
        tidied: Whether what was guessed had to go, and no aim was stated since.
        strict: Allergies for which food must be labelled.
        some: Diets that only some follow.
        harmful: Those of the refused to which somebody is allergic: no request takes that back.
        mild: Diets that rest on a refusal alone, which a request takes back.
        before: Things that the last utterance asked for, took out or spoke of that named any; none
            behind one that was taken back.
        named: What the newest utterance asked for or took out.
        about: What was asked for before and it speaks of, ahead of words such as "it".
        points: Whether it has such words.
        kinds: What "the frozen ones" are a kind of, by what they came to.
        removed: What the newest utterance wants taken out; `spared`, `empties`, `unasked` and
            `unclear` are its own, too.
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.asked: dict[str, Request] = {}
        self.earlier: list[str] = []
        self.refused: dict[str, None] = {}
        self.harmful: dict[str, None] = {}
        self.dropped: dict[str, None] = {}
        self.lessened: dict[str, None] = {}
        self.diets: frozenset[str] = frozenset()
        self.strict: frozenset[str] = frozenset()
        self.some: frozenset[str] = frozenset()
        self.hinted: frozenset[str] = frozenset()
        self.guesses = True
        self.tidied = False
        self.budget: Decimal | None = None
        self.mild: set[str] = set()
        self.before: list[str] = []
        self.named: list[str] = []
        self.about: list[str] = []
        self.points = False
        self.kinds: dict[str, str] = {}
        self.removed: list[Request] = []
        self.spared: list[str] = []
        self.kept: dict[str, None] = {}
        self.empties = self.unasked = self.unclear = False

    def hear(self, utterance: str, *, newest: bool) -> None:
        """Take in one utterance, clause by clause."""
        self.removed, self.spared, self.earlier = [], [], [*self.asked]
        self.empties = self.unasked = self.unclear = False
        last = self.named or self.about or self.before
        self.before, self.named = last if utterance else [], []
        ahead, *rest = _POINTS.split(evened(utterance), maxsplit=1)
        self.about, self.points = self.mentioned(ahead), bool(rest)
        some = self.some | of_some(utterance, self.diets)
        earlier, self.diets = self.diets, diet(utterance, self.diets, some)
        self.some = some - self.diets
        self.hinted = hinted(utterance, self.hinted)
        if _HARMLESS.search(evened(utterance)):
            self.refused = {each: None for each in self.refused if each not in self.harmful}
            self.harmful.clear()
        utterance = self.names.hidden(utterance)
        self.guesses = guesses(utterance, self.guesses)
        self.budget = budget(utterance, self.budget)
        why, leaves_some = asks_why(utterance), _LEAVES_SOME.search(evened(utterance))
        other = _OTHER.fullmatch(evened(utterance))
        self.unclear = bool(other)
        for clause in () if other else heard(besides_buying(utterance)):
            if _UNNEEDED.search(clause.text):
                self.unclear = True
                continue
            if not leaves_some and (unsafe_for := unsafe(clause, self.diets)):
                self.strict |= unsafe_for
                self.diets |= unsafe_for
                continue
            stay = [*map(self.names.shown, kept(clause))]
            self.kept |= dict.fromkeys(stay)
            for phrase in filter(None, map(self.gone, stay)):
                self.ask_for(Request(phrase), newest=newest)
                self.named.append(phrase)
            if unasked(clause, self.removed) or (why and _UNWANTED.search(clause.text)):
                self.unasked = True
                continue
            if self.unasked and _THOSE.fullmatch(clause.text):
                continue
            self.clear(clause)
            if self.put_back(clause, newest=newest):
                continue
            self.remove(clause)
            self.refuse(clause, earlier)
            self.ask(clause, newest=newest)
        aims = wants_ideas(utterance) or states_aim(evened(utterance))
        self.tidied = self.unasked or (self.tidied and not aims)

    def clear(self, clause: Said) -> None:
        """Take in that all is to leave the basket, or all but some."""
        spared_here = [self.names.shown(phrase) for phrase in spared(clause)]
        if not (clears(clause) or spared_here):
            return
        self.spared += spared_here
        self.empties = self.empties or not spared_here
        self.asked = {p: r for p, r in self.asked.items() if kind_of(p, spared_here)}

    def put_back(self, clause: Said, *, newest: bool) -> bool:
        """Take in that what has left the basket is put back there; whether that is all."""
        said = [phrase for each in removed(clause) for phrase in self.meant(each.phrase)]
        gone = [self.gone(p) or self.tidy(p) for p in said] if _PUT_BACK.search(clause.text) else []
        if not gone or not all(gone):
            return False
        for phrase in gone:
            self.ask_for(Request(phrase), newest=newest)
            self.named.append(phrase)
        return True

    def remove(self, clause: Said) -> None:
        """Take in what is to leave the basket."""
        for removal in removed(clause):
            some = _WHICH.fullmatch(removal.phrase)
            for phrase in self.that(removal.phrase) or self.meant(removal.phrase):
                fresh = {p: r for p, r in self.asked.items() if some and p in self.named}
                phrase = label(phrase) if is_diet(phrase) else phrase
                self.take_out(replace(removal, phrase=phrase))
                self.asked |= fresh
                self.named.append(phrase)

    def gone(self, phrase: str) -> str:
        """What a phrase names of what was taken out last; "" where it was asked for since."""
        said = singulars(phrase)
        kept = any(contains(singulars(each), said) for each in self.asked)
        left = [*self.refused, *self.dropped]
        out = (each for each in reversed(left) if contains(singulars(each), said))
        return "" if kept else next(out, "")

    def tidy(self, phrase: str) -> str:
        """A phrase of what left with all guesses; "" where none did, or it is asked for."""
        asked = any(kind_of(each, [phrase]) for each in self.asked)
        return phrase if self.tidied and not asked else ""

    def take_out(self, removal: Request) -> None:
        """Ask for less of what a removal takes out: rye bread may be what came for "bread"."""
        self.removed.append(removal)
        (self.dropped if removal.change == "none" else self.lessened)[removal.phrase] = None
        out = singulars(removal.phrase)
        self.kept = {each: None for each in self.kept if not contains(singulars(each), out)}
        for phrase, request in [*self.asked.items()]:
            kind = singulars(phrase)
            left = request.quantity - removal.quantity
            came_for_it = contains(out, kind) and out[-1:] == kind[-1:]
            if not (contains(kind, out) or came_for_it):
                replaces = tuple(old for old in request.replaces if old != removal.phrase)
                self.asked[phrase] = replace(request, replaces=replaces)
            elif removal.change == "none" or left < 1:
                del self.asked[phrase]
            else:
                self.asked[phrase] = replace(request, quantity=left)

    def refuse(self, clause: Said, earlier: frozenset[str]) -> None:
        """Take in what is not wanted; `earlier` are the diets of earlier utterances."""
        out = {self.names.shown(removal.phrase) for removal in removed(clause)}
        for said, how in unwanted(clause).items():
            those = self.that(said) or [self.names.shown(said)]
            found = self.ousted(clause) if said == SAME_ONE else those
            thing = next(iter(found), "")
            if not thing or is_diet(thing):
                shunned = how is Refusal.SHUNNED or label(thing) != thing
                if thing and shunned and "need" not in clause.text and thing not in out:
                    self.refused[label(thing)] = None
                continue
            restrictions = implied(thing, how)
            if how is not Refusal.HARMED:
                self.mild |= restrictions - earlier
            if not restrictions and thing not in out:
                self.refused[thing] = None
                told = () if asks(clause.text) else _ALLERGIC_TO.findall(clause.text)
                named = singulars(" ".join(told))
                if contains(named, singulars(thing)):
                    self.harmful[thing] = None
            for phrase in [p for p in self.asked if contains(singulars(p), singulars(thing))]:
                del self.asked[phrase]

    def ask(self, clause: Said, *, newest: bool) -> None:
        """Take in what is asked for."""
        requests = () if is_remark(clause.text) else wanted(clause)
        said = next((each.replaces for each in requests if each.replaces), ())
        ousted = self.ousted(clause) if said == (SAME_ONE,) else []
        found = (old for phrase in said for old in self.that(phrase) or self.meant(phrase))
        olds = tuple(ousted if said == (SAME_ONE,) else found)
        for request in requests:
            if not olds and request.replaces not in ((), (SAME_ONE,)):
                continue
            replaces = olds if request.replaces else ()
            request = replace(request, replaces=replaces)
            which = _WHICH.fullmatch(request.phrase)
            for phrase in self.meant(request.phrase):
                if not phrase or is_diet(phrase):
                    continue
                new = replace(request, phrase=phrase)
                kinds = tuple(old for old in replaces if kind_of(phrase, [old]))
                if said == (SAME_ONE,) and replaces and _alike(phrase, replaces):
                    kinds = replaces
                elif said == (SAME_ONE,) and not olds:
                    self.unclear = bool(self.spoken_of(every=True))
                for old in replaces:  # oat milk for whole milk, which came for "milk"
                    for each in [p for p in self.asked if kind_of(old, [p])]:
                        del self.asked[each]
                for kind in {*kinds} - {each.phrase for each in self.removed}:
                    self.take_out(Request(kind, change="none"))
                if which and not (replaces or _BESIDES.search(clause.text)):
                    new = self.refined(new, which[1], self.spoken_of()[0])
                new = self.cheaper(new) if new.change == "cheaper" else new
                self.ask_for(new, newest=newest)
                self.named.append(new.phrase)

    def refined(self, request: Request, which: str, old: str) -> Request:
        """A request that says `which` of `old` is meant: that makes way where there is such."""
        before = self.asked.get(old)
        alike = _ANY.issuperset(which.split())
        if before is None or request.change == "more":
            return replace(request, phrase=old) if alike else request
        if (request.quantity, request.counted, request.change) == (1, "pieces", "at least"):
            change = before.change if alike else "as many"
            outright = request.outright or before.outright
            request = replace(before, phrase=request.phrase, change=change, outright=outright)
        if alike:
            return replace(request, phrase=old)
        kind = self.kinds.get(old, old)
        kind = kind if kind in before.replaces else old
        if old not in self.named:
            self.take_out(Request(kind, change="none"))
        elif kind != old:
            del self.asked[old]
        self.named = [each for each in self.named if each != old]
        return replace(request, replaces=(kind,))

    def ask_for(self, request: Request, *, newest: bool) -> None:
        """Ask for something, once, whether in the singular or the plural.

        What older words change is added up, so that it is met once; the newest change what is
        there.
        """
        asked = singulars(request.phrase)
        if request.counted == "units" or (request.change, request.counted) == ("exactly", "pieces"):
            request = replace(request, counted=self.counts(request))
        for phrase, other in self.asked.items():
            replaces = tuple(old for old in other.replaces if singulars(old) != asked)
            self.asked[phrase] = replace(other, replaces=replaces)
        if request.change in ("exactly", "half"):
            for kind in [
                p for p in self.asked if contains(singulars(p), asked) and singulars(p) != asked
            ]:
                del self.asked[kind]
        same = next((p for p in self.asked if singulars(p) == asked), request.phrase)
        before = self.asked.pop(same, None)
        if not newest:
            more = before.quantity if before and request.change == "more" else 0
            request = replace(request, quantity=request.quantity + more, change="at least")
        self.asked[request.phrase] = request
        self.diets -= self.mild & implied(request.phrase)
        for words in (self.refused, self.dropped, self.lessened):
            for thing in [each for each in words if contains(asked, singulars(each))]:
                if thing not in self.harmful:
                    del words[thing]

    def counts(self, request: Request) -> Literal["packages", "pieces"]:
        """What the number of a request counts that changes an earlier one.

        That is what the number before did; where there was none, as many as 6 count pieces, and
        fewer the packages that a basket shows.
        """
        asked = singulars(request.phrase)
        before = [r for r in self.asked.values() if contains(asked, singulars(r.phrase))]
        if any(each.counted == "packages" for each in before):
            return "packages"
        several = any(each.counted == "pieces" and each.quantity > 1 for each in before)
        return "pieces" if several or request.quantity >= _PIECES else "packages"

    def cheaper(self, request: Request) -> Request:
        """The request for what its last word says, in the place of what was asked for before."""
        asked = singulars(request.phrase)
        kind = request.phrase.split()[-1]
        if not any(contains(singulars(p), asked) for p in self.asked):
            kind = request.phrase
        for phrase in [p for p in self.asked if contains(singulars(p), asked)]:
            request = replace(request, quantity=self.asked[phrase].quantity)
            request = replace(request, counted=self.asked.pop(phrase).counted)
        return replace(request, phrase=kind, replaces=(request.phrase,))

    def that(self, phrase: str) -> list[str]:
        """The one thing that was asked for by the word of "the red one"; or none."""
        which = _WHICH.fullmatch(phrase)
        asked = dict.fromkeys([*self.earlier, *self.asked])
        found = [each for each in asked if which and kind_of(each, [which[1]])]
        return found if len(found) == 1 else []

    def meant(self, phrase: str) -> list[str]:
        """What a phrase stands for: "it", "them" and "the frozen ones" are of what was named last.

        None where it is not clear of what.
        """
        if phrase == SAME_ONE:
            found = self.spoken_of(every=True)
            return found if len(found) == 1 else []
        if phrase == SAME_TWO:
            found = self.spoken_of(every=True)
            return found if len(found) > 1 else [*self.asked][-2:]
        which = _WHICH.fullmatch(phrase)
        if not (which or phrase in (SAME, SAME_ALL)):
            return [self.names.shown(phrase)]
        found = self.spoken_of(every=phrase == SAME_ALL)
        if not found or (phrase != SAME_ALL and len(found) > 1):
            self.unclear = True
            return []
        if not which:
            return found
        kind = self.kinds.get(found[0], found[0])
        if contains(singulars(kind), singulars(which[1])):
            return [kind]
        bare = re.sub(rf"^{QUALITY} ", "", kind) if re.fullmatch(QUALITY, which[1]) else kind
        self.kinds[f"{which[1]} {bare}"] = kind
        return [f"{which[1]} {bare}"]

    def ousted(self, clause: Said) -> list[str]:
        """The one thing that makes way for what a clause asks for; none where it is not one.

        That is what is of its kind among what was spoken of last, or else among what was asked for
        before; where nothing is, it is what was spoken of last.
        """
        last = self.spoken_of(every=True)
        for request in [each for each in wanted(clause) if each.replaces][:1]:
            phrase = self.names.shown(request.phrase)
            others = [old for old in self.earlier if not kind_of(old, [phrase])]
            last = _alike(phrase, last) or _alike(phrase, others) or last
        return last if len(last) == 1 else []

    def spoken_of(self, *, every: bool = False) -> list[str]:
        """The thing named last, or every thing named in this utterance; else those before."""
        found = self.named if every else self.named[-1:]
        return [*dict.fromkeys(found or (self.about if self.points else []) or self.before)]

    def mentioned(self, said: str) -> list[str]:
        """What was asked for that words speak of: milk, in "the milk is too dear, remove it"."""
        words = singulars(_SPARED.sub(" ", said))
        whole = [each for each in self.asked if contains(words, singulars(each))]
        kinds = [each for each in self.asked if contains(words, singulars(each)[-1:])]
        longest = [each for each in whole if not any(each in other.split() for other in whole)]
        return longest or kinds


def _alike(phrase: str, things: Sequence[str]) -> list[str]:
    """Those of `things` that are what the last word of `phrase` says."""
    last = singulars(phrase)[-1:]
    return [each for each in things if singulars(each)[-1:] == last]
