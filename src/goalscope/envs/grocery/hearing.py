"""What stands after all that a person has said: what they ask for, and what they rule out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from goalscope.envs.grocery.amounts import Request
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.diets import diet, implied, is_diet, violates
from goalscope.envs.grocery.names import Names
from goalscope.envs.grocery.requests import Refusal, clears, removed, spared, unwanted, wanted
from goalscope.envs.grocery.rewording import SAME
from goalscope.envs.grocery.words import contains, made, singulars

__all__ = ["Hearing", "hear"]

_NO_NAMES = Names(())


@dataclass(frozen=True, slots=True)
class Hearing:
    """What a person's words come to, later words before earlier ones.

    Attributes:
        wanted: Things asked for outright and not refused since, in their order.
        removed: What the newest words want taken out, all of it or some; no phrase where it is
            unclear what.
        spared: What alone stays in the basket, by the newest words; all of it where there is none.
        refused: Things refused and not asked for since.
        dropped: Things taken out of the basket, all of them, and not asked for since.
        lessened: Things of which some were taken out, and that were not asked for since.
        diets: Restrictions named, of `diets.DIETS`.
        words: All that was said, in lower case.
        empties: Whether the last words ask for an empty basket.
    """

    wanted: tuple[Request, ...]
    removed: tuple[Request, ...]
    spared: tuple[str, ...]
    refused: tuple[str, ...]
    dropped: tuple[str, ...]
    lessened: tuple[str, ...]
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
        return _kind_of(thing, self.refused)

    def drops(self, thing: str) -> bool:
        """Whether the person refused `thing`, or had it taken out."""
        return _kind_of(thing, (*self.refused, *self.dropped))

    def spurns(self, kind: str) -> bool:
        """Whether to add nothing of this kind unasked: after hot dog buns were dropped, no buns."""
        name = singulars(kind)
        out = (*self.dropped, *self.lessened)
        ends = any(singulars(each)[-len(name) :] == name for each in out)
        return ends or self.drops(kind) or _kind_of(kind, out)


def hear(utterances: Sequence[str], names: Names | None = None) -> Hearing:
    """Read utterances in their order; a word taken back counts no more.

    Args:
        utterances: What the person said, the newest last.
        names: Of the shop's items, which are then heard whole.
    """
    return _hear(tuple(utterances), names or _NO_NAMES)


@lru_cache(maxsize=64)
def _hear(utterances: tuple[str, ...], names: Names) -> Hearing:
    asked: dict[str, Request] = {}
    refused: dict[str, None] = {}
    dropped: dict[str, None] = {}
    lessened: dict[str, None] = {}
    changes: list[Request] = []
    kept: list[str] = []
    diets: frozenset[str] = frozenset()
    mild: set[str] = set()  # diets that rest on a refusal alone, which a request takes back
    for number, utterance in enumerate(utterances, start=1):
        newest = number == len(utterances)
        said = names.hidden(utterance)
        kept = [names.shown(phrase) for phrase in spared(said)]
        if clears(utterance) or kept:
            asked = {phrase: r for phrase, r in asked.items() if _kind_of(phrase, kept)}
        earlier, diets = diets, diet(utterance, diets)
        last = next(reversed(asked), "")
        for removal in removed(said):
            change = _named(removal, names, last)
            if newest:
                changes.append(change)
            if last := change.phrase:
                _reduce(asked, change)
                (dropped if change.change == "none" else lessened)[last] = None
        out = {names.shown(r.phrase) for r in removed(said)}
        for thing, how in unwanted(said).items():
            thing = names.shown(thing)
            if is_diet(thing):
                continue
            restrictions = implied(thing, how)
            if how is not Refusal.HARMED:
                mild |= restrictions - earlier
            if not restrictions and thing not in out:
                refused[thing] = None
            for phrase in [p for p in asked if contains(singulars(p), singulars(thing))]:
                del asked[phrase]
        for request in wanted(said):
            request = _named(request, names, last)
            if not request.phrase or is_diet(request.phrase):
                continue
            _ask(asked, request, newest=newest)
            diets -= mild & implied(request.phrase)
            for words in (refused, dropped, lessened):
                for thing in [
                    r for r in words if contains(singulars(request.phrase), singulars(r))
                ]:
                    del words[thing]
    return Hearing(
        wanted=tuple(asked.values()),
        removed=tuple(changes),
        spared=tuple(kept),
        refused=tuple(refused),
        dropped=tuple(dropped),
        lessened=tuple(lessened),
        diets=diets,
        words=". ".join(utterances).casefold(),
        empties=bool(utterances) and clears(utterances[-1]),
    )


def _kind_of(thing: str, words: Sequence[str]) -> bool:
    return any(contains(singulars(thing), singulars(each)) for each in words)


def _named(request: Request, names: Names, last: str) -> Request:
    """`request` with the shop's name or, for "it", the thing spoken of last, if there is any."""
    return replace(request, phrase=last if request.phrase == SAME else names.shown(request.phrase))


def _reduce(asked: dict[str, Request], change: Request) -> None:
    """Ask for less of what `change` takes out: rye bread may be what came for "bread"."""
    out = singulars(change.phrase)
    alike = [p for p in asked if contains(singulars(p), out) or contains(out, singulars(p))]
    for phrase in alike:
        left = asked[phrase].quantity - change.quantity
        if change.change == "none" or left < 1:
            del asked[phrase]
        else:
            asked[phrase] = replace(asked[phrase], quantity=left)


def _ask(asked: dict[str, Request], request: Request, *, newest: bool) -> None:
    """Ask for something, once, whether in the singular or the plural.

    What older words change is added up, so that it is met once; the newest change what is there.
    """
    same = next((p for p in asked if singulars(p) == singulars(request.phrase)), request.phrase)
    before = asked.pop(same, None)
    if not newest:
        more = before.quantity if before and request.change == "more" else 0
        request = replace(request, quantity=request.quantity + more, change="at least")
    asked[request.phrase] = request
