"""Whether words say exactly what is to be done, or leave something to be guessed from them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

from goalscope.envs.grocery.amounts import PACKS, WORD, Request
from goalscope.envs.grocery.hearing.diets import MEAL, diet
from goalscope.envs.grocery.hearing.limits import unlimited, wants_ideas
from goalscope.envs.grocery.hearing.moods import Mood
from goalscope.envs.grocery.hearing.requests import (
    Refusal,
    besides_refused,
    clears,
    pieces,
    removed,
    spared,
    unwanted,
)
from goalscope.envs.grocery.hearing.rewording import heard, unreasoned
from goalscope.envs.grocery.hearing.unasked import unasked
from goalscope.envs.grocery.restrictions import DIETS
from goalscope.envs.grocery.words import made
from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import declines, evened

__all__ = [
    "BEYOND",
    "adds_it",
    "besides_buying",
    "buys_changed",
    "buys_it",
    "had_too",
    "has_aim",
    "is_order",
    "leaves_open",
    "so_many",
    "states_aim",
    "tries_to_buy",
]

_AIM = re.compile(
    rf"\b(?:for|having|hosting|have|to) (?:[\w'-]+ ){{0,3}}{MEAL}s?\b"
    rf"|\b(?:\d+|(?!(?:an?|of|and)\b){WORD}) (?:\w+ )?"
    rf"(?:people|persons|guests|kids|children|adults|friends|of us)\b"
    r"|\b(?:serves?|feeds?|feeding|to go with)\b"
    r"|\b(?:friends|guests|people|family) (?:over|round|coming)\b"
)
_NO_AIM = re.compile(
    rf"\b(?:not|isn't|no) (?:(?:a|an|the|for|my|our|any) )*(?:\w+ )?{MEAL}s?\b"
    r"|\b(?:guests?|friends|visitors?|people|kids) (?=(?:(?:is|are|has|have|eats?) |can't|cannot"
    r"|doesn't|don't))"
)
"""Denies an occasion, or tells of guests what they do not eat."""
_OCCASION = re.compile(
    rf"\b(?:(?:some|any)thing(?! cheaper)|snacks?|treats?|ingredients|birthdays?|parties|{MEAL}s?"
    r"|guests?|friends|visitors?|celebrat\w+|holidays?|occasion|hungry|craving|in the mood"
    r"|(?:want|like|love|need|have|going|plan(?:ning)?) to (?!(?:add|ask|be|buy|call|cancel|change"
    r"|check|delete|drop|get|go|have|keep|know|leave|order|pay|purchase|put|remove|return|see|speak"
    r"|stop|take|talk|think|undo|wait)\b)\w+"
    r"|(?:i|we|they|you|he|she|everyone|everybody|nobody|[a-z]+s?) (?:(?:really|all|both|also) )?"
    r"(?:love|like|enjoy|prefer|fancy|crave)s?)\b"
)
_CALLS_OFF = re.compile(
    r"\b(?:cancel(?:led|ling|ing|s)?|undo(?:ne|ing)?|revert|abort|never ?mind|scrap|no need"
    r"|forget (?:it|that|this|about)|(?:take|took|put) (?:it|that|this|them|those) back|go back"
    r"|chang(?:ed?|ing) (?:my|our) minds?|not (?:yet|now|ready|done)|\w+n't (?:ready|done)"
    r"|hold (?:on|off)|wait|anything cheaper)\b"
)
BEYOND = re.compile(
    r"(?:^|(?<=[.,;!?] )|(?<=\band )|(?<=\bthen ))(?:please )?"
    r"((?:deliver|ship|wrap (?:it|them|that|everything)|(?:call|text|email) (?:me|us)|charge|redeem"
    r"|apply|use (?:my|the|a|this) (?:card|coupon|voucher|points|code|discount))\b[^.,;!?]*)"
)
"""What this shop does for nobody, as in "add milk, and deliver it by noon"."""
_OPEN = re.compile(
    r"\b(?:stuff|everything|whatever|groceries|bits|things)(?: \w+){0,2} (?:for|with|under|we need"
    r"|i need|goes?)\b|\bweekly (?:shop|groceries)\b|\bfor \d{1,2}(?=[.,;!?]|$)"
)
_PUTS_OFF = re.compile(r"(?:n't|\bnot) (?:buy|order|pay|purchase|check ?out)\b")
_HOLDS_BACK = re.compile(
    r"\b(?:buy|buying|purchas(?:e|ing)|order|ordering|pay|paying)(?: for)? (?:(?:the|my|our|this"
    r"|that|whole) ){1,2}(?:basket|cart|order|bill)\b"
    r"|\bcheck(?:ing)? ?out\b(?! (?:the|our|my|some|what))"
    r"|\b(?:i|we)(?:'ve| have)? (?:only |just |already |never )?(?:said|meant|wanted|asked"
    r"|ordered|told)\b"
    r"|\b(?:keep|leave) (?:the|my|our|those|these|them)\b|\b(?:swap|exchange|replace)\b|\bback$"
    r"|\b(?:buy|purchase|order|pay for) (?:it|this|that|them|all of (?:it|them))\b"
    r"|\b(?:make|should be)\b.*\binstead\b"
)
_TAKES_OUT = re.compile(
    r"(?:(?:please|ok|okay|now|then|and|just|so|no|actually|can you|could you)[ ,]+)*"
    r"(?:(?:remove|delete|ditch|get rid of)\b|(?:take|chuck|kick) (?:[^\s.,;!?]+ ){0,6}?"
    r"(?:out|off|away)\b)"
)
_MADE = re.compile(r"(?!(?:it|that|this|them|those|these)\b)")
_EMPTY = re.compile(
    r"(?:[\W_]*\b(?:and|but|or|so|please|yes|yeah|yep|ok|okay|no|not|nope|now|then|actually|also"
    r"|too|instead|just|only|maybe|well|oh|hi|hello|hey|sorry|wait|thanks|thank you|again|all"
    r"|at all|else|any ?more|either|after all|the|a|an|my|our|some|of|in total|today|i|we"
    r"|you|he|she|they|it|still|hold on|hang on|do|does|am|is|are|be|i'm|we're|he's|she's|they're"
    r"|i've|we've|have|has|got|can|could|would|will|really|very|severely|who|one|someone|somebody"
    r"|because|since|as|must|should|to|me|us|in|that|this|there|with|let's|what|which|go|ahead"
    r"|ditto|dittos|dittwo|inplace|said|asked|told|changed|mind"
    r"|for (?:me|us|it|that|him|her|them|now|today))(?![\w']))*[\W_]*"
)
_PERSON = re.compile(
    r"(?:(?:and|but|so|because|since|as) )?(?:(?:my|our|the|his|her) (?:[\w'-]+ ){1,3}|\w+ )"
    r"(?:is|are|has|have|can|does|who|who is|really|just|also)?"
)
_TOLD = re.compile(
    r"[\s,]*(?:\w+ )?there is .*\b(?:already|at home|left|enough|plenty|in the (?:fridge|freezer"
    r"|house|pantry|cupboard))\b.*|\s*there is (?:still )?(?:some|one|it|them|lots)(?: (?:still"
    r"|left))?\W*"
    r"|.*\b(?:over|above|more than|beyond) [$\u20ac\u00a3]?\d.*"
    r"|.*\btoo (?:expensive|dear|costly)\b.*"
)
_WISH = re.compile(rf"\b(?:want|need|like|love|fancy|crave|plan|host|{MEAL})\b")
_TRY = re.compile(
    r"(?:(?:ok(?:ay)?|yes|yeah|yep|sure|please|now|then|so|well|and|i|we|want to|i'd like to"
    r"|you can|can you|could you|let's|go ahead and|i'll|we'll|i'm|done|ready to|that's (?:it|all)"
    r"|great|perfect|good|thanks|thank you|just|finished|happy to)[\s,.!]+)*+"
    r"(?:buy|purchase|order|pay|check ?out|take|get|confirm|complete|place|done)"
    r"(?:[\s,.!]+(?:it|this|that|them|these|those|all|now|please|everything|pay|buy|what's left"
    r"|the (?:order|rest|others?|purchase|basket|cart|bill)"
    r"|for|thanks|thank you|then|right away|immediately|today))*[\s.!?]*"
)
_YES = (
    r"(?:(?:yes|yeah|yep|sure|ok(?:ay)?|please|then|and|so|great|good|perfect|can you|could you"
    r"|do)[\s,.!]+)*+"
)
_TAKES = (
    r"(?:add|get(?: me)?|include|put in|throw in|i'd like|i want|(?:i|we)'ll (?:have|take)|give me)"
)
_ADD_IT = re.compile(
    rf"{_YES}(?:{_TAKES}|take) (?:(?<!(?<!'ll )take )(?:it|that|them)|that one|this one|one|some"
    r"|one of (?:them|those|these))(?:[\s,]+(?:please|then|too|as well|thanks|anyway|instead"
    r"|(?:to|in) (?:the|my) (?:basket|cart)))*[\s.!?]*"
)
_BUY_IT = re.compile(
    rf"{_YES}(?:buy|order|purchase) (?:it|that|them|one|some)(?:[\s,]+(?:please|then|too|thanks))*"
    r"[\s.!]*"
)
_HAVING = re.compile(
    r"(?:.*[.!] )?(?:(?:i|we)(?:'ve| have)(?: still)? already(?: got)?"
    r"|(?:i|we) (?:already|still) have"
    r"|(?:i|we)(?:'ve| have)(?: got)?"
    r"(?=.* (?:at home|in the (?:fridge|cupboard|pantry|freezer))\b))"
    r" [^.;!?]+[.!]*"
)
_AND_THIS = re.compile(
    r"(?!.*\bplease\b)(?:and |plus )([^.,;!?]{1,60}?),? (?:too|as well|also)[.!]*"
)
_JOINED = re.compile(
    r"(?:,? (?:and|then)|,)(?: (?:then|please|now|just))* (?=(?:buy|purchase|order|place|pay"
    r"|check ?out)\b)"
)
_ASKED_OR_LATER = re.compile(
    r"^(?:(?:ok(?:ay)?|so|and|then)[ ,]+)*(?:shall|should|can|could|may) (?:i|we|you) (?=buy"
    r"|order|pay|check)"
    r"|\b(?: ?(?:tomorrow|later|tonight|soon|next (?:week|month|time)|on \w+day|in (?:a|an|the) \w+"
    r"|(?:this )?(?:morning|afternoon|evening|weekend)|another (?:day|time)))+[\s.!]*$"
    r"|,?(?: but)? only if\b[^!?]*$"
)
_SO_MANY = re.compile(
    rf"{_YES}(?:make it )?(?P<takes>{_TAKES} )?(?P<number>\d+|(?!(?:of|and)\b){WORD})"
    rf"(?: {PACKS}| (?=of)|(?(takes)|(?!)))(?: ?of (?:it|them|those|these|that))?"
    r"(?:[\s,]+(?:please|then|thanks))*[\s.!?]*"
)
_BUYS_CHANGED = re.compile(
    r"(?:(?:ok|okay|yes|now|then|please|so|can you|could you)[ ,]+)*(?:buy|order|pay for)"
    r" (?:it|that|this|everything|all of it|(?:the|my) (?:basket|cart|order))"
    r"(?:,? but)? (?:without|except|not|no|take out|remove|leave out|add)\b"
)
_BUYS = re.compile(r"\b(?:buy|purchase|order|pay|check ?out|take (?:it|them|all|everything))\b")


def is_order(utterance: str, meant: Callable[[Request], bool]) -> bool:
    """Whether `utterance` holds nothing but orders, refusals, limits, questions and remarks.

    Args:
        utterance: What the person said, with exact names hidden.
        meant: Whether a request is for a thing of the shop, or for one that it has not.
    """
    rest = besides_buying(utterance)
    if utterance and not rest:
        return True
    text = unreasoned(evened(rest))
    if wants_ideas(rest) or _AIM.search(text) or any(map(_MADE.match, made(text))):
        return False
    told, known = unlimited(text) != text, cache(meant)
    for said in heard(rest):
        if said.mood is Mood.QUESTION or unasked(said):
            told = True
            continue
        refuses = bool(clears(said) or spared(said) or removed(said) or unwanted(said))
        told = told or refuses
        for piece, request, asked in pieces(said):
            if request and known(replace(request, outright=asked or request.outright)):
                told = True
            elif _EMPTY.fullmatch(piece) or (refuses and _PERSON.fullmatch(piece.strip() + " ")):
                continue
            elif is_remark(piece) or _TOLD.fullmatch(piece) or _restricts(piece):
                told = True
            else:
                return False
    return told


def states_aim(text: str) -> bool:
    """Whether `text`, evened, speaks of an aim, an occasion or a taste."""
    return bool(_AIM.search(text) or _OCCASION.search(text) or any(map(_MADE.match, made(text))))


def has_aim(utterance: str) -> bool:
    """Whether words speak of an aim, an occasion or a taste, name no thing, or ask for ideas."""
    said = _NO_AIM.sub("", evened(utterance))
    return wants_ideas(utterance) or states_aim(said) or bool(_OPEN.search(said))


def leaves_open(utterance: str) -> bool:
    """Whether anything may be guessed from words that are no mere order.

    Not where they call off, refuse, put off, ask, correct or try to buy, unless they state an aim
    or a taste besides, as in "I'd like to bake a cake, but my sister can't eat gluten".
    """
    if wants_ideas(utterance):
        return True
    rest = besides_buying(unreasoned(utterance))
    holds = rest != utterance or declines(utterance) or bool(_PUTS_OFF.search(evened(utterance)))
    for said in heard(rest):
        if said.mood is Mood.QUESTION:
            holds = True
            continue
        left = besides_refused(said)
        dropped = Refusal.DROPPED in unwanted(said).values()
        takes_out = dropped or bool(_TAKES_OUT.match(said.text))
        holds = holds or takes_out or unasked(said) or clears(said) or bool(spared(said))
        for part in re.split(r"[,.;:!?](?:\s+|$)|\bbut\b", left):
            if _CALLS_OFF.search(part):
                holds = True
            elif states_aim(part):
                return True
            holds = holds or bool(_HOLDS_BACK.search(part) or BEYOND.search(part.strip()))
    return not holds


def _restricts(piece: str) -> bool:
    """Whether a piece states a diet, or takes one back."""
    every = frozenset(DIETS)
    plain = not _WISH.search(piece.replace("need not be", ""))
    return bool(diet(piece) or diet(piece, every) != every) and plain


def had_too(utterance: str, before: str) -> str:
    """What else a person has at home: "and eggs too", after "I already have flour"; or ""."""
    found = _AND_THIS.fullmatch(evened(utterance)) if _HAVING.fullmatch(evened(before)) else None
    return found[1] if found else ""


def adds_it(utterance: str) -> bool:
    """Whether words are no more than an order to add "it"."""
    return bool(_ADD_IT.fullmatch(evened(utterance)))


def buys_it(utterance: str) -> bool:
    """Whether words are no more than an order to buy "it": a thing, or all of the basket."""
    return bool(_BUY_IT.fullmatch(evened(utterance)))


def so_many(utterance: str) -> str:
    """What words ask for that are but an amount, as "3 packs of " for "yes please, 3 bags"."""
    found = _SO_MANY.fullmatch(evened(utterance))
    return f"{found['number']} packs of " if found else ""


def tries_to_buy(utterance: str) -> bool:
    """Whether words, a sentence of them at least, look as if all were to be bought by them."""
    return any(map(_tries, _sentences(utterance)))


def buys_changed(utterance: str) -> bool:
    """Whether words begin with an order to buy, and change the basket: "buy it without eggs"."""
    return bool(_BUYS_CHANGED.match(evened(utterance)))


def besides_buying(utterance: str) -> str:
    """`utterance` without the sentences that try to buy; as it is where none does."""
    said = _sentences(utterance)
    rest = [each for each in said if not _tries(each)]
    return utterance if len(rest) == len(said) else " ".join(rest)


def _sentences(utterance: str) -> list[str]:
    """The sentences, and what is joined to one and tries to buy, as in "add eggs and pay"."""
    said = re.split(r"(?<=[.;!?])\s+", evened(utterance))
    parts = [(each, _JOINED.split(each, maxsplit=1)) for each in said]
    return [p for whole, cut in parts for p in (cut if _tries(cut[-1]) else [whole])]


def _tries(sentence: str) -> bool:
    sentence = _ASKED_OR_LATER.sub("", sentence)
    return bool(_TRY.fullmatch(sentence) and _BUYS.search(sentence))
