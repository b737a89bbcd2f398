"""What a person says about guesses, and about how much all of it may cost."""

from __future__ import annotations

import re
from decimal import Decimal

from goalscope.envs.grocery.amounts import WORD, number
from goalscope.envs.speech import evened

__all__ = ["budget", "conditions", "guesses", "limits_of_things", "unlimited", "wants_ideas"]

_CLOSE = r"(?=\s*(?:[.,;!?]|$|\b(?:and|but|please|thanks|thank you|for now|today|at all|then)\b))"
_NEGATED = re.compile(
    r"(?:\b(?:no|not|never|without|stop|enough|why|who|quit|did|i asked)|n't)\b[^.,;!?]{0,25}$"
)
_IDEAS = re.compile(
    r"\b(?:surprise (?:me|us)|inspire (?:me|us)|suggest(?:ions?|ing)?|recommend(?:ations?|ing)?"
    r"|ideas?|inspiration|what else|anything else (?:i|we|you|that)|what (?:am i|are we) missing"
    r"|what (?:would|should|could|might|can) (?:i|we|go|fit|be (?:good|nice)|pair|match)"
    r"|what (?:goes|pairs|works|fits)\b|what to (?:cook|make|eat|serve|buy|get|have|drink)"
    r"|(?:pick|choose|decide|guess) (?:for (?:me|us)|something|some|anything|the rest|whatever)"
    r"|you (?:pick|choose|decide)|(?:it's )?up to you|whatever you (?:like|think|want))\b"
)
_OUGHT = r"(?:i|we)(?:'ve| have)?(?: (?:explicitly|actually|really))?"
_NAMING = (
    r"(?:ask|say|said|tell|told|want|order|request|mention|need|name|list|pick|choose|chosen|agree)"
)
_UNASKED = (
    rf"(?:(?: (?:that|which|what|unless|before|if|when))? (?:{_OUGHT}"
    r"(?: (?:(?:do|did|have|had)(?: not|n't)|not|never)(?: (?:really|ever|even))?)?"
    rf" {_NAMING}|(?:nobody|no one) {_NAMING})"
    r"| (?:on your own|by yourself|unasked|extra|at random|without (?:asking|me|my|being)))"
    r"(?:(?!\b(?:like|such as|with|containing|because|and|but|or|no)\b)[^.,;!?])*+"
)
_THINGS = r"(?:anything|things|stuff|items|extras?|products|whatever|what)"
_STOPS = re.compile(
    rf"\b(?:stop|quit|no more) (?:adding|putting(?: in)?|buying|throwing in|inventing|assuming)\b"
    rf"(?: in)?(?: (?:all|random|other|more|any|these|those|this|that|your|my|extra|so|much"
    rf"|many))*(?: {_THINGS}\b(?:{_UNASKED})?|(?: to)? (?:the|my|our) (?:basket|cart)\b|{_CLOSE})"
    rf"|(?:n't|\bnot|\bnever)(?: (?:just|ever|keep))* (?:add(?:ing)?|put|get|buy|include|order)"
    rf"(?: in)? (?:(?:other|more|any|random|extra) )*{_THINGS}"
    rf"(?: (?:to|in) (?:the|my|our) (?:basket|cart))?"
    rf"(?: (?:else|more)\b{_CLOSE}|{_CLOSE}|{_UNASKED})"
    r"|\b(?:only|just) (?:add|put in|put|get|buy|include|order|give me|do|stick to) (?:exactly )?"
    rf"(?:(?:the )?(?:things|items|stuff)(?: that)?|exactly what|what|that which) {_OUGHT}"
    r" (?:ask|tell|told|say|said|order|request|mention|name|list)(?:ed)?\b(?: you)?(?: for| to)?"
    rf"|\byou (?:keep|kept|are always|always)(?: on)? (?:adding|add)(?: (?:more|random|all|so|much"
    rf"|many|the|these|other))* {_THINGS}\b(?:{_UNASKED})?"
    r"|\badd nothing\b(?! (?:with|containing|made|but))"
    r"|(?:n't|\b(?:not|never|no|stop|quit|without|no more)) (?:guess|guesses|guessing)\b"
    r"|(?:^|(?<=[.,;!?] )|(?<=\band )|(?<=\bbut )|(?<=\bsaid ))"
    rf"(?:nothing (?:else|more|extra)|no extras){_CLOSE}(?! but)"
)

_FIGURE = (
    r"(\d{1,3}(?:,\d{3})+|\d{1,6}(?:[.,]\d{1,2})?"
    rf"|(?!(?:an?|of|and|half|few|couple|pair|several)\b){WORD}(?:[ -]{WORD})?)(?![\w%])"
)
_SIGN = r"(?:[$\u20ac\u00a3]|\b(?:usd|eur|gbp) ?)"
_COIN = r" ?(?:(?:dollars?|bucks?|euros?|eur|usd|gbp|quid)\b|[$\u20ac\u00a3])"
_ALL = (
    r"(?:everything|all(?: of (?:it|this|that))?|it all|this|food|groceries|shopping"
    r"|(?:the|my|this|our) (?:whole |entire )?(?:basket|cart|order|thing|shopping|groceries))"
)
_END = (
    rf"(?=\s*(?:[.,;!?]|$|\b(?:please|in total|total|altogether|overall|max|maximum|tops|at most"
    rf"|at the most|or (?:so|less)|and|but|so|today|this week|thanks|if|because|i|we|in all"
    rf"|(?:on|for) {_ALL})\b))"
)
_SUM = rf"{_SIGN}?{_FIGURE}(?:{_COIN}| pounds?\b)?{_END}"
_PRICED = rf"(?:{_SIGN}{_FIGURE}(?:{_COIN})?|{_FIGURE}{_COIN}){_END}"
_MOST = (
    r"(?:under|below|within|at most|(?:(?:no|not|never) )?(?:more|higher) than|(?:less|lower) than"
    r"|not (?:over|above)|no(?:t)? over|up to|max(?:imum)?(?: of)?)"
)
_SMALL = (
    r"(?:(?:i|we|i'd|we'd|i'm|we're|i'll|we'll|please|do|don't|doesn't|not|never|want|wants|like"
    r"|can|can't|could|couldn't|would|wouldn't|won't|will|should|shouldn't|must|mustn't|may|only"
    r"|really|just|able|willing|going|am|are|have|rather|prefer|let's|try|need|to|so|also|ok|okay"
    r"|you|actually|that|the|my|our|is|be|now|then) )*+"
)
_WHOLE = (
    r"(?:(?:the |my |our )?(?:(?:grand )?total|sum|bill|(?:whole |entire )?(?:basket|cart|order))"
    r"|everything|all of (?:it|this))"
)
_STARTS = "|".join(
    rf"(?<=\b{word} )"
    for word in (
        *("and", "but", "so", "bbq", "barbecue", "dinner", "lunch", "breakfast", "party"),
        *("picnic", "meal", "brunch", "groceries", "shopping", "food", "everything", "people"),
        *("guests", "kids", "week", "weekend", "please", "stuff", "things", "all"),
    )
)
_START = rf"(?:^|(?<=[.,;!?] )|{_STARTS})"
_LIMIT = rf"(?:{_MOST} {_PRICED}|{_PRICED}(?: |, )(?:max|maximum|tops|at (?:the )?most|or less)\b)"
_BUDGET = re.compile(
    rf"\b{_SMALL}(?:(?:on|with|within|for|at) )?(?:(?:an?|my|our|the) )?(?:spending |price )?"
    r"(?:budget|limit)(?:'s)?(?: (?:for \w+ )?(?:is|of|was|will be|would be|should be|stays?|at|to"
    rf"|today|about|around|only|now|just|strictly|{_MOST}))*:? {_SUM}"
    rf"|\b(?:on |with |within )?(?:an? |my |our )?{_SIGN}?{_FIGURE}(?:{_COIN})?"
    r" (?:budget|spending limit)\b"
    rf"|\b{_SMALL}(?:spend|pay|spending|paying)(?: (?:anything|any|much|a|penny|cent|only|just"
    rf"|about|around|{_MOST}|over|above))* {_SUM}"
    r"|\b(?:please )?(?:keep|stay|remain|leave|bring|get|hold)"
    r"(?: (?:it|this|that|things|all|down|to|well|in|the|my|price|cost|costs"
    rf"|at|us|me|somewhere|{_WHOLE}))* {_MOST} {_SUM}"
    rf"|\b{_WHOLE}(?: (?:should|must|may|can|has|have|to|is|be|stay|cost|come|comes|remain"
    rf"|in|needs?|at|not|n't|go))* {_MOST} {_SUM}"
    r"|(?:n't|\b(?:not|never))(?: want)?(?: it| us)?(?: to)?"
    rf" (?:exceed|(?:go|get|be|come) (?:over|above|beyond)) {_SUM}"
    rf"|\b(?:limit|cap) (?:it|this|everything|{_WHOLE}) (?:to|at) {_SUM}"
    rf"|\bif (?:it|that|this|{_WHOLE})(?:'s| is| stays?| costs?| comes? to)"
    rf"(?: (?:all|still|in total))* {_MOST} {_SUM}"
    rf"|(?:{_START}(?:for )?|(?<=\bsnacks )){_LIMIT}"
    rf"|{_START}(?:i|we)(?:'ve(?: got)?|(?: only| just)? (?:have|got))"
    rf"(?: (?:only|just|about|around|got))* {_PRICED}(?: (?:to spend|left|on me|with me|only))*"
)
_ONLY_IF = re.compile(
    rf"(?<=\w),? (?:but )?only if (?:they're|they are|they cost|those are) {_MOST} {_PRICED}"
)
"""Behind a thing that is not wanted at a higher price."""
_OF_ONE = re.compile(rf"(?<=\w) (?:for )?{_LIMIT}")
_BARE = re.compile(rf"(?:for )?{_LIMIT}")
_ONE_THING = re.compile(
    r"(?:^|\b(?:want|need|add|get|buy|like|have|me|us) )(?:an?|some|one|another) "
)
"""Names one thing: a limit that follows is that of the thing."""
_OCCASION = re.compile(
    r"\b(?:part(?:y|ies)|bbq|barbecue|dinner|lunch|breakfast|brunch|supper|meals?|picnic|feast"
    r"|buffet|groceries|shopping|food|stuff|things|bits|week|weekend|basket|ingredients|guests|friends"
    r"|people|everything|all)\b"
)
_DISH = re.compile(
    r"\b(?:curr(?:y|ies)|lasagn[ae]|chilli?|stews?|casseroles?|stir[ -]?fry|risotto|paella|roast"
    r"|soup|goulash|ratatouille|moussaka|bolognese|carbonara|fajitas?|enchiladas?|burritos?|tacos?"
    r"|salad|ramen|biryani|fondue|stroganoff|gumbo|jambalaya|quiche|tagine"
    r"|lunches|snacks|drinks|shop|tonight|tomorrow)\b"
    r"(?! (?:powder|paste|sauce|leaves|shells?|mix|dressing|spice|seasoning)\b)"
)
"""What is cooked of several things, or a time to eat: a limit that follows is a budget."""
_NO_THING = re.compile(
    rf"{_OCCASION.pattern}|{_DISH.pattern}"
    r"|\b(?:if|it|this|that|they|is|are|be|was|costs?|stays?|keep|price|total)\b"
)
_NO_BUDGET = re.compile(
    r"\b(?:never mind|forget(?: about)?|ignore|drop|lift|remove|scrap|no|without|there is no"
    r"|(?:do not|don't) (?:care about|mind))(?: (?:the|my|our|that|any|a))*"
    r" (?:spending |price )?(?:budget|limit)(?: limit)?\b(?! (?:is|of) )"
    r"|\b(?:the |my )?(?:budget|price|money|cost) (?:is no object|(?:doesn't|does not) matter)"
)


def wants_ideas(utterance: str) -> bool:
    """Whether a person wants to be told or given what they do not name: "surprise me"."""
    text = evened(utterance)
    return any(not _negated(text, found) for found in _IDEAS.finditer(text))


def guesses(utterance: str, before: bool = True) -> bool:
    """Whether things may be guessed after `utterance`, as they might, or might not, `before`."""
    text = evened(utterance)
    said = [(found.start(), _negated(text, found)) for found in _IDEAS.finditer(text)]
    stops = [(found.start(), True) for found in _STOPS.finditer(text)]
    asked_why = any(re.match(r".*\b(?:why|who|did)\b", text[:at]) for at, no in said if no)
    said = [(at, no) for at, no in said if not (no and asked_why)]
    return not max([*said, *stops])[1] if said or stops else before


def budget(utterance: str, before: Decimal | None = None) -> Decimal | None:
    """What all may cost after `utterance`, in the shop's currency, given what it might `before`."""
    text = evened(utterance)
    told = [each for each in _BUDGET.finditer(text) if not _is_of_one(text, each)]
    told += [each for each in _OF_ONE.finditer(text) if _OCCASION.search(_piece(text, each))]
    found = [(each.start(), _sum(each)) for each in told]
    lifted = [(each.start(), None) for each in _NO_BUDGET.finditer(text)]
    return max([*found, *lifted], key=lambda each: each[0])[1] if found or lifted else before


def limits_of_things(utterance: str) -> list[tuple[str, Decimal]]:
    """What single things may cost by `utterance`: words that name each, and the most for it."""
    text = evened(utterance)
    found = [each for each in _BUDGET.finditer(text) if _is_of_one(text, each)]
    found += _OF_ONE.finditer(_BUDGET.sub(lambda match: " " * len(match[0]), text))
    pieces = [(_piece(text, each), _sum(each)) for each in found]
    return [(piece, most) for piece, most in pieces if piece and not _NO_THING.search(piece)]


def conditions(utterance: str) -> list[tuple[str, Decimal]]:
    """What is wanted only below a price: words that name each thing, and the most for it."""
    text = evened(utterance)
    return [(_piece(text, each), _sum(each)) for each in _ONLY_IF.finditer(text)]


def unlimited(text: str) -> str:
    """`text`, evened, without what it says of prices and of guesses."""
    text = _ONLY_IF.sub("", text)
    for pattern in (_BUDGET, _NO_BUDGET, _STOPS):
        text = pattern.sub(" . ", text)
    return _OF_ONE.sub("", text)


def _is_of_one(text: str, limit: re.Match[str]) -> bool:
    piece = _piece(text, limit)
    named = _ONE_THING.search(piece) and not (_OCCASION.search(piece) or _DISH.search(piece))
    return bool(named and _BARE.fullmatch(limit[0]))


def _piece(text: str, limit: re.Match[str]) -> str:
    """What a limit stands behind, of what is listed."""
    before = re.split(r"[.;!?]", text[max(0, limit.start() - 100) : limit.start()])[-1]
    return re.split(r",|\band\b|\bplus\b|\bor\b", before.rstrip(" ,"))[-1].strip()


def _sum(match: re.Match[str]) -> Decimal:
    said = next(filter(None, match.groups()))
    if said[0].isdigit():
        return Decimal(re.sub(r",(?=\d{3}\b)", "", said).replace(",", "."))
    return Decimal(str(number(said)))


def _negated(text: str, found: re.Match[str]) -> bool:
    return bool(_NEGATED.search(text[max(0, found.start() - 40) : found.start()]))
