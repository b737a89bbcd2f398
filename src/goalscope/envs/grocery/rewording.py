"""The same words said more plainly: what a person says in many ways, said in one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from goalscope.envs.grocery.amounts import GRAMS, MILLILITRES, PACKS, WORD
from goalscope.envs.grocery.correcting import corrected, instead
from goalscope.envs.grocery.limits import unlimited
from goalscope.envs.grocery.listing import UNIT, unlisted
from goalscope.envs.grocery.moods import Mood, clauses
from goalscope.envs.grocery.phrases import END, IN_PLACE, IT, NUMBER, SAME, SAME_ALL
from goalscope.envs.speech import evened

__all__ = ["ASKING", "CART", "Said", "heard", "plain", "unreasoned"]

CART = "(?:basket|cart|order|list)"

_SPOKEN_OF = (("(?:it|that|this)", SAME), ("(?:them|those|these|both)", SAME_ALL))
_TO = "(?:to |up to |down to )"
_ACT = "(?:i|we|take|put|leave|throw|find|run)"
_ALL = "(?:everything|all(?: the)?(?: items| things)?)"
_EXCEPT = "(?:but|except(?: for)?|apart from|other than)"
_ALONE = r"(?=\s*(?:[.,;!?]|$|out|back|off|away|again|please|from))"
_PACKS = rf"(?!(?:{'|'.join([*GRAMS, *MILLILITRES])}|dozen)\b)"
_THINGS = r"((?:(?!\b(?:add|remove|get|take|for|with|by|to)\b)[^.;!?]){1,80}?)"
_PLAIN = (
    r"(?!(?:of|is|are|than|at|to|in|on|with|over|under|up|by|for|about|around|least|most|only|just"
    r"|and|or|it|that|this|i|we|us|me|the|an?|some|any|more|another|please|then|also|out|add|buy"
    r"|get|need|want|like|take|order|remove|bring|have|make|exactly)\b)[^\W\d_][\w'-]*"
)
_BEGIN = r"(?:(?<=[.,;!?] )|(?<=\band )|^)"
_THING = r"((?:(?!\b(?:and|but|add|remove)\b)[^.,;!?]){1,60}?)"

_FIND = (
    r"(?:find|get|give|show|use|take|choose|pick|want|need|like|prefer|have|add|buy|make)"
    r"(?: (?:me|us|it|that|this))? "
)
_FOUND = (
    rf"\b(?<!\bis )(?<!\bare )(?<!\bbe )(?<!'s )(?<!\bwas )(?<!\bwere )(?<!\bgets )(?:{_FIND})?"
)
_SOME = r"(?:something|anything|one|some)(?: (?:a (?:bit|little)|much|even))? "
_OLD = r"(?!\d|[$\u20ac\u00a3])(?:(?:the|my|our|that|this|any) )?"

ASKING = re.compile(
    r"\b(?:(?:i|we|you|they|he|she|(?:my|our|the) \w+)"
    r"(?:(?:'ll| will| also| still| really| just| definitely)*"
    r" (?:need|want|take|require|fancy|crave|wish for)s?|(?:'d| would)(?: also| really| just)*"
    r" (?:like|love|prefer|need|want|take|require|fancy))(?: to (?:get|buy|have"
    r"|order|add|include|use))?|(?:i|we|you|he|she)(?:'d| would|'ll| will)(?: also| just)* have"
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
    rf" (?:nearly |almost )?(?:everything|anything|all (?:food|things)) {_EXCEPT}"
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
        (r",? whichever (?:one )?(?:is|are) (?:the )?cheape(?:st|r)\b", ""),
        (
            rf"\b(?:two|2) (?:{PACKS} of )?([a-z]+)[,:]? (?:one|1) ([a-z]+) and (?:one|1) ([a-z]+)"
            rf"{END}",
            r"1 \2 \1 and 1 \3 \1",
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
_ASKED_OF = re.compile(
    r"\b(?:contain(?:s|ing)?|there|ha(?:ve|s)|any|of) (?:any |some )?(?P<thing>[a-z][a-z -]{1,30}?)"
    r"(?: in (?:it|them|this|that|these|those|here|there))?\?\s+"
    r"[^.;!?]{0,40}\b(?:allergic|intolerant)\b(?! (?:to|of|against)\b)"
)
"""An allergy to what was asked about: "does it contain nuts? My son is allergic"."""
_HARMED_BY = re.compile(
    r"^(?:(?:please )?(?:be )?(?:very )?careful (?:with|of|about) )?(?:the |any )?"
    r"(?P<thing>[\w-]+(?: [\w-]+)?),? (?:because |since |as )?"
    r"(?P<who>(?:(?:my|our|his|her) (?:[\w-]+ )?[\w-]+|he|she|i|we) (?:is|are|am))(?: \w+)?"
    r" (?P<ill>allergic|intolerant)(?=[.!]*$)"
)
"""An allergy to what is named before: "careful with the nuts, my son is allergic"."""
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
_CHANGES = [
    (re.compile(pattern), plainer)
    for pattern, plainer in (
        (
            r"\b(?:swap|change|switch|turn|convert|make)"
            r" (?:everything|it all|them all|all of (?:it|them))(?: (?:for|to|into|with))?"
            r" ([\w-]+-free|vegan|vegetarian|organic|halal)"
            rf"(?: (?:things|items|versions?|ones|stuff|food))?{END}",
            r"everything must be \1",
        ),
        (
            rf"\b(?:swap|exchange|switch|trade|replace|substitute|change)(?: out)? {_THINGS}"
            rf" (?:for|with|by|to|against) (?=(?!{NUMBER}{END}){_THING}{END})",
            rf". remove \1. add {IN_PLACE} ",
        ),
        (rf"(?<=\bprefer ){_THING} to {_THING}{END}", r"\1 instead of \2"),
        (rf"(?:'d| would) rather have {_THING} than {_THING}{END}", r" want \1 instead of \2"),
        (
            r"\b(?:change|set|reduce|increase|lower|raise|cut|bring|take|update|bump)"
            r" (?:the )?(?:(?:quantity|number|amount) of (?:the )?)?"
            rf"(?:{NUMBER} )?{_THING} (?:from {NUMBER} )?{_TO}({NUMBER}){END}",
            r". add exactly \2 packs of \1",
        ),
        (rf"\bmake ({IT}) (?:a )?double{END}", r". double \1"),
        *(
            (
                rf"\b(?:{much})(?: (?:of|as (?:many|much)|(?:the )?(?:amount|number|quantity)"
                rf"|the|my|our))* (?!an? ){_THING}{END}",
                rf". add {change} \1",
            )
            for much, change in (
                (r"double(?! (?:cream|chocolate|espresso)\b)|twice", "twofold"),
                (
                    r"halve|half(?= (?:of (?:the|my|our|that|it|them)|the|my|our|that|as)\b)",
                    "halved",
                ),
            )
        ),
        *(
            change
            for it, same in _SPOKEN_OF
            for change in (
                (rf"\b(twofold|halved) {it}{END}", rf"\1 {same}"),
                (
                    rf"\b(?:make|change|set) {it} {_TO}?(?:just |only |exactly )?({NUMBER}){END}",
                    rf". add exactly \1 packs of {same}",
                ),
                (rf"\b(remove|delete|drop(?! \w+ off\b)|take) {it}{_ALONE}", rf"\1 {same}"),
                (rf"\bput {it}(?= back\b(?! (?:how|where|the way|as)\b))", f"put {same}"),
            )
        ),
        *(
            (
                rf"\b(?:{take}) (?!(?:of|and|half)\b|an? (?!{PACKS}))({NUMBER})(?: {PACKS})?"
                rf"(?: of (?:it|them|those))?{out}{END}",
                rf"remove \1 {SAME}",
            )
            for take, out in (
                ("remove|delete|drop|take (?:out|off|away)", ""),
                ("take|put|leave", " (?:out|off|away|back)"),
            )
        ),
        (
            rf"(?:\bmake {IT} )?(?<!\w)(?!(?:of|and|half)\b)({NUMBER}) {PACKS}(?: of {IT})?"
            rf"(?: in total| in all| altogether)?{END}",
            rf". add exactly \1 packs of {SAME}",
        ),
        (rf"\bmake {IT} organic{END}", ". add the organic one"),
        (
            rf"\bmake (?:the|my|our) {_THING} organic{END}",
            rf". remove \1. add {IN_PLACE} organic \1",
        ),
        (rf"\bmake {IT} (?=the [^.,;!?]{{1,40}} ones?\b)", ". add "),
        (rf"\b({NUMBER}) of each{END}", rf"exactly \1 packs of {SAME_ALL}"),
        (
            rf"(?:^(?:(?:ok|okay|yes|no|please|actually|then)[ ,]+)*|, )({NUMBER}) of"
            rf" (?:it|them|those){END}",
            rf". add exactly \1 packs of {SAME}",
        ),
        (rf"{_BEGIN}(?:less|fewer)(?: of (?:it|them|those))?{END}", rf". remove 1 {SAME}"),
        (
            rf"\b(?:only |just )?({NUMBER}) {_THING}"
            rf" (?:(?:is|are|will be|would be|'s) (?:enough|plenty)|(?:will|would|'ll) do){END}",
            r". add exactly \1 packs of \2",
        ),
        (
            rf"\b({NUMBER}) (?:is|are|will be|would be|'s) (?:enough|plenty){END}",
            rf". add exactly \1 packs of {SAME}",
        ),
        (
            rf"\bmake {IT} (?:just |only |exactly )?({NUMBER}) {_PACKS}",
            r". add exactly \1 packs of ",
        ),
        (
            rf"\bmake {IT} (?:just |only |exactly )?({NUMBER} ?{UNIT})"
            rf"(?: (?:instead of|rather than) {NUMBER}(?: ?{UNIT})?)?{END}",
            rf". add exactly \1 {SAME}",
        ),
        (
            rf"^(\d{{1,4}}(?:\.\d{{1,3}})? ?{UNIT})(?: please)?(?=[.!]*$)",
            rf". add exactly \1 {SAME}",
        ),
        (rf"\bmake {IT} (?:just |only |exactly )?(?={NUMBER} )", ". add exactly "),
        (
            rf"(?<!\w)({NUMBER}) {_THING} (?:instead of|rather than) (?:the )?{NUMBER}{END}",
            r"exactly \1 packs of \2",
        ),
        (
            rf"(?<!\w)({NUMBER}) {_THING}(?: please| in total)?,? not {NUMBER}{END}",
            r"exactly \1 packs of \2",
        ),
        (
            r"\b(?:(?:i|we) )?(?:don't|do not) (?:want|need)"
            rf" {NUMBER} {_THING},? (?:just|only) ({NUMBER}){END}",
            r"exactly \2 packs of \1",
        ),
        (r"\bi (?:said|meant) (?=exactly )", ""),
        *(
            (
                r"\b(?:i|we)(?: had|'d)? (?:wanted|asked for|said)(?: only| just)?"
                r"(?![^.;!?]*\b(?:got|yesterday|last|before|earlier|never mind)\b)"
                rf" (?!(?:an?|of|and|half)\b){how}",
                f". add exactly {amount}",
            )
            for how, amount in (
                (rf"({NUMBER}){END}", rf"\1 packs of {SAME}"),
                (rf"(?={NUMBER} (?!things?\b)\w)", ""),
            )
        ),
        (rf"\bmake the {_THING} ({NUMBER}){END}", r". add exactly \2 packs of \1"),
        (rf"{_BEGIN}(?:and |add |get |i'd like )*(?:another|an extra)(?: one)?{END}", "1 more"),
        (rf"\b({NUMBER}) more(?: of {IT})?{END}", rf"\1 more {SAME}"),
        (rf"\b(?:want|like|need) {_THING} (?:removed|taken out|gone){END}", r". remove \1"),
        (
            rf"{_BEGIN}(?:the )?{_THING} (?:is|are)(?: not|n't| no longer) (?:needed|wanted){END}",
            r"don't need \1",
        ),
        (
            rf"{_BEGIN}(?:please )?(?:(?:i|we)(?:'d| would)? (?:want|need|like) )?"
            rf"(?:an? (?:bit|little) )?(?:less|fewer) (?:of )?(?:the )?{_THING}{END}",
            r". remove 1 \1",
        ),
        (
            rf"{_BEGIN}(?:(?:that|it|this)(?:'s| is) |they(?:'re| are) )?(?:way |much |a bit )?"
            r"too (?:expensive|dear|pricey|costly|much), (?=\w)"
            r"|(?<=\w), (?:(?:that|it)'s )?(?:way )?too (?:expensive|dear|costly)(?=[.!]*$)",
            "",
        ),
        (
            r"^(?:(?:no|actually|sorry|wait|oops)[ ,.!]+)+(?!(?:an?|of|and|half)\b)"
            rf"({NUMBER})(?= please|[.!]*$)",
            rf". add exactly \1 packs of {SAME}",
        ),
        (
            r"\b(remove|delete|drop|take(?: out)?) the (?:very )?last (?:thing|item|one|product)"
            rf"(?: (?:i|you)(?: just)? (?:added|asked for|named))?{END}",
            rf"\1 {SAME}",
        ),
        (
            rf"^\W*(?:(?:no|please|actually|sorry|ok|okay) )*(?:only|just) ({NUMBER}){END}",
            rf". add exactly \1 packs of {SAME}",
        ),
        (
            rf"^\W*(?:(?:make {IT}|just|only) )*({NUMBER}) dozens?{END}",
            rf". add exactly \1 dozen {SAME}",
        ),
        (
            r"\b((?:remove|delete|drop|take out|get rid of) (?:(?:the|all|those|these|that) )*+"
            r"(?!(?:things?|stuff|items?|products|everything|anything|whatever|what|all|rest|extras?)\b)"
            r"[^.;!?,]{1,60}?) (?:that |which )?(?:i|we|nobody|no one)(?: have)?"
            r" (?:didn't|did not|never|don't|haven't|ever)"
            rf" (?:ask(?:ed)?(?: you)?(?: for)?|order(?:ed)?|want(?:ed)?|need(?:ed)?){END}",
            r"\1",
        ),
        (rf"\b(?:only|just) (need|want|get|have|take|add) (?={NUMBER} )", r"\1 exactly "),
        (rf"\b({NUMBER}) (?:fewer|less) (?=\w)", r". remove \1 "),
        (rf"(?<!\w)({NUMBER}) {_THING} (?:less|fewer){END}", r". remove \1 \2"),
        (
            rf"(?:(?<=[.,;!?] )|^)(?!.{{0,40}}\b{_ACT}\b)(?:the )?{_THING}"
            rf" (?:out|(?:can|should|must) go|(?:can|must|should) be removed){END}",
            r". remove \1",
        ),
        (
            rf"\b(?:remove|delete|drop|forget|clear|empty|take out|get rid of) {_ALL}(?: else)?"
            rf" {_EXCEPT} ",
            ". keep only ",
        ),
        (rf"\b(?:take )?{_ALL}(?: else)? out {_EXCEPT} ", ". keep only "),
        (
            rf"\b(?:i|we|they|he|she) (?:like|love|want)s? (?:{_ALL}|it all) {_EXCEPT}"
            rf" the {_THING}{END}",
            ". ",
        ),
        (
            rf"^\W*(?:(?:yes|ok|okay|sure|please|fine)[ ,.!]+)*{_ALL}(?: of (?:it|them))? {_EXCEPT}"
            rf" (?:the )?{_THING}{END}",
            r". remove \1",
        ),
        (
            r"^\W*(?:(?:please|ok|okay|so|no|now|actually|and|then|let's"
            r"|(?:can|could) (?:you|we)) )*(?:only|just) keep ",
            ". keep only ",
        ),
        (
            rf"{_BEGIN}(?:(?:please|ok|okay|no|actually|just|now|then|so|let's|sorry|can|could|you"
            r"|i|we|want|i'd|like|to|know|what) )*+(?:cancel|scrap|scratch|abandon|never mind"
            r"|forget(?: about)?) (?:(?:(?:the|my|our|this|that) )?(?:whole |entire )?(?:thing"
            r"|order|basket|cart|shopping|purchase|list)|everything|it all|all of it|the lot)"
            rf"{END}",
            ". empty the basket",
        ),
        *(
            (rf"{_FOUND}{cheaper}{END}", f". add lowpriced {thing}")
            for cheaper, thing in (
                (rf"{_SOME}cheaper (?:than|for|instead of|in place of) {_OLD}{_THING}", r"\1"),
                (rf"(?:{_SOME}cheaper|(?:the |an? )?cheaper ones?|{_FIND}cheaper)", SAME),
                (
                    r"(?:(?:just|only) )?(?:an? |some |the )?(?:cheaper|cheapest) (?!than\b|one)"
                    r"(?:(?:version|kind|brand|alternative"
                    rf"|option|substitute|replacement) (?:of|to|for) )?{_OLD}{_THING}",
                    r"\1",
                ),
            )
        ),
        (r"\bchanged (?:my|our) minds? about\b", "remove"),
        (
            r"\b(?:put|toss|throw|stick|chuck|pop|place|drop) ([^.;!?]{1,200}?)"
            rf" (?:(?:in|into|to|on) (?:the|my|our|this) {CART}|in there)\b",
            r"add \1",
        ),
        (
            r"\b(?:put|toss|throw|stick|chuck|pop) (?!(?:it|that|this|them|those|these|in|back)\b)"
            r"([^.,;!?]{1,60}?) in(?=\s*(?:[.,;!?]|$| (?:and|please|too|then|as well|for me)\b))",
            r"add \1",
        ),
        (
            r"\b(?:want|like|have|get|bring|add|need) "
            r"(?!(?:it|that|this|them|those|these|to|you|me|us|my money|your)\b)"
            rf"([^.,;!?]{{1,60}}?) back(?: in(?:to)?(?: (?:the|my) {CART})?)?{END}",
            r"add \1",
        ),
        (r"\b(?:undo|revert|reverse) (?=(?:all )?(?:your|the|what(?:ever)? you) guess)", "remove "),
        (r"\b(?:add|bring|get) back (?=(?:the|my|our|some)\b)", "add "),
        (rf"\b(?:add|get) (?:it|that|this) (?:back|again){END}", f"add {SAME}"),
        (rf"\bout of (?:the|my|our|this) {CART}\b", "out"),
        (rf" (?:from|off) (?:the|my|our|this) {CART}\b", ""),
        (
            rf"{_BEGIN}([a-z][\w' -]{{0,60}}?) ?[x\u00d7(] ?(\d{{1,4}})\)?{END}",
            r"\2 \1",
        ),
        (
            rf"(?<![\w'-])({_PLAIN}(?: {_PLAIN}){{0,2}}),? ?\(?"
            rf"(\d{{1,4}}(?:\.\d{{1,3}})?) ?({UNIT})\)?{END}",
            r"\2 \3 \1",
        ),
        (r"\badd exactly 0 packs of ", "remove "),
    )
]
"""Patterns of changes to the basket, and the additions and removals that they come to."""


@dataclass(frozen=True, slots=True)
class Said:
    """A clause, reworded to one or more plain sentences, and what it does."""

    text: str
    mood: Mood


@lru_cache(maxsize=512)
def heard(utterance: str) -> tuple[Said, ...]:
    """The clauses of `utterance` in lower case, reworded; changes only where they are ordered."""
    text = re.sub(r"\s*\n\s*", ". ", _BULLET.sub(", ", utterance[:2000]).strip())
    text = instead(unreasoned(unlisted(evened(text))))
    text = unlimited(_ALONE_WANTED.sub(r". keep only \1. only \1\2", text))
    text = re.sub(
        r"\b((?:remove|delete|drop|take out)\b[^.;!?,]*?) first(?=[.;!?,]|$)", r"\1", text
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
    text = _HARMED_BY.sub(r"\g<who> \g<ill> to \g<thing>", text)
    text = _ASKED_OF.sub(r"\g<0> to \g<thing>", text)
    text = _MINDING.sub(lambda match: f"{match[1]} {_VERBS[match[2]]}", corrected(text))
    found: list[Said] = []
    for clause, mood in clauses(text):
        for pattern, plainer in (*(_CHANGES if mood is Mood.ORDER else ()), *_REWORDED):
            clause = pattern.sub(plainer, clause)
        found.append(Said(clause, mood))
    return tuple(found)


def unreasoned(text: str) -> str:
    """`text`, evened, without what says why it is so much: "we are 12, so 12 juices"."""
    return _REASON.sub("", text)


def plain(utterance: str) -> str:
    """`utterance` in lower case and on one line, reworded."""
    return " ".join(said.text for said in heard(utterance))
