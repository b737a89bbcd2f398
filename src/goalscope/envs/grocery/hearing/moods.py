"""What a person does with words: an order or refusal, a question, or a mere statement."""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import Enum, auto

from goalscope.envs.grocery.words import asks

__all__ = ["Mood", "clauses"]


class Mood(Enum):
    """What a clause does: order (or name, or refuse) something, ask, or only tell or deny."""

    ORDER = auto()
    QUESTION = auto()
    STATEMENT = auto()


_FILLER = (
    r"please|kindly|ok|okay|yes|yeah|yep|yup|no|nope|nah|hmm|um|ah|right|alright|cool|oh|well|hi|hello|hey|actually|just|also|then|now"
    r"|and|so|but|maybe|perhaps|sorry|thanks|thank you|great|good|perfect|fine|first|again|instead"
    r"|definitely|really|simply|wait|sure|go ahead|feel free to|(?:make|be) sure (?:to|you)"
    r"|(?:don't forget|remember) to|i guess|i think|on second thoughts?|never ?mind|forget it"
    r"|(?:i(?:'ve| have)?|we(?:'ve| have)?) changed (?:my|our) minds?|if (?:possible|you can)|thus"
    r"|time to|in that case|to begin with|and then|only|(?:how|what) about|it's best to"
)
_WISH = (
    r"(?:can|could|will|would|may|might) (?:you|we|i)(?: mind| be able to)?|let ?'s|let us|let me"
    r"|(?:i|we)(?:'d| would|'ll| will|'ve| do)?(?: also| really| just| definitely| actually)*"
    r" (?:want|wanted|like|love|prefer|need|have|decided|wish)(?: you)? to"
    r"|do you mind"
    r"|(?:i|we)(?:'d| would) rather|(?:i|we)(?:'m|'re| am| are) going to|(?:i|we)(?:'ll| will)"
    r"|(?:you|we)(?: will|'ll)? (?:can|could|should|may|might|must|need to|have to)"
    r"|i (?:said|asked you|told you)(?: to)?|you forgot to"
    r"|(?:is|would) it (?:be )?possible to"
    r"|(?:i'd appreciate it|it would be (?:good|great|nice)) if you(?: could| can| would)?"
)
_GAP = r"[^\w']{0,5}"
_PREFACE = re.compile(rf"(?:{_GAP}\b(?:{_FILLER}|{_WISH})(?!['\w])){{0,8}}+{_GAP}")
_POLITE = re.compile(
    rf"{_GAP}(?:\w+{_GAP}){{0,2}}?(?:can|could|will|would|may|might) (?:you|we|i)\b"
)
_VERB = (
    r"(?:remove|delete|drop|ditch|discard|lose the|minus the|undo|return|cancel|get rid"
    r"|take|put|throw|leave|swap|exchange|switch|trade|replace|substitute|change"
    r"|make (?:it|that|this|them|the)|keep|add|buy|get me|empty|clear|start)\b"
)
_FIRST = re.compile(rf"\b(?:{_VERB}|(?:set|reduce|increase|lower|raise|cut|bring|update|bump)\b)")
_LEAD = re.compile(rf"(?:{_GAP}\b(?:{_FILLER})(?!['\w])){{0,8}}+{_GAP}")
_ASKED = (
    r"(?:do|does|did|is|are|was|were|has|have|should|shall|what|why|who|how|when|where)"
    r" (?:you|i|we|they|he|she|it|there|the|about|much|many|if|is|are|did|do)\b"
)
_BREAK = re.compile(
    r"(?:(?P<mark>,|\s[-\u2013\u2014](?=\s))|(?=\s(?:and|but|so|then|or|also|because|please)\b))"
    rf"(?P<joint>(?:\s*\b(?:and|but|so|then|or|also|because|please)\b){{0,4}}+)\s*"
    rf"(?={_PREFACE.pattern}\b{_VERB}|(?<!please ){_ASKED})"
)
_SENTENCE = re.compile(r"(?<=[;!?])|(?<=\.)(?=\s)")


def clauses(text: str) -> Iterator[tuple[str, Mood]]:
    """Each clause of `text`, in lower case and on one line, with its closing marks, and its mood.

    "Remove it" changes the basket; "did you remove it?" and "I never said to remove it" do not,
    and neither does what is joined to them, as in "did you add milk and remove it?".
    """
    for sentence in _SENTENCE.split(text):
        breaks = [
            found
            for found in _BREAK.finditer(sentence)
            if not _PREFACE.fullmatch(sentence, 0, found.start())
        ]
        starts = [0, *(found.end() for found in breaks)]
        ends = [*(found.start() for found in breaks), len(sentence)]
        mood = Mood.ORDER
        for place, (start, end) in enumerate(zip(starts, ends, strict=True)):
            clause = sentence[start:end].strip()
            joined = place > 0 and re.search(r"\b(?:and|or)\b", breaks[place - 1]["joint"])
            if not (joined and mood is not Mood.ORDER and re.match(_VERB, clause)):
                last = place == len(breaks)
                mood = _mood(clause, asked=last and sentence.rstrip().endswith("?"))
            if clause:
                yield (clause if clause[-1] in ".;!?" else f"{clause}.", mood)


def _mood(clause: str, *, asked: bool) -> Mood:
    if asks(clause) or asks(_LEAD.sub("", clause, count=1)):
        return Mood.QUESTION
    verb = _FIRST.search(clause)
    if verb and not _PREFACE.fullmatch(clause[: verb.start()]):
        return Mood.STATEMENT
    return Mood.STATEMENT if asked and not (verb or _POLITE.match(clause)) else Mood.ORDER
