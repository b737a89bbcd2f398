"""What a person is told of words that led to nothing, or to what they did not say."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal

from goalscope.envs.grocery.amounts import Request
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.choosing import Choice
from goalscope.envs.grocery.heard import Hearing
from goalscope.envs.grocery.hearing.correcting import QUALITY
from goalscope.envs.grocery.hearing.moods import Mood
from goalscope.envs.grocery.hearing.orders import BEYOND, states_aim
from goalscope.envs.grocery.hearing.requests import besides_refused, uncontained
from goalscope.envs.grocery.hearing.rewording import ASKING, Said
from goalscope.envs.grocery.telling import not_there
from goalscope.envs.grocery.words import contains, singulars
from goalscope.envs.remarks import is_remark

__all__ = ["above_limit", "not_replaced", "undone"]

_ORDERS = re.compile(
    rf"{ASKING.pattern}|\b(?:put|toss|throw|pop|bring|give me|swap|exchange|replace|change|switch"
    r"|instead|remove|delete|take (?:out|off|away)|leave out)\b"
)
_TAKES_OUT = re.compile(
    r"\b(?:swap|exchange|replace|change|switch|instead|remove|delete|leave out"
    r"|take (?:out|off|away))\b"
)
_ASIDE = re.compile(
    r"\b(?:for|with|because|since|so|like|as|if|when|while|from|in|on|at|that|which|who|than|about"
    r"|into|to|not|but|there is"
    r"|(?:i|we|they|he|she|you|it) (?:have|had|has|like|love|eat|drink|am|are|is|was|were|do|did"
    r"|can|make|bake|cook))\b[^,;.!?]*"
)
"""What is said besides an order: what it is for, and what they have or like."""
_LACKS = re.compile(r"nothing called '([^']+)'")
_PUT_AWAY = re.compile(
    r"\b(?:put|toss|throw|pop|bring) (?:(?!\b(?:in|into|on|to)\b)[^,;.!?]){1,60}"
    r" (?:in|into|on|to) (?:the|my|our|a) "
    r"(?!(?:(?:shopping|grocery) )?(?:basket|cart|order|list)\b)\w+"
)
"""What is done with a thing at home."""


def above_limit(
    piece: str,
    things: Mapping[str, Item],
    most: Decimal,
    money: Callable[[Decimal], str],
    lacked: Iterable[str] = (),
) -> str:
    """That a thing costs more than it may, or that nothing watches a limit; "" if neither.

    Args:
        piece: What was said of the thing.
        things: Items by the phrases that asked for them.
        most: What the thing may cost.
        money: How a price is told.
        lacked: What is told to be none of the shop's things, so that a limit matters nothing.
    """
    said = singulars(piece)
    if any(contains(said, singulars(phrase)) for phrase in lacked):
        return ""
    named = [item for phrase, item in things.items() if contains(said, singulars(phrase))]
    if not named:
        return f"No limit for one thing is watched, so please look at the price: {money(most)}."
    dear = [f"{i.name}, {money(i.price)}" for i in named if i.price is not None and i.price > most]
    return f"Above the {money(most)} that you named: {'; '.join(dear)}." if dear else ""


def not_replaced(hearing: Hearing, held: Sequence[Item], choice: Choice) -> list[str]:
    """What was to make way for a thing of the shop, and was not in a basket with others."""
    removed = {each.phrase for each in hearing.removed}
    olds = dict.fromkeys(
        old
        for request in hearing.newest
        for old in request.replaces
        if request.change != "cheaper" and choice.meant(request.phrase, hearing, ())
    )
    named = (each for each in olds if each not in removed and not re.fullmatch(QUALITY, each))
    sold = [each for each in named if choice.sells(each)]
    missing = [Request(each) for each in sold if not choice.called(each, held)]
    return [*not_there(missing, held, lessened=False)] if held else []


def undone(
    clauses: Iterable[Said],
    mentioned: Callable[[str], Sequence[str]],
    done: Sequence[str],
    held: Iterable[str],
) -> Iterator[str]:
    """Which things the newest words order, as far as anything in them was done or told.

    Args:
        clauses: The newest words.
        mentioned: Gives the things of the shop that a text names.
        done: Names and phrases of what was heard, done, or told.
        held: Names of what the basket holds; only what is to leave it matters of that.
    """
    known, there = set(singulars(" ".join(done))), set(singulars(" ".join(held)))
    left: dict[str, None] = {}
    lacks = _LACKS.findall(" ".join(done))
    for clause in clauses:
        text = besides_refused(clause)
        if beyond := [each.strip() for each in BEYOND.findall(text)]:
            left |= dict.fromkeys(e for e in beyond if not any(name in e for name in lacks))
            continue
        orders = clause.mood is Mood.ORDER and _ORDERS.search(text)
        if not orders or states_aim(clause.text) or is_remark(text) or "need not" in text:
            continue
        heard = known if _TAKES_OUT.search(text) else known | there
        names = mentioned(_ASIDE.sub(" . ", _PUT_AWAY.sub(" . ", uncontained(text))))
        left |= dict.fromkeys(each for each in names if heard.isdisjoint(singulars(each)))
    if left:
        yield f"Nothing was done about: {', '.join(left)}."
