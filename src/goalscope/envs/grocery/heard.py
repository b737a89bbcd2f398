"""What a person's words come to: what they ask for, what they rule out, and what binds guesses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal

from goalscope.envs.grocery.amounts import Request
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.restrictions import violates
from goalscope.envs.grocery.words import contains, made, singulars

__all__ = ["Hearing", "kind_of"]

_STUFF = re.compile(r" (?:stuff|things|items|products|supplies)$")
_SIZED = ("produce",)
"""Aisles where "baby" is a size."""


@dataclass(frozen=True, slots=True)
class Hearing:
    """What a person's words come to, later words before earlier ones.

    Attributes:
        wanted: Things asked for outright and not refused since, in their order.
        newest: Those of them that the newest words asked for.
        removed: What the newest words want taken out, all of it or some.
        unclear: Whether the newest words say "it" of nothing, or of one of several things.
        spared: What alone stays in the basket, by the newest words; all of it where there is none.
        refused: Things refused and not asked for since.
        harmful: Those of them that harm somebody, which asking for does not take back.
        dropped: Things taken out of the basket, all of them, and not asked for since.
        lessened: Things of which some were taken out, and that were not asked for since.
        diets: Restrictions named, of `diets.DIETS`.
        strict: Those of them for which food must be labelled.
        food: The catalogue's categories of food.
        words: All that was said, in lower case.
        empties: Whether the last words ask for an empty basket.
        unasked: Whether they want nothing in it that was not asked for.
        some: Restrictions that only some people follow; they bind what is guessed alone.
        hinted: Restrictions that any words spoke of; they bind what is guessed.
        guesses: Whether anything may be guessed.
        budget: What all may cost, in the shop's currency; None for any sum.
        kept: Things that are to stay, whoever asked for them.
        again: Whether the newest words ask for something back, or again.
    """

    wanted: tuple[Request, ...]
    newest: tuple[Request, ...]
    removed: tuple[Request, ...]
    unclear: bool
    spared: tuple[str, ...]
    refused: tuple[str, ...]
    harmful: tuple[str, ...]
    dropped: tuple[str, ...]
    lessened: tuple[str, ...]
    diets: frozenset[str]
    strict: frozenset[str]
    food: frozenset[str]
    words: str
    empties: bool
    unasked: bool
    some: frozenset[str]
    hinted: frozenset[str]
    guesses: bool
    budget: Decimal | None
    kept: tuple[str, ...]
    again: bool

    def makes(self, thing: str) -> bool:
        """Whether the person wants to make `thing` themselves, so that it is not to be bought.

        Who says "bake a chocolate cake with nuts" makes a cake, and neither chocolate nor nuts.
        """
        last = singulars(thing)
        return bool(last) and any(singulars(m)[-len(last) :] == last for m in made(self.words))

    def asks_for(self, thing: str) -> bool:
        """Whether `thing`, or a kind of it, is asked for."""
        return any(kind_of(each.phrase, [thing]) for each in self.wanted)

    def permits(self, item: Item) -> bool:
        """Whether nothing that was said speaks against `item`."""
        ruled_out = self.refuses(item.name) or any(_is_such(item, each) for each in self.refused)
        unsafe = item.category in self.food and not self.strict <= item.tags
        return not (ruled_out or unsafe or any(violates(item, each) for each in self.diets))

    def refuses(self, thing: str) -> bool:
        """Whether `thing` is, or is a kind of, something that the person refused."""
        return kind_of(thing, self.refused)

    def drops(self, thing: str) -> bool:
        """Whether the person refused `thing`, or had it taken out."""
        return kind_of(thing, (*self.refused, *self.dropped))

    def spurns(self, kind: str) -> bool:
        """Whether to add nothing of this kind unasked: after hot dog buns were dropped, no buns."""
        name = singulars(kind)
        out = (*self.dropped, *self.lessened)
        ends = any(singulars(each)[-len(name) :] == name for each in out)
        return ends or self.drops(kind) or kind_of(kind, out)

    def keeping(self, things: Iterable[str]) -> Hearing:
        """The same without what speaks against these `things`."""
        kept = {*things}
        return replace(
            self,
            removed=tuple(each for each in self.removed if each.phrase not in kept),
            refused=tuple(each for each in self.refused if each not in kept),
            dropped=tuple(each for each in self.dropped if each not in kept),
        )


def kind_of(thing: str, words: Sequence[str]) -> bool:
    """Whether `thing` is one of these, or a kind of one: rye bread is a kind of bread."""
    return any(contains(singulars(thing), singulars(each)) for each in words)


def _is_such(item: Item, refused: str) -> bool:
    """Whether an item is of what "no baby stuff" refuses: of that aisle, or of that name."""
    kind = singulars(_STUFF.sub("", refused))
    named = contains(singulars(item.name), kind) and item.category not in _SIZED
    return bool(_STUFF.search(refused)) and (singulars(item.category) == kind or named)
