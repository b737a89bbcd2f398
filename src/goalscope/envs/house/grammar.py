"""A small grammar of what people say to a robot in a house: clauses, verbs, things, places."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from goalscope.envs.house.names import naming

__all__ = ["Clause", "Phrase", "first_things", "is_plain", "parse", "plainly", "sentences"]

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
    "|keep your hands off|don't touch",
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
    " either instead only".split()
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
    *("inside of", "into", "onto", "inside", "in", "on", "to", "upon", "at", "under the"),
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


@dataclass(frozen=True, slots=True)
class Phrase:
    """A thing as it was said.

    Attributes:
        types: The object types that it may be; empty for a pronoun ("" in `word`: none at all).
        word: "it", "them", "one", "slice" ... for pronouns, "" for things that are named.
        every: Whether all of them are meant.
        number: How many, 0 where it was not said.
        group: Whether it was named by a group word.
        number_name: The number of a name in the scene, 2 of "drawer 2", or 0.
        liquid: What it holds, "coffee" of "a cup of coffee".
    """

    types: tuple[str, ...] = ()
    word: str = ""
    every: bool = False
    number: int = 0
    group: bool = False
    number_name: int = 0
    liquid: str = ""


@dataclass(frozen=True, slots=True)
class Clause:
    """One order, wish or refusal.

    Attributes:
        verb: One of the actions, or "any" in a refusal of whatever may be done.
        things: To what it is to be done.
        place: Where the things are to be put, or which thing a liquid goes to.
        negated: Whether it is ruled out.
        excluded: Things named as exceptions.
        liquid: What to fill with, "" where it was not said.
        plain: Whether every word of it was understood, and it is a simple order.
    """

    verb: str
    things: tuple[Phrase, ...] = ()
    place: Phrase | None = None
    negated: bool = False
    excluded: tuple[Phrase, ...] = ()
    liquid: str = ""
    plain: bool = False
