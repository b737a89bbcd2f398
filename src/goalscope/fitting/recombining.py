"""More conversations from those that people wrote: about other things, and more in one breath.

Recombined examples teach a reader to copy what was said rather than to expect what is usual
(Jia & Liang, 2016: "Data Recombination for Neural Semantic Parsing").
"""

from __future__ import annotations

import random
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from goalscope.benchmarks.reading import Line
from goalscope.orders import Order, speaks, words_of
from goalscope.standing import acting

__all__ = ["Conversation", "Recombining"]

Conversation = Sequence[Line]
"""Lines of one person, each of which has those before it as its context."""


class Recombining:
    """Draws variants of conversations.

    Args:
        corpus: Conversations, whose things and first messages are drawn from.
        renamed: Share of things that become others.
        joined: Share of conversations that begin with another one's first message.
    """

    def __init__(self, corpus: Sequence[Conversation], *, renamed: float, joined: float) -> None:
        self._renamed = renamed
        self._joined = joined
        things = defaultdict[tuple[str, str, bool], dict[str, None]](dict)
        self._first = defaultdict[str, list[Line]](list)
        for conversation in corpus:
            line = conversation[0]
            if not line.question and all(each.do != "undo" for each in line.orders):
                self._first[line.domain].append(line)
            for line in conversation:
                for order in acting(line.orders):
                    if order.what:
                        things[_kind(line.domain, order)][order.what] = None
        self._things = {kind: [*names] for kind, names in things.items()}

    def drawn(self, conversation: Conversation, draw: random.Random) -> Conversation:
        """A variant of a conversation, often itself."""
        conversation = self._about_others(conversation, draw)
        if draw.random() < self._joined:
            conversation = self._with_more(conversation, draw)
        return conversation

    def _with_more(self, conversation: Conversation, draw: random.Random) -> Conversation:
        first, *rest = conversation
        others = self._first[first.domain]
        if first.question or not others or not any(map(speaks, first.orders)):
            return conversation
        other = draw.choice(others)
        spoken = tuple(each for each in (*other.orders, *first.orders) if each.do != "none")
        end = "" if other.message[-1:] in ".!?," else draw.choice((".", ",", " and", ""))
        message = f"{other.message}{end} {first.message}"
        return [replace(first, message=message, orders=tuple(dict.fromkeys(spoken))), *rest]

    def _about_others(self, conversation: Conversation, draw: random.Random) -> Conversation:
        """Things that are named in one way alone are named otherwise, wherever they occur."""
        named = {
            order.what: _kind(line.domain, order)
            for line in conversation
            for order in acting(line.orders)
            if order.what
        }
        for what, kind in named.items():
            if draw.random() < self._renamed:
                other = draw.choice(self._things[kind])
                if _alone(what, conversation) and not _shares(other, conversation):
                    conversation = [_with(line, what, other) for line in conversation]
        return conversation


def _kind(domain: str, order: Order) -> tuple[str, str, bool]:
    return domain, order.do, order.what.endswith("s")


def _texts(line: Line) -> list[str]:
    slots = (text for each in line.orders for text in (each.what, each.for_, each.where, each.if_))
    return [line.message, line.question, *filter(None, slots)]


def _alone(what: str, conversation: Conversation) -> bool:
    """Whether a thing was said, and its last word stands nowhere but in its whole name."""
    said = any(_named(what).search(line.message) for line in conversation)
    rest = " ".join(_named(what).sub(" ", text) for each in conversation for text in _texts(each))
    last = words_of(what)[-1:]
    return said and bool(last) and not any(word.startswith(last[0][:4]) for word in words_of(rest))


def _shares(what: str, conversation: Conversation) -> bool:
    said = {word for line in conversation for text in _texts(line) for word in words_of(text)}
    return not said.isdisjoint(words_of(what))


def _named(what: str) -> re.Pattern[str]:
    return re.compile(rf"(?<!\w){re.escape(what)}(?!\w)", re.IGNORECASE)


def _with(line: Line, what: str, other: str) -> Line:
    def renamed(text: str) -> str:
        return _named(what).sub(lambda _: other, text)

    orders = tuple(
        replace(
            each,
            what=renamed(each.what),
            for_=renamed(each.for_),
            where=renamed(each.where),
            if_=renamed(each.if_),
        )
        for each in line.orders
    )
    return replace(
        line, message=renamed(line.message), question=renamed(line.question), orders=orders
    )
