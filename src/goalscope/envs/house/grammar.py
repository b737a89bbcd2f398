"""A small grammar of what people say to a robot in a house: clauses, verbs, things, places."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace

from goalscope.envs.house import vocabulary as v
from goalscope.envs.house.names import naming
from goalscope.envs.house.object_types import object_types

__all__ = ["Clause", "Phrase", "first_named", "parse", "parse_plain"]


_MODAL = re.compile(
    r"(?:all |both |also |still |just |only )*(?P<modal>(?:needs?|ha(?:s|ve)) to(?: be)?"
    r"|should(?:n't| not)?(?: all)?(?: be| go)?|must(?:n't| not)?(?: be| go)?|(?:is|are) to be"
    r"|(?:do not|don't|doesn't|does not) (?:belong|go)|belongs?|goes?|to be|can be|needs?)\b ?"
)
_LEAVE_ALONE = re.compile(
    r"\b(?:leave|keep)\b.*\b(?:alone|where|as (?:it|they)|in place|be|untouched|there|out)\b"
)
_ASKED = re.compile(
    r"(?:(?:and|so|but|ok|okay|oh|well|hey|hi|hello)[ ,]+)*(?:please )?(?:(?:can|could|would|will)"
    r" (?:you|we)\b|why (?:don't|not|do not) (?:you|we)\b|would you mind)"
)
_QUESTION = re.compile(
    r"(?:(?:and|so|but|ok|okay|oh|well)[ ,]+)*(?:what|which|who|whose|when|why|how|where|do|does"
    r"|did|is|are|was|were|has|have you|should|shall|may i|can i|could i|would it|will it)\b"
)
_PLAIN_LEAD = re.compile(
    r"(?:(?:ok|okay|yes|yeah|sure|hi|hello|hey|thanks|robot|now|then|next|first|also|and|please"
    r"|kindly|just|go ahead and|you may|i want you to|i need you to|i'd like you to"
    r"|i would like you to|(?:can|could|would|will) you) ?)*"
)
_PLEASANT = re.compile(
    r"(?:(?:ok|okay|yes|yeah|yep|sure|great|good|perfect|nice|thanks|thank you|hi|hello|hey|there"
    r"|robot|please|now|very much|so much|awesome|job|work|again)[ ,]*)+"
)
_HEDGED = re.compile(
    r"n't\b|\b(?:not|no|never|nor|or|but|if|unless|until|without|except|instead|after|before"
    r"|once|when|while|as soon as|can't|dont|cant|wont)\b"
)
_CONDITION = re.compile(r"\b(?:if|unless|until|whether|in case|suppos\w+|imagine|pretend)\b")


@dataclass(frozen=True, slots=True)
class Phrase:
    """A thing as it was said.

    Attributes:
        types: The object types that it may be; none for a pronoun.
        word: The pronoun: "it", "them", "one", "slice", "everything", "water" ...
        every: Whether all such things are meant.
        number: How many; 0 where it was not said.
        group: Whether it was named by a group word, such as "food".
        which: The number in a name of the scene, 2 in "drawer 2"; 0 without one.
        liquid: What it holds: "coffee" in "a cup of coffee".
    """

    types: tuple[str, ...] = ()
    word: str = ""
    every: bool = False
    number: int = 0
    group: bool = False
    which: int = 0
    liquid: str = ""


@dataclass(frozen=True, slots=True)
class Clause:
    """One order, wish, refusal, or a statement.

    Attributes:
        verb: The action; "any" in a refusal of whatever may be done; "" in a statement.
        things: To what it is done, or of what the statement speaks first.
        place: Where the things are put.
        negated: Whether it is ruled out.
        excluded: Things named as exceptions.
        liquid: What to fill with.
        plain: Whether it is a simple order of which every word was understood.
    """

    verb: str
    things: tuple[Phrase, ...] = ()
    place: Phrase | None = None
    negated: bool = False
    excluded: tuple[Phrase, ...] = ()
    liquid: str = ""
    plain: bool = False


def parse(text: str, here: Collection[str] = ()) -> list[Clause]:
    """The orders, wishes, refusals and statements in `text`; questions and conditions are none."""
    found: list[Clause] = []
    text = re.sub(r"[\"\u201c][^\"\u201d]*[\"\u201d]", " , ", text[:2000].strip('"\u201c\u201d '))
    for sentence in re.split(r"(?<=[.!?;:])\s+|\n", text):
        found += _sentence(v.normal(sentence), here)
    return found


def parse_plain(text: str, here: Collection[str] = ()) -> list[Clause]:
    """The orders in `text` if it consists of nothing but simple ones and pleasantries, else none.

    A condition, a negation, a quotation, a question, or any word that the grammar does not know
    makes it none.
    """
    said = " ".join(text.casefold().replace("\u2019", "'").split())
    if (
        len(said) > 300
        or ".." in said
        or re.search(r"[^a-z0-9 ,.;!?']|(?<![a-z])'|'(?![a-z])", said)
    ):
        return []
    if _HEDGED.search(said):
        return []
    found: list[Clause] = []
    for sentence in re.split(r"(?<=[.!?;])\s*", said):
        words = sentence.strip(" ,.!;?")
        if not words or (_PLEASANT.fullmatch(words) and "?" not in sentence):
            continue
        orders = _sentence(sentence, here)
        if "?" in sentence and not re.search(r"\bplease\b|\bfor me\b", sentence):
            return []
        if not orders or not all(order.plain for order in orders):
            return []
        found += orders
    return found


def first_named(text: str, here: Collection[str] = ()) -> Phrase | None:
    """The first thing that `text` names, such as what a question is about."""
    words = re.findall(r"[a-z0-9']+", v.normal(text))
    named = next(filter(None, (naming(words, i, here) for i in range(len(words)))), None)
    return Phrase(named.types, every=named.plural, group=named.group) if named else None


def _whole(thing: Phrase) -> Phrase:
    """What is to be sliced where "two slices of tomato" are to be cut."""
    if not thing.types or not all(kind.endswith("Sliced") for kind in thing.types):
        return thing
    types = tuple(kind.removesuffix("Sliced") for kind in thing.types)
    return replace(thing, types=types, every=False, number=1)


def _sentence(text: str, here: Collection[str]) -> list[Clause]:
    question = (text.endswith("?") or _QUESTION.match(text)) and not _ASKED.match(text)
    if question or _CONDITION.search(text):
        return []
    words = re.findall(r"[a-z0-9]+(?:'[a-z]+)?|,", text)
    reader = _Reader(words, here)
    cuts = [i for i, word in enumerate(words) if word in v.BREAKS and reader.begins(i + 1)]
    found: list[Clause] = []
    for start, end in zip([0, *cuts], [*cuts, len(words)], strict=True):
        clause = _Reader(
            words[start:end], here, bool(re.search(r"\bplease\b|\bfor me\b", text))
        ).clause()
        if clause is None:
            rest = " ".join(words[start:end]).strip(" ,")
            if rest and not _PLEASANT.fullmatch(rest):
                found.append(Clause(""))
            continue
        before = found[-1] if found else None
        if before and before.verb and not before.things and not before.place and start:
            found[-1] = replace(before, things=clause.things)
            negated = clause.negated or before.negated
            clause = replace(clause, negated=negated, plain=clause.plain and not negated)
        found.append(clause)
    return found


@dataclass
class _Reader:
    """Reads one clause, word by word."""

    words: list[str]
    here: Collection[str]
    polite: bool = False
    leftover: bool = field(default=False, init=False)

    def at(self, i: int) -> str:
        return self.words[i] if i < len(self.words) else ""

    def verb(self, i: int, forms: dict[str, str]) -> tuple[str, str, int] | None:
        """The verb at `i`, as an action and as said, and where it ends."""
        for length in (4, 3, 2, 1):
            said = " ".join(self.words[i : i + length])
            if i + length <= len(self.words) and said in forms:
                after = self.at(i + length)
                alone = said in v.NOUNS and after in ("", ",", "and", "of", "is", "or")
                if alone or (said == "slice" and after == "of"):
                    return None
                if (said, after) in (("start", "by"), ("start", "with"), ("make", "sure")):
                    return None
                return forms[said], said, i + length
        return None

    def lead(self, i: int) -> int:
        while self.at(i) in v.LEAD and not self.verb(i, v.BASE):
            i += 1
        while self.at(i) == ",":
            i = self.lead(i + 1)
        return i

    def begins(self, i: int) -> bool:
        """Whether a new clause begins at `i`."""
        after = self.lead(i)
        if self.verb(after, v.BASE) or (self.verb(after, v.ING) and self.at(i - 1) != ","):
            return True
        if after > i and v.LIKED & set(self.words[i:after]):
            return True
        _, end = self.things(i)
        return end > i and bool(_MODAL.match(" ".join(self.words[end:])))

    def clause(self) -> Clause | None:
        start = next((i for i, w in enumerate(self.words) if w not in v.BREAKS - v.NEGATIONS), 0)
        first = self.lead(start)
        lead = self.words[start:first]
        negated = bool(v.NEGATIONS & set(lead))
        text = " ".join(self.words)
        if alone := self.leave_alone(first):
            return alone
        if verb := self.verb(first, v.BASE) or (
            self.verb(first, v.ING) if v.GERUND & {*lead} else None
        ):
            if "i" in lead and not v.LIKED & {*lead} and not {"i'd", "you"} & {*lead}:
                return None
            clause = self.order(*verb, negated=negated)
            is_polite = self.polite or not re.search(r"\b(?:can|could|would|will) you\b", text)
            plain = (
                not negated
                and not self.leftover
                and is_polite
                and bool(_PLAIN_LEAD.fullmatch(" ".join(w for w in lead if w != ",")))
                and verb[0] != "make"
            )
            return replace(clause, plain=plain) if clause else None
        refusal = negated or self.at(first) in ("no", "nothing")
        if refusal and self.at(first) == "no":
            first += 1
        things, end = self.things(first)
        if not things:
            place, _, _ = self.places(first)
            return Clause("put in", (), place, True) if refusal and place else None
        modal = _MODAL.match(" ".join(self.words[end:]))
        if modal and modal["modal"]:
            negated = negated or bool(re.search(r"n't|not", modal["modal"]))
            end += len(modal[0].split())
            return self.state(things, end, "", negated)
        if {"make", "sure"} <= {*lead} and self.at(end) in ("is", "are"):
            return self.state(things, end + 1, "", negated)
        if v.LIKED & {*lead} or "i'd" in lead:
            if negated:
                return Clause("any", things, negated=True)
            return self.state(things, end, "pick up", negated)
        if refusal:
            return Clause("any", things, negated=True)
        beside = text.startswith(tuple(f"{said} " for said in (*v.INTO, *v.ASIDE)))
        return Clause("", () if beside else things)

    def leave_alone(self, first: int) -> Clause | None:
        """A refusal such as "leave the mug where it is"."""
        if not _LEAVE_ALONE.match(" ".join(self.words[first:])):
            return None
        things, _ = self.things(first + 1)
        return Clause("any", things or (Phrase(word="it"),), negated=True)

    def order(self, verb: str, said: str, i: int, *, negated: bool) -> Clause | None:
        """What follows a verb."""
        if self.at(i) in ("me", "us"):
            i += 1
        if verb in ("turn on", "turn off") and self.at(i + (self.at(i) == "the")) in (
            "water",
            "sink",
        ):
            self.words[i + (self.at(i) == "the")] = "faucet"
        things, i = self.things(i)
        if verb in ("turn", "close") and self.at(i) in ("on", "off", "down"):
            verb, i = "turn on" if self.at(i) == "on" else "turn off", i + 1
        elif verb == "use" and self.at(i) == "up":
            verb, i = "use up", i + 1
        elif self.at(i) == "away" and said in ("throw", "toss"):
            said, i = "throw away", i + 1
        into, said_into, source, excluded, liquid = self.tail(i)
        watery = bool(things) and things[0].word == "water"
        if watery:
            liquid = things[0].liquid
        if said == "crack" and any(t.types != ("Egg",) for t in things):
            verb = "open"
        if verb == "turn" or (verb == "use" and not negated):
            return None
        if verb == "ignore" and not things:
            return None
        if verb in ("ignore", "use") or (negated and said in ("move", "take", "remove")):
            return Clause("any", things or (Phrase(word="it"),), negated=True, excluded=excluded)
        if negated and verb == "put" and things and things[0].word == "everything" and into:
            return Clause("put in", (), into, True)
        if verb == "make":
            verb, liquid = self.made(things)
            if not verb:
                return None
        if verb == "pour" or (watery and verb in ("put", "pick up", "empty")):
            if (source and not into) or verb in ("pick up", "empty"):
                return Clause("empty", (source,) if source else (Phrase(word="it"),), None, negated)
            return Clause("fill", (into or Phrase(word="it"),), None, negated, liquid=liquid)
        if watery:
            return None
        if verb in ("put", "pick up") and things and things[0].liquid:
            held = into if into and v.VESSELS & {*into.types} else None
            if held or (said == "add" and not into):
                return Clause("fill", (held or things[0],), None, negated, (), things[0].liquid)
        if verb == "slice":
            things = tuple(_whole(thing) for thing in things)
        liquid = "water" if said == "water" else liquid if verb == "fill" else ""
        if verb == "pick up" and into and said_into in ("into", "onto", "to", "over to", "back to"):
            verb = "put"
        if verb == "put" and said in ("throw away", "dispose of"):
            into = into or Phrase(("GarbageCan",))
        if said in ("keep", "leave") and not into:
            return Clause("any", things, negated=True) if said == "leave" else None
        place = into if verb == "put" else None
        return Clause(verb, things, place, negated, excluded, liquid)

    def state(
        self, things: tuple[Phrase, ...], i: int, otherwise: str, negated: bool
    ) -> Clause | None:
        """What follows "the mug needs to be" or "I want the mug"."""
        while self.at(i) in ("to", "be", "all", "both", "get", "go", "placed", "also"):
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
        into, _, _, excluded, _ = self.tail(i)
        if into:
            return Clause("put", things, into, negated, excluded)
        if otherwise and "toast" in self.words:
            otherwise = "cook"
        return Clause(otherwise, things, None, negated, excluded)

    def passive(
        self, things: tuple[Phrase, ...], verb: str, said: str, i: int, *, negated: bool
    ) -> Clause | None:
        if verb == "turn" and self.at(i) in ("on", "off"):
            verb, i = f"turn {self.at(i)}", i + 1
        if verb == "use" and self.at(i) == "up":
            verb, i = "use up", i + 1
        into, _, _, excluded, liquid = self.tail(i)
        if verb in ("use", "ignore") or (negated and said.startswith(("mov", "remov", "tak"))):
            return Clause("any", things, negated=True) if negated else None
        if verb in ("turn", "make", "pour"):
            return None
        if said.startswith("watered"):
            liquid = "water"
        return Clause(verb, things, into if verb == "put" else None, negated, excluded, liquid)

    def made(self, things: tuple[Phrase, ...]) -> tuple[str, str]:
        """What "make" and "prepare" come to: coffee, toast, slices."""
        if things and things[0].liquid:
            return "fill", things[0].liquid
        if "toast" in self.words:
            return "cook", ""
        sliced = bool(things) and all(t.endswith("Sliced") for t in things[0].types)
        return ("slice" if sliced else ""), ""

    def places(self, i: int) -> tuple[Phrase | None, str, int]:
        """A place with its preposition at `i`."""
        for said in v.INTO:
            size = len(said.split())
            if self.words[i : i + size] == said.split():
                place, end = self.thing(i + size)
                if place:
                    return place, said, end
                if self.at(i + size) in ("me", "us", "half"):
                    return None, "", i + size + 1
        return None, "", i

    def tail(self, i: int) -> tuple[Phrase | None, str, Phrase | None, tuple[Phrase, ...], str]:
        """Where to, by which preposition, where from, what is excepted, and with which liquid."""
        into: Phrase | None = None
        said_into, liquid = "", ""
        source: Phrase | None = None
        excluded: tuple[Phrase, ...] = ()
        while i < len(self.words):
            before = i
            for said in (*v.EXCEPT, *v.ASIDE):
                parts = said.split()
                if self.words[i : i + len(parts)] != parts:
                    continue
                if said in v.EXCEPT:
                    more, end = self.things(i + len(parts))
                    excluded += more
                    self.leftover = True
                else:
                    aside, end = self.thing(i + len(parts))
                    if said in ("from", "out of", "off"):
                        source = aside or source
                    if said in ("with", "of", "using") and self.at(end - 1) in v.LIQUIDS:
                        liquid = self.at(end - 1)
                    self.leftover |= aside is None
                i = max(end, i + len(parts))
                break
            else:
                place, said, i = self.places(i)
                if place and (
                    into is None or (said in ("into", "onto") and said_into in ("in", "on"))
                ):
                    into, said_into = place, said
            if i == before:
                if self.words[i : i + 2] == ["for", "me"]:
                    i += 1
                elif self.at(i) not in v.TAIL and self.at(i) != ",":
                    self.leftover = True
                i += 1
        return into, said_into, source, excluded, liquid

    def things(self, i: int) -> tuple[tuple[Phrase, ...], int]:
        """Things in a row: "the apple, the egg and a mug"; "or" makes one of several."""
        found: list[Phrase] = []
        thing, end = self.thing(i)
        either = False
        while thing:
            if either and found[-1].types and thing.types:
                found[-1] = replace(found[-1], types=(*found[-1].types, *thing.types))
            else:
                found.append(thing)
            i = end
            while self.at(i) in (",", "and", "plus", "or", "also", "then"):
                either = self.at(i) == "or"
                i += 1
            thing, after = self.thing(i) if i > end else (None, end)
            end = after if thing else end
        return tuple(found), end

    def thing(self, i: int) -> tuple[Phrase | None, int]:
        """One thing with what determines it, or a pronoun."""
        start, every, number = i, False, 0
        while i < len(self.words):
            word = self.at(i)
            named = naming(self.words, i, self.here)
            if named:
                which = (
                    int(self.at(named.end))
                    if re.fullmatch(r"[1-9]\d{0,2}", self.at(named.end))
                    else 0
                )
                liquid = self.at(named.end + 1) if self.at(named.end) == "of" else ""
                liquid = liquid if liquid in v.LIQUIDS else ""
                if self.at(named.end) == "of" and not liquid:
                    inner, end = self.thing(named.end + 1)
                    if inner and any(kind.endswith("Sliced") for kind in inner.types):
                        return inner, end
                every = every or (named.plural and not number)
                end = named.end + (1 if which else 2 if liquid else 0)
                return Phrase(named.types, "", every, number, named.group, which, liquid), end
            if word in v.SLICES:
                whole, end = self.thing(i + 2) if self.at(i + 1) == "of" else (None, i + 1)
                if not whole or not whole.types:
                    return Phrase(word="slice", every=every, number=number), max(end, i + 1)
                types = tuple(
                    t
                    for w in whole.types
                    if (t := f"{w.removesuffix('Sliced')}Sliced") in object_types()
                )
                return Phrase(types or whole.types, "", every, number), end
            if word == "coffee":
                return Phrase(("Mug", "Cup"), liquid="coffee"), i + 1
            if word == "water":
                return Phrase(word="water", liquid="water"), i + 1
            if word in v.VAGUE:
                vague = "everything" if word in ("everything", "anything", "nothing") else "them"
                return Phrase(word=vague, every=every, number=number), i + 1
            if word in v.NUMBERS or word.isdigit():
                number = v.NUMBERS.get(word, 0) or min(int(word) if word.isdigit() else 0, 99)
            elif word not in v.DETERMINERS and word not in v.FILLERS and word not in v.PRONOUNS:
                break
            every = every or word in v.EACH
            i += 1
        said = self.words[start:i]
        pronoun = next((w for w in reversed(said) if w in v.PRONOUNS), "")
        if pronoun:
            return Phrase(word=pronoun, every=every, number=0 if pronoun == "it" else number), i
        return None, start
