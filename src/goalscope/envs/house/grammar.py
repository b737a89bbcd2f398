"""A small grammar of what people say to a robot in a house: orders, wishes, refusals."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

from goalscope.envs.house import vocabulary as v
from goalscope.envs.house.object_types import object_type
from goalscope.envs.house.phrases import Phrase, PhraseReader, first_named

__all__ = ["Clause", "parse", "parse_plain"]


_MODAL = re.compile(
    r"(?:all |both |also |still |just |only )*(?P<modal>(?:needs?|ha(?:s|ve)) to(?: be)?"
    r"|should(?:n't| not)?(?: all)?(?: be| go)?|must(?:n't| not)?(?: be| go)?|(?:is|are) to be"
    r"|(?:do not|don't|doesn't|does not) (?:belong|go|live)|belongs?|go(?:es)?|lives?|to be|can be"
    r"|needs?)\b ?"
)
_LEAVE_ALONE = re.compile(
    r"\b(?:leave|keep)\b.*\b(?:alone|where|as (?:it|they)|in place|be|untouched|there|out)\b"
)
_ASKED = re.compile(
    r"(?:(?:and|so|but|ok|okay|oh|well|hey|hi|hello)[ ,]+)*(?:please )?(?:(?:can|could|would|will)"
    r" (?:you|we)\b|why (?:don't|not|do not) (?:you|we)\b|would you mind"
    r"|(?:can|could|may) (?:i|we) (?:please )?have\b)"
)
_QUESTION = re.compile(
    r"(?:(?:and|so|but|ok|okay|oh|well)[ ,]+)*(?:what|which|who|whose|when|why|how|where"
    r"|do(?! (?:it|that|this)\b)|does"
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


_LATER_FIRST = re.compile(
    rf"\s*(?:(?:and|then|but|ok|okay|so|please|no|yes|sure|maybe|perhaps)[ ,]+)*{v.LATER}\b"
)


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


def parse(text: str, here: Collection[str] = ()) -> list[Clause]:
    """The orders, wishes, refusals and statements in `text`; questions and conditions are none."""
    found: list[Clause] = []
    text = re.sub(r"[\"\u201c][^\"\u201d]*[\"\u201d]", " , ", text[:2000].strip('"\u201c\u201d '))
    for sentence in re.split(r"(?<=[.!?;:])\s+|\n", text):
        found += _sentence(v.normal(sentence), here, found[-1] if found else None)
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


def _whole(thing: Phrase) -> Phrase:
    """What is to be sliced where "two slices of tomato" are to be cut."""
    if not thing.types or not all(kind.endswith("Sliced") for kind in thing.types):
        return thing
    types = tuple(kind.removesuffix("Sliced") for kind in thing.types)
    return replace(thing, types=types, every=False, number=1)


def _sentence(text: str, here: Collection[str], before: Clause | None = None) -> list[Clause]:
    words = re.findall(r"[a-z0-9]+(?:'[a-z]+)?|,", text)
    question = (text.endswith("?") or _QUESTION.match(text)) and not _ASKED.match(text)
    if question or _CONDITION.search(text):
        asked = first_named(text, here) if text.endswith("?") else None
        return [Clause("", (asked,))] if asked else []
    polite = bool(re.search(r"\bplease\b|\bfor me\b", text))
    reader = _Reader(words, here)
    cuts = [0]
    for i, word in enumerate(words):
        if word in v.BREAKS and i and reader.begins(i + 1, cuts[-1]):
            cuts.append(i)
    parts = [words[i:j] for i, j in zip(cuts, [*cuts[1:], len(words)], strict=True)]
    found: list[Clause] = []
    mine = loose = False
    put_off = bool(_LATER_FIRST.match(text))
    while parts:
        part = parts.pop(0)
        later = put_off or v.LATER in part
        part = [word for word in part if word != v.LATER]
        reader = _Reader(part, here, polite, mine)
        clause = reader.clause()
        mine = reader.mine
        said = "" if later or mine else reader.order_said()
        if reader.rest:
            parts.insert(0, part[reader.rest :])
            part = part[: reader.rest]
        if clause is None:
            rest = " ".join(part).strip(" ,")
            if later and not (mine and rest):
                found.append(Clause("", later=True))
            elif rest and not _PLEASANT.fullmatch(rest):
                found.append(Clause("", said=said))
            continue
        before = found[-1] if found else before
        if clause.verb == "same" and not _repeats(part, words, before, first=not found):
            clause = replace(clause, verb="")
        if found and before and before.verb and not before.things and not before.place:
            found[-1] = replace(before, things=clause.things)
            negated = clause.negated or before.negated
            clause = replace(clause, negated=negated, plain=clause.plain and not negated)
            if clause.verb == "same":
                continue
        if loose and any(thing.word in ("it", "them") for thing in clause.things):
            found[-1] = replace(found[-1], verb="pick up", place=None)
        loose = reader.loose
        corrects = clause.verb == "same" and bool({*words} & v.CORRECTS)
        plain = clause.plain and not later
        found.append(replace(clause, corrects=corrects, later=later, plain=plain, said=said))
        found += [replace(found[-1], verb=verb, plain=False) for verb in reader.also]
    return found


def _repeats(
    part: Sequence[str], words: Sequence[str], before: Clause | None, *, first: bool
) -> bool:
    """Whether a thing alone repeats the request before it: or gives what that lacks."""
    if not first:
        return bool(before and before.verb and not before.negated)
    lacks = before and before.verb and not any(t.types or t.word == "it" for t in before.things)
    marked = part[0] in v.AGAIN or not v.MARKS.isdisjoint(part) or not v.CORRECTS.isdisjoint(words)
    return bool(marked or lacks)


@dataclass
class _Reader(PhraseReader):
    """Reads one clause, word by word."""

    polite: bool = False
    mine: bool = False
    loose: bool = False
    also: list[str] = field(default_factory=list[str])
    """Further verbs of a passive: "washed and sliced"."""

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
                if alone or (said == "slice" and after == "of"):
                    return None
                if (said, after) in (("start", "by"), ("start", "with"), ("make", "sure")):
                    return None
                return forms[said], said, i + length
        return None

    def order_said(self) -> str:
        """The words from where an order begins; empty if none does."""
        start = next((i for i, word in enumerate(self.words) if word not in v.BREAKS), 0)
        first = self.lead(start)
        lead = {*self.words[start:first]}
        known = self.verb(first, v.BASE) and self.at(first) not in v.SAID_OF_ALL
        if lead & (v.STATING | v.NEGATIONS) or not (known or self.commands(first)):
            return ""
        end = self.rest or len(self.words)
        while self.at(end - 1) in v.BREAKS or self.at(end - 1) in (
            "please",
            "now",
            "thanks",
            "too",
        ):
            end -= 1
        return " ".join(self.words[first:end]).replace(" ,", ",") if end > first + 1 else ""

    def commands(self, i: int) -> bool:
        """Whether the word at `i` is plainly a verb that is not known: "play the guitar"."""
        word = self.at(i)
        return (
            self.at(i + 1) in v.ARTICLES
            and word not in v.STOPS | v.NOT_ORDERED | v.DETERMINERS | v.FILLERS | v.EACH
            and not word.endswith(("s", "ing", "ed", "ly"))
            and len(word) > 2
            and not word.isdigit()
            and not self.noun(i)[0]
            and not self.preposition(i)
        )

    def lead(self, i: int) -> int:
        while self.at(i) in v.LEAD and not self.verb(i, v.BASE):
            i += 1
        while self.at(i) == ",":
            i = self.lead(i + 1)
        return i

    def begins(self, i: int, start: int) -> bool:
        """Whether a new clause begins at `i`, behind one that begins at `start`."""
        after = self.lead(i)
        if self.verb(after, v.BASE) or (self.verb(after, v.ING) and self.at(i - 1) != ","):
            return True
        if self.commands(after):
            return True
        if after > i and v.LIKED & set(self.words[i:after]):
            return True
        _, end = self.things(i)
        if end == i or not _MODAL.match(" ".join(self.words[end:])):
            return False
        before = self.joints(start)
        return self.things(before)[1] != end and self.things(self.lead(before))[1] != end

    def clause(self) -> Clause | None:
        start = next((i for i, w in enumerate(self.words) if w not in v.BREAKS - v.NEGATIONS), 0)
        first = self.lead(start)
        lead = {*self.words[start:first]}
        text = " ".join(self.words)
        own = bool(v.MINE & lead or {"let", "me"} <= lead) and "you" not in lead
        self.mine = (own or self.mine) and not lead & {"you", "please"}
        wish = bool(v.LIKED & lead) or "i'd" in lead
        wish = wish or (own and "have" in lead and bool(lead & {"i'll", "will", "can", "could"}))
        negated = bool(v.NEGATIONS & lead)
        if alone := self.leave_alone(first):
            return alone
        verb = self.verb(first, v.BASE) or (self.verb(first, v.ING) if v.GERUND & lead else None)
        if verb:
            clause = self.order(*verb, negated=negated)
            if (
                self.mine
                and not wish
                and not (clause and clause.verb == "pick up" and verb[1] == "take" and own)
            ):
                return None
            is_polite = self.polite or not re.search(r"\b(?:can|could|would|will) you\b", text)
            plain = (
                not negated
                and not self.leftover
                and is_polite
                and bool(
                    _PLAIN_LEAD.fullmatch(" ".join(w for w in self.words[start:first] if w != ","))
                )
                and verb[0] != "make"
            )
            return replace(clause, plain=plain) if clause else None
        while first > start and self.at(first - 1) in v.DETERMINERS | v.PRONOUNS:
            first -= 1
        refusal = negated or self.at(first) in ("no", "nothing")
        if refusal and self.at(first) == "no":
            first += 1
        things, end = self.things(first, refused=refusal)
        if not things:
            place, _, _ = self.places(first)
            return Clause("put in", (), place, True) if refusal and place else None
        modal = _MODAL.match(" ".join(self.words[end:]))
        if modal and modal["modal"]:
            negated = negated or bool(re.search(r"n't|not", modal["modal"]))
            end += len(modal[0].split())
            return self.state(things, end, "", negated or "nothing" in self.words[first:end])
        if {"make", "sure"} <= lead and self.at(end) in ("is", "are"):
            return self.state(things, end + 1, "", negated)
        if wish and v.KEPT & {*self.words[end:]}:
            return None
        if wish:
            return self.state(things, end, "any" if negated else "pick up", negated)
        if refusal:
            if self.at(first - 1) == "no" and (place := self.tail(end).into):
                return Clause("put", things, place, negated=True)
            return Clause("any", things, negated=True)
        if text.startswith(tuple(f"{said} " for said in (*v.INTO, *v.ASIDE))):
            return Clause("")
        self.words = [
            "," if w in ("first", "instead", "rather") or (w == "next" and after != "to") else w
            for w, after in zip(self.words, [*self.words[1:], ""], strict=True)
        ]
        place = self.tail(end).into
        if place and v.VESSELS & {*place.types} and self.words[first:end] == ["wine"]:
            return Clause("fill", (place,), liquid="wine")
        told = lead & {"is", "are", "there"}
        same = (
            not (self.leftover or told)
            and any(thing.is_named for thing in things)
            and not self.mine
        )
        if same and self.polite and things[0].liquid and not place:
            return Clause("fill", things, liquid=things[0].liquid)
        return Clause("same" if same else "", things, place)

    def leave_alone(self, first: int) -> Clause | None:
        """A refusal such as "leave the mug where it is"."""
        if not _LEAVE_ALONE.match(" ".join(self.words[first:])):
            return None
        things, _ = self.things(first + 1)
        return Clause("any", things or (Phrase(word="it"),), negated=True)

    def order(self, verb: str, said: str, i: int, *, negated: bool) -> Clause | None:
        """What follows a verb."""
        to_me = self.at(i) in ("me", "us")
        i += to_me
        start = i
        things, i = self.things(i, refused=negated)
        poured = next((word for word in self.words[start:i] if word in v.LIQUIDS), "")
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
            things, watery = (Phrase(("Faucet",)),), False
        if watery:
            liquid = things[0].liquid
        if said == "crack" and any(t.types != ("Egg",) for t in things):
            verb = "open"
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
        if verb == "pour" or (watery and verb in ("put", "pick up", "empty")):
            if verb == "pick up" and not tail.source:
                return None
            if (tail.source and not into) or verb in ("pick up", "empty"):
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
            into = into or Phrase(("GarbageCan",))
        away = tail.source if verb == "put" or not into else into
        if away or (verb not in ("put", "pick up") and tail.aside):
            at = away.types if away else ()
            things = tuple(replace(thing, described=True, at=at) for thing in things)
        kept = v.KEPT & {*self.words[start:]} and "the whole" not in " ".join(self.words)
        if said in ("keep", "leave") and kept:
            return None
        if said in ("keep", "leave") and not into:
            return Clause("any", things, negated=True) if said == "leave" else None
        return Clause(verb, things, into if verb == "put" else None, negated, tail.excluded, liquid)

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
        tail = self.tail(i)
        if tail.into:
            return Clause("put", things, tail.into, negated, tail.excluded)
        if otherwise and "toast" in self.words:
            otherwise = "cook"
        return Clause(otherwise, things, None, negated, tail.excluded)

    def passive(
        self, things: tuple[Phrase, ...], verb: str, said: str, i: int, *, negated: bool
    ) -> Clause | None:
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
