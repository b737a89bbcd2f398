"""What a person wants to be asked about before it is done: "ask me before you cut anything"."""

from __future__ import annotations

import re

from goalscope.envs.house.hearing.leave import IRREVERSIBLE

__all__ = ["acts_to_ask_for", "is_only_a_wish"]

_ASK = r"(?:ask|check with|consult|tell|warn)(?:ing)?"
_WISH = re.compile(
    rf"\b{_ASK} (?:(?:me|us|for \w+ (?:leave|permission)) )?(?:(?:about \w+|again|always) )?"
    r"(?:first|before(?:hand)?)\b|\b(?:be|get|am) asked (?:first|before)\b"
    rf"|\bwithout (?:first )?(?:{_ASK}|checking|permission|(?:my|our) \w|(?:me|us|i) \w)"
    r"|\b(?:unless|until|before) (?:i|we) (?:say|said|tell|told|agree|allow|permit|ask)"
)
_BARE = re.compile(
    rf"(?:(?:so|and|but|please|always|just|you (?:must|should|have to|need to))[ ,]+)*{_ASK}"
    r" (?:(?:me|us) )?(?:first|beforehand)(?:,? (?:please|always|next time|in future))*[ .!]*"
)
_ANYTHING = re.compile(r"\b(?:any|every|some|no)thing\b")
_ACTS = {
    "break": re.compile(r"\b(?:br(?:eak|oken)|crack|smash|shatter|destroy)\w*"),
    "slice": re.compile(r"\b(?:cut|slic|chop|carv|halv)\w*"),
    "use up": re.compile(r"\bus(?:e|ed|es|ing)\b"),
    "cook": re.compile(r"\b(?:cook|toast|boil|fry|bak(?:e|ing)|roast|heat)\w*"),
}


def acts_to_ask_for(sentence: str) -> tuple[str, ...]:
    """The irreversible acts of which a sentence, evened, says that they need a question first.

    All of them, where the sentence names none.
    """
    if not _WISH.search(sentence):
        return ()
    named = tuple(verb for verb in IRREVERSIBLE if _ACTS[verb].search(sentence))
    return named or IRREVERSIBLE


def is_only_a_wish(sentence: str) -> bool:
    """Whether a sentence, evened, says of acts in general or of one that is named to ask first.

    So does a bare "ask me first".
    """
    general = _ANYTHING.search(sentence) or any(each.search(sentence) for each in _ACTS.values())
    return bool(_WISH.search(sentence) and (general or _BARE.fullmatch(sentence)))
