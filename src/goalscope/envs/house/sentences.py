"""Where one sentence of a person's words ends and the next one begins."""

from __future__ import annotations

import re

__all__ = ["CONDITION", "sentences"]

CONDITION = re.compile(r"\b(?:if|unless|until|whether|in case|suppos\w+|imagine|pretend)\b")
"""Words of which nothing is known to be so."""

_ENDS = re.compile(
    r"(?<=[.!?;:])\s+|\n|(?<!\bbe)(?<!\bvery),? (?:(?:and|but) )?"
    r"(?=(?:be )?(?:very )?careful (?:with|of|about)\b)",
    re.IGNORECASE,
)
"""What stands between sentences; a warning is one of its own."""

_BEFORE_ASKING = re.compile(
    r"(?:,(?: (?:so|and|but))?| (?:so|and|but)) (?=(?:can|could|would|will) you\b)", re.IGNORECASE
)
"""Where an order begins that is asked for behind a statement: "it is old, could you toss it?"."""

_WHEN = re.compile(rf"{CONDITION.pattern}|\b(?:after|before|once|when|while|as soon as)\b", re.I)
"""What an order behind it depends on."""


def sentences(text: str) -> list[str]:
    """The sentences of a text, without what it quotes."""
    text = re.sub(r"[\"\u201c][^\"\u201d]*[\"\u201d]", " , ", text.strip('"\u201c\u201d '))
    return [
        each
        for part in _ENDS.split(text)
        for each in ([part] if _WHEN.search(part) else _BEFORE_ASKING.split(part))
    ]
