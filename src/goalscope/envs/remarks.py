"""Words that say nothing of what is wanted: thanks, refusals, complaints, questions about acts."""

from __future__ import annotations

import re

from goalscope.envs.speech import evened

__all__ = ["asks_for_guesses", "asks_why", "changes_mind", "is_remark", "takes_leave"]

_LEAD = (
    r"(?:(?:ok(?:ay)?|and|but|so|well|hey|hi|hello|hm+|wait|oops|sorry|please|now|then|actually"
    r"|hold on|excuse me|no+|nope)[ ,]+)*"
)
_WHY = (
    r"(?:why(?! (?:not|don't (?:you|we)|can't (?:you|we))\b)|how come|what (?:made|makes) you"
    r"|who (?:asked|told|said|wants|wanted)|what (?:is|are|was|were) (?:it|that|this|these|those)"
    r" for|since when)\b.*"
)
_THAT = r"(?:th(?:is|at|ese|ose)|it|they)"
_NEGATED = r"(?:did not|didn't|never|have not|haven't|had not|hadn't)"
_BAD = (
    r"(?:wrong|incorrect|right|correct|true|nonsense|silly|stupid|ridiculous|absurd|weird|odd"
    r"|strange|crazy|annoying|useless|awful|terrible|bad|funny|unnecessary|unneeded|confusing"
    r"|confused|mistaken|lost|kidding|joking|drunk|too (?:much|many|expensive|dear|fast)|a lot"
    r"|a mistake|a joke|an error|(?:my|your) mistake|what i .*|what we .*|it|so)"
)
_GOOD = (
    r"(?:good|great|fine|perfect|nice|lovely|wonderful|excellent|awesome|cool|super|brilliant"
    r"|amazing|kind|helpful|ok(?:ay)?|all(?: right)?|everything|enough|it|done|ready|happy)"
)
_REST = (
    r"(?: (?:so|very|much|many|a lot|a bunch|you|for (?:that|this|it|now|today|tonight|everything"
    r"|this (?:evening|morning|week)|your (?:help|time)|the (?:help|moment|day|night))"
    r"|again|all|then|today|now|already|really|indeed"
    r"|job|work|choice|idea|one|there|here|please|thanks|thank you|with (?:that|this|it)"
    r"|i (?:need|want|wanted|asked|said|think|guess)|we need|we want|to me|robot))*"
)
_LEAVE = (
    r"(?:(?:that|this|it)(?:(?:'s| is|'ll be| will be| would be) (?:all|it|enough|everything)"
    r"|'ll do| will do)|(?:(?:thanks|thank you) )?(?:bye(?: bye)?|goodbye)"
    r"|good night|see you(?: \w+)?"
    r"|(?:i'm|i am|we're|we are)(?: all)? (?:done|finished|leaving)"
    rf"|nothing(?: (?:else|more|really))?|no more){_REST}"
)
_GUESSES = (
    r"(?:(?:what|which(?: \w+)?)(?: (?:in|of) (?:the|my|our) (?:basket|cart))?"
    r" (?:(?:all )?(?:did|have) you(?: just)? guess(?:ed)?"
    r"|(?:was|were|is|are) guessed|(?:are|were) (?:your|the) guesses|(?:did|have) you (?:add(?:ed)?"
    r"|do|done|move[d]?|put in|buy|bought) (?:that|which|what)"
    r" (?:i|we|nobody|no one) (?:(?:did not|didn't|never|haven't|have not) )?"
    r"(?:ask|order|mention|want|say|said)(?:ed)?(?: you)?(?: for)?)"
    r"|(?:what(?:'s| is) (?:in (?:the|my|our) (?:basket|cart) )?(?:that )?"
    r"|which of (?:these|those|them|it) (?:is|are|was|were)?)"
    r"(?: ?(?:you guessed|did you guess|guessed|guesses|a guess))"
    rf"|did you guess (?:anything|something)|(?:show|tell|list)(?: me)? (?:your|the) guesses)"
    rf"(?: so far)?{_REST}"
)
_PATTERNS = (
    _WHY,
    r"(?:what|who|huh|pardon|excuse me|come again|say that again|seriously|really|come on)",
    rf"what (?:is|are|was|were) (?:{_THAT}|you|going on|happening|wrong|all {_THAT})(?: .*)?",
    rf"what's (?:{_THAT}|going on|happening|wrong|all {_THAT})(?: .*)?",
    r"what (?:did|have|had) you .*",
    r"what (?:(?:the|on) (?:hell|heck|fuck|devil|deuce|earth)\b.*|do you mean.*"
    r"|(?:can|could|do|else can) you do(?: (?!with|for)\w+)?)",
    rf"how (?:are you|is it going|do you (?:do|know|work)|does {_THAT} work|did you)(?: .*)?",
    r"how's (?:it going|that)(?: .*)?",
    r"(?:did|didn't|have|haven't|had|are|aren't|were|weren't) (?:you|i|we)\b"
    r"(?! (?:able|going|got|seen|heard|any|ideas?|suggestions?|recommendations?)\b) .*",
    rf"(?:i|we) (?:really |just )?meant? {_THAT}(?: (?:as|in|for) .*| seriously| ironically)?",
    rf"(?:is|isn't|was|wasn't|are|aren't|were|weren't) {_THAT}\b"
    r"(?! (?:ok(?:ay)?|possible|fine|too late)\b)(?: .*)?",
    r"do you (?:(?:even |really )?(?:understand|listen|hear me|get it)|see the problem)(?: .*)?",
    rf"(?:i|we) (?:really )?{_NEGATED} (?:ask|want|say|said|order|mention|need|request|mean|tell"
    rf"|told|agree)(?:ed)?(?:(?: any of)? {_THAT}(?: (?:things?|stuff|either|at all|now|yet"
    r"|please))*"
    r"| (?:for|to|you)\b.*| (?:that )?(?:i|we) (?:want|need|like|eat|ask)\w*\b.*| so)?",
    r"nobody (?:asked|wants|wanted|ordered|needs)\b.*",
    rf"(?:{_THAT}(?:'s| is| are| was| were|'re)|you(?:'re| are| were)|i'm|i am)"
    rf"(?: (?:not|just|really|so|very|quite|totally|completely|a bit|all|simply|rather))*"
    rf" (?:{_BAD}|{_GOOD}){_REST}",
    rf"(?:{_THAT} (?:isn't|aren't|wasn't|weren't)|you aren't)(?: \w+)? (?:{_BAD}|{_GOOD}){_REST}",
    r"you (?:didn't|did not|don't|do not|never|are not|aren't) (?:understand|listen(?:ing)?"
    r"|hear|get it|answer|ask|know)(?: .*)?",
    r"(?:please )?(?:be )?(?:very |really )?careful"
    r"(?: (?:with|of|about) (?:the|my|our|your|that|it|them|this|these|those)"
    r"(?: (?!(?:and|then|but|so)\b)[\w'-]+){0,5})?",
    _GUESSES,
    r"you (?:got|have) (?:it|that|me|this) (?:all )?wrong",
    rf"{_THAT}(?:'s| is| was|'re| are| were) (?:not the right|the wrong) \w+",
    r"you (?:misunderstood|misheard|already (?:said|asked|told))(?: .*)?",
    r"(?:not|never) what (?:i|we) .*",
    rf"(?:this|that|it) (?:makes|made) no sense{_REST}",
    rf"(?:wrong|incorrect|not (?:right|really|exactly|quite|yet|now|sure|today|good|bad)){_REST}",
    rf"too (?:much|many|expensive){_REST}",
    r"(?:(?:that|this|it)(?:'s| is| was) )?my (?:bad|mistake|fault|error)",
    r"no+(?: (?:no|way|idea|problem|worries|need))*|nope|nah|stop(?: it| that)?"
    r"|(?:wait|hang on|hold on)(?: (?:for )?(?:just )?(?:a|one) \w+)?(?: please)?"
    r"|ugh|wtf|whatever|never ?mind(?: that| it)?|forget (?:it|that)|let me (?:think|see)(?: .*)?",
    rf"(?:many |big )?(?:thanks|thank you|cheers|thx){_REST}",
    rf"(?:good|great|fine|perfect|nice|lovely|wonderful|excellent|awesome|cool|super|brilliant"
    rf"|amazing|well done|well){_REST}",
    r"(?:hi|hello|hey|(?:good )?(?:morning|afternoon|evening)|good day|nice to meet you)"
    r"(?: (?:there|robot|again))?",
    r"have a (?:nice|good|great|lovely) \w+|you're welcome|who are you|what's your name",
    _LEAVE,
    r"i (?:don't|do not) (?:know|understand|get it|care|mind)(?: (?:yet|really|that))?",
    r"i (?:love|like|hate) (?:it|that|this)|sounds (?:good|great|fine|wrong|odd)|i see|got it",
    r"(?:stop|quit|no more|enough of?) (?:adding|guessing|doing|putting|moving|buying|that)\b.*",
    rf"{_THAT}(?:'s| is| are|'re) (?:way |far |much )?(?:over|above|more than|beyond)"
    r" (?:(?:the|my|our) (?:budget|limit)|\W?\d+.{0,20})",
    r"what (?:did|have) i (?:say|tell|ask|said|told|asked).*|what next|anything else|is that all",
    r"(?:i|we) (?:said|told you|already said) (?:that|so|no|stop)(?: (?:already|before))?",
)
_REMARK = re.compile(f"{_LEAD}(?:{'|'.join(_PATTERNS)})")
_CHANGES_MIND = re.compile(
    r"\bchang(?:ed?|ing) (?:my|our) minds?\b|\bon second thoughts?\b"
    r"|\b(?:not|forget|scrap|scratch|drop|never ?mind)\b[^.;!?]{1,60}\b(?:let's|instead)\b"
    r"|\blet's\b[^.;!?]{1,60}\binstead\b(?! of)"
)
_TAKES_LEAVE = re.compile(_LEAD + _LEAVE)
_ASKS_WHY = re.compile(_LEAD + _WHY)
_ASKS_FOR_GUESSES = re.compile(_LEAD + _GUESSES)
_FILLER = re.compile(r"(?:ok(?:ay)?|and|but|so|well|hm+|oops|sorry|please|now|then|actually)")
_CLAUSE = re.compile(
    r"[,.;:!?\n()\u2013\u2014]+|\s-\s|\s(?:but|and)\s(?=(?:i|you|that|this|it|why)\b)"
)


def is_remark(text: str) -> bool:
    """Whether nothing in `text` says what its speaker wants done.

    "Why did you add butter?", "I never asked for that" and "Great, thanks!" are remarks; "Why not
    add butter?", "No, oil" and "Something sweet?" are not. A plain "yes" is none: what it agrees to
    may be wanted.
    """
    clauses = _clauses(text)
    return bool(clauses) and all(map(_REMARK.fullmatch, clauses))


def asks_for_guesses(text: str) -> bool:
    """Whether a person asks what was done that nobody had asked for."""
    return any(map(_ASKS_FOR_GUESSES.fullmatch, _clauses(text)))


def asks_why(text: str) -> bool:
    """Whether a person asks for the reason of what was done."""
    return any(map(_ASKS_WHY.fullmatch, _clauses(text)))


def changes_mind(text: str) -> bool:
    """Whether a person says that they want something else than before."""
    return bool(_CHANGES_MIND.search(evened(text)))


def takes_leave(text: str) -> bool:
    """Whether a person says that they are done, in words that may not end the task."""
    return any(map(_TAKES_LEAVE.fullmatch, _clauses(text)))


def _clauses(text: str) -> list[str]:
    said = (part.strip() for part in _CLAUSE.split(evened(text)))
    return [part for part in said if part and not _FILLER.fullmatch(part)]
