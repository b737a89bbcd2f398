"""The same words said more plainly: what a person says in many ways, said in one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from goalscope.envs.grocery.amounts import PACKS, WORD
from goalscope.envs.grocery.hearing.altering import CHANGES
from goalscope.envs.grocery.hearing.correcting import corrected, instead
from goalscope.envs.grocery.hearing.limits import unlimited
from goalscope.envs.grocery.hearing.listing import unlisted
from goalscope.envs.grocery.hearing.moods import Mood, clauses
from goalscope.envs.grocery.hearing.phrases import END, EXCEPT, NUMBER
from goalscope.envs.speech import evened

__all__ = ["ASKING", "Said", "heard", "plain", "unreasoned"]


ASKING = re.compile(
    r"\b(?:(?:i|we|you|they|he|she|(?:my|our|the) \w+)"
    r"(?:(?:'ll| will| do| also| still| really| just| only| definitely)*"
    r" (?:need|want|take|require|fancy|crave|wish for)s?"
    r"|(?:'d| would)(?: also| really| just| rather)*"
    r" (?:like|love|prefer|need|want|take|require|fancy))(?: to (?:get|buy|have"
    r"|order|add|include|use))?"
    r"|(?:i|we|you|he|she)(?:'d| would|'ll| will)(?: also| just| rather| better)* have"
    r"|looking for|(?:i'm|we're) after|could (?:do with|use)|in the mood for"
    r"|(?:can|could|may|might) (?:i|we|you)(?: also| please| just)*"
    r" (?:(?:get|find|order|buy)(?: me| us)?|have|add|include|put in|throw in|do|give (?:me|us))"
    r"|add(?: in)?|get(?: me| us)?|buy(?: me| us)?|grab(?: me| us)?|pick up|throw in|put in|include"
    r"|give (?:me|us)|bring(?: me| us)?|(?<!my )(?<!the )(?<!our )order|need|how about"
    r"|what about|go for"
    r"|let's (?:have|get|add|do|take|go with)|let (?:me|us) (?:get|have|add)"
    r"|there should be"
    r"|make sure (?:there is|there are|(?:we|i) have|to (?:get|add))|use)\b"
    r"(?: (?:is|are)\b)?(?! to (?!get|buy|have|order|add))"
)
_EATS_ALL_BUT = (
    r"\b(i|we|you|they|he|she|my \w+) (?:can |will |do )?(?:eat|like|love|enjoy)s?"
    rf" (?:nearly |almost )?(?:everything|anything|all (?:food|things)) {EXCEPT}"
)
_EATEN = (
    r"(?!(?:the|my|our|that|this|these|those|please|no|i|i'm|i'd|we|he|she|they|it|for|so|get|add"
    r"|can|could|because|since|as)\b)[\w'-]+"
    r"(?: (?!(?:and|or|so|because|since|as|please|but|is|are)\b)[\w'-]+)?"
)
_REWORDED = [
    (re.compile(pattern), plainer)
    for pattern, plainer in (
        (r"\ballerg(?:y|ies|ens?)\s?:", "allergic to"),
        (r"(?<=\d),(?=\d{3}\b)", ""),
        (
            r"\b(?:be )?(?:very |really )?careful (?:with|of|about)"
            r" (?!(?:the|my|our|that|it|them|this|these|those)\b)",
            "avoid ",
        ),
        (r"\b(?:be )?(?:very |really )?careful (?:with|of|about) [^.,;!?]{1,60}", ""),
        *(
            (rf"{_EATS_ALL_BUT} ({what}){end}", r"\1 can't eat \2. ")
            for what, end in (
                (
                    rf"{_EATEN}(?:, {_EATEN})*(?:,? (?:and|or) {_EATEN})?",
                    r"(?=\s*(?:[.!;]|$)|,? (?:so|because|since|as|but)\b"
                    r"|,? and (?:i|we|he|she|please|get|add|can|could|buy|some)\b"
                    r"|, (?:i|we|get|add|buy|can|could|please|thanks|swap|make)\b)",
                ),
                (rf"{_EATEN}(?: (?:and|or) {_EATEN})?", r", (?=[^.;!]*\bplease\b)"),
            )
        ),
        (r"\b(?:there(?:'s| is) )?no need (?:for|of) (?=\w)", "don't need "),
        (r", (?:nobody|no ?one) (?:asked for|needs?|wants?) (?:it|that|those|them)(?=[.;!]|$)", ""),
        (r",? ?\bif (?:you have|there(?:'s| is| are)) (?:any|some|it|them|one)\b,?", ""),
        (
            r"\b(?:\w+n't|not|never)(?: let (?:me|us))?(?: ever)? (?:forget|miss|skip|omit|drop"
            r"|leave out)\b(?! to (?!add|get|buy|include))(?: (?:about|to (?:add|get|buy|include))"
            r"\b)?",
            "add",
        ),
        (
            r"\b(?:\w+n't|not|never) (?:remove|delete|take out|get rid of|throw (?:out|away))\b",
            "keep",
        ),
        (r"\bi (?:almost |nearly )?forgot\b(?: (?:about|to (?:add|get|buy|mention))\b)?", "add"),
        (
            r"[$\u20ac\u00a3]?\b\d{1,6}(?:\.\d\d)?(?: ?(?:dollars?|bucks|euros?))?"
            r"(?: worth of|(?<=[a-z]) of) ",
            "some ",
        ),
        (
            r"\ban? (?:(?:small )?(?:handful|bit|pinch|touch|splash|knob|dash) of|little) (?!of\b)",
            "some ",
        ),
        (r"\b(?:avoids|stays (?:away from|off)) (?!(?:it|that|them|those|these)\b)", "can't eat "),
        (
            r"(?:^|(?<=[.,;!?] )|(?<=\band )|(?<=\bbecause )|(?<=\bsince )|(?<=\bbut ))"
            r"(?P<who>i|we|he|she|they|(?:my|our) (?!dog|cat|pet|puppy|kitten)[a-z]+)"
            r"(?:'s|'re|'m| is| are| am) off (?:all )?(?P<what>dairy|gluten|wheat|lactose|meat|nuts"
            r"|sugar|eggs|fish|pork|soya?|seafood|shellfish|alcohol)"
            r"(?=[.,;!?]|$| (?:too|now|as well|completely|entirely|and|so|because)\b)",
            r"\g<who> can't eat \g<what>",
        ),
        (
            r"^\W*(?:(?:ok|okay|so|right|well|yes|hi|hello|please|first|now)[ ,]+)*"
            r"(?:let's |(?:i|we)(?:'ll| will|'d like to| want to) )?(?:start|begin)(?: off)? with"
            r" (?=(?:an?|some|two|three|\d+|milk|eggs|bread)\b)",
            "add ",
        ),
        (
            r"(?:^|(?<=[.;!?,] ))(?!(?:i|we|you|he|she|they)\b)[a-z]+"
            r" (?:can't|cannot|doesn't|won't|mustn't) (?:have|eat|like|drink|stand)"
            r" (?:it|them|that|those|these)(?=[.,;!?]|$)",
            "",
        ),
        (r",? whichever (?:one )?(?:is|are) (?:the )?cheape(?:st|r)\b", ""),
        (
            rf"\b(?:two|2) (?:{PACKS} of )?((?:frozen |fresh )?)([a-z]+)[,:]? (?:one|1) ([a-z]+)"
            rf"(?:,|,? and)? (?:one|1) ([a-z]+){END}",
            r"1 \1\3 \2 and 1 \1\4 \2",
        ),
        (r"\b(?:i|we)(?:'m| am|'re| are)(?: still)? missing\b(?! something)", ". need"),
        (r"\b(?:an? )?half(?: an?)? dozen\b", "6"),
        (rf"\b({WORD}) and a half\b", r"\1 half"),
        (r"\b(\d+) (?:and a half|1/2)\b", r"\1.5"),
        (
            r"\b(?:nobody|no ?one|none of us)(?: here)? (?:is|are) (allergic|intolerant)"
            r" ((?:to|of|against) [^.;!?,]{1,40}?),? (?:but|except|apart from|other than)(?: for)?"
            r" (?!(?:the|we|i|it|that|this)\b)(?=[^.;!?,]{1,30}(?:[.;!?,]|$))",
            r"someone is \1 \2, ",
        ),
        (r"\b(?:nobody|no one|none)\b[^.;!?,]{0,40} allergic\b[^.;!?]*", ""),
        (r"\b(?:don't|do not|doesn't|does not) (?:need|want)(?: any)? more [^.;!?,]+", ""),
        (
            r"\b(?:(?:i|we)(?: do not| don't|(?:'ve| have) not) (?:have|got)|haven't got"
            r"|(?:do not|don't|does not|doesn't) have (?:any|enough))\b"
            r"(?! (?:any )?(?:dairy|gluten|lactose|meat|alcohol)\b)",
            ". need",
        ),
        (
            r"\b(?:i|we|i've|we've)(?: have)?(?: got)? (?:no|hardly any)"
            r"(?= (?!longer\b|.{0,20}allerg))",
            ". need",
        ),
        (
            r"\bthere(?:'s| is| are) no(?= [^.;!?,]{1,40} (?:at home|in the))"
            r"|\b(?:(?:there(?:'s| is| are)|has|have) )?no(?= [^.;!?,]{1,40} left\b)",
            ". need",
        ),
        (
            r"\b(?:(?:i|we)(?:'m|'re| am| are)|ran|run|running)"
            r"(?: (?:all|just|nearly|almost|completely))? (?:out of|low on|short (?:of|on))\b"
            r"|\b(?:i|we) lack\b",
            ". need",
        ),
        (
            r"(?<!can )(?<!could )(?<!may )(?<!might )(?<!do )(?<!sure )"
            r"\b(?:i|we)(?:'ve| have| already have| still have)\b(?! to\b)(?: got\b)?",
            ". there is",
        ),
        (
            r", so |,? (?:so|but|and|also) (?=(?:no|without|don't|nothing|i|we|let's|i'm|we're)\b)"
            r"|, (?=(?:i|we|i'm|we're|i'd|i'll|we'd|we'll|can you|could you|please|that's"
            r"|that is|that will|that'll)\b)"
            r"|, (?=(?:because |since |as )?(?:nobody|no ?one|(?:none|one|some|both) of us|he|she"
            r"|everyone|everybody|(?:my|our|his|her) (?:[\w-]+ ){0,2}[\w-]+?)"
            r"(?:'s|'re| is| are| has| have| can't| cannot| doesn't| don't| won't| isn't| aren't)"
            r"(?![\w'])(?! (?:\w+ )?(?:allergic|intolerant)\b(?! (?:to|of|against)\b)))"
            r"|, (?=(?:it|they) (?:ha(?:s|ve) to|must|needs? to) be\b)",
            ". ",
        ),
    )
]
"""Patterns, and the plainer words that stand for what they match: lacking a thing is needing it."""

_REASON = re.compile(
    r"(?:^|(?<=[,.;!?] ))(?:since |because |as )?(?:we|they|there|i|you)(?:'re| are|'ll be"
    r"| will be| have)"
    rf" (?:about )?(?!an? ){NUMBER}(?: of (?:us|them)| (?:\w+ )?(?:people|persons|guests|kids"
    rf"|children|adults|friends))?(?:,? so|,)(?: (?:we|i)(?:'d)? (?:need|want|like))? (?!(?:an?"
    rf"|of|and|half)\b)(?={NUMBER} \w)"
)
_ALONE_WANTED = re.compile(
    r"(?:^|(?<=[.,;!?] ))(?:(?:ok|okay|no|so|actually|please|well|i|we|want|need|keep|get) )*+"
    r"(?:only|just) (?:(?:keep|want|need|get|have|leave) )?([^.;!?]{1,100}?)"
    rf"(, ?{NUMBER} of (?:it|them|those))?(?:\s*[,.;!])? (?:and |but )?nothing else\b(?! but)"
)
_THEM = r"(?:it|them|that|those|these|this|(?:all|both)(?: of)?(?: (?:it|them|that|those|these))?)"
_AND_GUESSES = re.compile(
    r"\b((?:remove|take out|delete|drop|get rid of) (?!everything\b)[^.;!?]{1,80}?),? and"
    r" (?:everything|all|whatever|the (?:things|stuff|rest))(?: (?:that|else))?"
    r" you(?:'ve| have)?(?: just)? guessed(?: just now| in this round| last)?(?=[.;!?]|$)"
)
"""Behind what is to be taken out: that the guesses are, too."""
_REDUNDANT = re.compile(
    r"((?:i|we|he|she|they|(?:my|our|the) \w+)(?: (?:really|actually))?"
    r" (?:don't|do not|doesn't|does not|didn't|did not|never|no longer)(?: (?:really|even|ever))?"
    r" (?:want(?:ed)?|need(?:ed)?|ask(?:ed)? for|order(?:ed)?|like|eat|drink)"
    rf" (?!{_THEM}[,.;!])[^.;!?]{{1,80}}?)[,.;!]+"
    r" (?:(?:so|and|then|please|just|(?:can|could) you) )*"
    rf"(?:(?:put|take|throw) {_THEM}(?: all)? (?:back|out|away|off)"
    rf"|(?:remove|delete|drop|get rid of) {_THEM})(?: again)?(?:,? please)?(?=[.;!?]|$)"
)
"""What is not wanted, and behind it that it is to go: "I don't need the eggs, take them out"."""
_ASKED_OF = re.compile(
    r"\b(?:contain(?:s|ing)?|there|ha(?:ve|s)|any|of) (?:any |some )?(?P<thing>[a-z][a-z -]{1,30}?)"
    r"(?: in (?:it|them|this|that|these|those|here|there))?\?\s+"
    r"[^.;!?]{0,40}\b(?:allergic|intolerant)\b(?! (?:to|of|against)\b)"
)
"""An allergy to what was asked about: "does it contain nuts? My son is allergic"."""
_HARMED_BY = re.compile(
    r"^(?:(?:please )?(?:be )?(?:very )?careful (?:with|of|about) )?(?:the |any )?"
    r"(?P<thing>[\w-]+(?: [\w-]+)?)"
    r"(?P<who>,? (?:because |since |as )?(?:(?:my|our|his|her) (?:[\w-]+ )?[\w-]+?|he|she|i|we)"
    r"(?:'s|'m|'re| is| are| am)|, (?!(?:nobody|none|who|it|that|all|every\w+)\b)[a-z]+(?:'s| is))"
    r"(?: \w+)? (?P<ill>allergic|intolerant)(?=[.!]*$)"
)
"""An allergy to what is named before: "careful with the nuts, my son is allergic"."""
_PAUSE = re.compile(
    r"^(?:(?:hold|hang) on|one (?:second|sec|moment)|u[hm]+|hm+|ah+)[ ,.!]+(?=\w)"
    r"|^(?:(?:no|wait|but|oh|please)[ ,.!]+)*first,?"
    r" (?=(?:swap|exchange|replace|take|remove|add)\b)",
    re.IGNORECASE,
)
"""What somebody says before what they think of late."""
_AT_LAST = re.compile(r"(?<=\w),? (?:then|though)(?=[ .!]*$)", re.IGNORECASE)
_BULLET = re.compile(r"\n[ \t]*[-*\u2022][ \t]+")
_VERBS = {
    "adding": "add",
    "changing": "change",
    "removing": "remove",
    "replacing": "replace",
    "swapping": "swap",
    "taking": "take",
}
_MINDING = re.compile(rf"\b(mind|about) ({'|'.join(_VERBS)})\b")


@dataclass(frozen=True, slots=True)
class Said:
    """A clause, reworded to one or more plain sentences, and what it does."""

    text: str
    mood: Mood


@lru_cache(maxsize=512)
def heard(utterance: str) -> tuple[Said, ...]:
    """The clauses of `utterance` in lower case, reworded; changes only where they are ordered."""
    text = re.sub(r"\s*\n\s*", ". ", _BULLET.sub(", ", utterance[:2000]).strip())
    text = _AT_LAST.sub("", _PAUSE.sub("", text))
    text = _REDUNDANT.sub(r"\1", instead(unreasoned(unlisted(evened(text)))))
    text = _AND_GUESSES.sub(r"\1. remove everything you guessed", text)
    text = unlimited(_ALONE_WANTED.sub(r". keep only \1. only \1\2", text))
    text = re.sub(
        r"\b((?:remove|delete|drop|take out|add|get|buy)(?! the first)\b[^.;!?,]*?) first"
        r"(?=[.;!?,]|$)",
        r"\1",
        text,
    )
    text = re.sub(r"\b(remove|delete|drop|take out|add|get|buy):[\s,]*", r"\1 ", text)
    text = re.sub(r"([^\w\s'])(?:\s*\1)+", r"\1", text)
    text = text.replace(" go ahead and ", " ")
    text = re.sub(r"\b(to|it|that) zero(?=[.,;!?]|$)", r"\1 0", text)
    text = re.sub(
        r"(?:^|(?<=[.;!?,]))(?! ?(?:it|that|this)\b)([^.;!?,]+?) (?:(?:is|are) (?:a must|essential"
        r"|needed)|would be (?:nice|great|lovely|good|perfect)(?=,))",
        r". need \1.",
        text,
    )
    text = re.sub(
        rf"(?:^|(?<=[.;!?] ))((?:an?|some|{NUMBER}) {PACKS} of [^.;!?,]{{1,40}}?) would be"
        r" (?:nice|great|lovely|good|perfect)(?: too| as well| please)*(?=[.;!?,]|$)",
        r". need \1.",
        text,
    )
    text = _HARMED_BY.sub(_harmed, text)
    text = _ASKED_OF.sub(r"\g<0> to \g<thing>", text)
    text = _MINDING.sub(lambda match: f"{match[1]} {_VERBS[match[2]]}", corrected(text))
    found: list[Said] = []
    for clause, mood in clauses(text):
        for pattern, plainer in (*(CHANGES if mood is Mood.ORDER else ()), *_REWORDED):
            clause = pattern.sub(plainer, clause)
        found.append(Said(clause, mood))
    return tuple(found)


def _harmed(found: re.Match[str]) -> str:
    who = re.sub(r"^,? (?:(?:because|since|as) )?", "", found["who"])
    return f"{who} {found['ill']} to {found['thing']}"


def unreasoned(text: str) -> str:
    """`text`, evened, without what says why it is so much: "we are 12, so 12 juices"."""
    return _REASON.sub("", text)


def plain(utterance: str) -> str:
    """`utterance` in lower case and on one line, reworded."""
    return " ".join(said.text for said in heard(utterance))
