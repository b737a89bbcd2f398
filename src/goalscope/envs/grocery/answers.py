"""Answers to a person's questions about stock, prices and the basket."""

from __future__ import annotations

import re
from collections import Counter
from itertools import takewhile

from goalscope.envs.grocery.amounts import CONTAINER
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.choosing import called, is_vague
from goalscope.envs.grocery.hearing.diets import hinted, undieted
from goalscope.envs.grocery.hearing.limits import budget
from goalscope.envs.grocery.restrictions import ALLERGIES
from goalscope.envs.grocery.suiting import (
    DEPTH,
    IN_BASKET,
    IN_THIS,
    THE,
    Bounds,
    Stock,
    names,
    suits,
)
from goalscope.envs.grocery.words import NO_GOODS, contains, singulars
from goalscope.envs.speech import LEAD, evened
from goalscope.types import counted

__all__ = ["answered"]

_NAMED = 5
"""Items that an answer names at most."""

_NEAR = 0.52
"""Cosine from which on what is found is told to be near."""

_AISLES_NAMED = 30
"""Aisles that an answer names at most."""

_LETTERS = 4
"""Letters from which on two words begin alike."""


_BASKET = re.compile(
    rf"{LEAD}(?:what(?:'s| is| do (?:i|we|you) have| have (?:i|we|you) got| have you added"
    r"| did you (?:add|put))"
    rf"(?: now| currently| so far)? {IN_BASKET}"
    r"(?!.*\b(?:guess|that|which|with|without|contain))[^.;!?]*"
    rf"|{LEAD}what (?:do (?:i|we) have|have (?:i|we) got)(?: (?:now|currently|so far|already))*"
    rf"|{LEAD}what (?:did|have) (?:you|i|we)(?: already| just)?"
    r" (?:add(?:ed)?|put in|get|got|buy|bought|order(?:ed)?|asked? for)"
    r"(?: (?:now|so far|already|for (?:me|us)))*"
    r"|(?:can|could|may) (?:i|we|you) (?:see|show(?: me)?|read(?: me)?|list) (?:the|my) "
    r"(?:basket|cart).*|is (?:the|my) (?:basket|cart) empty)"
)
_TOTAL = re.compile(
    rf"{LEAD}(?:(?:what(?:'s| is)|how much is|how much are) (?:the|my) (?:grand )?"
    r"(?:total|sum|bill|basket|cart|order)(?: (?:price|cost|so far|now|total))*"
    r"|how much (?:is|does|do|will|would|are)"
    r" (?:it|this|that|these|those|they|everything|all of (?:it|this|that|them)|i)"
    r"(?: all)?(?: together)?(?: (?:cost|come to|be|owe))?"
    r"(?: (?:in total|altogether|so far|now|me|all))*"
    r"|what (?:does|do|will|would) (?:it|this|that|everything|all of (?:it|this|that))(?: all)?"
    r" (?:come to|cost|add up to)(?: (?:in total|altogether|so far|now))*"
    r"|how much (?:have|did) (?:i|we|you) spen[dt](?: (?:in total|altogether|so far|now|already))*"
    r"|how much (?:is it |so far |in all )?(?:now|so far|in total|altogether)"
    r"|how much(?: (?:of )?(?:(?:the|my|our) )?(?:money|budget))?"
    r" (?:is|do (?:i|we) have|have (?:i|we) got) left"
    r"(?: (?:to spend|(?:in|of|from) [^.;!?]{1,30}))?"
    r"|what(?:'s| is) left (?:in|of|from) (?:the|my|our) budget"
    r"|(?:am|are) (?:i|we) (?:over|under|within|above|below) (?:the |my |our )?budget"
    r"|(?:is|are|am) (?:it|this|that|everything|we|i|all of (?:it|this|that)"
    r"|(?:the|my|our) (?:whole )?(?:total|sum|bill|basket|cart|order))"
    r"(?: now| still| all| already)*"
    r" (?:under|below|over|above|within|less than|more than|at most|cheaper than)"
    r" (?:(?:the|my|our) (?:budget|limit)|[$\u20ac\u00a3]?\d[\d.,]*(?: ?[a-z\u20ac\u00a3]+)?)"
    r"(?: (?:in total|altogether|so far|now|all))*)"
)
_IF_WITHOUT = re.compile(
    rf"{LEAD}(?:how much|what) (?:is|would|will|does)"
    r" (?:it|that|this|everything|the total|the rest)"
    r"(?: all)?(?: be| cost| come to)? (?:without|minus|less) (?:the |my |any )?(?P<what>.+)"
)
_AND_BUDGET = re.compile(r",? (?:and|but) (?:what|how|am i|is (?:it|that))\b[^.;!?]*\bbudget$")
"""Behind a question for the total, whose answer tells of the budget, too."""
_INSTEAD = re.compile(r" (?:instead of|rather than|in place of) .+$")
_PRICE = re.compile(
    rf"{LEAD}(?:how much (?:is|are|does|do|would|will|for) {THE}([^,;]+?)(?: cost| be)?"
    rf"|what (?:does|do) {THE}(.+?) cost|what(?:'s| is) the (?:price|cost) (?:of|for) {THE}(.+?))"
)
_HELD = re.compile(
    rf"{LEAD}(?:is|are) (?:there )?{THE}(.+?) (?:already )?{IN_BASKET}(?: now| already| yet)?"
    rf"|{LEAD}does (?:the|my) (?:basket|cart) (?:hold|have|contain|include) {THE}(.+?)"
    r"(?: now| already| yet)?"
)
_YOU_GOT = r"(?:did|have) you (?:add|get|got|pick|choose|chosen|take|taken|order)(?:ed)?"
_GOT = re.compile(
    rf"{LEAD}(?:(?:do|did) (?:i|we) (?:already )?(?:have|get|order)|have (?:i|we)(?: already)?"
    rf" (?:got|ordered)|(?:did you|have you)(?: already)? (?:add|put|added)) {THE}(?P<one>.+?)"
    rf"(?: (?:now|already|yet|so far|{IN_BASKET}))*"
    rf"|{LEAD}how (?:many|much) (?:{CONTAINER} of )?(?P<many>.+?) (?:(?:do|did|have) (?:i|we)"
    rf"(?: (?:have|get|got|order|ordered))?|{_YOU_GOT}|(?:is|are) (?:there )?{IN_BASKET})"
    rf"(?: (?:now|already|yet|so far|{IN_BASKET}))*"
    rf"|{LEAD}(?:which|what)(?: (?:kind|sort|type) of)? (?P<kind>.+?) (?:(?:is|are)"
    rf" (?:it|that|they|those|these)|{_YOU_GOT})"
)
_HELP = re.compile(
    rf"{LEAD}(?:help(?: me)?|what (?:else )?(?:can|do) you do(?: for (?:me|us))?"
    r"|how (?:can|do) you help(?: me| us)?|what can (?:i|we) (?:do|say|ask)(?: here)?(?: you)?"
    r"|how (?:does (?:this|it)|do you|do i use (?:this|you)) ?(?:works?)?)"
)
_AISLES = re.compile(
    rf"{LEAD}(?:what (?:all )?(?:do you|does (?:the|this) shop|can you)"
    r" (?:sell|have|offer|stock|carry)(?: here)?"
    r"|what(?:'s| is) (?:there|in (?:the|your) (?:shop|store)|on offer|available)"
    r"|what can (?:i|we) (?:buy|get|order)(?: here)?"
    r"|(?:what|which) (?:aisles|categories|departments"
    r"|(?:kinds?|sorts?|types?) of (?:things|products|items|food|groceries))"
    r" (?:do you have|are there|do you sell|is there)"
    r"|(?:can you )?(?:show|list|name)(?: me)? (?:the|your|all(?: the)?) (?:aisles|categories))"
)
_RULES = (
    r"(?:allerg(?:y|ies)|diets?|(?:dietary )?(?:restrictions?|needs|preferences)|intolerances?)"
)
_BOUNDS = re.compile(
    rf"{LEAD}(?:what|which) (?:are |is )?(?:my |our |the )?{_RULES}"
    r"(?: (?:do you (?:know(?: of| about)?|have|remember|follow|heed)|did (?:i|we) (?:tell you|say"
    r"|mention|name)|have (?:i|we) (?:told you|named|mentioned)|are you (?:following|heeding"
    r"|considering|minding|keeping in mind)))?(?: (?:of|about|so far|now|again))*"
    rf"|{LEAD}(?:do you (?:know|remember)|have you (?:noted|got)) (?:about )?(?:my|our|the|his|her)"
    rf" (?:[\w-]+'s )?{_RULES}"
    rf"|{LEAD}what (?:can't|can not|cannot) (?:i|we|he|she|they|(?:my|our) [\w-]+) (?:eat|have)"
    r"|what (?:did|have) (?:i|we) (?:say|said|told you|tell you) (?:that )?(?:i|we|he|she|they"
    r"|(?:my|our) [\w-]+) (?:can't|can not|cannot|couldn't) (?:eat|have)"
)
"""Asks which restrictions were heard."""
_CHEAPEST = re.compile(
    rf"{LEAD}(?:(?:which|what)(?: one)?(?: of (?:them|those|these))?(?:'s| is| are)(?: the| your)?"
    r" (?:cheapest|least expensive)(?: ones?\b)?(?: (?:of )?(?:the )?(.+?))??"
    r"|(?:which|what) (?!one\b|of\b)(.+?) (?:is|are) (?:the )?(?:cheapest|least expensive)"
    rf"|(?:is|are) there (?:any |a |an |some )?cheaper (.+?)"
    r"|do you have (?:any |a |an |some )?cheaper (.+?)"
    r"|(?:is there|do you have) (?:anything|something) cheaper"
    r"(?: than (?:the |my )?(?:[\w'-]+ ){0,4}([\w'-]+))?)"
    r"(?: (?:you (?:have|sell)|do you have|there is|in stock|available))?"
)
_DEAREST = re.compile(
    rf"{LEAD}(?:which|what)(?: one| of (?:them|those|these))?(?:'s| is| are| was) (?:the|your|my)"
    r" (?P<end>(?:cheapest|least expensive)(?= \w)|most expensive|dearest|priciest|costliest)"
    rf"(?: (?:things?|items?|products?|ones?(?= in )))?(?: {IN_THIS})?"
)
"""Asks for what is dearest or cheapest in the basket."""
_STOCK = re.compile(
    rf"{LEAD}(?:(?:what|which)(?: (?:kinds?|sorts?|types?|brands?|varieties) of)? (.+?) "
    r"(?:do|have|can|are) (?:you|there)(?: (?:have|got|sell|offer|carry|stock|recommend"
    r"|guys have))*"
    rf"|(?:do|can) you (?:(?:also |even |still )?(?:have|sell|carry|stock|offer)) {THE}(.+?)"
    rf"|have you(?: got)? {THE}(.+?)|(?:is|are) there {THE}(.+?)"
    rf"|(?:got )?any (?!{NO_GOODS}\b"
    r"|[^.;!?]* in (?:the|my|it|them|this|that|here|there)\b)([^.;!?]+)"
    r"|what do you have (?:in|for|by way of|in the way of) (.+?))"
    r"(?: in stock| available| here| left| there| today| on offer"
    r"| in (?:the|your|this) (?:shop|store))*"
)


_NOT_STOCK = re.compile(
    r" in (?:it|them|this|that|these|those)$"
    r"|(?:what|which) (?:\w+ )?(?:flavou?rs?|sizes?|brands?|colou?rs?|kinds?|types?)\b(?! of)"
)
"""Ends a question about what things hold or come in, which names and prices do not tell."""


def answered(question: str, shop: Stock, bounds: Bounds, before: str = "") -> str | None:
    """The answer to `question`, or None where it is no question about stock or basket.

    Args:
        question: What is asked.
        shop: What it is answered from.
        bounds: What the basket has to be.
        before: What was asked before, of which "those" may be.
    """
    text = _AND_BUDGET.sub("", evened(question)[:300].rstrip(" ?!."))
    stated, _, rest = text.partition(", ")
    text = rest if rest and budget(stated) is not None else text
    if (match := _IF_WITHOUT.fullmatch(text)) and (told := _without(match["what"], shop)):
        return told
    if _BASKET.fullmatch(text):
        return shop.status()
    if _HELP.fullmatch(text):
        return (
            "I find groceries, fill your basket, change it, and tell prices. Say what you need, "
            "what you plan, what you do not eat, and what it may cost. "
            f'To have the basket bought, say "{shop.completion_phrase}".'
        )
    if _AISLES.fullmatch(text):
        return _aisles(shop)
    first, _, last = text.rpartition("? ")
    if (match := _DEAREST.fullmatch(last)) and (told := _extreme(match["end"], shop)):
        return told
    if match := _CHEAPEST.fullmatch(last):
        term = next(filter(None, match.groups()), "")
        about = _STOCK.fullmatch(first or evened(before)[:300].rstrip(" ?!."))
        return _cheapest(term or (next(filter(None, about.groups())) if about else ""), shop)
    if _BOUNDS.fullmatch(text):
        return _bound(bounds, shop, allergies=bool(re.search("allerg|intoleran", text)))
    if told := suits(text, shop, bounds):
        return told
    if _TOTAL.fullmatch(text):
        return f"The total is {shop.catalogue.money(shop.total)}{_left(bounds, shop)}."
    if match := _HELD.fullmatch(text):
        return _held(match[1] or match[2], shop)
    if (match := _GOT.fullmatch(text)) and (told := _got(match, shop)):
        return told
    if match := _PRICE.fullmatch(text):
        return _offered(next(filter(None, match.groups())), shop)
    if (match := _STOCK.fullmatch(_INSTEAD.sub("", text))) and not _NOT_STOCK.search(text):
        return _offered(next(filter(None, match.groups())), shop)
    return None


def _offered(terms: str, shop: Stock) -> str:
    """The items that are one of `terms`, with prices; or the nearest ones, said to be such."""
    told = [_offered_of(each, shop) for each in re.split(r",? or (?:any |some )?", terms)]
    has = [each for each in told if not each.startswith("The shop has nothing")]
    return " ".join(dict.fromkeys(has)) or told[0]


def _offered_of(term: str, shop: Stock) -> str:
    labels = hinted(term) | ({"organic"} & {*singulars(term)})
    asked_by_label = labels and is_vague(undieted(term))
    if fit := [i for i in shop.catalogue.items if labels <= i.tags] if asked_by_label else []:
        some = "; ".join(item.name for item in fit[:_NAMED])
        named = f"labelled as {' and '.join(sorted(labels))}"
        return f"The shop has {counted(len(fit), 'thing')} {named}, such as {some}."
    found = shop.search(term, 2 * _NAMED)
    asked = singulars(term)
    exact = [item for item in found if contains(singulars(item.name), asked)]
    if len(asked) == 1:
        found.sort(key=lambda item: -_alike(item, asked[0]))
    if not found:
        return "The shop has nothing of that name."
    money = shop.catalogue.money
    listed = "; ".join(f"{i.name}, {money(i.price)}" for i in (exact or found)[:_NAMED])
    if exact:
        return f"The shop has {listed}."
    near = f" Near it: {listed}." if shop.nearness(term) > _NEAR else ""
    return f"The shop has nothing called that.{near}"


def _alike(item: Item, asked: str) -> int:
    """Letters that a word of the item's name begins with as the one asked for; 0 below 4."""
    pairs = [zip(asked, other, strict=False) for other in singulars(item.name)]
    same = max((sum(takewhile(bool, (a == b for a, b in pair))) for pair in pairs), default=0)
    return same if same >= _LETTERS else 0


def _aisles(shop: Stock) -> str:
    aisles = Counter(item.category for item in shop.catalogue.items if item.category)
    if not aisles:
        names = "; ".join(item.name for item in shop.catalogue.items[:_NAMED])
        return f"The shop has {counted(len(shop.catalogue), 'item')}, such as {names}."
    named = ", ".join(aisle for aisle, _ in aisles.most_common(_AISLES_NAMED))
    more = ", and more" if len(aisles) > _AISLES_NAMED else ""
    return f"The shop sells: {named}{more}."


def _cheapest(term: str, shop: Stock) -> str | None:
    if not singulars(term):
        return 'Please say of what, as in "Which is the cheapest milk?".'
    near = shop.search(term, DEPTH)
    found = called(term, near) or called(singulars(term)[-1], near)
    priced = [(item.price, item.id, item.name) for item in found if item.price is not None]
    if not priced:
        return "The shop has nothing of that name with a price."
    price, _, name = min(priced)
    return f"The cheapest is {name}, {shop.catalogue.money(price)}."


def _extreme(end: str, shop: Stock) -> str | None:
    """What of the basket is at one end of the prices; None where it holds nothing with a price."""
    held = [item for name in shop.basket if (item := shop.catalogue.get(name))]
    priced = [(item.price, item.id, item.name) for item in held if item.price is not None]
    if not priced:
        return None
    price, _, name = min(priced) if end in ("cheapest", "least expensive") else max(priced)
    return f"In the basket the {end} is {name}, {shop.catalogue.money(price)}."


def _without(term: str, shop: Stock) -> str:
    """The total without what the basket holds by that name; "" where it holds no such thing."""
    held = [item for name in shop.basket if (item := shop.catalogue.get(name))]
    out = [item for item in called(term, held) if item.price is not None]
    rest = shop.total - sum((i.price or 0) * shop.basket[i.name] for i in out)
    return f"Without {names(out)} the total is {shop.catalogue.money(rest)}." if out else ""


def _left(bounds: Bounds, shop: Stock) -> str:
    """What a total leaves of the budget, if there is one."""
    if bounds.budget is None:
        return ""
    named, left = shop.catalogue.money(bounds.budget), bounds.budget - shop.total
    if left < 0:
        return f", {shop.catalogue.money(-left)} above the {named} that you named"
    return f", which leaves {shop.catalogue.money(left)} of the {named} that you named"


def _bound(bounds: Bounds, shop: Stock, *, allergies: bool) -> str:
    """What the basket has to be, by what was said; of allergies also that none was named."""
    told: list[str] = []
    if bounds.harmful:
        told.append(f"Nothing comes in that is called {' or '.join(bounds.harmful)}.")
    elif allergies and not (bounds.refused or ALLERGIES & (bounds.diets | bounds.some)):
        told.append("I heard of no allergy.")
    if bounds.diets:
        told.append(f"By what you said it has to be {' and '.join(sorted(bounds.diets))}.")
    if bounds.some:
        told.append(
            f"Only some are {' and '.join(sorted(bounds.some))}: what I guess will be, too."
        )
    if bounds.budget is not None:
        told.append(f"It may cost {shop.catalogue.money(bounds.budget)}.")
    if left_out := [each for each in bounds.refused if each not in bounds.harmful]:
        told.append(f"You do not want: {', '.join(left_out)}.")
    return " ".join(told) or "I heard of nothing that it has to be. Please say what it is."


def _got(match: re.Match[str], shop: Stock) -> str | None:
    """What of a thing the basket holds; None where the shop has nothing of that name."""
    term = next(filter(None, match.groups()))
    if is_vague(term) or not called(term, shop.search(term, DEPTH)):
        return None
    told = _held(term, shop)
    if match["kind"] and told.startswith("No"):
        return None
    return told.replace("Yes: ", "The basket holds ") if not match["one"] else told


def _held(term: str, shop: Stock) -> str:
    asked = singulars(term)
    held = [f"{n} x {name}" for name, n in shop.basket.items() if contains(singulars(name), asked)]
    return f"Yes: {'; '.join(held)}." if held else "No, the basket holds nothing of that name."
