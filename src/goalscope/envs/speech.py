"""What people type, made even before a grammar reads it."""

from __future__ import annotations

import re
from functools import lru_cache

__all__ = ["ASSENT", "LEAD", "LONGEST", "MILD"]
__all__ += ["agrees", "declines", "evened", "is_question", "kept", "lowered", "misspelt"]
__all__ += ["refuses"]

LEAD = (
    r"(?:(?:ok(?:ay)?|hi|hello|hey|so|and|but|well|sorry|excuse me|also|please|(?:can|could) you"
    r" tell me|do you know|tell me)[ ,]+)*"
)
"""How a question begins that is evened."""

ASSENT = (
    r"yes|yeah|yep|yup|sure|of course|go ahead|please do|do it|you may|certainly|absolutely"
    r"|by all means"
)
"""A yes."""

MILD = r"ok(?:ay)?|please|fine|that'?s (?:fine|ok(?:ay)?)|thanks|thank you"
"""What is a yes beside one, and is a doubtful one alone."""

LONGEST = 2000
"""Characters that are read of an utterance."""

_EVENED = [
    (re.compile(pattern), plainer)
    for pattern, plainer in (
        (
            r"\b(do|does|did|is|are|was|were|should|would|could|must|need|have|has)nt\b",
            r"\1n't",
        ),
        (r"\b(?:cannot|cant)\b", "can't"),
        (r"\bwont\b", "won't"),
        (r"\b(let|that|what|there)s\b(?! \d)", r"\1's"),
        (r"\bi(m|ve)\b", r"i'\1"),
        (r"\b(?:pls|plz|plse|pleas)\b", "please"),
        (r"\b(?:thx|thanx|thnx)\b", "thanks"),
        (r"\b(?:u|ya)\b", "you"),
        (r"\b(c|w|sh)ld\b", r"\1ould"),
        (r"\bteh\b", "the"),
        (r"\b(?:taht|thta|tath|thath)\b", "that"),
        (r"\b(?:unod|udno|undu)\b", "undo"),
        (r"\bgimme\b", "give me"),
        (r"\blemme\b", "let me"),
        (r"\bwanna\b", "want to"),
        (r"\bgonna\b", "going to"),
        (r"(?<=\w) n (?=\w)", " and "),
        (
            r"(?<=\w)(?:,? (?:btw|by the way|actually|either|though|tho|haha|lol|ofc|of course"
            r"|asap))+"
            r"(?=[ ,]*(?:[,.;!?]|$))",
            "",
        ),
        (r"(?:(?:^|(?<=[ ,.!?]))(?:uh+m?|um+|erm?|hm+|oh|lol|haha)\b[,.]* ?)+", ""),
        (
            r"(?:^|(?<=[.;!?] ))i (?:think|guess|suppose|believe),? (?:that )?(?="
            r"(?:i|we|you|it|he|she|they|there|let|please)\b|that(?:'s| is| will)\b"
            r"|(?!(?:about|all|at|both|for|half|in|just|like|maybe|most|not|of|on|only|so|with)\b)"
            r"\w+ (?:the|an?|my|our|it|them|this|that|these|those|some)\b"
            r"|[^.,;!?]{1,60} (?:should|must|can|could|needs?|has to|have to|would be"
            r"|(?:is|are) (?:a must|essential|needed))\b)",
            "",
        ),
        (r",? (?:i (?:guess|think|suppose|believe)|i'd say)(?=[ ,]*(?:[.;!?]|$))", ""),
        (r"\b(?:as well as|along with|together with)\b", "and"),
        (
            r"\b(?:i|we) (?:don't|do not) (?:really )?(?:think|believe|suppose|guess)(?: that)?"
            r" (i|we|you|they)(?:'ll|'d| will| would)? (?:(?:still|even|really|actually|all) )*"
            r"(?=(?:need|want|like|eat|drink|use)\b)",
            r"\1 don't ",
        ),
        (r"\b(?:evry|evrey|evey|evrything|every|eveyr|ever)[ -]?(?:th?ing|thign)\b", "everything"),
        (
            r"\b(hello|hi|good (?:morning|afternoon|evening)|please|thanks|thank you|yes|no|fine|ok"
            r"|okay|right),? (?:my )?(?:dear|love|darling)\b",
            r"\1",
        ),
        (
            r"^(?:(?:good )?(?:morning|afternoon|evening)|good day|hello|hey|hi)(?: there)?[.!]+"
            r" (?=\w)",
            "",
        ),
        (r"[ ,]+(?=[.;!?]|$)", ""),
    )
]
"""Patterns, and what people write who take their time."""


_CALLED_BACK = re.compile(
    r"(?:^|(?<=[.;!?,])|\band )(?:(?!\band\b)[^.;!?,])+[.;!?,]? (?:(?:no|wait|actually|oh|sorry)"
    r"[, .!]+)+(?:(?:keep (?:it|them|that)|don't|do not|leave (?:it|them|that)"
    r"(?: there| alone| on| off| open| closed)?|forget (?:it|that)|never ?mind|not yet)[ .!]*$"
    r"|(?<=no )wait[ .!]*$|(?<=no, )wait[ .!]*$|(?<=wait )no[ .!]*$|(?<=wait, )no[ .!]*$)",
    re.IGNORECASE,
)
"""What is taken back as soon as it is said: "remove the milk, no, keep it"."""

_ASKS = re.compile(
    rf"{LEAD}(?:who|whose|what|which|when|where|why|how)(?:'s|'re)?\b(?! (?:about|if)\b)"
)
_POLITE = re.compile(rf"{LEAD}(?:can|could|would|will) you\b")

_REFUSES = re.compile(
    r"\W*(?:no (?!idea|problem|matter|doubt)\w|never \w|without \w"
    r"|(?:don't|do not) (?!know|mind|care)\w)"
)

_PLAIN_YES = (
    rf"(?:{ASSENT}|ok(?:ay)?|al(?:l )?right|y|(?:that|it)(?:'s| is) (?:fine|right|ok(?:ay)?"
    r"|correct|good)|fine by me|i (?:do|confirm|agree)|confirmed|agreed|correct)"
)
_AGREES = re.compile(
    rf"(?:well[ ,]+)?{_PLAIN_YES}(?:[ ,.!]+(?:{_PLAIN_YES}|please|thanks|thank you))*[ .!]*"
)


def agrees(text: str) -> bool:
    """Whether `text` is a yes, and nothing besides."""
    return bool(_AGREES.fullmatch(evened(text)))


def declines(text: str) -> bool:
    """Whether `text` begins as a no does."""
    return bool(re.match(r"\W*(?:no|nope|nah|not|don't|do not|leave|never)\b", evened(text)))


def refuses(text: str) -> bool:
    """Whether `text` begins with a thing or an act that is not wanted: "no pond, please"."""
    return bool(_REFUSES.match(evened(text)))


def is_question(text: str) -> bool:
    """Whether `text` ends as a question does, or begins as one; "can you bring it?" is an order."""
    said = evened(text)
    last = re.split(r"(?<=[.!?;]) ", said)[-1]
    asks = last.endswith("?") or _ASKS.match(said)
    return bool(asks and not _POLITE.match(last))


def lowered(text: str) -> str:
    """`text` in lower case and on one line, with plain apostrophes."""
    text = re.sub("[\u2018\u2019\u00b4`]", "'", text[:LONGEST].casefold())
    return " ".join(text.split())


def evened(text: str) -> str:
    """`text` lowered, with what is typed in haste written out, and without fillers."""
    text = lowered(text)
    for pattern, plainer in _EVENED:
        text = pattern.sub(plainer, text)
    return text


def kept(text: str) -> str:
    """`text` without a last clause that is called back with the next words."""
    return _CALLED_BACK.sub("", text[:LONGEST])


@lru_cache(maxsize=4096)
def misspelt(word: str, known: frozenset[str]) -> str:
    """The one known word that differs by doubled letters, or by two neighbours that changed places.

    Other slips, and those in short words, lead to other words too often. Empty where there is
    none, or more than one.
    """
    if len(word) < 5:
        return ""
    turned = {f"{word[:i]}{word[i + 1]}{word[i]}{word[i + 2 :]}" for i in range(len(word) - 1)}
    bare = _undoubled(word)
    found = {each for each in known if each in turned or _undoubled(each) == bare}
    return found.pop() if len(found) == 1 else ""


def _undoubled(word: str) -> str:
    return re.sub(r"(.)\1+", r"\1", word)
