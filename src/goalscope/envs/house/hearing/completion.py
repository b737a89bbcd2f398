"""Whether a person says that all is done."""

from __future__ import annotations

import re

from goalscope.envs.speech import lowered

__all__ = ["completes", "is_glad"]

_GLAD = (
    r"(?:ok(?:ay)?|yes|yeah|yep|great|perfect|good|excellent|awesome|wonderful|nice|well done"
    r"|lovely|fine|alright|thanks|thank you|thank you (?:so|very) much|thanks a lot|cool|now|so"
    r"|and|then|(?:good|great|nice|excellent|awesome) (?:job|work)|all good|bye|goodbye|have a"
    r" (?:nice|good|great) day|that'?s (?:it|all|everything|great|perfect)|that is (?:it|all"
    r"|everything)|nothing else|robot|no,? that'?s (?:all|it|everything)|i think|everything"
    r" looks (?:good|great|perfect)|for now|here|it looks (?:good|great|perfect)|looks"
    r" (?:good|great)|you did (?:great|well)|good night"
    r"|for (?:today|tonight|this (?:evening|morning)|the (?:day|moment|night)))"
)
_DONE = (
    r"(?:(?:(?:the|this|my|our|your|whole|entire|all) ){0,2}(?:tasks?|jobs?|chores?)(?: (?:is"
    r"|are|has been|have been)|'s)?(?: now)?(?: all| fully)? (?:complete|completed|done"
    r"|finished)|(?:we|you)(?:'re| are) (?:now )?(?:all )?(?:done|finished)|everything is (?:all"
    r" )?(?:done|complete|finished)|all done|you(?:'ve| have) (?:completed|finished) (?:the|your"
    r"|this) (?:whole )?task|we(?:'ve| have) (?:completed|finished) (?:the|our|this) (?:whole"
    r" )?task)"
)
_SAYS_DONE = re.compile(rf"(?:{_GLAD}[ ,]+)*{_DONE}(?:[ ,]+{_GLAD})*")
_IS_GLAD = re.compile(rf"{_GLAD}(?:[ ,]+{_GLAD})*")


def completes(utterance: str) -> bool:
    """Whether `utterance` says that the task is complete, and nothing else but pleasantries.

    A negation, a condition, a quotation, a question or one more wish makes it a no.
    """
    text = lowered(utterance).strip('"\u201c\u201d ')
    if len(text) > 200 or "?" in text or re.search(r"[^a-z ,.!;'\u2013\u2014-]|\.\.", text):
        return False
    said = False
    for sentence in re.split(r"[.!;]+|\s[-\u2013\u2014]+\s", text):
        sentence = sentence.strip(" ,")
        if _SAYS_DONE.fullmatch(sentence):
            said = True
        elif sentence and not _IS_GLAD.fullmatch(sentence):
            return False
    return said


def is_glad(said: str) -> bool:
    """Whether `said`, in lower case, is nothing but thanks, praise and the like."""
    return bool(_IS_GLAD.fullmatch(said.strip(" .!")))
