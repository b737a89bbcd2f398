"""Where one sentence of a person's words ends and the next one begins."""

from __future__ import annotations

import re

__all__ = ["CONDITION", "reworded", "sentences"]

CONDITION = re.compile(r"\b(?:if|unless|until|whether|in case|suppos\w+|imagine|pretend)\b")
"""Words of which nothing is known to be so."""

_NAMED = r"(?:the|my|our|your|his|her)(?: [\w'-]+){1,2}"
_CARE = r"\b(?:please )?(?:be )?(?:very |really )?careful (?:with|of|about)"
_CARE_NOT_TO = re.compile(
    rf"{_CARE} (?P<what>[^,.;:!?]{{1,60}})[,.;:!]+ (?:so )?(?P<not>don't|do not|never) (?P<act>\w+)"
    r" (?:it|them)\b",
    re.IGNORECASE,
)
_INSTEAD = re.compile(
    r"(?:(?:no|actually|sorry|oops|wait|please)\b[ ,]+)*+"
    r"(?P<yes>(?:the|my|our|that) [\w ]{1,40}?),? (?:instead of|rather than)"
    r" (?P<no>(?:the|my|our|that) [\w ]{1,40}?)(?:,? please)?[ .!]*",
    re.IGNORECASE,
)
_FRAGILE = re.compile(
    r"(?:careful\b[ ,:!.]*)?(?P<thing>\b(?:the|my|our) \w+(?: \w+)?) (?:is|are)"
    r" [\w ]{1,40}[,.;!]+ (?:so )?"
    r"(?P<not>don't|do not|never) (?P<act>\w+) (?:it|them)\b",
    re.IGNORECASE,
)
"""A warning, and what is not to be done for it: "the pan is hot. Don't touch it"."""
_NOT_AT_ALL = re.compile(
    r"(?:no[ ,]+)?(?P<not>not (?:the|my|our|that) [\w ]{1,40}?)[,.;:]+ (?:just |please )?"
    r"(?:leave|keep) (?:it|them)(?: (?:alone|be|where (?:it|they) (?:was|were)))?[ .!]*",
    re.IGNORECASE,
)
_INTRODUCED = re.compile(
    r"(?:^|(?<=[.,;!?] ))(?:there(?:'s| is| are)|(?:i|we)(?: can|'ve| have| just)*"
    r" (?:see|saw|found|find|got|bought|noticed)|(?:i|we) (?:can't|cannot|couldn't)"
    r" (?:reach|find|carry|lift|get to|see)) (?:(?:still|also) )?(?:an?|some|the|my|our)"
    r" (?P<thing>[a-z]+(?: [a-z]+)?)(?: (?:in|on|at|under|near|inside) [^,.;!?]{1,40})?"
    r"(?:[,.;]|,? (?:so|and)\b) (?=(?:(?:so|and|then|please|can you|could you) )*[a-z]+"
    r" (?:it|them)\b)",
    re.IGNORECASE,
)
"""What names a thing that is then spoken of: "there's an apple on the shelf, put it away"."""
_WARNING = re.compile(
    rf"(?:, ?|\b(?:and|but) )*{_CARE}(?: (?!(?:and|then|but|so)\b)[\w'-]+)+"
    rf"(?:(?:, {_NAMED}){{0,5}},? and {_NAMED}(?=[.,;:!?]|$))?"
    r"(?:, (?:or |it |it'll |it's |they |they're |you |you'll |you might )[^,.;:!?]*)?",
    re.IGNORECASE,
)
"""What names a thing, and asks for nothing: "careful with the knife, it's sharp"."""

_ENDS = re.compile(r"(?<=[.!?;:])\s+|\n")

_BEFORE_ASKING = re.compile(
    r"(?:,(?: (?:so|and|but))?| (?:so|and|but)) (?=(?:can|could|would|will) you (?!please\W*$)\w)",
    re.IGNORECASE,
)
"""Where an order begins that is asked for behind a statement: "it is old, could you toss it?"."""

_SLIP = re.compile(
    r"\b(?P<verb>put|place|move|take|bring|throw|set|carry|leave|get)"
    r" (?:the|my|our|an?) \w+(?: \w+)?,? (?:no,? wait|wait,? no|no|sorry|i meant?|or rather"
    r"|actually),? (?P<thing>(?:the|my|our|an?) \w+(?: \w+)??),? "
    r"(?=(?:in|into|on|onto|to|back|away|out|up)\b)",
    re.IGNORECASE,
)
"""One thing, and the other that is meant: "put the apple, no, the tomato, in the fridge"."""
_WITH = re.compile(
    r"\bwith (?:coffee|water|wine)[,.]? (?:(?:no|sorry|i meant?|actually|wait)[, ]+)+"
    r"(?:with )?(?P<liquid>coffee|water|wine)\b",
    re.IGNORECASE,
)
_RUN_ON = re.compile(
    r"(?P<told>(?:(?:the|my|our|this|that) \w+(?: \w+)?|it|this|that)"
    r" (?:is|are|looks?|smells?|seems?|got)(?: (?!not\b)\w+){1,3})"
    r" (?=(?:can|could|would|will) you \w+ (?:it|them)\b)",
    re.IGNORECASE,
)
"""A statement with what is asked for behind it: "the bread is old could you throw it away"."""

_WHEN = re.compile(rf"{CONDITION.pattern}|\b(?:after|before|once|when|while|as soon as)\b", re.I)
"""What an order behind it depends on."""


def reworded(text: str) -> str:
    """A correction in the words that are understood: "not the cup, the mug"."""
    text = _INTRODUCED.sub(r"the \g<thing>, ", text)
    text = _SLIP.sub(r"\g<verb> \g<thing> ", text)
    text = _WITH.sub(r"with \g<liquid>", text)
    text = _FRAGILE.sub(r"\g<not> \g<act> \g<thing>", text)
    if found := _INSTEAD.fullmatch(text):
        return f"not {found['no']}, {found['yes']}"
    found = _NOT_AT_ALL.fullmatch(text)
    return found["not"] if found else text


def sentences(text: str) -> list[str]:
    """The sentences of a text, without what it quotes, or only warns of."""
    text = re.sub(r"[\"\u201c][^\"\u201d]*[\"\u201d]", " , ", text.strip('"\u201c\u201d '))
    text = _RUN_ON.sub(r"\g<told>, ", text)
    text = _WARNING.sub("", _CARE_NOT_TO.sub(r"\g<not> \g<act> \g<what>", text))
    return [
        each
        for part in _ENDS.split(text)
        for each in ([part] if _WHEN.search(part) else _BEFORE_ASKING.split(part))
    ]
