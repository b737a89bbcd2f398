"""What patterns of a person's words are made of, and words that stand for things spoken of."""

from __future__ import annotations

from goalscope.envs.grocery.amounts import WORD

__all__ = [
    "ASKED_NOT",
    "CART",
    "END",
    "EXCEPT",
    "IN_PLACE",
    "IT",
    "NUMBER",
    "SAME",
    "SAME_ALL",
    "SAME_ONE",
    "SAME_TWO",
    "TAKES",
    "UNASKED_FOR",
]

SAME = "ditto"
"""Stands for the thing that was spoken of last, as in "make it three"."""

SAME_ALL = "dittos"
"""Stands for all things that were spoken of last, as in "take them out"."""

SAME_TWO = "dittwo"
"""Stands for the two things that were spoken of last, in one breath or two: "remove both"."""

SAME_ONE = "dittone"
"""Stands for the thing that was spoken of last, where it was one alone: "no, I meant oil"."""

IN_PLACE = "inplace"
"""Begins what takes the place of what the same clause takes out."""

NUMBER = rf"(?:\d+|{WORD}(?:[ -]{WORD}){{0,3}})"
IT = "(?:it|that|this|them|those|these)"
END = r"(?=\s*(?:[.,;!?]|$| and | please| instead| but ))"
CART = "(?:basket|cart|order|list)"
EXCEPT = "(?:but|except(?: for)?|apart from|other than)"
TAKES = (
    r"(?:remove|delete|drop(?! [\w' ]{1,40} off\b)|ditch|discard"
    r"|(?:lose|minus|undo|return|cancel)(?= the )|get rid of|(?:put|take) back"
    r"|(?:take|throw|toss|chuck) (?:out|off|away))"
)
ASKED_NOT = (
    r"(?:didn't|did not|never|haven't|have not|hadn't)(?: (?:even|really|ever))?"
    r" (?:ask(?:ed)? for|want(?:ed)?|order(?:ed)?|mention(?:ed)?|request(?:ed)?|say|said)"
)
UNASKED_FOR = (
    rf"(?: (?:that|which))? (?:(?:i|we|nobody|no one) (?:{ASKED_NOT}|asked for|wanted)"
    r"|(?:was|were) not asked for|you(?: just| only)?(?: have|'ve)? guessed)\b"
)
