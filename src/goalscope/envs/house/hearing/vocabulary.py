"""The words of the grammar: verbs, what leads to them, prepositions, and how orders begin."""

from __future__ import annotations

import re


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
