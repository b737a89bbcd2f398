"""Leave for what cannot be undone: how it is asked for, given, refused and taken back."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from functools import lru_cache

from goalscope.envs.house.hearing.completion import is_glad
from goalscope.envs.house.hearing.grammar import parse_plain
from goalscope.envs.house.hearing.phrases import Phrase, PhraseReader
from goalscope.envs.house.hearing.rewording import normal
from goalscope.envs.house.names import the
from goalscope.envs.speech import ASSENT, MILD

__all__ = ["IRREVERSIBLE", "ask_permission", "asked", "assented", "denies", "doubts"]
__all__ += ["hesitates", "keeps", "takes_back"]

IRREVERSIBLE = ("break", "slice", "use up", "cook")
"""What nobody can undo, so that it needs leave."""

_QUESTION = re.compile(r"May I (break|slice|use up|cook) (?:the )?([A-Za-z0-9 ]+)\?$")
_YES = rf"(?:{ASSENT}|VERB (?:it|(?:the )?NAME))"
_GOES_ON = re.compile(r"(?:and|then|also|next)\b")
_UNSURE = re.compile(r"\b(?:first|only|just|keep|leave|rather|later|wait|hold|stop|careful\w*)\b")
_AGREES = r"(?!yes|yeah|sure|ok|go ahead|of course)"
_DENIAL = re.compile(
    rf"{_AGREES}(?:no\b(?! problem)|nope|nah|not|never|stop|wait|leave|keep|later|tomorrow"
    rf"|on second thoughts?|better not)\b|{_AGREES}.*(?:n't\b|\b(?:not|never)\b"
    r"|\brather (?:keep|leave|have it whole)\b)"
)
_TAKES_BACK = re.compile(
    r"(?:^|[.!?;,]\s*)(?:(?:actually|oh|ok|okay|please|no|hmm|sorry)[ ,]+)*(?:never ?mind|forget"
    r" (?:it|that|about (?:it|that|everything))|cancel\b|stop\b(?! \w+ing)|scratch that|undo that"
    r"|leave it(?!\s+(?:on|in|whole|raw|intact|un\w+|as)\b)|i(?:'ve| have)? changed my mind"
    r"|on second thoughts?|hold on|wait\b|(?:i(?:'m| am|'m just| was))? ?(?:just )?(?:kidding"
    r"|joking)|(?:that's |that is )?enough(?: now)?(?=\s*(?:$|[.!,;]))"
    r"|(?:(?:i|you|we)(?:'d| had| would) )?(?:better|rather) not(?: to)?(?=\s*(?:$|[.!,;]))"
    r"|i(?:'d| would) (?:rather|prefer)(?: that| it if)?(?: you)? (?:not(?: to)?|didn't|don't)"
    r"(?=\s*(?:$|[.!,;])))"
)
_NEGATIVE = re.compile(r"n't\b|\b(?:not|never|no|nothing|dont|without|nope)\b")
_HESITANT = re.compile(
    r"\b(?:rather|prefer|unsure|hesitat\w+|enough|only|just|at most|later|tomorrow|tonight"
    r"|on second thoughts?)\b"
)
_STATES = re.compile(
    r"\b(?P<state>whole|intact|raw|uncooked|uncut|unsliced|unbroken|undamaged|unharmed"
    r"|in one piece|as (?:it|they) (?:is|are)|as is)\b"
)
_RATHER_KEEP = re.compile(
    r"\b(?:rather|prefer to) (?:just )?keep (?P<it>(?!.*\b(?:in|on|at)\b)[a-z0-9 ]+)[.!]*$"
)
_RULED_OUT = {
    **dict.fromkeys(("whole", "unbroken", "in one piece"), ("slice", "break")),
    **dict.fromkeys(("raw", "uncooked"), ("cook",)),
    **dict.fromkeys(("uncut", "unsliced"), ("slice",)),
}
_Ruled = tuple[tuple[str, ...], tuple[Phrase, ...]]
"""Verbs, and the things for which they are ruled out."""

_NEAR = 160
"""Characters on either side of a state in which the things that are in it are named."""

_ASKS = re.compile(r"(?:is|are|was|were|do|does|did|why|what|which|who|when|where|how)\b")


def ask_permission(verb: str, name: str) -> str:
    """The question to which a plain yes permits `verb` for the thing of this name."""
    return f"May I {verb} {the(name)}?"


def asked(query: str) -> tuple[str, str] | None:
    """The verb and the name in a question that ends by asking for leave."""
    found = _QUESTION.search(query.strip())
    return (found[1], found[2]) if found else None


def assented(said: str, verb: str, name: str, here: Collection[str]) -> str | None:
    """What follows a plain yes; None where `said` is no yes.

    Thanks, "please" and "fine" alone are none. What follows must be simple orders of other acts.
    """
    yes = _YES.replace("VERB", verb).replace("NAME", re.escape(name.casefold()))
    token = re.compile(rf"(?:(?P<yes>{yes})|(?P<mild>{MILD}))(?![\w'])(?P<gap>[ ,.!]*)")
    end, agreed, mild, gap = 0, False, set[str](), ""
    while match := token.match(said, end):
        agreed |= bool(match["yes"])
        mild |= {match["mild"]} if match["mild"] else set()
        end, gap = match.end(), match["gap"]
    rest = said[end:]
    if not rest:
        ok = bool(mild & {"ok", "okay"}) and mild <= {"ok", "okay", "please"}
        return "" if (agreed or ok) and ".." not in said else None
    apart = "." in gap or "!" in gap or _GOES_ON.match(rest)
    if not agreed or not apart or ".." in said or _UNSURE.search(rest) or _STATES.search(rest):
        return None
    orders = parse_plain(rest, here)
    return rest if orders and all(order.verb != verb for order in orders) else None


def denies(said: str) -> bool:
    """Whether a reply to the question for leave is a no."""
    return bool(_DENIAL.match(said))


def takes_back(said: str) -> bool:
    """Whether a person gives up all that was asked for."""
    return bool(_TAKES_BACK.search(said))


def doubts(said: str) -> bool:
    """Whether there is a negation in what is said."""
    return bool(_NEGATIVE.search(said)) and not is_glad(said)


def hesitates(said: str) -> bool:
    """Whether a person would rather have something else, or less of it, or have it later."""
    return bool(_HESITANT.search(said))


def keeps(text: str, here: Collection[str]) -> Sequence[_Ruled]:
    """What is ruled out by wishes such as "leave it whole", and for which things.

    Without things, those spoken of last are meant. Of what stands before and behind the state some
    words are read, and the same words once.
    """
    return _keeps(text, frozenset(here))


@lru_cache(maxsize=128)  # each round reads the whole conversation again
def _keeps(text: str, here: frozenset[str]) -> tuple[_Ruled, ...]:
    return tuple(_kept(text, here))


def _kept(text: str, here: Collection[str]) -> Iterator[_Ruled]:
    for sentence in re.split(r"(?<=[.!?;])\s+|\s+but\s+", text):
        if _ASKS.match(sentence):
            continue
        if match := _RATHER_KEEP.search(sentence):
            yield IRREVERSIBLE, _things(match["it"], here)
        seen: set[tuple[str, str]] = set()
        for match in _STATES.finditer(sentence):
            before = sentence[max(match.start() - _NEAR, 0) : match.start()]
            behind = sentence[match.start() :][:_NEAR]
            if (before, behind) in seen:
                continue
            seen.add((before, behind))
            clause = re.split(r"[,;:]|\b(?:and|so)\b", before)[-1]
            if _NEGATIVE.search(clause) or re.search(r"\b(?:the|on|as a) $", before):
                continue
            verbs = _RULED_OUT.get(match["state"], IRREVERSIBLE)
            attribute = _things(behind, here, first=True)
            if attribute and re.search(
                r"\b(?:an?|some|one|two|three|\d+|my|those|these) $", before
            ):
                orders = parse_plain(sentence, here)
                verbs = tuple(verb for verb in verbs if all(o.verb != verb for o in orders))
                yield verbs, attribute
            else:
                yield verbs, _things(before, here)


def _things(text: str, here: Collection[str], *, first: bool = False) -> tuple[Phrase, ...]:
    """The last row of things in `text`, or the one at its begin."""
    reader = PhraseReader(re.findall(r"[a-z0-9]+(?:'[a-z]+)?|,", normal(text)), here)
    if first:
        return tuple(thing for thing in reader.things(0)[0] if thing.types)
    found: tuple[Phrase, ...] = ()
    i = 0
    while i < len(reader.words):
        things, end = reader.things(i)
        if things and any(thing.types or thing.word != "unknown" for thing in things):
            found = things
        i = max(end, i + 1)
    return found
