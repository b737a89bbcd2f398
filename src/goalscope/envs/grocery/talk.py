"""What a person said and let stand, in the words of the shop, and what that comes to."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import takewhile

from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.choosing import Choice, called, is_vague
from goalscope.envs.grocery.heard import Hearing
from goalscope.envs.grocery.hearing.diets import diet, hinted
from goalscope.envs.grocery.hearing.following import standing_alone
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.hearing.orders import adds_it, buys_it, had_too, so_many
from goalscope.envs.grocery.hearing.swapping import swapped
from goalscope.envs.grocery.hearing.undoing import harm
from goalscope.envs.grocery.search import Search
from goalscope.envs.grocery.words import words
from goalscope.envs.speech import LEAD, evened
from goalscope.types import TakenBack, Turn

__all__ = ["Talk"]

_IN_STOCK = re.compile(
    rf"{LEAD}(?:do you (?:have|sell|stock|carry)|have you(?: got)?|got|(?:is|are) there|any"
    r"|how much (?:is|are|for))\b.*\?$"
)
_LISTS = re.compile(r"(?:an?|some|two|three|four|\d+|also|the) ")
_HALF_DOZEN = re.compile(r"\b(?:an? )?half(?: an?)? dozen(?: of)? ([a-z]+)\b", re.IGNORECASE)


class Talk:
    """Reads turns by what the shop sells."""

    def __init__(self, catalogue: Catalogue, search: Search, choice: Choice) -> None:
        self._names = catalogue.names
        self._food = catalogue.labelled
        self._tags = frozenset(tag for item in catalogue.items for tag in item.tags)
        self._search = search
        self._choice = choice
        self.translated = lru_cache(maxsize=1024)(search.translated)
        """Words with the shop's names for things: "courgettes" become zucchini."""
        self._spoken = lru_cache(maxsize=64)(self._in_words_of_the_shop)

    def spoken(self, turns: Sequence[Turn]) -> list[str]:
        """The utterances that stand; "add it" names what a question before was about."""
        return [*self._spoken(tuple(turns))]

    def heard(self, turns: Sequence[Turn], contents: Sequence[tuple[Item, int]]) -> Hearing:
        """What the words come to; what was to make way for what the shop lacks stays.

        Args:
            turns: The transcript.
            contents: The basket's items with their numbers.
        """
        hearing = hear(self.spoken(turns), self._names)
        hearing = replace(hearing, food=self._food, strict=hearing.strict & self._tags)
        kept, gone = list[str](), list[str]()
        for request in hearing.wanted:
            if request.replaces and not is_vague(request.phrase):
                lacks = self._choice.meant(request.phrase, hearing, ()) is None
                (kept if lacks else gone).extend(request.replaces)
        wanted = tuple(
            each for each in hearing.wanted if each.phrase not in {*gone} - {*each.replaces}
        )
        held = [item for item, _ in contents]
        basket = {item.name for item in held}
        spared = tuple(
            phrase
            for phrase in hearing.spared
            if self._choice.meant(phrase, hearing, basket) or called(phrase, held)
        )
        stay = (*hearing.kept, *kept)
        return replace(hearing, wanted=wanted, spared=spared, kept=stay).keeping(kept)

    def _in_words_of_the_shop(self, turns: tuple[Turn, ...]) -> list[str]:
        stands = [
            harm(turn.utterance) if isinstance(turn, TakenBack) else turn.utterance
            for turn in turns
        ]
        said = [_HALF_DOZEN.sub(self._packed, self.translated(each)) for each in stands]
        for i, turn in enumerate(turns):
            last = partial(self._named_last, said[:i])
            before = partial(hear, said[:i], self._names)
            said[i] = self.translated(standing_alone(said[i], before, last, self._sells))
            said[i] = swapped(said[i], last, self._choice.sells)
            if has := had_too(said[i], said[i - 1] if i else ""):
                said[i] = f"I already have {has}"
            first, rest = _first(stands[i])
            many = so_many(first)
            buys = buys_it(first) and self._told_of(turn.query, said[:i])
            if many or adds_it(first) or buys:
                asked = takewhile(lambda text: text.rstrip().endswith("?"), reversed(said[:i]))
                things = ((self._search.mentioned(text), text) for text in (*asked, turn.query))
                found = (
                    self._named(each[0], text, before()) for each, text in things if len(each) == 1
                )
                thing = next(found, "")
                if thing and not (buys and before().asks_for(thing)):
                    instead = f"{thing} instead" if first.rstrip(" .!").endswith("instead") else ""
                    one = swapped(instead, last, self._choice.sells) or f"Add {many}{thing}"
                    said[i] = f"{one}. {self.translated(rest)}" if rest else one
        return said

    def _told_of(self, query: str, said: Sequence[str]) -> bool:
        """Whether a query names a thing of the shop after a question whether there is such."""
        asked = any(_IN_STOCK.match(evened(text)) for text in said[-1:])
        has = "nothing called" not in query
        return asked and has and bool(self._search.mentioned(query))

    def _sells(self, name: str) -> bool:
        return self._choice.sells(self.translated(name))

    def _packed(self, match: re.Match[str]) -> str:
        """The one thing that comes by the half dozen; or the words as they are."""
        named = self._search.named(f"half dozen {match[1]}")
        return named[0].name if len(named) == 1 else match[0]

    def _named_last(self, said: Sequence[str]) -> list[str]:
        things = (self._search.mentioned(each) for each in reversed(said))
        return next((each for each in things if each), list[str]())

    def _named(self, thing: str, question: str, hearing: Hearing) -> str:
        """A thing that was asked about, with what it was to be labelled for; or the cheapest."""
        said = question.casefold()
        organic = ["organic"] if re.search(r"\borganic\b", said) else []
        labels = [*organic, *sorted(hinted(question) | diet(question))]
        ahead, found, _ = said.partition(thing)
        for word in reversed(words(ahead) if found and not labels else []):
            if not self._choice.sells(f"{word} {thing}"):
                break
            thing = f"{word} {thing}"
        name = " ".join([*labels, thing])
        wants_cheapest = re.search(r"\bcheapest\b", said)
        item = self._choice.cheaper(None, name, hearing) if wants_cheapest else None
        return item.name if item else name


def _first(utterance: str) -> tuple[str, str]:
    """What comes first where it orders no more than "a pack of that", and the rest."""
    for end in (". ", ", and ", " and "):
        first, _, rest = utterance.partition(end)
        lists = end == ". " or _LISTS.match(rest.casefold())
        if rest and lists and (so_many(first) or adds_it(first)):
            return first, rest
    return utterance, ""
