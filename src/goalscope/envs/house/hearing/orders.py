"""Orders, word by word: what follows a verb, and what follows "should be"."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.phrases import Phrase, PhraseReader
from goalscope.envs.house.simulator.object_types import object_type

__all__ = ["Clause", "OrderReader"]


@dataclass(frozen=True, slots=True)
class Clause:
    """One order, wish, refusal, or a statement.

    Attributes:
        verb: The action; "same" where a thing alone repeats the last one; "any" in a refusal of
            whatever may be done, "put in" of putting things there; "" in a statement.
        things: To what it is done, or of what the statement speaks first.
        place: Where the things are put.
        negated: Whether it is ruled out.
        excluded: Things named as exceptions.
        liquid: What to fill with.
        plain: Whether it is a simple order of which every word was understood.
        corrects: Whether its things take the place of the last ones.
        later: Whether it is wanted at another time, and so not now.
        said: Its words, if it begins like an order.
        stays: Whether its things are to stay where they are, and not to go back.
        alone: Whether they are to be left alone: they stay if they are where they were ordered to,
            and in a put go back if they were ordered away.
        aside: Beside what its things are said to be.
    """

    verb: str
    things: tuple[Phrase, ...] = ()
    place: Phrase | None = None
    negated: bool = False
    excluded: tuple[Phrase, ...] = ()
    liquid: str = ""
    plain: bool = False
    corrects: bool = False
    later: bool = False
    said: str = ""
    stays: bool = False
    alone: bool = False
    aside: Phrase | None = None


@dataclass
class OrderReader(PhraseReader):
    """Reads what follows the verb of a clause.

    Attributes:
        loose: Whether "get X on Y" may tell where X is.
        also: Further verbs: of "washed and sliced", of "crack the egg into the pan".
        serves: Whether what is made is to stand ready: "make me a coffee".
    """

    loose: bool = field(default=False, init=False)
    also: list[str] = field(default_factory=list[str], init=False)
    serves: bool = field(default=False, init=False)

    def verb(self, i: int, forms: dict[str, str]) -> tuple[str, str, int] | None:
        """The verb at `i`, as an action and as said, and where it ends."""
        before = self.words[i - 1] if i else ""
        counted = self.at(i) == "slice" and (before in v.NUMBERS or before.isdigit())
        if before in v.ARTICLES or counted:
            return None
        for length in (4, 3, 2, 1):
            said = " ".join(self.words[i : i + length])
            if i + length <= len(self.words) and said in forms:
                after = self.at(i + length)
                alone = said in v.NOUNS and after in ("", ",", "and", "of", "is", "or")
                mess = said == "dirty" and after not in v.DETERMINERS | v.PRONOUNS
                if alone or mess or (said == "slice" and after == "of"):
                    return None
                if (said, after) in (("start", "by"), ("start", "with"), ("make", "sure")):
                    return None
                return forms[said], said, i + length
        return None

    def order(self, verb: str, said: str, i: int, *, negated: bool) -> Clause | None:
        """What follows a verb."""
        to_me = self.at(i) in ("me", "us")
        i += to_me
        start = i
        things, i = self.things(i, refused=negated)
        if verb == "turn" and (apart := self.apart(said, i)):
            verb, said = v.BASE[apart], apart
        state = self.at(i)
        poured = next((word for word in self.words[start:i] if word in v.LIQUIDS), "")
        i += i > start and self.at(i) == "back" and f"{said} {self.at(i + 1)}" in v.SWITCHED
        if (
            i > start
            and (apart := f"{said} {self.at(i)}") in v.BASE
            and (said != "put" and self.at(i + 1) != "of")
        ):
            verb, said, i = v.BASE[apart], apart, i + 1
        if said == "get" and things and (done := self.verb(i, v.DONE)):
            return self.passive(things, *done, negated=negated)
        tail = self.tail(i, listed=not things)
        things, into, by, liquid = things or tail.listed, tail.into, tail.by, tail.liquid
        self.leftover |= any(thing.word == "unknown" for thing in things)
        self.leftover |= bool(tail.listed or tail.excluded)
        watery = bool(things) and things[0].word == "water"
        if watery and verb in ("turn on", "turn off"):
            things, watery = (Phrase(("Faucet", "ShowerHead")),), False
        if watery:
            liquid = things[0].liquid
        if said == "crack" and [thing.word for thing in things] == ["it"]:
            things = (Phrase(("Egg",)),)
        egg = all(t.types == ("Egg",) for t in things)
        if said == "crack" and not egg:
            verb = "open"
        elif verb == "break" and egg and into and v.CRACKED_INTO & {*into.types}:
            verb = "put"
            self.also.append("break")
        if said in ("set", "lay", "load") and things and not into and _is_furniture(things[0]):
            into, things = things[0], tail.using or (Phrase(word="unknown"),)
        if verb == "turn" or (verb == "use" and not negated) or (verb == "ignore" and not things):
            return None
        if verb in ("ignore", "use") or (negated and said in ("move", "take", "remove")):
            things = things or (Phrase(word="it"),)
            return Clause("any", things, negated=True, excluded=tail.excluded)
        if negated and verb == "put" and things and things[0].word == "everything" and into:
            return Clause("put in", things[:1], into, True)
        if verb == "make":
            verb, liquid = self.made(things)
            if not verb:
                return None
            if verb == "fill" and into and (into.word == "it" or {"Mug", "Cup"} & {*into.types}):
                things, into = (into,), None
            self.serves = verb == "fill" and to_me
        if verb == "pour" or (watery and verb in ("put", "pick up", "empty")):
            if verb == "pick up" and not tail.source:
                return None
            drained = watery and into and "Sink" in into.types
            if drained or (tail.source and not into) or verb in ("pick up", "empty"):
                return Clause("empty", (tail.source or Phrase(word="it"),), None, negated)
            held = things[:1] if things and things[0].liquid and things[0].types else ()
            into = into or next(iter(held), Phrase(word="it"))
            return Clause("fill", (into,), None, negated, liquid=liquid or poured)
        if watery:
            return None
        if verb in ("put", "pick up") and things and things[0].liquid:
            held = into if into and v.VESSELS & {*into.types} else None
            if held or (said == "add" and not into):
                return Clause("fill", (held or things[0],), None, negated, (), things[0].liquid)
        wine = verb == "put" and poured == "wine" and "bottle" not in self.words[start:i]
        if wine and into and v.VESSELS & {*into.types}:
            return Clause("fill", (into,), None, negated, liquid=poured)
        if verb == "slice":
            things = tuple(_whole(thing) for thing in things)
        liquid = "water" if said == "water" else liquid if verb == "fill" else ""
        if verb == "pick up" and into and _brings(said, by, to_me=to_me):
            verb = "put"
            self.loose = said in ("get", "fetch") and by in ("on", "on top of")
        if verb == "put" and said in v.DISPOSALS:
            if into and "GarbageCan" not in into.types:
                tail.source, into = into, None
            into = into or Phrase(("GarbageCan",))
        elif verb == "put" and said in v.THROWS and tail.source and not into:
            verb = said
        if said in v.LOCKS:
            into = into or Phrase(("Safe",))
        away = tail.source if verb == "put" or not into else into
        if away or (verb not in ("put", "pick up") and tail.aside):
            at = away.types if away else ()
            things = tuple(replace(thing, described=True, at=at) for thing in things)
        asks = things and not into and state in ("on", "off", "open", "closed", "shut")
        if said in ("keep", "leave") and asks:
            return Clause(v.STATES[state], things, None, negated, tail.excluded)
        kept = v.KEPT & {*self.words[start:]} and "the whole" not in " ".join(self.words)
        if said in ("keep", "leave") and kept:
            return None
        back = "back" in self.words[start:]
        one = any(thing.which or thing.described for thing in things)
        some = "other" in self.words[start:] or any(thing.number for thing in things)
        if said in ("keep", "leave") and not into and (some or not (back and one)):
            known = said == "leave" or back
            return Clause("any", things, negated=True, alone=some or not back) if known else None
        if verb == "put" and not into and (said in v.RETURNS or back):
            into = Phrase(word="home")
            every = things and things[0].word == "everything"
            things = (replace(things[0], every=True),) if every else things
            if said in ("keep", "leave"):
                return Clause("put", things, into, negated, alone=True)
        into = into or tail.lost
        pointed = verb == "slice" and into and not into.types
        into = into if verb == "put" or pointed else None
        here = verb != "pick up" or to_me or said not in ("bring", "carry", "take")
        aside = tail.aside if here and verb != "put" else None
        return Clause(verb, things, into, negated, tail.excluded, liquid, aside=aside)

    def apart(self, said: str, i: int) -> str:
        """The verb whose particle stands behind a place at `i`: "switch the lamp on the desk off".

        The particle is taken out of the words.
        """
        start = self.said_at(i, (*v.INTO, *v.ASIDE))[1]
        end = self.thing(start)[1] if start > i else i
        apart = f"{said} {self.at(end)}"
        if end == start or apart not in v.SWITCHED:
            return ""
        self.reread([*self.words[:end], ",", *self.words[end + 1 :]])
        return apart

    def state(
        self, things: tuple[Phrase, ...], i: int, otherwise: str, negated: bool
    ) -> Clause | None:
        """What follows "the mug needs to be" or "I want the mug"."""
        while self.at(i) in ("to", "be", "all", "both", "get", "go", "placed", "also"):
            if self.at(i) == "to" and self.places(i)[0]:
                break
            i += 1
        verb = self.verb(i, v.DONE) or self.verb(i, v.ING)
        if verb:
            return self.passive(things, *verb, negated=negated)
        if self.at(i) in v.STATES and (
            self.at(i) not in ("on", "off") or self.at(i + 1) in ("", "and", ",", "please", "now")
        ):
            return Clause(v.STATES[self.at(i)], things, negated=negated)
        if self.at(i) == "water" or (things[0].liquid and otherwise):
            return Clause("fill", things, negated=negated, liquid=things[0].liquid or "water")
        tail = self.tail(i)
        if tail.into:
            return Clause("put", things, tail.into, negated, tail.excluded)
        if otherwise and "toast" in self.words:
            otherwise = "cook"
        return Clause(otherwise, things, None, negated, tail.excluded)

    def passive(
        self, things: tuple[Phrase, ...], verb: str, said: str, i: int, *, negated: bool
    ) -> Clause | None:
        """What follows "should be washed"."""
        if verb == "turn" and self.at(i) in ("on", "off"):
            verb, i = f"turn {self.at(i)}", i + 1
        if verb == "use" and self.at(i) == "up":
            verb, i = "use up", i + 1
        while self.at(i) == "and" and (more := self.verb(i + 1, v.DONE)):
            i = more[2]
            self.also.append(more[0])
        tail = self.tail(i)
        liquid = "water" if said.startswith("watered") else tail.liquid
        place = tail.into if verb == "put" else None
        if verb in ("use", "ignore") or (negated and said.startswith(("mov", "remov", "tak"))):
            return Clause("any", things, negated=True) if negated else None
        if verb in ("turn", "make", "pour"):
            return None
        return Clause(verb, things, place, negated, tail.excluded, liquid)

    def made(self, things: tuple[Phrase, ...]) -> tuple[str, str]:
        """What "make" and "prepare" come to: coffee, toast, slices."""
        if things and things[0].liquid:
            return "fill", things[0].liquid
        if "toast" in self.words:
            return "cook", ""
        types = things[0].types if things else ()
        if types == ("Bed",):
            return "clean", ""
        if types == ("Egg",):
            return "cook", ""
        sliced = bool(types) and all(t.endswith("Sliced") for t in types)
        return ("slice" if sliced else ""), ""


def _is_furniture(thing: Phrase) -> bool:
    flags = [object_type(kind).flags for kind in thing.types]
    return any("receptacle" in each and "pickupable" not in each for each in flags)


def _brings(said: str, by: str, *, to_me: bool) -> bool:
    """Whether "get X on Y" and the like say where X should be, and not where it is."""
    if by in ("into", "onto", "to", "over to", "back to", "on to", "in to", "back on", "back in"):
        return True
    if to_me:
        return False
    if said.startswith(("gather", "collect", "bring")):
        return True
    return said in ("get", "fetch") and by in ("on", "on top of")


def _whole(thing: Phrase) -> Phrase:
    """What is to be sliced where "two slices of tomato" are to be cut."""
    if not thing.types or not all(kind.endswith("Sliced") for kind in thing.types):
        return thing
    types = tuple(kind.removesuffix("Sliced") for kind in thing.types)
    return replace(thing, types=types, every=False, number=1)
