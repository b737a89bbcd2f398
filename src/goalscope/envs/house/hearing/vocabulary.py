"""The words of the grammar: verbs, what leads to them, prepositions, plainer wordings."""

from __future__ import annotations

import re

from goalscope.envs.speech import evened


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_VERBS = {
    "put": "put|put away|put back|take back|place|move|set|store|stow|drop|carry|transfer|arrange"
    "|stack|hang|return|serve|lay|lay out|set out|line|line up|relocate|deposit|insert|throw"
    "|throw away|throw out|toss|toss away|toss out|keep"
    "|leave|dispose of|get rid of|plate|add|stick|pop|chuck|hide|tuck|shove|lock up|lock away",
    "pick up": "pick up|pickup|pick|grab|take|take out|get|bring|bring back|bring over|fetch"
    "|retrieve|hold|give|hand|collect|gather|gather up|find|remove|lift|lift up",
    "open": "open|open up",
    "close": "close|shut",
    "turn on": "turn on|turn back on|switch on|switch back on|power on|start|light|run",
    "turn off": "turn off|turn back off|switch back off|switch off|power off|shut off"
    "|kill|blow|blow out|put out|extinguish",
    "turn": "turn|switch",
    "slice": "slice|slice up|cut|cut up|chop|chop up|dice",
    "cook": "cook|boil|fry|bake|roast|toast|grill",
    "break": "break|smash|shatter|crack",
    "fill": "fill|fill up|refill|water",
    "pour": "pour",
    "empty": "empty|empty out|drain|pour out|dump|dump out",
    "clean": "clean|clean up|rinse|wash|scrub|wipe|rinse off|wash off|wipe off",
    "dirty": "dirty|soil",
    "push": "push",
    "pull": "pull",
    "use up": "use up",
    "use": "use|touch|disturb|bother|mess with|go near",
    "make": "make|prepare|brew",
    "ignore": "ignore|skip|forget about|forget|never mind|stay away from|keep away from|hands off"
    "|keep your hands off",
}
_IRREGULAR = {
    **{"take": "taken", "get": "gotten", "bring": "brought", "hold": "held", "give": "given"},
    **{"find": "found", "break": "broken", "throw": "thrown", "keep": "kept", "hang": "hung"},
    **{"leave": "left", "make": "made", "light": "lit", "lay": "laid", "blow": "blown"},
}


def _forms() -> tuple[dict[str, str], dict[str, str], dict[str, str], dict[str, str]]:
    """Verbs by their base forms, -ing forms and participles; base forms by participles."""
    base: dict[str, str] = {}
    ing: dict[str, str] = {}
    done: dict[str, str] = {}
    base_of: dict[str, str] = {}
    for verb, listed in _VERBS.items():
        for form in listed.split("|"):
            head, space, rest = form.partition(" ")
            base[form] = verb
            stem = head.removesuffix("e")
            for start in (stem, head + head[-1]):
                ing[f"{start}ing{space}{rest}"] = verb
                done[f"{start}ed{space}{rest}"] = verb
                base_of[f"{start}ed{space}{rest}"] = form
            done[f"{_IRREGULAR.get(head, head)}{space}{rest}"] = verb
            base_of[f"{_IRREGULAR.get(head, head)}{space}{rest}"] = form
    return base, ing, done, base_of


BASE, ING, DONE, BASE_OF = _forms()
NEGATIONS = _set(
    "don't not never no without avoid stop shouldn't mustn't can't won't needn't wouldn't nor"
    " didn't doesn't isn't aren't neither nobody"
)
LEAD = _set(
    "please kindly may sorry actually instead quickly simply are can could would will"
    " you we i i'd i'm i'll we'll you'll need needs want like love to now then and so ok okay yes"
    " yeah sure hi hello hey first next also just let's let us me try have should must shall go"
    " ahead finally lastly again good great nice perfect job work thanks thank alright there"
    " carefully gently slowly quietly"
    " start by be do help remember make today your task is the going it says that all after"
    " this would've got but or well mind awesome more one robot had better either only rather"
    " meanwhile"
) | (NEGATIONS - {"no", "nobody", "neither"})
LIKED = _set("need want like love needs")
FELT = _set("hate dislike finished")
"""Verbs of what a person thinks of a thing, or is done with."""
MINE = frozenset(("i", "i'll", "i'm"))
"""Subjects of what the person does."""
ARTICLES = _set("the a an my our your his her their any some every each another these those")
EACH = _set("all every each both")
DETERMINERS = ARTICLES | EACH | _set("other same single of that this whole more just only")
QUALITIES: dict[str, tuple[str, bool | str]] = {
    **{"dirty": ("isDirty", True), "clean": ("isDirty", False), "broken": ("isBroken", True)},
    **{"open": ("isOpen", True), "closed": ("isOpen", False), "sliced": ("isSliced", True)},
    **{"full": ("isFilledWithLiquid", True), "empty": ("isFilledWithLiquid", False)},
    **{"hot": ("temperature", "Hot"), "cold": ("temperature", "Cold")},
    **dict.fromkeys(("cooked", "boiled", "toasted"), ("isCooked", True)),
}
"""Adjectives, and the states in AI2-THOR's metadata for which they stand."""
FILLERS = _set(
    "middle small big large little red blue green white black brown yellow grey gray"
    " left right top bottom upper lower round"
    " wooden first second third last next remaining rest lone fresh used nearest"
    " closest smaller larger smallest largest edible"
) | frozenset(QUALITIES)
DISPOSALS = frozenset(
    ("throw away", "throw out", "toss away", "toss out", "dispose of", "get rid of")
)
"""What puts things in the garbage."""
THROWS = frozenset(("throw", "toss", "chuck", "drop"))
"""What cannot be done out of a window or off a roof."""
SURFACES = ("CounterTop", "DiningTable", "CoffeeTable", "SideTable", "Desk", "Dresser")
"""Where what was made for a person stands ready."""
LOCKS = frozenset(("lock up", "lock away"))
"""What puts things in the safe, if no other place is named."""
RETURNS = frozenset(("put back", "take back", "return"))
"""What puts things where they were, if no other place is named."""
CHOOSING = FILLERS | _set("this that these those other same")
"""Words that tell which of several things is meant."""
NUMBERS = {
    **{"zero": 0, "a": 1, "an": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6},
    **{"seven": 7, "eight": 8, "nine": 9, "ten": 10, "another": 1, "both": 2, "couple": 2},
}
PRONOUNS = _set("it them they those these that this one ones both all")
SWITCHED = frozenset(f"{verb} {way}" for verb in ("turn", "switch") for way in ("on", "off"))
"""Verbs that "back" may stand in: "turn it back on"."""
LIDS = frozenset(("lid", "door", "cover"))
"""Parts that stand for the whole that opens."""
PLAIN = frozenset(("it", "them", "they"))
"""Pronouns that no noun follows."""
VAGUE = _set("items item things thing objects object everything anything nothing")
INTO = (
    *("on top of", "in to", "on to", "back in", "back on", "back to", "back into", "over to"),
    *("inside of", "into", "onto", "inside", "in", "on", "to", "upon", "at"),
)
TOWARDS = frozenset(("into", "onto", "in to", "on to", "back in", "back on", "back into"))
"""Those that tell, even without a verb, where a thing should go."""
ASIDE = (
    *("next to", "in front of", "out of", "close to", "to the left of", "to the right of"),
    *("left of", "right of", "on the left of", "on the right of", "beside", "by", "near"),
    *("under", "underneath", "above", "below", "behind", "from", "off", "with", "using", "of"),
)
EXCEPT = (
    *("except for", "except", "but not", "apart from", "other than", "besides", "and not", "not"),
    *("rather than", "instead of"),
)
THERE = (
    *("with the others", "with the other ones", "with the rest", "with the other things"),
    *("in the same place", "to the same place", "in there", "over there", "there"),
)
"""The place of the last put, or the one spoken of last."""
JOINTS = frozenset((",", "and", "plus", "or", "also", "then", "too", "please"))
"""What may stand between two things of a list."""
AGAIN = frozenset(("and", "plus", "also", "next", "then"))
"""Words at whose head a thing alone repeats the last request."""
MARKS = frozenset(("too", "also", "first", "please"))
"""Words beside which, too, it does so."""
CORRECTS = frozenset(("actually", "instead", "sorry", "rather"))
"""Words with which a thing alone takes the place of the last one."""
TAIL = _set(
    "please now up too also thanks carefully there back away down over in on together again"
)
STATES = {
    **{"on": "turn on", "off": "turn off", "open": "open", "closed": "close", "shut": "close"},
    **{"clean": "clean", "empty": "empty", "full": "fill", "dirty": "dirty"},
}
BARE_STATES = STATES.keys() - {"dirty"}
"""Those that alone ask for it: "lights off"."""
CUTTING = frozenset(("slice", "break"))
"""What makes pieces of a thing."""
LATER = "anothertime"
"""What stands for words such as "tomorrow" in a text that `normal` made."""
KEPT = _set("whole intact raw uncooked uncut unsliced unbroken undamaged unharmed")
"""States that a thing is left in."""
LIQUIDS = frozenset(("water", "coffee", "wine"))
VESSELS = frozenset(("Mug", "Cup", "Bowl", "Pot", "Bottle", "Kettle", "WateringCan"))
CRACKED_INTO = frozenset(("Pan", "Pot", "Bowl", "Mug", "Cup"))
SLICES = frozenset(("slice", "slices", "piece", "pieces"))
NOUNS = _set("toast plate water light hand empty open dirty add set")
"""Verbs that are as often something else; alone, or before "and", they are no orders."""
GERUND = frozenset(("by", "start", "try", "without", "avoid", "stop", "not", "never", "mind", "we"))
"""Words after one of which an -ing form is an order or a refusal."""
BREAKS = frozenset((",", "and", "then", "but", "also", "so", "or", "without", "not", "avoid"))
STOPS = (
    _set("go goes belong belongs live lives has have are was were who which where")
    | (LEAD | BREAKS | TAIL | VAGUE | PRONOUNS | NOUNS)
    | frozenset((*STATES, *BASE))
)
"""Words that no noun unknown to the grammar goes beyond."""
STATING = _set(
    "i i'm i'd i'll we let's let me going it that says is all would've had this your one there"
)
"""Words before which a verb is no order: "I take", "that is good"."""
SAID_OF_ALL = _set("have find hold keep start leave return add set use give get make prepare plate")
"""Verbs of which much else is said than orders."""
MAKES = frozenset(("make", "prepare", "set"))
"""Those of them that order, too, what is not known: "make me a sandwich"."""
MEALS = _set("dinner lunch breakfast supper brunch food")
AIMS = _set("tidy declutter organise organize rearrange decorate")
"""Verbs of orders that need not say what."""
WILD = _set("jump climb fly swim dance sing explode burn destroy kill attack steal drive ring")
"""Verbs of what the robot cannot do, also where no thing follows."""
ONESELF = _set("me us him her yourself everything everyone them it")
"""What, besides things, verbs that are not known are said of."""
PARTICLES = frozenset(("up", "down", "out", "off"))
"""What belongs to a verb before it: "heat up"."""
NOT_ORDERED = _set(
    "what why how because here for about enjoy wait see know think hope mean look check tell ask"
    " say said excuse call wish hate believe imagine pardon welcome happy hungry thirsty fine maybe"
    " even still already while until since within half quite such many much most than very been did"
    " might"
)
"""Other words that begin no order."""
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


ASKED = re.compile(
    r"(?:(?:and|so|but|ok|okay|oh|well|hey|hi|hello)[ ,]+)*(?:please )?(?:(?:can|could|would|will)"
    r" (?:you|we)\b|why (?:don't|not|do not) (?:you|we)\b|would you mind"
    r"|(?:can|could|may) (?:i|we) (?:please )?have\b)"
)
"""How an order begins that is said as a question."""
PLAIN_LEAD = re.compile(
    r"(?:(?:ok|okay|yes|yeah|sure|hi|hello|hey|thanks|robot|now|then|next|first|also|and|please"
    r"|kindly|just|go ahead and|you may|i want you to|i need you to|i'd like you to"
    r"|i would like you to|(?:can|could|would|will) you)(?![\w'])[ ,]*)*"
)
"""Words that leave an order plain."""
_NARRATES = re.compile(r"\b(?:i|we|he|she|they|was|were|had|did|got)\b")


def _is_order(text: str) -> bool:
    """Whether `text` begins with a verb as orders do, and tells of nothing."""
    head, *more = re.findall(r"[a-z0-9']+", text) or [""]
    verb = BASE.get(head) or BASE.get(" ".join([head, *more[:1]]))
    if not verb or verb in ("ignore", "use") or head in ("leave", "keep"):
        return False
    unsure = head in NOUNS | SAID_OF_ALL
    thing = bool(more) and (more[0] in DETERMINERS | PRONOUNS or more[0] in NUMBERS)
    return (thing or not unsure) and not _NARRATES.search(text)


def _in_order(said: re.Match[str]) -> str:
    """Put what is to be done first first: "slice the bread" of "after you've sliced the bread".

    Only orders are turned round: what is asked, told or forbidden stays as it was said.
    """
    rest, first, then = ((said[part] or "").strip(" ,.!?") for part in ("rest", "first", "then"))
    lead = PLAIN_LEAD.match(rest)
    rest = rest[len(lead[0]) :] if lead else rest
    if not rest and (polite := PLAIN_LEAD.match(then)):
        lead, then = polite, then[len(polite[0]) :]
    start = lead[0] if lead else ""
    end = "?" if said[0].rstrip(" .!").endswith("?") else ""
    refused = {*re.findall(r"[a-z']+", said[0])} & {*NEGATIONS, "nothing", "none", "nobody"}
    if not _is_order(rest or then) or refused or (end and not ASKED.match(start)):
        return said[0]
    words = first.split()
    for length in (2, 1):
        head = " ".join(words[:length])
        verb = DONE.get(head) or ING.get(head) or BASE.get(head)
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
            r"|make|prepare|get|bring|give|please|now|then|and|me|us|some) )*"
            rf"({_COOKED}(?:(?:,| and|, and) {_COOKED})*)(?:,? please)?[.!?]*$",
            _to_make,
        ),
        (
            r"\b(put|place|serve|set) (?!(?:it|them|that|both|everything)\b)([a-z0-9 ]{1,40}?)"
            r" (?:on|onto|in) ((?:an?|the|my) (?:plate|bowl|tray))"
            r" on (the (?:[a-z]+ )?(?:table|counter|desk|stool))\b",
            r"put \3 on \4, and put \2 on it",
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
        (r" ?&", " and"),
        (rf"\b(?:{_LATER})", f" {LATER} "),
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


def normal(text: str) -> str:
    """`text` evened and reworded."""
    text = evened(text)
    for pattern, plain in _REWORDED:
        text = pattern.sub(plain, text)
    return text
