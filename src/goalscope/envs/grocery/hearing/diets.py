"""Which dietary restrictions a person states."""

from __future__ import annotations

import re

from goalscope.envs.grocery.hearing.requests import Refusal, unwanted
from goalscope.envs.grocery.hearing.rewording import heard
from goalscope.envs.grocery.restrictions import DIETS, Diet, either, finder
from goalscope.envs.grocery.words import asks, made, sentences, singulars
from goalscope.envs.speech import LONGEST, evened
from goalscope.envs.undoing import LEAD

__all__ = [
    "MEAL",
    "diet",
    "hinted",
    "implied",
    "is_diet",
    "label",
    "of_some",
    "undieted",
    "waves_off",
]


_GOODS = frozenset({"egg", "fish", "peanut", "pork", "sugar"})
"""Things that a basket holds, so that who drops one of them need not follow a diet."""


def _harm(entry: Diet) -> str:
    return either(f"{entry.refused}, {entry.allergens}")


def _banned(entry: Diet) -> str:
    """Words such as "nuts are not allowed" and "it can't contain nuts", of what harms."""
    harm = rf"(?:{_harm(entry)})s?"
    shunned = "|".join(s for each in entry.refused.split(",") if (s := each.strip()) not in _GOODS)
    return (
        rf"{harm} (?:is|are) (?:(?:strictly|absolutely) )?(?:off (?:the table|limits)|forbidden"
        r"|banned|poison|deadly|dangerous|a no[- ]go|not (?:allowed|ok(?:ay)?|an option))"
        rf"|{harm} (?:would|could|can|will|might) kill"
        rf"|keep (?:the |any |all )?{harm} (?:out|away)"
        rf"|(?:can't|cannot|mustn't|must not|shouldn't|may not) (?:contain|include)(?: any)? {harm}"
        rf"|(?:{shunned or '(?!)'})s? (?:is|are) out(?! of)"
        rf"|{harm} (?:is|are) out(?= .*\b(?:allerg|intoleran)|,.*\b(?:allerg|intoleran))"
    )


def _named(name: str, entry: Diet) -> str:
    harm = _harm(entry)
    return rf"{name}|(?:{harm})s?[- ]free{'|' * bool(entry.said)}{entry.said}"


_NAMED = {
    name: re.compile(rf"(?<!\w)(?:{_named(name, entry)})(?![\w-])") for name, entry in DIETS.items()
}
_ANY = "(?:" + "|".join(_named(name, entry) for name, entry in DIETS.items()) + ")"
_FROM = r"(?:from|after|if|when|whenever) (?:\w+ )?(?:eat\w* |drink\w* |has |have )?(?:any |some )?"
_HARMED = r"(?:ill|sick|unwell|a rash|hives|a (?:bad |severe )?reaction)"
_ILL = {
    name: re.compile(
        rf"\b(?:(?:{either(entry.ill)})s?|(?:{_harm(entry)})s?"
        r"(?:(?:,? and |,? or |/|, )[\w-]+(?: nuts?)?){0,3}[- ](?:allerg|intoleran|sensitiv)\w*"
        rf"|{_HARMED} {_FROM}(?:{_harm(entry)})s?"
        rf"|(?:{_harm(entry)})s? (?:makes?|gives?) (?:\w+ ){{1,3}}{_HARMED}|{_banned(entry)})\b"
    )
    for name, entry in DIETS.items()
    if entry.refused
}
_IT = r"(?:it|them|that|those|these)\b"
_HARMED_BY_IT = re.compile(
    rf"\b(?:(?:allergic|intolerant|sensitive) to|{_HARMED} {_FROM}"
    rf"|(?:can't|cannot) (?:digest|tolerate)) ?{_IT}"
    r"|(?:'s|'m|'re| is| are| am)(?: (?:very|really|severely|highly|badly|deadly|quite|so))?"
    r" (?:allergic|intolerant)(?! (?:to|of|against)\b)"
    rf"|\b(?:it|that|they|those|these) (?:makes?|gives?) (?:\w+ ){{1,3}}{_HARMED}\b"
)
_SHARED = 200
"""Characters that two parts of a long line share, so that no statement is cut in two."""


_ALL = "(?:foods?|stuff|things?|products?|items?|ingredients?|options?|groceries|shopping|basket)"
_PERSON = (
    "(?:friend|guest|visitor|colleague|coworker|neighbou?r|roommate|flatmate|partner|wife|husband"
    "|girlfriend|boyfriend|fiance|son|daughter|child|children|kid|boy|girl|baby|toddler|sister"
    "|brother|mother|mom|mum|father|dad|parent|grandma|grandpa|aunt|uncle|cousin|niece|nephew"
    "|boss|family|household|team|group|school|class|office|person|people|man|men|woman|women"
    "|crowd|customer)"
)
MEAL = (
    "(?:cake|dinner|lunch|breakfast|brunch|supper|meal|dish|dessert|menu|recipe|party|buffet"
    "|picnic|barbecue|bbq|feast|diet|lifestyle|night|evening|weekend|week)"
)
"""What people eat, or eat at: an occasion."""
_SUBJECT = (
    r"(?:i|we|he|she|it|that|this|everything(?: (?:i|we|you) \w+)?|every\w+|all|nothing|who"
    r"|nobody|no ?one"
    r"|there|of (?:us|them)|they(?=(?:'re| are| have to| must| need to)\b)|(?<=^)\w+(?= is\b)"
    rf"|{_PERSON}s?|{MEAL}s?|{_ALL})"
)
_CHAIN = (
    r"(?:am|is|are|was|were|be|been|being|have|has|had|got|gotta|to|must|should|needs?|shall|will"
    r"|would|ought|can|could|does|do|did|\w+n't|cannot|not|no longer|always|strictly|also|just|now"
    r"|completely|fully|entirely|totally|100%|exclusively|mostly|all|both|a|an|the|very|actually"
    r"|really|stays?|go|goes|gone|going|went|become|became|turned|eats?|prefers?|keeps?|live"
    r"|try|rather|one|two|three|few|some|\d+"
    r"|cooks? only|cooks?|bakes?|only (?:buy|use|cook|want|shop)|(?:buy|use|want|shop) only|only"
    r"|and|or|&|as|necessarily"
    rf"|{_ANY})"
)
_STATED = re.compile(
    rf"(?:\bnot |n't (?:need|want|expect) )?\b(?P<subject>{_SUBJECT})(?:'\w+)?"
    rf"(?>[\s,]+{_CHAIN}(?!\w))*+[\s,]+$"
)
_CHOSEN = ("vegan", "vegetarian")
"""Diets that harm nobody who breaks them: those of some bind only what is guessed."""
_SOME = re.compile(
    r"\b(?:one|two|three|four|some|several|a (?:few|couple)|\d+)(?: of)?"
    rf"(?: (?:my|our|the|us|them))?(?: [\w-]+)?? (?P<who>{_SUBJECT})$"
    r"|\b(?:an?|another)(?: [\w-]+)??"
    rf" (?!(?:family|household|team|group|school|class|office|crowd)\b)(?P<guest>{_PERSON})$"
)
"""Before a diet that not everybody follows: "one of my guests" is vegan."""
_GUEST = re.compile(
    r"\b(?:have|having|there(?:'s| is| are)|got)(?: also)?"
    r" (?:an?|one|some|two|three|\d+)(?: other)? $"
)
"""Before a diet of somebody who comes besides: "we also have a" vegetarian coming."""
_US = r"(?:i|we|it|that|this|every\w*|all|nothing|who|nobody|there|they)"
_SOLE = re.compile(
    r"(?:'s|'m| is| am) the (?:only )?(?:one (?:who(?:'s| is)|that(?:'s| is)) )?$"
    r"|\b(?<!not )only (?:(?:my|our|one of) )?[\w-]+(?: [\w-]+)??(?:'s| is) (?:an? )?$"
)
"""Before a diet of one person alone: "she's the only" vegan."""
_REST = re.compile(
    r"s?,? (?:(?:but|and|while|though) )?(?:(?:the|all (?:the )?|my|our) (?:others?|rest"
    r"|other (?:people|guests|ones|kids|friends))|everyone else|everybody else)(?: of (?:us|them))?"
    r" (?:(?:all|just|do) )?(?:aren't|are not|isn't|is not|don't|do not|doesn't"
    r"|eats? (?!no\b|only\b|vegan|vegetarian)|likes? |loves? |can )"
)
"""Behind a diet that others do not follow: vegan, "the others eat meat"."""
_NOT_I = re.compile(r"\bi(?:'m| am) not (?:an? )?$")
_BUT_OTHERS = re.compile(
    r" (?:myself|personally)\b|,? (?:though|but (?:she|he|they|(?:my|our) \w+))\b"
)
"""Around a diet of others: "I'm not" vegan "myself"."""
_COMING = re.compile(
    rf"s?(?: {_PERSON}s?)?(?: (?:coming|over|round|among us|with us|too|as well)\b|[.!]|$)"
)
_NONE = re.compile(
    r"\b(?:nobody|no ?one|(?:none|neither|not one)(?: of)?|neither (?:[\w-]+ ){1,3}nor)"
    r"(?: (?:here|in|at|of|from|my|our|the|this))*\s*$"
)
"""Before people of whom a restriction is denied: "none of" us, "nobody in my" family."""
_NOBODY = re.compile(r"\b(?:nobody|no ?one)")
_PEOPLE = re.compile(rf"of us|i|we|(?:{_PERSON})s?")
_BUT = re.compile(r"[\s,]*(?:except|apart|other than|besides|but(?! (?:\w+ ){1,2}(?:is|are)\b))\b")
_BUT_ONE = re.compile(
    r"[\s,]*(?:(?:but|except|apart from|other than|besides)(?: for)?|only|just)"
    r" (?:me|him|her|them|us"
    rf"|(?:(?:my|our|one|two|some|the)(?: of)?(?: my| our| the)? )?{_PERSON}s?)\s*(?:[.,;!?]|$)"
)
"""Behind what nobody follows, somebody who does."""
_REASON = re.compile(r" (?:because|since|as) .*$| for [\w']+$")
"""Why or for whom it is, behind a restriction."""
_WHOLE = re.compile(
    rf"\W*+(?>(?:{_CHAIN}|{_SUBJECT}|make|please|yes|thanks|ok|okay|well|oh|then|so|too|if"
    r"|possible|instead|obviously|naturally|clearly"
    r"|wait|hold on|but|and|um|hmm|btw|by the way|remember|careful|important|note|one thing)"
    r"(?!\w)\W*+)++"
)
_HERE = re.compile(
    rf"(?:^|(?<=[.!;] ))(?:(?:hi|hello|hey)[ ,]+)?(?P<diet>{_ANY}) (?:here|speaking)(?=[,.;!]|$)",
    re.MULTILINE,
)
_ONLY = re.compile(
    r"\bnothing (?:but |non-?|not |(?:that|which)(?:'s| is)? not |(?:that|which) isn't )"
)
_NOUN = re.compile(
    r"(?:[\s-]+(?!(?:last|please|and|or|but|for|because|as|too|if|so|only|when|where|now|this|today"
    r"|tonight|at|in|on|with|to|any|since|though|also|instead|here|by|is|are|was|has|have|would"
    r"|will|can|must|should|need|needs|want|wants|like|likes|who|that|which|not|isn't|i|we|then"
    r"|thanks|except|than|from|again|anymore|yet|all|myself|ourselves|doesn't|does|of"
    r"|obviously|naturally|clearly)\b)"
    r"[\w'&-]+){1,5}"
)
_NOT = re.compile(
    r"\b(?:not?|\w+n't|no longer|(?:nobody|no ?one)(?:'?s)?|none|neither|without)"
    r"(?:\s[\w-]+){0,4}\s*$"
)
_DROPPED = re.compile(
    rf"(?:^|[,.;:!] ?){LEAD}(?:(?:but|so|well|you may|maybe)[ ,]+)*"
    r"(?:forget|never ?mind|drop|skip|scratch|ignore)(?: about)?(?: that)?"
    r"(?: the| my| our| it being| being| (?:i|we)(?:'m|'re| am| are))? $"
    r"|(?:n't|not) (?:matter|care|mind)\b.*$"
)
_RULE = r"(?:thing|part|bit|rule|requirement|restriction|preference)s?"
"""What a restriction is called by."""
_LABEL_REFUSED = re.compile(
    r"(?:(?:^|[,.;!?:] |\b(?:said|want|please|but|and|with|ok|oh) )no|\b(?:remove|delete|drop|ditch"
    r"|(?:take|throw|toss) (?:out|off|away)|get rid of|(?:take|throw|put)(?= the)"
    r"|(?:don't|do not|didn't|did not|never) (?:want|buy|get|add|like|ask for|order)))"
    r"(?: (?:any|the|all|of|more|your|those|these|this|every|anything|everything|things"
    r"|stuff))*\s*$"
)
"""Before a restriction's name: what is labelled so is refused."""
_REMOVED = re.compile(
    r"\b(?:remove|delete|discard|return|swap|replace|exchange|change|take (?:out|off|away|back)"
    r"|get rid of|put back)\b(?:(?!\b(?:for|with|by|to)\b).)*$"
)
"""Before the label of a thing that is to leave."""
_WAVES_OFF = re.compile(
    rf"^{LEAD}(?:but |so )?(?:forget|never ?mind|drop|skip|scratch|scrap|ignore|disregard|undo"
    r"|cancel|revert|lift|take back|withdraw|remove|delete)\b.*"
    rf"\b(?:allerg\w+|intoleran\w+|diets?|{_ANY}|{_RULE})"
    rf"(?: {_RULE})?(?:,? (?:please|now|again|after all))*$"
    r"|(?:\b(?:not|no longer|nobody|no ?one)\b|n't\b).*\b(?:allergic|intolerant|sensitive)\b"
    r"|\b(?:is|are) (?:fine|ok|okay|allowed|all right|no problem)\b"
    r"|\bout(?:grew|grown)\b"
)
_OTHERWISE = re.compile(r"\s(?:\w+ )?(?:also )?(?:fine|ok|okay|good|will do)\b")
_WAIVED = re.compile(
    r"\s(?:is|are)(?:n't| not) (?:a must|necessary|needed|required|important)|\s(?:does|need)n't\b"
)


def diet(
    utterance: str, before: frozenset[str] = frozenset(), some: frozenset[str] = frozenset()
) -> frozenset[str]:
    """The restrictions of `DIETS` that stand after `utterance`, given those that stood `before`.

    A restriction stands when it is stated of a person, of everything, or of what is made: an
    allergy, intolerance or refusal ("no gluten"), "I'm vegan", "we only eat organic", "it must be
    halal", "keep it vegetarian", a word on its own ("Organic, please."), "a gluten-free dinner".
    A word before any other noun, or said of one thing, is about that thing only: "two organic
    apples", "oat milk for a vegan colleague". "It need not be organic" takes it back.

    Args:
        utterance: What was said.
        before: The restrictions that stood.
        some: Those that only some follow, as was said: "she is vegan" tells who.
    """
    standing = set(before)
    parts = [part for line in utterance.splitlines() for part in _parts(line)]
    text = _HERE.sub(r"i am \g<diet>", "\n".join(map(evened, parts)))
    for sentence in sentences(_ONLY.sub("everything is ", text)):
        for name, pattern in _NAMED.items():
            for match in pattern.finditer(sentence):
                stated = _stated(sentence, match, name in some)
                if stated is not None:
                    (standing.add if stated else standing.discard)(name)
        for name, pattern in _ILL.items():
            if _affirmed(pattern, sentence):
                standing.add(name)
    harmed = _affirmed(_HARMED_BY_IT, text)
    for said in (said for part in parts for said in heard(part)):
        for thing, how in unwanted(said).items():
            standing |= implied(thing, Refusal.HARMED if harmed else how)
    return frozenset(standing)


def hinted(utterance: str, before: frozenset[str] = frozenset()) -> frozenset[str]:
    """The restrictions that a person spoke of in any way, as in "vegan burgers", and `before`.

    Not "organic", which harms nobody that goes without. What is denied is taken back.
    """
    standing = set(before)
    for sentence in sentences(evened(utterance)):
        for name, pattern in _NAMED.items():
            for match in pattern.finditer(sentence):
                denied = _NOT.search(_clause(sentence, match.start())) or _LABEL_REFUSED.search(
                    sentence[: match.start()]
                )
                (standing.discard if denied else standing.add)(name)
    return frozenset(standing - {"organic"})


def of_some(utterance: str, standing: frozenset[str] = frozenset()) -> frozenset[str]:
    """The diets that only some of the people follow, by what was said: "one of us is vegan".

    Who is "not vegan myself" leaves it to others, where that diet is `standing`.
    """
    found = set[str]()
    for sentence in sentences(evened(utterance)):
        for name in () if asks(sentence) else _CHOSEN:
            for match in _NAMED[name].finditer(sentence):
                before = sentence[max(0, match.start() - 100) : match.start()]
                stated = _STATED.search(before)
                some = stated and _SOME.search(before[: stated.end("subject")])
                after = sentence[match.end() :]
                guest = _GUEST.search(before) and _COMING.match(after)
                not_i = name in standing and _NOT_I.search(before) and _BUT_OTHERS.match(after)
                if some or guest or not_i or _is_of_one(before, after):
                    found.add(name)
    return frozenset(found)


def _is_of_one(before: str, after: str) -> bool:
    """Whether a diet between these words is of one person, and not of the others."""
    return bool(_SOLE.search(before) or _REST.match(after[:100]))


def waves_off(utterance: str, standing: frozenset[str]) -> frozenset[str]:
    """Those of the restrictions `standing` that an utterance seems to take back."""
    found = set[str]()
    for sentence in sentences(evened(utterance)):
        waved = _WAVES_OFF.search(sentence.rstrip(" .!"))
        if asks(sentence) or not waved or re.search(r"\belse\b", sentence):
            continue
        phrase = " ".join(singulars(sentence))
        named = {
            name
            for name in standing
            if _NAMED[name].search(sentence)
            or finder(f"{DIETS[name].refused}, {DIETS[name].allergens}").search(phrase)
        }
        general = re.search(
            r"\b(?:allerg(?:y|ies)|intolerances?|diets?|restrictions?|anything)\b", sentence
        )
        found |= named or (standing if general else set())
    return frozenset(found)


def undieted(text: str) -> str:
    """`text`, evened, without the names of restrictions."""
    for pattern in _NAMED.values():
        text = pattern.sub(" ", text)
    return " ".join(text.split())


def implied(thing: str, how: Refusal = Refusal.SHUNNED) -> frozenset[str]:
    """The restrictions of a person who refuses `thing`, such as "eggs" or "nut products"."""
    phrase = re.sub(r" (?:stuff|things?|products?|items?)$", "", " ".join(singulars(thing)))
    if how is Refusal.DROPPED and phrase in _GOODS:
        return frozenset()
    if how is Refusal.HARMED:
        found = [
            n for n, d in DIETS.items() if finder(f"{d.refused}, {d.allergens}").search(phrase)
        ]
    else:
        found = [n for n, d in DIETS.items() if finder(d.refused).fullmatch(phrase)]
    return frozenset(found)


def is_diet(phrase: str) -> bool:
    """Whether `phrase`, in lower case, is but the name of a restriction, such as "organic"."""
    return bool(re.fullmatch(rf"(?:only |all |everything )*{_ANY}(?: {_ALL}| only)?", phrase))


def label(phrase: str) -> str:
    """What things are labelled that `phrase`, in lower case, means by a diet: "vegan stuff"."""
    return re.sub(rf"^(?:only |all |everything |anything )+| (?:{_ALL}|only)$", "", phrase)


def _parts(line: str) -> list[str]:
    """A line in parts that are short enough to be read; each begins with the end of another."""
    step = LONGEST - _SHARED
    return [line[i : i + LONGEST] for i in range(0, max(len(line) - _SHARED, 1), step)]


def _affirmed(pattern: re.Pattern[str], text: str) -> bool:
    return any(not _NOT.search(_clause(text, each.start())) for each in pattern.finditer(text))


def _clause(sentence: str, end: int) -> str:
    """What comes before `end` in its clause; a person's words that matter are close by."""
    return re.split(r"[,;]|\bbut\b", sentence[max(0, end - 100) : end])[-1]


def _stated(sentence: str, match: re.Match[str], of_some: bool) -> bool | None:
    """Whether a restriction's name is stated (True), taken back (False), or about one thing.

    Args:
        sentence: What was said.
        match: Where it is named.
        of_some: Whether it is known to be of some people only.
    """
    before = sentence[max(0, match.start() - 100) : match.start()]
    after = sentence[match.end() : match.end() + 80]
    waived = _WAIVED.match(after)
    after = re.sub(rf"^(?:(?:,|\s|\band\b|\bor\b|&)+{_ANY}\b)+", "", after)
    found = _NOUN.match(after)
    noun = found[0].lstrip(" -") if found else ""
    people = re.search(rf"\b{_PERSON}s?$", noun)
    whole = people or re.search(rf"\b{MEAL}$|^{_ALL}$", noun)
    rule = re.fullmatch(_RULE, noun)
    if waived or (_DROPPED.search(before) and (whole or rule or not noun)):
        return False
    if match[0] == "organic" and re.search(r"\bmake (?:it|this|that|them|these|those) $", before):
        return None
    if _LABEL_REFUSED.search(before) and (not noun or re.search(rf"^{_ALL}\b", noun)):
        return False
    if re.search(r"\bnon[- ]$", before):
        return False if _OTHERWISE.match(after) else None
    if asks(sentence) or _REMOVED.search(_clause(sentence, match.start())):
        return None
    if match[0] in _CHOSEN and _is_of_one(before, sentence[match.end() :]):
        return False
    if re.search(r"\bfor (?:[\w']+ )?$", before) and (people or not noun):
        return bool(re.search(rf"\b(?:{MEAL}|mak\w+|cook\w*|bak\w+|host\w*)\b", before)) or None
    if noun:
        whole = whole or any(match[0] in thing for thing in made(before + match[0]))
        return True if whole and not _NOT.search(_clause(sentence, match.start())) else None
    stated = _STATED.search(before)
    if not stated:
        part = sentence
        if match[0].endswith("free"):
            end = sentence.find(",", match.end())
            part = sentence[sentence.rfind(",", 0, match.start()) + 1 : end if end >= 0 else None]
            part = _REASON.sub("", part)
        whole = len(sentence) < 100 and _WHOLE.fullmatch(part)
        denied = re.search(
            r"\bnot\b(?! only| just)|\bno longer\b", _clause(sentence, match.start())
        )
        return not denied if whole else None
    one = of_some and re.fullmatch(rf"he|she|{_PERSON}|(?!{_US}$)\w+", stated["subject"])
    if match[0] in _CHOSEN and (one or _SOME.search(before[: stated.end("subject")])):
        return None
    none = _NONE.search(before, 0, stated.start("subject"))
    if none or _NOBODY.match(stated["subject"]):
        people = _NOBODY.search((none or stated)[0]) or _PEOPLE.fullmatch(stated["subject"])
        plain = people and not re.search(r"\bnot\b|n't\b", stated[0])
        if plain and _BUT_ONE.match(after):
            return True
        return False if plain and not _BUT.match(after) else None
    if not re.search(r"\bnot\b|n't\b|\bno longer\b|\bnothing\b", stated[0]):
        return True
    waiving = re.search(r"\bhave to|need|necessarily|no longer|not (?:every|all)", stated[0])
    return False if waiving or stated["subject"] in ("i", "we", "it", "everything") else None
