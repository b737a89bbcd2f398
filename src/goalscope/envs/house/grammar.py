"""A small grammar of what people say to a robot in a house: clauses, verbs, things, places."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace

from goalscope.envs.house.names import naming
from goalscope.envs.house.object_types import object_types

__all__ = ["Clause", "Phrase", "normal", "parse", "parse_plain"]

_VERBS = {
    "put": "put|put away|place|move|set|store|stow|drop|carry|transfer|arrange|stack|hang|return"
    "|serve|lay|relocate|deposit|insert|throw|throw away|toss|keep|leave|dispose of|plate|add",
    "pick up": "pick up|pick|grab|take|get|bring|bring back|fetch|retrieve|hold|give|hand|collect"
    "|gather|find|remove|lift|lift up",
    "open": "open|open up",
    "close": "close|shut",
    "turn on": "turn on|switch on|power on|start|light",
    "turn off": "turn off|switch off|power off|shut off|turn down|blow out|put out|extinguish",
    "turn": "turn|switch",
    "slice": "slice|slice up|cut|cut up|chop|chop up|dice",
    "cook": "cook|boil|fry|bake|roast|toast|grill",
    "break": "break|smash|shatter|crack",
    "fill": "fill|fill up|refill|water",
    "pour": "pour",
    "empty": "empty|empty out|drain|pour out|dump|dump out",
    "clean": "clean|clean up|rinse|wash|scrub|wipe|rinse off|wash off|wipe off",
    "dirty": "dirty|soil",
    "push": "push",
    "pull": "pull",
    "use up": "use up|finish up",
    "use": "use|touch|disturb|bother|mess with|go near",
    "make": "make|prepare|brew",
    "ignore": "ignore|skip|forget about|forget|never mind|stay away from|keep away from|hands off"
    "|keep your hands off",
}
_IRREGULAR = {
    **{"take": "taken", "get": "gotten", "bring": "brought", "hold": "held", "give": "given"},
    **{"find": "found", "break": "broken", "throw": "thrown", "keep": "kept", "hang": "hung"},
    **{"leave": "left", "make": "made", "light": "lit", "lay": "laid", "blow": "blown"},
}


def _forms() -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
    """Verbs by their base forms, their -ing forms and their participles."""
    base: dict[str, str] = {}
    ing: dict[str, str] = {}
    done: dict[str, str] = {}
    for verb, listed in _VERBS.items():
        for form in listed.split("|"):
            head, space, rest = form.partition(" ")
            base[form] = verb
            stem = head.removesuffix("e")
            for start in (stem, head + head[-1]):
                ing[f"{start}ing{space}{rest}"] = verb
                done[f"{start}ed{space}{rest}"] = verb
            done[f"{_IRREGULAR.get(head, head)}{space}{rest}"] = verb
    return base, ing, done


_BASE, _ING, _DONE = _forms()
_NEGATIONS = frozenset(
    "don't not never no without avoid stop shouldn't mustn't can't won't needn't wouldn't nor"
    " didn't doesn't isn't aren't neither nobody".split()
)
_LEAD = frozenset(
    "please kindly can could would will you we i i'd i'll we'll you'll need needs want like love to"
    " now then and so ok okay yes yeah sure hi hello hey first next also just let's let us me try"
    " have should must shall go ahead finally lastly again good great nice perfect job work thanks"
    " thank alright there start by be do help remember make sure today your task is the going it"
    " says that all after this would've got but or well awesome more one robot and-then had better"
    " either only".split()
) | (_NEGATIONS - {"no", "nobody", "neither"})
_LIKED = frozenset("need want like love needs".split())
_DETERMINERS = frozenset(
    "the a an my our your his her their any some all every each both another other same single of"
    " these those that this whole more just only".split()
)
_FILLERS = frozenset(
    "clean dirty small big large little red blue green white black brown yellow grey gray left"
    " right cooked boiled toasted empty full open closed top bottom upper lower round wooden first"
    " second third last next remaining rest lone fresh hot cold used nearest closest smaller larger"
    " smallest largest two-thirds edible".split()
)
_EACH = frozenset("all every each both".split())
_NUMBERS = {
    **{"a": 1, "an": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6},
    **{"seven": 7, "eight": 8, "nine": 9, "ten": 10, "another": 1, "both": 2, "couple": 2},
}
_PRONOUNS = frozenset("it them they those these that this one ones ones' both all".split())
_VAGUE = frozenset("items item things thing objects object everything anything nothing".split())
_INTO = (
    *("on top of", "in to", "on to", "back in", "back on", "back to", "back into", "over to"),
    *("inside of", "into", "onto", "inside", "in", "on", "to", "upon", "at"),
)
_ASIDE = (
    *("next to", "in front of", "out of", "close to", "to the left of", "to the right of"),
    *("left of", "right of", "on the left of", "on the right of", "beside", "by", "near"),
    *("under", "underneath", "above", "below", "behind", "from", "off", "with", "using", "of"),
)
_EXCEPT = (
    *("except for", "except", "but not", "apart from", "other than", "besides", "and not", "not"),
    *("rather than", "instead of"),
)
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
    r"(?:(?:and|so|but|ok|okay|oh|well)[ ,]+)*(?:what|which|who|whose|when|why|how|where|do|does|did"
    r"|is|are|was|were|has|have you|should|shall|may i|can i|could i|would it|will it)\b"
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
_TAIL = frozenset("please now up too also thanks carefully there back away down over in on".split())


_STATES = {
    **{"on": "turn on", "off": "turn off", "open": "open", "closed": "close", "shut": "close"},
    **{"clean": "clean", "empty": "empty", "full": "fill", "dirty": "dirty"},
}
_LIQUIDS = frozenset(("water", "coffee", "wine"))
_SLICES = frozenset(("slice", "slices", "piece", "pieces"))
_NOUNS = frozenset("toast plate water light hand empty open dirty add set".split())
"""Verbs that are as often something else; alone, or before "and", they are no orders."""
_BREAKS = frozenset((",", "and", "then", "but", "also", "so", "or", "without", "not", "avoid"))
_REWORDED = [
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r"[\u2018\u2019\u00b4`]", "'"),
        (r"\b(do|does|did|is|are|was|should|would|could|must|need)nt\b", r"\1n't"),
        (r"\b(?:cannot|cant)\b", "can't"),
        (r"\bwont\b", "won't"),
        (r"\blets\b", "let's"),
        (r"\b(?:pls|plz|pleas)\b", "please"),
        (r"\bu\b", "you"),
        (r"\bcoffe+\b", "coffee"),
        (r"\b(?:don't|do not|never) (?:forget|hesitate)(?: about)?(?: to)?\b", "please"),
        (r"\bdo not\b", "don't"),
        (r"\b(?:there(?:'s| is) )?no need (?:to|for)\b", "don't"),
        (r"^(?:no|nope|nah)(?:,| (?=please\b))", ""),
        (r"\b(?:instead of|rather than) (?=\w+ing\b)", ", not "),
        (r"\b(?:after|before|once|when|while|as soon as)\b(?! (?:that|this)\b)[^,]*(?:, ?|$)", ""),
        (r"\b(?:if (?:you (?:can|could|please|don't mind)|possible))\b", ""),
    )
]
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


def normal(text: str) -> str:
    """`text` in lower case, on one line, with plain quotation marks and contractions."""
    text = " ".join(text[:2000].casefold().split())
    for pattern, plain in _REWORDED:
        text = pattern.sub(plain, text)
    return text


def parse(text: str, here: Collection[str] = ()) -> list[Clause]:
    """The orders, wishes, refusals and statements in `text`; questions and conditions are none."""
    found: list[Clause] = []
    for sentence in re.split(r"(?<=[.!?;:])\s+|\n", text[:2000]):
        found += _sentence(normal(sentence), here)
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
    if re.search(r"\b(?:\w+n't|not|no|never|nor|or|but|if|without|except)\b", said):
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


def _sentence(text: str, here: Collection[str]) -> list[Clause]:
    question = (text.endswith("?") or _QUESTION.match(text)) and not _ASKED.match(text)
    if question or _CONDITION.search(text):
        return []
    words = re.findall(r"[a-z0-9]+(?:'[a-z]+)?|,", text)
    reader = _Reader(words, here)
    cuts = [i for i, word in enumerate(words) if word in _BREAKS and reader.begins(i + 1)]
    found: list[Clause] = []
    for start, end in zip([0, *cuts], [*cuts, len(words)], strict=True):
        clause = _Reader(
            words[start:end], here, bool(re.search(r"\bplease\b|\bfor me\b", text))
        ).clause()
        if clause is None:
            if re.search(r"[a-z]", " ".join(words[start:end])):
                found.append(Clause(""))
            continue
        before = found[-1] if found else None
        if before and before.verb and not before.things and not before.place and start:
            found[-1] = replace(before, things=clause.things)
            clause = replace(clause, negated=clause.negated or before.negated)
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
                alone = said in _NOUNS and after in ("", ",", "and", "of", "is", "or")
                if alone or (said == "slice" and after == "of"):
                    return None
                if (said, after) in (("start", "by"), ("start", "with"), ("make", "sure")):
                    return None
                return forms[said], said, i + length
        return None

    def lead(self, i: int) -> int:
        while self.at(i) in _LEAD and not self.verb(i, _BASE):
            i += 1
        while self.at(i) == ",":
            i = self.lead(i + 1)
        return i

    def begins(self, i: int) -> bool:
        """Whether a new clause begins at `i`."""
        after = self.lead(i)
        if self.verb(after, _BASE) or (self.verb(after, _ING) and self.at(i - 1) != ","):
            return True
        if after > i and _LIKED & set(self.words[i:after]):
            return True
        _, end = self.things(i)
        return end > i and bool(_MODAL.match(" ".join(self.words[end:])))

    def clause(self) -> Clause | None:
        start = next((i for i, w in enumerate(self.words) if w not in _BREAKS - _NEGATIONS), 0)
        first = self.lead(start)
        lead = self.words[start:first]
        negated = bool(_NEGATIONS & set(lead))
        text = " ".join(self.words)
        if alone := self.leave_alone(first):
            return alone
        if verb := self.verb(first, _BASE) or (self.verb(first, _ING) if lead else None):
            if "i" in lead and not _LIKED & {*lead} and not {"i'd", "you"} & {*lead}:
                return None
            clause = self.order(*verb, negated=negated)
            is_polite = self.polite or not re.search(r"\b(?:can|could|would|will) you\b", text)
            plain = (
                not negated
                and not self.leftover
                and is_polite
                and bool(_PLAIN_LEAD.fullmatch(" ".join(w for w in lead if w != ",")))
                and first > 0 - 1
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
        if _LIKED & {*lead} or "i'd" in lead:
            if negated:
                return Clause("any", things, negated=True)
            return self.state(things, end, "pick up", negated)
        if refusal:
            return Clause("any", things, negated=True)
        return Clause("", things)

    def leave_alone(self, first: int) -> Clause | None:
        """ "Leave the mug where it is" and the like."""
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
        if verb == "turn" or (verb == "use" and not negated):
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
            if source and not into or verb in ("pick up", "empty"):
                return Clause("empty", (source,) if source else (Phrase(word="it"),), None, negated)
            return Clause("fill", (into or Phrase(word="it"),), None, negated, liquid=liquid)
        if watery:
            return None
        if verb == "pick up" and into and said_into in ("into", "onto", "to", "over to", "back to"):
            verb = "put"
        if verb == "put" and said in ("throw away", "dispose of"):
            into = into or Phrase(("GarbageCan",))
        if said in ("keep", "leave") and not into:
            return None
        place = into if verb == "put" else None
        return Clause(verb, things, place, negated, excluded, liquid)

    def state(
        self, things: tuple[Phrase, ...], i: int, otherwise: str, negated: bool
    ) -> Clause | None:
        """What follows "the mug needs to be" or "I want the mug"."""
        while self.at(i) in ("to", "be", "all", "both", "get", "go", "placed", "also"):
            i += 1
        verb = self.verb(i, _DONE) or self.verb(i, _ING)
        if verb:
            return self.passive(things, *verb, negated=negated)
        if self.at(i) in _STATES and (i + 1 >= len(self.words) or self.at(i) not in ("on", "off")):
            return Clause(_STATES[self.at(i)], things, negated=negated)
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
        for said in _INTO:
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
            for said in (*_EXCEPT, *_ASIDE):
                parts = said.split()
                if self.words[i : i + len(parts)] != parts:
                    continue
                if said in _EXCEPT:
                    more, end = self.things(i + len(parts))
                    excluded += more
                    self.leftover = True
                else:
                    aside, end = self.thing(i + len(parts))
                    if said in ("from", "out of", "off"):
                        source = aside or source
                    if said in ("with", "of", "using") and self.at(end - 1) in _LIQUIDS:
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
                elif self.at(i) not in _TAIL:
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
            if named and not (word == "slice" and named is None):
                which = (
                    int(self.at(named.end))
                    if re.fullmatch(r"[1-9]\d{0,2}", self.at(named.end))
                    else 0
                )
                liquid = self.at(named.end + 1) if self.at(named.end) == "of" else ""
                liquid = liquid if liquid in _LIQUIDS else ""
                every = every or named.group or (named.plural and not number)
                end = named.end + (1 if which else 2 if liquid else 0)
                return Phrase(named.types, "", every, number, named.group, which, liquid), end
            if word in _SLICES:
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
            if word in _VAGUE:
                vague = "everything" if word in ("everything", "anything", "nothing") else "them"
                return Phrase(word=vague, every=every, number=number), i + 1
            if word in _NUMBERS or word.isdigit():
                number = _NUMBERS.get(word, 0) or min(int(word) if word.isdigit() else 0, 99)
            elif word not in _DETERMINERS and word not in _FILLERS and word not in _PRONOUNS:
                break
            every = every or word in _EACH
            i += 1
        said = self.words[start:i]
        pronoun = next((w for w in reversed(said) if w in _PRONOUNS), "")
        if pronoun:
            return Phrase(word=pronoun, every=every, number=0 if pronoun == "it" else number), i
        return None, start
