"""What people say to a robot, said more plainly, before the grammar reads it."""

from __future__ import annotations

import re

from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.speech import evened

__all__ = ["amended", "normal"]

_PEOPLE = (
    r"(?:i|i'm|i've|i'll|he|she|he's|she's|they|they're|everyone|everybody|someone|somebody|my"
    r"|our|the (?:guests?|kids?|children|others|people|movie|game|party|rain|sun)"
    r"|we(?:'re|'ve| are| have)? (?:back|home|eaten|get home|come|return|leave|left|eat)"
    r"|dinner|lunch|breakfast|supper|work|school|midnight|noon|sunset|dark)"
)
_UNITS = r"(?:seconds?|moments?|minutes?|mins?|hours?|days?|weeks?|while|bit)"
_DAYS = r"(?:monday|tuesday|wednesday|thursday|friday|saturday|sunday|week|weekend|month|morning)"
_LATER = (
    rf"(?:after|once|when|whenever|as soon as) {_PEOPLE}\b(?!')[^,;?]*"
    r"|(?<!for )(?<!you )(?<!be back )later(?: on| today)?\b"
    r"|(?<!for )(?:tomorrow|tonight)\b(?!')(?: (?:morning|noon|evening|afternoon|night))?"
    rf"|(?<!for )(?:next|on|this|by) {_DAYS}\b|(?<!for )this (?:evening|afternoon)\b"
    rf"|in (?:an?|one|two|three|five|ten|\d+|half an|a few|a couple of) {_UNITS}\b"
    r"|(?:some other|another|some) (?:time|day)\b|someday\b|at (?:noon|midnight|night|\d+)\b"
    r"|not (?:right |just )?now\b|(?:at |for )?dinner ?time\b"
)
"""Another time than now."""


_NARRATES = re.compile(r"\b(?:i|we|he|she|they|was|were|had|did|got)\b")


def _is_order(text: str) -> bool:
    """Whether `text` begins with a verb as orders do, and tells of nothing."""
    head, *more = re.findall(r"[a-z0-9']+", text) or [""]
    verb = v.BASE.get(head) or v.BASE.get(" ".join([head, *more[:1]]))
    if not verb or verb in ("ignore", "use") or head in ("leave", "keep"):
        return False
    unsure = head in v.NOUNS | v.SAID_OF_ALL
    thing = bool(more) and (more[0] in v.DETERMINERS | v.PRONOUNS or more[0] in v.NUMBERS)
    return (thing or not unsure) and not _NARRATES.search(text)


def _in_order(said: re.Match[str]) -> str:
    """Put what is to be done first first: "slice the bread" of "after you've sliced the bread".

    Only orders are turned round: what is asked, told or forbidden stays as it was said.
    """
    rest, first, then = ((said[part] or "").strip(" ,.!?") for part in ("rest", "first", "then"))
    lead = v.PLAIN_LEAD.match(rest)
    rest = rest[len(lead[0]) :] if lead else rest
    if not rest and (polite := v.PLAIN_LEAD.match(then)):
        lead, then = polite, then[len(polite[0]) :]
    start = lead[0] if lead else ""
    end = "?" if said[0].rstrip(" .!").endswith("?") else ""
    refused = {*re.findall(r"[a-z']+", said[0])} & {*v.NEGATIONS, "nothing", "none", "nobody"}
    if not _is_order(rest or then) or refused or (end and not v.ASKED.match(start)):
        return said[0]
    words = first.split()
    for length in (2, 1):
        head = " ".join(words[:length])
        verb = v.DONE.get(head) or v.ING.get(head) or v.BASE.get(head)
        if verb and verb not in ("pick up", "use", "ignore") and len(words) > length:
            after = [part for part in (rest, then) if part]
            return start + ", then ".join([" ".join([verb, *words[length:]]), *after]) + end
    return said[0]


_BRING = (
    r"(?:^|(?<=[.,;!?] )|(?<=please )|(?<=and )|(?<=then )|(?<=(?:could|would) you )"
    r"|(?<=can you )|(?<=will you ))(?:bring|get|fetch|give) (?:me|us) (?:an? |some )?"
    r"(?:(?:nice|cold|fresh|big) )*"
)
_WASH = "(?:wash|rinse|scrub|wipe|clean)"
_SOME = "(?:the|my|an?|some|both|that)"
_DONE_SO = r"\b(?:fried|scrambled|poached|boiled|toasted|grilled) "
_COOKED = rf"(?:an? |some |the |two |one )?(?:toast|{_DONE_SO}(?:eggs?|bread|potato(?:es)?))"
_WARMED = "(?:[a-z]+ )?(?:potato(?:es)?|eggs?|bread|toast|food)"


def _to_make(said: re.Match[str]) -> str:
    """An order for food that is only named: "make toast and eggs", for "toast and fried eggs"."""
    return f"make {re.sub(_DONE_SO, '', said[1])}"


_FIRST = r"(?:^|(?<=[.,;!?] )|(?<=and )|(?<=please )|(?<=can you )|(?<=could you ))"
"""Before the verb of an order."""

_REWORDED = [
    (re.compile(pattern), plain)
    for pattern, plain in (
        (
            r"\b(?:wait|hang on|hold on)(?: for)?(?: just)? (?:a|one)(?: \w+)?"
            r" (?:sec|second|min|minute|moment|bit)\b",
            "wait",
        ),
        (
            r"^(?:(?:no|oh|ok|okay|actually|sorry)[ ,]+)*(?:(?:no,? )?(?:wait|hang on|hold on)"
            r"|i(?:'ve| have)? changed my mind|on second thoughts?|never ?mind)[ ,.:-]+"
            r"(?!(?:until|till|for|about|a|\w+ing)\b)(?:so |and )?",
            "",
        ),
        (
            r",? (?:it|they|which)(?:'s|'re| is| are)(?: (?:probably|maybe|somewhere|still))* "
            r"(?:in|on|at|inside) (?P<at>(?:the|a|my|our) [a-z]+(?: [a-z0-9]+)?)"
            r"(?:,? (?:(?:i|we) (?:think|guess|believe|suppose)|probably|maybe))?(?=[,.;!]|$)",
            r" from \g<at>",
        ),
        (r", not (?:the|that) ones? (?:from|in|on|at) (?:the|my|our) [a-z]+(?: [a-z]+)?", ""),
        (
            r"\b(?:in|into|on|onto) (?:the |my |a )?[a-z]+(?: [a-z]+)?,? (?:no|wait|sorry|oops"
            r"|actually|no wait)\b[, ]+(?=(?:in|into|on|onto)\b)",
            "",
        ),
        (r",? (?:would|could|can|will) you(?: please)?\?$", " please"),
        (
            r", (?:the|my|our) (?:guests?|kids?|children|baby|neighbou?rs?|parents?|friends?)"
            r"(?: (?:is|are|will be)|'s|'re) (?:[a-z]+ )?(?:coming|asleep|sleeping|here|home|hungry"
            r"|back|visiting|arriving|around|over)\b[^,.;!?]*",
            "",
        ),
        (r"\btake (?:your time|care|a (?:seat|break|look))\b", ""),
        (
            r"\bput (?:it all|them all|all (?:of )?(?:it|them|that|this|those|the things)|all)"
            r" back\b",
            "put everything back",
        ),
        (r"\bcoff?e+\b", "coffee"),
        (
            r"\bstop (?=(?:the|this|that|my|our) (?:water|tap|faucet|shower|tv|television|music"
            r"|radio|microwave|toaster|kettle|coffee (?:maker|machine))\b(?! (?:from|being)\b))",
            "turn off ",
        ),
        (
            rf"\b(?:heat|warm) (?P<up>up )?(?P<food>{_SOME} {_WARMED}|it|them)"
            r"(?(up)| up\b)",
            r"cook \g<food>",
        ),
        (rf"\b(?:heat|microwave) (?={_SOME} {_WARMED}\b)", "cook "),
        (
            r"\bput ((?:the|that|my|both|all(?: the| those)?|those) (?:[a-z]+ )?(?:candles?|lights?"
            r"|fire|flames?)|it|them) out(?= please|[ ]?[,.;!]| and\b| too\b| now\b|$)",
            r"put out \1",
        ),
        (
            r"\b(?:bring|fetch) (?:me|us) (?:an? |some )?(?:(?:nice|hot|fresh) )*"
            r"(?:(?:cup|mug) of )?coffee(?=(?:,? please)?[.!]*$)",
            "make coffee and bring it",
        ),
        (
            r"\b(?:bring|get|fetch|give) (?:me|us) (?:an? |some )?(?:(?:nice|hot|fresh) )*"
            r"(?:(?:cup|mug) of )?coffee\b",
            "make coffee",
        ),
        (rf"{_BRING}(cup|mug|glass) of (water|wine)\b", r"fill a \1 with \2 and bring it"),
        (rf"{_BRING}water\b(?! bottle)", "fill a glass with water and bring it"),
        (
            r"^(?:(?:and|now|then|ok|okay|please)[ ,]+)*(?=back |\w+ again)(?:back )?(on|off)"
            r"(?: again)?(?: please)?[ .!]*$",
            r"turn it \1",
        ),
        (
            r"\b(make|prepare)( me| us)? ((?:an? |some |the )?(?:\w+ ){0,2}?(?:toast|eggs?)) and"
            r" (?:an? |some )?(?:(?:cup|mug) of )?coffee\b",
            r"\1\2 \3 and make\2 coffee",
        ),
        (
            r"\b(make|prepare)( me| us)? ((?:an? |some )?(?:(?:cup|mug) of )?coffee) and"
            r" ((?:an? |some )?(?:\w+ ){0,2}?toast)\b",
            r"\1\2 \3 and make\2 \4",
        ),
        (
            r"^(?:(?:(?:can|could|may) (?:i|you|we) (?:have|get|make)|(?:i|we)(?:'d| would) like"
            r"|make|prepare|get|bring|give|please|now|then|and|me|us) )*"
            rf"({_COOKED}(?:(?:,| and|, and) {_COOKED})*)(?:,? please)?(?:[.!]*|(?<=please)\?)$",
            _to_make,
        ),
        (
            r"^((?:(?:please|now|then|ok|okay|and|can you|could you)[ ,]+)*)(?:put|place|serve|set)"
            r" (?!(?:it|them|that|both|everything)\b)"
            r"((?:(?!(?:in|on|onto|into|from|not|and)\b)[a-z0-9]+ ){1,5})"
            r"(?:on|onto|in) ((?:an?|my) (?:plate|bowl|tray))"
            r" on (the (?:[a-z]+ )?(?:table|counter|desk|stool))(?=(?:,? please)?[.!]*$)",
            r"\1put \3 on \4, and put \2on it",
        ),
        (r"\b(?:do|wash) (?:the |our |my )?(?:dishes|washing[ -]?up)\b", "wash the dishes"),
        (r"\b(?:would|is) it (?:be )?possible (?:for you )?to\b", "could you"),
        (
            rf"\b(?:needs?|could (?:do with|use)) an? (?:\w+ )?{_WASH}"
            r"(?=[,.!?]|$| and\b| please\b)",
            r"needs washing",
        ),
        (
            rf"\bgive ([^,.!?]{{1,40}}?) an? (?:\w+ )?{_WASH}\b(?! (?!and|please|now|for|too|then"
            r"|first|with|before)\w)",
            r"wash \1",
        ),
        (
            r"\b(?:pour|tip|dump|throw) (?:out )?(?:the|my|our|this|that) (coffee|water|wine)"
            r" (?:away|out(?! of)|down the (?:sink|drain))",
            r"empty the \1",
        ),
        (
            rf"{_FIRST}(?:sit|seat|prop) (?=(?:the|my|our) )",
            "put ",
        ),
        (
            rf"{_FIRST}lock"
            r" ((?:(?!\b(?:put|in|doors?|windows?)\b)[^.;!?]){1,60}?)(?: away| up)? in(?:to)?"
            r" (?=the (?:safe|drawer|cabinet)\b)",
            r"put \1 in ",
        ),
        (r"\bfold (?:up )?((?:the|my|our) (?:laptop|computer))(?: up)?\b", r"close \1"),
        (r" ?&", " and"),
        (rf"\b(?:{_LATER})", f" {v.LATER} "),
        (
            r", (?:it|they)(?:'s|'re| is| are)(?: (?!(?:in|on|at|to|for|by|near|under|inside|not|no"
            r"|and|but|or|so|then|also|please|dirty|open|closed|off)\b)[a-z']+){1,8}(?=[.!]|$)",
            "",
        ),
        (r"\bneither\b", "not"),
        (
            r"\b(?:back )?(?:to )?(?:where|how|the way) (?:(?:it|they|that|this|those|everything"
            r"|things) (?:was|were|came from)"
            r"|you (?:found|got|took) (?:it|them|that|this|those)(?: from)?)(?: before)?\b",
            "back",
        ),
        (r"\balso (?=(?:needs?|should|must|ha(?:s|ve)|go(?:es)?|belongs?)\b)", ""),
        (r"\b(?:as|like) i said\b,? ?", ""),
        (
            r"\bi (?:mean(?:t)?|said(?! (?:nothing|no|stop|so|i|we|it)\b))\b"
            r"(?: that\b(?= (?:the|my|our|an?)\b))?",
            "rather",
        ),
        (r"\bi (?:just |only )?wanted (?=(?:the|an?|my|both|all|two)\b)", "i want "),
        (
            r"\b(?:i|we) (?:never|did(?:n't| not)|have(?:n't| not)) (?:got|get|gotten|received?)"
            r" (?:either|any|the|my|an?)\b",
            "i want the",
        ),
        (
            r"\b(i|we) (?:never|did(?:n't| not)) (?:ask(?:ed)?(?: you)? for|want(?:ed)?"
            r"|order(?:ed)?) (?=(?:the|my|our|that|those|these) \w)",
            r"\1 don't want ",
        ),
        (
            r"\b(turn|switch) ((?:on|off) [^,.;!?]{1,40}?|[^,.;!?]{1,40}? (?:on|off)),? and"
            r" ((?:the|my|our|all|both) [a-z0-9 ]{1,40}?) (on|off)(?= please|[,.;!]|$)",
            r"\1 \2, and \1 \3 \4",
        ),
        (
            r"\b(turn|switch) (?!on\b|off\b)((?:(?!\b(?:on|off)\b)[^.;!?]){1,80}? and"
            r" (?:(?!\b(?:on|off|turn|switch)\b)[^.;!?]){1,40}?) (on|off)(?= please|[,.;!]|$)",
            r"\1 \3 \2",
        ),
        (r"\b(to|let's|we|i'll|we'll|will) watch (?!(?:on|in|over)\b)", r"\1 view "),
        (r"\bas well\b", "too"),
        (r"\b(?:(?:and|the|do) )*same (?:thing |goes )?(?:for|with)\b", "also"),
        (r"\b(can|could|may) (i|we) (?:please )?get\b", r"\1 \2 have"),
        (r"\b(?:don't|do not|never) (?:forget|hesitate)(?: about)?(?: to)?\b", "please"),
        (r"\bput (?:it|them) all back\b", "put everything back"),
        (
            r"\b(?:anywhere|any place|everywhere|somewhere) (?:but|except|other than)(?: not)?"
            r" (?=(?:in|on|at|into|onto|near|under)\b)",
            "not ",
        ),
        (
            r"\b((?:everything|all(?: (?:of )?(?:the|my|our|these|those))? [a-z]+)"
            r"(?: (?:back|off|on|out|away))?|(?:both|it|them)(?: all)? back),? but"
            r" (?=(?:the|my|our)(?: (?!(?:needs?|should|must|is|are|goes?|belongs?|has|have|can"
            r"|will|in|on|into|onto|to)\b)[a-z0-9']+){1,4}"
            r"(?: (?:in|on|into|onto|to) [^.,;!]{1,60})?(?: please)?[.,;!]*$)",
            r"\1 except ",
        ),
        (r" a (?:little )?bit(?! of\b)(?= |$|[,.!])", ""),
        (r"\band (?:then )?be (wash|clean|open|cook|fill|heat|toast)ed\b", r"and \1 it"),
        (r"\band (?:then )?be (rinse|close|slice)d\b", r"and \1 it"),
        (r",? (?:and )?so (?:do|does|should|must|goes?) (?=(?:the|my|our)\b)", ", and also "),
        (r"\bdo not\b", "don't"),
        (r"\b(?:there(?:'s| is) )?no need (?:to|for)\b", "don't"),
        (r"^(?:no|nope|nah)(?:,| (?=please\b))", ""),
        (r"\b(?:instead of|rather than) (?=\w+ing\b)", ", not "),
        (
            r"[, ]*\b(?:and )?(?:(?:after|once|when) (?:that|this)\b(?:'s| is)?(?: done)?"
            r"|afterwards?\b),?",
            ", then",
        ),
        (
            r"^(?P<rest>.*?)\b(?:after|once)\b(?: you(?:'ve| have)?)? (?P<first>[^,]+)"
            r"(?:,(?P<then>.*))?$",
            _in_order,
        ),
        (
            r"\b(?:after|before|once|when|while|as soon as)\b(?! (?:that|this)\b)[^,?]*"
            r"(?:, ?|(?=\?)|$)",
            "",
        ),
        (r"\b(?:if (?:you (?:can|could|please|don't mind)|possible))\b", ""),
    )
]
"""Patterns, and the plainer words that stand for what they match."""


_AMENDS = re.compile(
    r"(?:^|(?<=[.!?;] )|(?<=, ))(?:(?:no|hmm+|oh|actually|but|or)[ ,]+)*"
    r"(?:on second thoughts?|(?:or )?rather|(?:maybe |or )?better(?: yet)?|hmm+)[ ,]+"
    r"(?=(?:in|on|onto|into) (?:the|my|top)\b|the [a-z]+(?: [a-z]+)? instead\b)",
    re.IGNORECASE,
)
"""Before another place, as "no" may be."""
_BOTH = re.compile(
    r"^(?:(?:no|oh|actually|sorry|or|but|please)[ ,]+)*both(?: of them)? (?=(?:in|on|into|onto) )",
    re.IGNORECASE,
)
"""Before another place for two things."""
_IF_SO = re.compile(
    r"\b(?:is )?(?P<what>(?:the|my|our) [a-z ]{2,30}?)(?:, is it)?(?: still| already)?"
    r" (?:open|closed|shut|on|off|lit|burning|dirty|clean|full|empty)\?"
    r" (?:if (?:so|not|yes|it(?: is| isn't| is not|'s not))|otherwise),? (?:then )?(?:please )?"
    r"(?P<act>close|open|shut|wash|clean|turn|switch|light|put out|blow out|empty) it"
    r"(?P<how> on| off|)\b",
    re.IGNORECASE,
)
"""How a thing is to be, behind the question whether it is so."""


_NEEDED = re.compile(
    r"(?<=\bnot )(?P<what>(?:the |my )?[a-z]+(?: [a-z0-9]+)?),"
    r" (?:i|we)(?:'ll)? (?:still )?need (?:it|that|this|them)"
    r"(?: (?:in the (?:morning|evening|afternoon)|today|tomorrow|tonight|later|now|soon|myself"
    r"|for (?:work|school|later)))?(?=[ .!]*$)",
    re.IGNORECASE,
)
"""What is not to be moved, and why: "not the watch, I need that in the morning"."""


def amended(text: str) -> str:
    """`text` where another place, or how a thing is to be, is said as by a plain order.

    "On second thought, on the shelf" is "No, on the shelf", "Both on the bed" is "Put both on the
    bed", and "Is the box open? If so, close it" is "close the box".
    """
    text = _NEEDED.sub(r"\g<what>", _AMENDS.sub("No, ", text))
    text = _IF_SO.sub(r"\g<act> \g<what>\g<how>", text)
    return _BOTH.sub("Put both ", text)


def normal(text: str) -> str:
    """`text` evened and reworded."""
    text = evened(text)
    for pattern, plain in _REWORDED:
        text = pattern.sub(plain, text)
    return text
