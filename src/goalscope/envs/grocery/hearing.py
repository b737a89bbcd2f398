"""What stands after all that a person has said: what they ask for, and what they rule out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.diets import diet, implied, is_diet, violates
from goalscope.envs.grocery.requests import Refusal, Request, clears, unwanted, wanted
from goalscope.envs.grocery.words import contains, made, singulars

__all__ = ["Hearing", "hear"]


@dataclass(frozen=True, slots=True)
class Hearing:
    """What a person's words come to, later words before earlier ones.

    Attributes:
        wanted: Things asked for outright and not refused since, in their order.
        refused: Things refused and not asked for since.
        diets: Restrictions named, of `diets.DIETS`.
        words: All that was said, in lower case.
        empties: Whether the last words ask for an empty basket.
    """

    wanted: tuple[Request, ...]
    refused: tuple[str, ...]
    diets: frozenset[str]
    words: str
    empties: bool

    def makes(self, thing: str) -> bool:
        """Whether the person wants to make `thing` themselves, so that it is not to be bought.

        Who says "bake a chocolate cake with nuts" makes a cake, and neither chocolate nor nuts.
        """
        last = singulars(thing)
        return bool(last) and any(singulars(m)[-len(last) :] == last for m in made(self.words))

    def permits(self, item: Item) -> bool:
        """Whether nothing that was said speaks against `item`."""
        diets = self.diets
        return not self.refuses(item.name) and not any(violates(item, diet) for diet in diets)

    def refuses(self, thing: str) -> bool:
        """Whether `thing` is, or is a kind of, something that the person refused."""
        return any(contains(singulars(thing), singulars(refused)) for refused in self.refused)


def hear(utterances: Sequence[str]) -> Hearing:
    """Read utterances in their order; a word taken back counts no more."""
    asked: dict[str, Request] = {}
    refused: dict[str, None] = {}
    diets: frozenset[str] = frozenset()
    mild: set[str] = set()  # diets that rest on a refusal alone, which a request takes back
    for utterance in utterances:
        if clears(utterance):
            asked.clear()
        earlier, diets = diets, diet(utterance, diets)
        for thing, how in unwanted(utterance).items():
            if is_diet(thing):
                continue
            restrictions = implied(thing, how)
            if not restrictions:
                refused[thing] = None
            elif how is not Refusal.HARMED:
                mild |= restrictions - earlier
            for phrase in [p for p in asked if contains(singulars(p), singulars(thing))]:
                del asked[phrase]
        for request in wanted(utterance):
            if is_diet(request.phrase):
                continue
            asked[request.phrase] = request
            diets -= mild & implied(request.phrase)
            for thing in [r for r in refused if contains(singulars(request.phrase), singulars(r))]:
                del refused[thing]
    said = ". ".join(utterances).casefold()
    empties = bool(utterances) and clears(utterances[-1])
    return Hearing(tuple(asked.values()), tuple(refused), diets, said, empties)
