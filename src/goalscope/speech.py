"""What people type, made even before patterns look for a yes or a denial (`advice`)."""

from __future__ import annotations

import re

__all__ = ["ASSENT", "LEAD", "LONGEST", "MILD", "fold_case", "normalize"]

LEAD = (
    r"(?:(?:ok(?:ay)?|hi|hello|hey|so|and|but|well|sorry|excuse me|also|please|(?:can|could) you"
    r" tell me|do you know|tell me)[ ,]+)*"
)
"""How a question begins that is normalized."""

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


def fold_case(text: str) -> str:
    """`text` in lower case and on one line, with plain apostrophes."""
    text = re.sub("[\u2018\u2019\u00b4`]", "'", text[:LONGEST].casefold())
    return " ".join(text.split())


def normalize(text: str) -> str:
    """`text` lowered, with what is typed in haste written out, and without fillers."""
    text = fold_case(text)
    for pattern, plainer in _EVENED:
        text = pattern.sub(plainer, text)
    return text
