"""A small grammar of what people say to a robot in a house: orders, wishes, refusals."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.hearing.orders import Clause, OrderReader
from goalscope.envs.house.hearing.phrases import Phrase, first_named
from goalscope.envs.house.hearing.rewording import normal
from goalscope.envs.house.hearing.sentences import CONDITION, sentences
from goalscope.envs.remarks import is_remark, takes_leave
from goalscope.envs.speech import lowered

__all__ = ["is_exact", "parse", "parse_plain", "sentences"]


_MODAL = re.compile(
    r"(?:all |both |also |still |just |only )*(?P<modal>(?:needs?|ha(?:s|ve)) to(?: be)?"
    r"|should(?:n't| not)?(?: all)?(?: be| go)?|must(?:n't| not)?(?: be| go)?|(?:is|are) to be"
    r"|(?:do not|don't|doesn't|does not) (?:belong|go|live)|belongs?|go(?:es)?|lives?|to be|can be"
    r"|needs?)\b ?"
)
_LEAVE_ALONE = re.compile(
    r"\b(?:leave|keep)\b.*\b(?:alone|where|as (?:it|they)|in place|be|untouched|there|out)\b"
)
_STAYS = re.compile(r"(?:leave|keep) (?:\w+ ){1,4}(?:there|where|in place)\b")
_LEFT_THERE = re.compile(r"\b(?:leave|keep) \w+ (?:there|where|in place)\b")
_QUESTION = re.compile(
    r"(?:(?:and|so|but|ok|okay|oh|well)[ ,]+)*(?:what|which|who|whose|when|why|how|where"
    r"|do(?! (?:it|that|this)\b|(?: (?:the|my|our|some|your)) \w+(?: please| now)?[ .!]*$)|does"
    r"|did|is|are|was|were|has|have you|should|shall|may i|can i|could i|would it|will it)\b"
)
_PLEASANT = re.compile(
    r"(?:(?:ok|okay|yes|yeah|yep|sure|great|good|perfect|nice|thanks|thank you|hi|hello|hey|there"
    r"|robot|please|now|very much|so much|awesome|job|work|again)[ ,]*)+"
)
_HEDGED = re.compile(
    r"n't\b|\b(?:not|no|never|nor|or|but|if|unless|until|without|except|instead|after|before"
    r"|once|when|while|as soon as|can't|dont|cant|wont)\b"
)


_DENIES = re.compile(
    r"\b(?:don't|never) (?!(?:worry|wait|bother|mind|panic|hurry|rush|stress)\b)[^,]+$"
)
"""What denies an act that nobody here can do: "don't eat ..."."""


_BARE = 3
"""Words of a part that names a verb alone, with the comma before it: ", throw away"."""

_LATER_FIRST = re.compile(
    rf"\s*(?:(?:and|then|but|ok|okay|so|please|no|yes|sure|maybe|perhaps)[ ,]+)*{v.LATER}\b"
)


def parse(text: str, here: Collection[str] = ()) -> list[Clause]:
    """The orders, wishes, refusals and statements in `text`; questions and conditions are none."""
    return list(_parse(text[:2000], frozenset(here)))


@lru_cache(maxsize=128)  # each round reads the whole conversation again
def _parse(text: str, here: frozenset[str]) -> tuple[Clause, ...]:
    found: list[Clause] = []
    for sentence in sentences(text):
        if is_remark(sentence) and takes_leave(sentence):  # "nothing else" rules nothing out
            continue
        found += _sentence(normal(sentence), here, found[-1] if found else None)
    return tuple(found)


def is_exact(text: str, here: Collection[str], *, repeats: bool) -> bool:
    """Whether every sentence of `text` is an order, a refusal, a question or a remark.

    An order that does not say what, or where to, is none.

    Args:
        text: What was said.
        here: Types that are in the scene.
        repeats: Whether there is an order that a thing alone can repeat.
    """
    return _all_exact(text[:2000], frozenset(here), repeats)


@lru_cache(maxsize=128)
def _all_exact(text: str, here: frozenset[str], repeats: bool) -> bool:
    said = False
    for sentence in sentences(text):
        words, remark = normal(sentence), is_remark(sentence)
        orders = [] if remark else _sentence(words, here)
        exact = [_is_exact(order, repeats=repeats) for order in orders]
        if not (any(exact) or remark or _asks(words)):
            if (left := words.strip(" ,.!;:")) and not _PLEASANT.fullmatch(left):
                return False
            continue
        rest = [order for order, ok in zip(orders, exact, strict=True) if not ok]
        if any(order.verb or order.said or (order.things and any(exact)) for order in rest):
            return False
        said, repeats = True, repeats or any(exact)
    return said


def _is_exact(order: Clause, *, repeats: bool) -> bool:
    """Whether it says what is to be done with what, and where to."""
    if any(thing.word == "unknown" for thing in order.things):
        return False
    if order.negated:
        return True
    if not order.verb or not order.things:
        return False
    if order.verb == "same":
        return repeats or bool(order.place or order.aside)
    return bool(order.place or order.verb != "put")


def _asks(text: str) -> bool:
    """Whether `text`, which `normal` made, is a question and no order."""
    marked = text.rstrip(" .!)'").endswith("?")
    return bool(marked or _QUESTION.match(text)) and not v.ASKED.match(text)


def parse_plain(text: str, here: Collection[str] = ()) -> list[Clause]:
    """The orders in `text` if it consists of nothing but simple ones and pleasantries, else none.

    A condition, a negation, a quotation, a question, or any word that the grammar does not know
    makes it none.
    """
    said = lowered(text)
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


def _sentence(text: str, here: Collection[str], before: Clause | None = None) -> list[Clause]:
    words = re.findall(r"[a-z0-9]+(?:'[a-z]+)?|,", text)
    if _asks(text) or CONDITION.search(text):
        asked = first_named(text, here) if text.rstrip(" .!)'").endswith("?") else None
        return [Clause("", (asked,))] if asked else []
    polite = bool(re.search(r"\bplease\b|\bfor me\b", text))
    reader = _Reader(words, here)
    cuts = [0]
    for i, word in enumerate(words):
        if word in v.BREAKS and i and reader.begins(i + 1, cuts[-1]):
            cuts.append(i)
    parts = [words[i:j] for i, j in zip(cuts, [*cuts[1:], len(words)], strict=True)]
    found: list[Clause] = []
    mine = loose = listed = False
    put_off = bool(_LATER_FIRST.match(text))
    headed = text.rstrip().endswith(":")
    denied = elliptic = orders = False
    while parts:
        part = parts.pop(0)
        if denied and _stands_behind_or(part, parts, listed=elliptic, orders=orders):
            part = [part[0], "don't", *part[1:]]
        later = put_off or v.LATER in part
        part = [word for word in part if word != v.LATER]
        reader = _Reader(part, here, polite, mine)
        clause = reader.clause()
        if not v.BREAKS.issuperset(part):
            denies = bool(_DENIES.search(" ".join(part)))
            denied = clause.negated if clause and clause.verb else denies
            orders = bool(clause and clause.verb not in ("", "any"))
            elliptic = not (clause and clause.things)
        mine = reader.mine and not reader.did
        mine = mine and not (reader.feels and parts and parts[0][0] != "and")
        said = "" if later or mine or headed else reader.order_said()
        every = clause is not None and [each.word for each in clause.things] == ["everything"]
        if listed and clause and clause.place and not clause.verb and every:
            clause = replace(clause, things=(Phrase(word="unknown"),))
        if listed and clause and any(thing.word == "unknown" for thing in clause.things):
            said = " ".join(part).strip(" ,").removeprefix("and ")
        listed = bool(reader.rest) and bool(said)
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
        puts = polite and bool(clause.place or clause.aside)
        again = puts or _repeats(part, words, before, first=not found)
        if clause.verb == "same" and not again:
            clause = replace(clause, verb="", excluded=())
        if found and before and before.verb and not before.things and not before.place:
            found[-1] = replace(before, things=clause.things)
            negated = clause.negated or before.negated
            clause = replace(clause, negated=negated, plain=clause.plain and not negated)
            if clause.verb == "same":
                continue
        if loose and any(thing.word in ("it", "them") for thing in clause.things):
            found[-1] = replace(found[-1], verb="pick up", place=None)
        if clause.verb == "any" and found and found[-1].verb not in ("", "same", "put", "pick up"):
            stays = clause.things and clause.things[0].word and _LEFT_THERE.search(" ".join(part))
            clause = replace(clause, verb="put") if stays else clause
        loose = reader.loose
        corrects = clause.verb == "same" and bool({*words} & v.CORRECTS)
        corrects = corrects or (bool(clause.verb) and [*part, ""][-2:-1] == ["instead"])
        plain = clause.plain and not later
        found.append(replace(clause, corrects=corrects, later=later, plain=plain, said=said))
        found += [replace(found[-1], verb=verb, plain=False) for verb in reader.also]
        if reader.serves and not (later or clause.negated):
            found.append(Clause("put", (Phrase(word="it"),), Phrase(v.SURFACES)))
    return found


def _stands_behind_or(
    part: Sequence[str], rest: Sequence[Sequence[str]], *, listed: bool, orders: bool
) -> bool:
    """Whether "or" leads to a part, or to one behind it in a list.

    Args:
        part: The part, behind one that is denied.
        rest: Those behind it.
        listed: Whether it may be a verb alone, as in "don't wash, slice or cook it".
        orders: Whether it may be a whole order, as in "don't wash the mug, slice the apple or ...".
    """
    if part[:1] != [","]:
        return len(part) > 1 and part[0] in ("or", "nor")
    last = next((each for each in rest if each[:1] != [","]), [""])
    if last[0] not in ("or", "nor"):
        return False
    if 1 < len(part) <= _BARE and (v.ARTICLES | v.PRONOUNS).isdisjoint(part):
        return listed
    marked = {*v.PRONOUNS, "please", "just"}
    return orders and len(part) > 1 and marked.isdisjoint([*part, *last])


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
class _Reader(OrderReader):
    """Reads one clause, word by word.

    Attributes:
        polite: Whether the sentence says please.
        mine: Whether it is about what the person does, and not the robot.
        did: Whether it tells of what was done: "I left the mug there".
        feels: Whether it tells how the person is, or likes a thing: "I'm hungry".
    """

    polite: bool = False
    mine: bool = False
    did: bool = False
    feels: bool = False
    _leads: dict[int, int] = field(default_factory=dict[int, int], init=False)

    def order_said(self) -> str:
        """The words from where an order begins; empty if none does."""
        start = next((i for i, word in enumerate(self.words) if word not in v.BREAKS), 0)
        first = self.lead(start)
        does = [i for i in range(start, first) if self.at(i) == "do"]
        first = next((i for i in does if self.at(i + 1) in v.ARTICLES), first)
        lead = {*self.words[start:first]}
        known = self.verb(first, v.BASE) and (
            self.at(first) not in v.SAID_OF_ALL
            or (
                self.at(first) in v.MAKES
                and self.at(first + 1 + (self.at(first + 1) in v.PARTICLES))
                in v.ARTICLES | v.MEALS | {"me", "us"}
            )
        )
        known = known or self.at(first) == "do"
        known = known or (self.at(first) in v.AIMS | v.WILD)
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
        return (
            " ".join(self.words[first:end]).replace(" ,", ",")
            if end > first + (self.at(first) not in v.AIMS | v.WILD)
            else ""
        )

    def commands(self, i: int) -> bool:
        """Whether the word at `i` is plainly a verb that is not known: "play the guitar"."""
        word = self.at(i)
        return (
            self.at(i + 1 + (self.at(i + 1) in v.PARTICLES)) in v.ARTICLES | v.ONESELF
            and word not in v.STOPS | v.NOT_ORDERED | v.DETERMINERS | v.FILLERS | v.EACH
            and (word.endswith("eed") or not word.endswith(("s", "ing", "ed", "ly")))
            and len(word) > 2
            and not word.isdigit()
            and not self.noun(i)[0]
            and not self.preposition(i)
        )

    def lead(self, i: int) -> int:
        """Where the words that lead to a verb at `i` end."""
        end = i
        while end not in self._leads and (
            self.at(end) == "," or (self.at(end) in v.LEAD and not self.verb(end, v.BASE))
        ):
            end += 1
        last = self._leads.get(end, end)
        self._leads |= dict.fromkeys(range(i, end), last)
        return last

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
        if (
            end > i
            and self.at(end) in v.BARE_STATES
            and self.at(end + 1) in ("", ",", "and", *v.TAIL)
        ):
            return True
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
        self.did = verb is None and self.verb(first, v.DONE) is not None
        feeling = wish or bool(lead & {"i'm", "am"}) or self.at(first) in v.FELT
        self.feels = feeling and not (verb or self.verb(first, v.ING))
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
                    v.PLAIN_LEAD.fullmatch(" ".join(w for w in self.words[start:first] if w != ","))
                )
                and verb[0] != "make"
            )
            return replace(clause, plain=plain) if clause else None
        if self.at(first) in v.FELT:
            felt, _ = self.things(first + 1)
            return Clause("", felt) if felt else None
        while first > start and self.at(first - 1) in v.DETERMINERS | v.PRONOUNS:
            first -= 1
        refusal = negated or self.at(first) in ("no", "nothing")
        if refusal and self.at(first) == "no":
            first += 1
        things, end = self.things(first, refused=refusal)
        if not things:
            place, _, _ = self.places(first)
            return Clause("put in", (), place, True) if refusal and place else None
        where, _, after = self.places(end)
        if where and where.types and _MODAL.match(" ".join(self.words[after:])):
            things = tuple(replace(thing, at=where.types) for thing in things)
            end = after
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
        self.reread(
            [
                "," if w in ("first", "instead", "rather") or (w == "next" and after != "to") else w
                for w, after in zip(self.words, [*self.words[1:], ""], strict=True)
            ]
        )
        self._leads.clear()
        if self.at(end) in v.BARE_STATES and self.only_tail(end + 1):
            if not self.polite and self.at(first) in v.DETERMINERS:
                return Clause("", things)
            return self.state(things, end, "", negated=False)
        tail = self.tail(end)
        place = tail.into
        if place and v.VESSELS & {*place.types} and self.words[first:end] == ["wine"]:
            return Clause("fill", (place,), liquid="wine")
        if place and tail.by in v.TOWARDS and not (lead & v.STATING or self.leftover):
            if self.words[first:end] == ["coffee"]:
                return Clause("fill", (place,), liquid="coffee")
            return Clause("put", things, place)
        if tail.source:
            things = tuple(replace(thing, at=tail.source.types) for thing in things)
        told = lead & {"is", "are", "there"}
        same = (
            not (self.leftover or told)
            and any(thing.is_named for thing in things)
            and not self.mine
        )
        if same and self.polite and things[0].liquid and not place:
            return Clause("fill", things, liquid=things[0].liquid)
        return (
            Clause("same", things, place, False, tail.excluded, aside=tail.aside)
            if same
            else Clause("", things, place)
        )

    def only_tail(self, i: int) -> bool:
        """Whether nothing but words such as "please" stands from `i` on."""
        return all(word in v.TAIL or word == "," for word in self.words[i:])

    def leave_alone(self, first: int) -> Clause | None:
        """A refusal such as "leave the mug where it is"."""
        if not _LEAVE_ALONE.match(" ".join(self.words[first:])):
            return None
        things, _ = self.things(first + 1)
        stays = bool(_STAYS.match(" ".join(self.words[first:])))
        things = things or (Phrase(word="it"),)
        return Clause("any", things, negated=True, stays=stays, alone=True)
