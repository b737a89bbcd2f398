"""Changes to the basket, said more plainly: how many, what goes, what takes its place."""

from __future__ import annotations

import re

from goalscope.envs.grocery.amounts import GRAMS, MILLILITRES, PACKS
from goalscope.envs.grocery.hearing.listing import UNIT
from goalscope.envs.grocery.hearing.phrases import (
    CART,
    END,
    EXCEPT,
    IN_PLACE,
    IT,
    NUMBER,
    SAME,
    SAME_ALL,
    SAME_TWO,
)

__all__ = ["CHANGES"]

_SPOKEN_OF = (
    ("(?:it|that|this)", SAME),
    ("(?:them|those|these)", SAME_ALL),
    ("both(?: of (?:them|those|these))?", SAME_TWO),
)
_TO = "(?:to |up to |down to )"
_ACT = "(?:i|we|take|put|leave|throw|find|run)"
_ALL = "(?:everything|all(?: the)?(?: items| things)?)"
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
_DO = "(?:enough|plenty|fine|ok|okay|good|great|perfect)"
CHANGES = [
    (re.compile(pattern), plainer)
    for pattern, plainer in (
        (
            r"^((?:(?:please|ok|okay|no|actually|and|so|oh|sorry|can you|could you)[ ,]+)*"
            r"(?:take|remove|delete|drop|leave out|put back)\b[^.,;!?]{1,60}?)"
            r"(?:,? (?:because|since|as)|,)"
            r" (?:(?:i|we)(?:'ve| have)?(?: still| already)* (?:have|got)"
            r"|(?:my|our) \w+(?: has| have)?(?: already| just)* (?:bought|brought))"
            rf" (?:some|enough|plenty|lots|one|it|{NUMBER}(?: (?:{PACKS}|loaf|loaves))?)"
            rf"(?: (?:left|already|at home|here))*{END}",
            r"\1",
        ),
        (
            r"\b(ask(?:ed)? for|order(?:ed)?|want(?:ed)?|need(?:ed)?)"
            r" all (?:that|this|those|these) (?=\w)",
            r"\1 the ",
        ),
        (
            r"\b(?:i|we) (?:only|just) (?:want(?:ed)?|need(?:ed)?|asked for) ([^.;!?]{1,100}?)"
            r"[,.;]* (?:and |so )?(?:(?:put|take|throw) )?(?:all )?"
            r"(?:the (?:rest|others?)|everything else)"
            rf" (?:can go|goes|must go|should go|away|out|back)(?: back| out| away)?{END}",
            r". keep only \1",
        ),
        (
            rf"^(?:(?:no|sorry|oops|please)[ ,]+)*not {NUMBER},? (?:but )?({NUMBER})"
            r"(?= please|[.!]*$)",
            rf". add exactly \1 units of {SAME}",
        ),
        (
            rf"^(?:(?:ok|okay|no|please|actually)[ ,]+)*({NUMBER} ?{UNIT}) of {IT}"
            r"(?= please|[.!]*$)",
            rf". add exactly \1 {SAME}",
        ),
        (rf"\bget ((?:the|my|those|these|that) {_THING}) out{END}", r"take \1 out"),
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
            r". add exactly \2 units of \1",
        ),
        (
            r"^(?:(?:and|ok|okay|please|no|actually|then)[ ,]+)*(?:the |my )?"
            rf"(?!{NUMBER}\b|{IT}\b|(?:i|we|you|not|from|do|want|need|like|go|add|get|buy|have)\b)"
            rf"([\w'-]+(?: [\w'-]+)?) {_TO}({NUMBER})(?:,? please)?[.!]*$",
            r". add exactly \2 units of \1",
        ),
        (
            rf"(?:{_BEGIN}|(?<=\bplease )|(?<=\bthen )|(?<=\bjust )|(?<=\bnow )|(?<=\bcan you )"
            r"|(?<=\bcould you ))(?:buy|order|get|take)"
            rf" (?:it|that|this|everything|the lot|the basket|my order)(?: all| now)?,?"
            rf" (?:but )?(?:without|minus) (?:the|my|our) {_THING}{END}",
            r". remove \1",
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
                    rf". add exactly \1 units of {same}",
                ),
                (rf"\b(remove|delete|drop(?! \w+ off\b)|take) {it}{_ALONE}", rf"\1 {same}"),
                (
                    rf"(?:{_BEGIN}|(?<=\bcan )|(?<=\bplease )|(?<=\bjust ))leave {it} out"
                    rf"(?: of (?:the|my|our|this) {CART})?\b(?! for\b)",
                    f"remove {same}",
                ),
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
        (
            rf"{_BEGIN}(?:the |my )?({_PLAIN}(?: {_PLAIN}){{0,2}}),? (?:i|we)"
            r" (?:(?:already|still) )?(?:have|'ve got)(?: already| at home| enough| plenty)*"
            rf"{END}",
            r"there is \1 at home",
        ),
        (
            rf"\bmake (?:the|my|our) {_THING} half an? ({UNIT}|dozens?){END}",
            r". add exactly 0.5 \2 of \1",
        ),
        (
            rf"\bmake (?:the|my|our) {_THING} ({NUMBER} ?(?:{UNIT}|dozens?)){END}",
            r". add exactly \2 of \1",
        ),
        (
            rf"{_BEGIN}(?!.{{0,40}}\b{_ACT}\b){_THING},? the cheapest(?: ones?| you have)?{END}",
            r"the cheapest \1",
        ),
        (
            rf"(?<!\w)(?!(?:an?|of|and|half)\b){NUMBER} {_THING},? (?:no|sorry|i mean),?"
            rf" (?:make (?:it|that) )?((?!(?:an?|of|and|half)\b){NUMBER}){END}",
            r"\2 \1",
        ),
        (
            rf"\b(?:make|change|turn) one of (?:the|my|our) {_THING}s? (?:in)?(?:to )?"
            rf"((?:an? )?(?:{_PLAIN} ){{1,2}}?)instead{END}",
            r". remove 1 \1. add 1 \2",
        ),
        (
            rf"{_BEGIN}one of (?:the|my|our) {_THING}s? should be (?:an? )?{_THING}{END}",
            r". remove 1 \1. add 1 \2",
        ),
        (
            rf"\b(?:make|change|turn) one of (?:them|those|these) (?:in)?(?:to )?(?:an? )?{_THING}"
            rf"(?: instead)?{END}",
            rf". remove 1 {SAME}. add 1 \1",
        ),
        (rf"\bmake {IT} organic{END}", ". add the organic one"),
        (
            rf"\bmake (?:the|my|our) {_THING} organic{END}",
            rf". remove \1. add {IN_PLACE} organic \1",
        ),
        (rf"\bmake {IT} (?=the [^.,;!?]{{1,40}} ones?\b)", ". add "),
        (rf"\b({NUMBER})(?: {PACKS})? of each(?: one)?{END}", rf"exactly \1 packs of {SAME_ALL}"),
        (
            rf", ({NUMBER})(?: {PACKS})? each(?: please)?{END}",
            rf". add exactly \1 packs of {SAME_ALL}",
        ),
        (
            rf"(?:^(?:(?:ok|okay|yes|no|please|actually|then)[ ,]+)*|, )({NUMBER}) of"
            rf" (?:it|them|those){END}",
            rf". add exactly \1 units of {SAME}",
        ),
        (rf"{_BEGIN}(?:(?:and|add|get) )?a (?:second|third) (?=\w+{END})", "1 more "),
        (
            rf"\b(?:add|get) (?:them|those|these|both)(?: both)? (?:back|again){END}",
            f"add {SAME_ALL}",
        ),
        (
            rf"{_BEGIN}(?:but )?(?:the|my) ([\w'-]+(?: [\w'-]+)?) (?:should|must|has to|have to)"
            rf" be (?!(?:an?|the|no|not|there|here|in|on|at|for|enough|very|too|{NUMBER})\b)"
            rf"([a-z'-]+(?: [a-z'-]+)?){END}",
            rf". remove \1. add {IN_PLACE} \2 \1",
        ),
        (
            rf"{_BEGIN}(?:(?:that's|that is|it's|those are|they're) )?(?:way |far )?too"
            r" (?:many|much),? (?:(?:just|only|and|so|i|we|need|want|make it|take|get) )*"
            rf"({NUMBER})(?: please)?{END}",
            rf". add exactly \1 units of {SAME}",
        ),
        (rf"{_BEGIN}(?:that's |there's |it's )?one too many{END}", rf". remove 1 {SAME}"),
        (rf"{_BEGIN}(?:less|fewer)(?: of (?:it|them|those))?{END}", rf". remove 1 {SAME}"),
        (
            rf"\b(?:only |just )?({NUMBER}) {_THING}"
            rf" (?:(?:is|are|will be|would be|'s) {_DO}|(?:will|would|'ll) do){END}",
            r". add exactly \1 \2",
        ),
        (
            rf"\b({NUMBER}) (?:is|are|will be|would be|'s) {_DO}{END}",
            rf". add exactly \1 units of {SAME}",
        ),
        (
            rf"\bmake {IT} (?:just |only |exactly )?({NUMBER}) dozens?"
            rf"(?: of (?:it|them|those))?{END}",
            rf". add exactly \1 dozen {SAME}",
        ),
        (
            rf"\bmake {IT} (?:just |only |exactly )?({NUMBER}) {_PACKS}",
            r". add exactly \1 ",
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
            r"exactly \1 \2",
        ),
        (
            rf"(?<!\w)({NUMBER}) {_THING}(?: please| in total)?,? not {NUMBER}{END}",
            r"exactly \1 \2",
        ),
        (
            r"\b(?:(?:i|we) )?(?:don't|do not) (?:want|need)"
            rf" {NUMBER} {_THING},? (?:just|only) ({NUMBER}){END}",
            r"exactly \2 \1",
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
                (rf"({NUMBER}){END}", rf"\1 units of {SAME}"),
                (rf"(?={NUMBER} (?!things?\b)\w)", ""),
            )
        ),
        (rf"\bmake the {_THING} ({NUMBER}){END}", r". add exactly \2 units of \1"),
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
            r"^(?:(?:no|yes|ok|okay|sure|actually|sorry|wait|oops)[ ,.!]+)+"
            r"(?!(?:an?|of|and|half)\b)"
            rf"({NUMBER})(?= please|[.!]*$)",
            rf". add exactly \1 units of {SAME}",
        ),
        (
            r"\b(remove|delete|drop|take(?: out)?) the (?:very )?last (?:thing|item|one|product)"
            rf"(?: (?:i|you)(?: just)? (?:added|asked for|named))?{END}",
            rf"\1 {SAME}",
        ),
        (
            rf"^\W*(?:(?:no|please|actually|sorry|ok|okay) )*(?:only|just) ({NUMBER}){END}",
            rf". add exactly \1 units of {SAME}",
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
            rf" {EXCEPT} ",
            ". keep only ",
        ),
        (rf"\b(?:take )?{_ALL}(?: else)? out {EXCEPT} ", ". keep only "),
        (
            rf"\b(?:i|we|they|he|she) (?:like|love|want)s? (?:{_ALL}|it all) {EXCEPT}"
            rf" the {_THING}{END}",
            ". ",
        ),
        (
            rf"^\W*(?:(?:yes|ok|okay|sure|please|fine)[ ,.!]+)*{_ALL}(?: of (?:it|them))? {EXCEPT}"
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
                    rf"(?:{PACKS} of )?"
                    r"(?:(?:version|kind|brand|alternative"
                    rf"|option|substitute|replacement) (?:of|to|for) )?{_OLD}{_THING}"
                    r"(?: (?:that )?(?:you(?:'ve)? (?:have|got|sell|carry|offer)|there is))?",
                    r"\1",
                ),
            )
        ),
        (
            rf"{_BEGIN}(?:(?:fine|ok|okay|well|so|and)[ ,]+)*"
            r"((?:the|those|these) (?!(?:kids|children|guests|others|train|bus|car|dog)\b)"
            r"(?:(?!\b(?:add|remove|but)\b)[^.,;!?]){1,60}?)"
            rf" (?:can|has to|have to) go(?: (?:as well|too|now|again|away))*{END}",
            r"remove \1",
        ),
        (r"\bchanged (?:my|our) minds? about\b", "remove"),
        (
            rf"{_BEGIN}(?:the )?{_THING} (?:was|were)(?: not|n't) (?:my|our) idea{END}",
            r"don't want \1",
        ),
        (
            r"\b(?:put|toss|throw|stick|chuck|pop|place|drop) ([^.;!?]{1,200}?)"
            rf" (?:(?:in|into|to|on) (?:the|my|our|this) {CART}|in there)\b",
            r"add \1",
        ),
        (
            r"\b(?:put|place|stick|pop|bring) (?!(?:it|that|this|them|those|these)\b)"
            rf"([^.,;!?]{{1,60}}?) back in(?:to)?(?: (?:the|my) {CART})?"
            rf"(?: (?:too|as well|again))*{END}",
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
            rf"{_BEGIN}([^\W\d_][\w' -]{{0,60}}?) ?[x\u00d7(] ?(\d{{1,4}})\)?{END}",
            r"\2 \1",
        ),
        (
            r"(?:^|(?<=, ))(?!(?:my|our|his|her|he|she|at|for|turn(?:s|ing)|room|number)\b)"
            rf"({_PLAIN}(?: {_PLAIN})?) (\d{{1,2}})(?=[.!]*$|,)",
            r"\2 \1",
        ),
        (
            rf"(?<![\w'-])({_PLAIN}(?: {_PLAIN}){{0,2}}),? ?\(?(?:(?:about|around|roughly) )?"
            rf"(\d{{1,4}}(?:\.\d{{1,3}})?) ?({UNIT})\)?{END}",
            r"\2 \3 \1",
        ),
        (r"\badd exactly 0 (?:packs|units) of ", "remove "),
        (r"\b(?:scratch|strike|ditch|lose) (?=(?:the|my|our|those|these|both)\b)", "remove "),
    )
]
"""Patterns of changes to the basket, and the additions and removals that they come to."""
