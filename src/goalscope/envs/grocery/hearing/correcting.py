"""What a person says to correct what they said before, said more plainly."""

from __future__ import annotations

import re

from goalscope.envs.grocery.hearing.phrases import END, IT, NUMBER, SAME_ONE
from goalscope.envs.speech import kept

__all__ = ["CORRECTION", "NAMED", "QUALITY", "SUCH", "corrected", "instead"]

CORRECTION = re.compile(
    r"(?:[\s,.;!?\u2013\u2014-]*\b(?:no,? wait"
    r"|wait,? no(?=\s*(?:[,.;:!?\u2013\u2014-]|$|(?:i|make|it|that|the|add|remove)\b))"
    r"|no,? sorry|wait|sorry|oops"
    r"|(?:no,? )?i mean|i meant|scratch that)\b[\s,:.]*)+"
)
_SAID_ANEW = re.compile(
    rf"(?!(?:{IT}|i|i'm|we|you|can|could|make|please|no|not|don't|never|for|about|but|and|add"
    rf"|remove"
    r"|take|get|buy|put|drop|delete|swap|replace|change|there|is|are|what|how|do|did)\b)\w"
)
_RESTRICTS = re.compile(r"allerg|intoleran|\b(?:no|not|cannot|without|avoid|never|\w+n't)\b")
NAMED = r"(?!(?:is|are|was|were|can|do|does|should|that)\b)[\w'%-]+"
_NOT_BUT = re.compile(
    r"^(?:(?:no|sorry|wait|oops|hey|but|please|ok|okay)[ ,.!]+)*"
    r"(?:(?:i|we)(?: had)? (?:clearly |actually |only )?(?:meant?|said|want(?:ed)?|asked for) "
    r"|(?:add|buy|get|use|give me|get me) )"
    rf"(?!(?:{IT}|i|i'm|we|we're|he|she|they|you|there|but|not|maybe|remove|delete|drop|take|put"
    r"|leave|keep|swap|replace|change|cancel|make)\b)"
    rf"({NAMED}(?: {NAMED}){{0,4}}?),? (?:and )?not (?!{NUMBER}{END})"
    rf"(?:the |any |an? |some )?({NAMED}(?: {NAMED}){{0,3}}?)(?: please)?[.!]*$"
)
"""One thing and not another: "I said almond milk, not yogurt"."""
_WANTED = re.compile(
    r"^(?:(?:no|but|hey|sorry|oops)[ ,]+)*(?:i|we) (?:wanted|asked for|did (?:want|ask for|order)) "
    rf"(?!to\b|(?!(?:an?|of|and|half)\b){NUMBER}\b|"
    r".*\b(?:yesterday|last|before|earlier)\b)([^.,;!?]{1,60})[.!]*$"
)
"""What is still wanted, since nothing else is said."""
_NO_I_MEANT = re.compile(
    r"^(?:(?:(?:no|nope|sorry|wait|oops|hey|but)[ ,.!]+)+(?:i|we) meant?,? "
    r"|(?:(?:no,? wait|wait,? no(?=[,.!])|oops)[ ,.!]++(?:the )?+"
    r"|(?:no,? )?(?:not (?:that one|this one|that|those|these|them)|wrong ones?)[ ,.!]++"
    r"(?:the |(?=[\w'-]*\d|[\w'-]+ [\w'-]+[.!]*$)))"
    r"(?!(?:i'm|i'd|i'll|i've|i|we|you|can|could|would|make|please|don't|never|about|but|and|or|add"
    r"|buy|put|swap|replace|change|keep|leave|cancel|stop|wait|undo|let|let's|there|is|are|what"
    r"|which|how|why|do|did|an?|use|give|sorry|my|too|very|wrong|more|less|fewer|another|some|cheap\w*"
    r"|bigger|smaller|first|before|after|until|what's|that's|avoid|skip|must|should|he|she|they|there|leave)\b))"
    rf"(?!{NUMBER}{END}|(?:{IT}|for|to|in|on|at|by|nothing|everything|all|every|without|with"
    r"|organic|remove|take|get|drop|delete|no|not|only|just|now|later|today|tomorrow|that)\b)"
    r"([^.;!?,]{1,60})[.!]*$"
)
_MAKE_IT = re.compile(
    rf"\bmake {IT} (?=(?!{NUMBER} )[^.,;!?]{{1,60}}? (?:instead of|rather than) (?!{NUMBER}{END}))"
)
QUALITY = (
    "(?:white|brown|red|green|black|yellow|small|large|big|fresh|frozen|dried|canned|tinned|ground"
    "|instant|plain|salted|unsalted|smoked|sliced|shredded|dark|light|sweet|spicy|mild)"
)
SUCH = re.compile(
    r"^(?:(?:no(?:pe)?[,.!]|(?:sorry|actually|oh|ok|okay|hmm|please)[ ,.!])[ ,.!]*)*+"
    rf"(?:(?:i (?:want|meant|said|prefer)|i'd (?:like|prefer)|make (?:it|that)) )?"
    rf"({QUALITY}|decaf|sparkling)"
    rf"(?:,? (?:and )?not {QUALITY}|,? (?:instead of|rather than)(?: the)? {QUALITY}(?: ones?)?)?"
    r"(?: instead|,? actually)?(?:,? please)?[.!]*$"
)
"""Which of the things spoken of last is meant: "brown, not white"."""
_CHANGED = re.compile(
    r"^(?:(?:no|actually|sorry|ok|oh)[ ,.!]+)*i(?:'ve| have)? changed my mind[,.:;]? (?:and )?"
    r"(?=[^.;!?]* instead\b)"
)
_FIRST = re.compile(
    rf"^instead of (?:(?:the|my|our) )?({NAMED}(?: {NAMED}){{0,3}}?)"
    r"(?:, | (?=(?:an?|some|take|get|add|give me|use) ))(?!(?:i|we|can|could|let's)\b)"
    r"((?:(?!\band\b)[^.,;!?]){1,60})(?=[ .!]*$)"
)
"""What is to go before what takes its place."""
_SO_MANY = re.compile(
    rf"^(?:(?:no|actually|sorry|ok|oh)[ ,.!]+)*(?:(?:an?|some|the) )?(?!{NUMBER}\b)"
    rf"({NAMED}(?: {NAMED}){{0,4}}? instead) ?(of [^.,;!?]{{1,40}}?)?,? (?:(?:and|but) )?"
    rf"(?:just|only) ({NUMBER})(?: of (?:it|them|those))?(?: please)?[.!]*$"
)
"""How many of what takes another's place: "oat milk instead, just one"."""
_OF_IT = re.compile(rf"\b(?:instead of|rather than) {IT}{END}")
_SEVERAL = re.compile(
    r"(?<= instead of )([^.,;!?]{1,40}?),? and "
    rf"(?=(?!{QUALITY} instead)[^.,;!?]{{1,40}}? instead of )"
)
"""Between two swaps, the second of which names a thing."""
_MEANT = re.compile(r",\s*([^,.;!?]+?),? i mean(?:t)?(?=[.;!?]|$)")
_NEVER_MIND = re.compile(
    r"(?:^|(?<=[.;!?] ))(?P<said>[^.;!?]+)[.;!?,]+ (?:(?:actually|oh|no|wait|sorry|hmm|but)[ ,]+)*"
    r"never ?mind(?:[.,;!]+ (?:i|we)(?:'ve| have)? (?:still |already )?(?:have|got)"
    r" (?:it|some|one|that|them|enough|plenty)(?: already| at home| left)*)?(?=[.,;!?]|$)"
)
"""What is taken back in one breath: "get milk. Actually never mind, I have some"."""
_AFTERTHOUGHT = re.compile(
    r", (?:(?:and|but|oh|actually|no|wait)[ ,]+)*(?=(?:never ?mind|forget(?: about)?) the\b)"
)
_BEFORE_LAST = re.compile(
    r"[,;.!?]|\b(?:and|or|plus|add|get|buy|want|need|like|have|take|remove|order|delete)\b"
)


def instead(text: str) -> str:
    """`text`, evened, where it says no more than what is to take the place of what."""
    text = _MAKE_IT.sub("add ", text)
    text = _FIRST.sub(r"\2 instead of \1", _CHANGED.sub("", text))
    text = _SO_MANY.sub(lambda m: f"{m[3]} {m[1]} {m[2] or 'of it'}", _SEVERAL.sub(r"\1. ", text))
    text = _OF_IT.sub(rf"instead of {SAME_ONE}", text)
    text = _NOT_BUT.sub(r"add \1 instead of \2", text)
    text = SUCH.sub(r"the \1 one", text)
    text = _WANTED.sub(r"i want \1", kept(text))
    return _NO_I_MEANT.sub(rf"add \1 instead of {SAME_ONE}", text)


def corrected(text: str) -> str:
    """`text` without what a person says wrong and corrects at once, as in "milk, no wait, oil".

    What one must not or does not eat is not taken back so: better one restriction too many.
    """
    text = _NEVER_MIND.sub(lambda m: m[0] if _RESTRICTS.search(m["said"]) else "", text)
    text = _AFTERTHOUGHT.sub(". ", text)
    said, *anew = CORRECTION.split(_MEANT.sub(r", i mean \1", text))
    for part in anew:
        if re.match(rf"{NUMBER}{END}", part):
            said += ". make it"
        elif not _SAID_ANEW.match(part):
            said += "."
        elif _RESTRICTS.search(re.split(r"[.;!?]", said)[-1]):
            said += ","
        else:
            breaks = list(_BEFORE_LAST.finditer(said, max(0, len(said) - 60)))
            said = said[: breaks[-1].end()] if breaks else ""
        said += f" {part}"
    return said.strip()
