"""Which items of the shop a person's phrases and the agent's search terms mean."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from goalscope.envs.grocery.amounts import CONTAINER, Request
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.heard import Hearing
from goalscope.envs.grocery.hearing.diets import diet, implied, undieted
from goalscope.envs.grocery.hearing.requests import Refusal
from goalscope.envs.grocery.restrictions import violates
from goalscope.envs.grocery.search import Search
from goalscope.envs.grocery.synonyms import is_its_own, usual
from goalscope.envs.grocery.words import contains, head_nouns, singular, singulars, words
from goalscope.envs.remarks import is_remark

__all__ = ["Choice", "called", "is_vague", "taken"]

_PER_TERM = 5
"""Items offered for each search term."""

_VAGUE = frozenset({
    "food", "foods", "meal", "dinner", "lunch", "drink", "drinks", "item", "items", "thing",
    "things", "set",
})  # fmt: skip
"""Words too general to choose an item by."""

_NO_PRODUCT = _VAGUE | {
    "something", "anything", "nothing", "everything", "stuff", "one", "ones", "rest", "bit", "lot",
    "lots", "other", "others", "each", "some", "more", "a", "the", "of", "my", "good", "nice",
    "meals", "breakfast", "ingredients", "groceries", "shopping", "basket", "cart", "order", "list",
    "fruit", "fruits", "vegetables", "vegetable", "veggies", "dessert", "desserts", "snack", "to",
    "going", "us", "me", "them", "her", "him", "ready", "back", "help", "idea", "ideas", "recipe",
    "correct", "right", "yup", "yep", "nope", "total", "weekly", "monthly", "shop",
    "dozen", "dozens", "sandwich", "sandwiches",
}  # fmt: skip
"""Words that name no product, at least alone or together."""

_NO_BEGINNING = frozenset({
    "something", "anything", "nothing", "everything", "whatever", "as", "at", "by", "in", "on",
    "to", "near", "out", "after", "from", "under", "until", "making", "cooking", "planning",
    "having", "doing",
})  # fmt: skip
"""Words that no product's name begins with."""

_TALK = frozenset({
    "i", "we", "you", "he", "she", "they", "it", "them", "us", "me", "him", "who", "eat", "eats",
    "need", "needs", "want", "wants", "like", "likes", "love", "loves", "come", "comes", "is",
    "are", "was", "have", "has", "here", "friends", "guests", "people", "family", "nobody",
    "nobodys",
})  # fmt: skip
"""Words of a sentence, which no product's name holds."""

_PRODUCT = 0.45
"""Cosine with the nearest item from which on a bare phrase is taken for a product."""

_DEPTH = 10
"""Best items of a search that count."""

_IN_UNITS = re.compile(rf" {CONTAINER}$")
"""What a thing is counted in, behind it: "fennel bulbs"."""

_ROLLS = re.compile(r"(?<!paper)(?<!towel)(?<!foil)(?<!wrap) rolls?$")
"""What bread may be baked as, behind it: no other thing is counted so."""


class Choice:
    """Chooses items of one catalogue for what is said."""

    def __init__(self, catalogue: Catalogue, search: Search) -> None:
        """Choose among the items of `catalogue` with the help of its `search`."""
        self._names = catalogue.names
        self._aisles = set(words(" ".join({item.category for item in catalogue.items})))
        self._tags = {tag for item in catalogue.items for tag in item.tags}
        self._search = search

    def meant(self, phrase: str, hearing: Hearing, basket: Collection[str]) -> Item | None:
        """The item that a request means: by its exact name, in the basket, usual, or plainest."""
        if is_vague(phrase) and phrase not in self._names:
            return None
        if hearing.strict:  # only another thing of the same aisle stands for one without a label
            usual = self._meant(phrase, _unlabelled(hearing), basket)
            found = self._meant(phrase, hearing, basket)
            return found if found and usual and found.category == usual.category else None
        return self._meant(phrase, hearing, basket)

    def _meant(self, phrase: str, hearing: Hearing, basket: Collection[str]) -> Item | None:
        _, kind = _labelled(phrase, self._tags)
        names = dict.fromkeys((phrase, kind))
        others = (i for name in names for i in self._search.named(name) if _allowed(i, hearing))
        every = list(dict.fromkeys([*self._found(phrase, hearing), *others]))
        if is_its_own(kind):
            every = [*_headed(kind, every), *self.usually(kind, every)]
        plain = [item for item in every if not self._search.labels(item, phrase)]
        named = called(phrase, every)
        meant = [item for item in named if item.name in basket]
        usual_ones = self._usual(kind, hearing, every if kind == phrase else named)
        labelled = hearing.diets and any(hearing.diets <= item.tags for item in named)
        meant = meant or (not labelled and (usual_ones or called(phrase, plain))) or named

        def unfit(item: Item) -> tuple[bool, bool, tuple[int, ...]]:
            fits = hearing.diets <= item.tags
            return not fits, item not in usual_ones, self._search.plainness(item, phrase)

        if meant:
            return min(meant, key=unfit)
        nearly = self._nearly(phrase)
        same = singulars(nearly) == singulars(phrase)
        item = None if same else self.meant(nearly, hearing, basket)
        return item if item and self._is_one(item, phrase) else None

    def called(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items` that `phrase` names, or would if it were a name here: "juice boxes"."""
        if found := called(phrase, items) or self.usually(phrase, items):
            return found
        nearly = "" if self._search.named(phrase) else self._nearly(phrase)
        return [item for item in called(nearly, items) if self._is_one(item, phrase)]

    def usually(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items` that people mean by a bare word: cod, by "fish"."""
        return next(filter(None, (called(each, items) for each in usual(phrase))), list[Item]())

    def cheaper(self, old: Item | None, kind: str, hearing: Hearing) -> Item | None:
        """The cheapest permitted item of a kind; None where none is cheaper than `old`."""
        named = [item for item in self._search.named(kind) if _allowed(item, hearing)]
        like = old or self.meant(kind, hearing, ())
        alike = [item for item in named if not like or item.category == like.category]
        priced = [(i.price, i.id, i) for i in called(kind, alike) if i.price is not None]
        found = min(priced)[2] if priced else None if old else like
        dearer = not old or (found and old.price and priced and min(priced)[0] < old.price)
        return found if dearer else None

    def lacking(self, request: Request, hearing: Hearing) -> list[str]:
        """Why nothing can be added for the request; nothing where it names no product."""
        phrase = request.phrase
        if hearing.strict and self.meant(phrase, _unlabelled(hearing), ()):
            label = " and ".join(sorted(hearing.strict))
            return [f"Not added, since it is not labelled as {label}: {phrase}."]
        vague = _NO_PRODUCT.union(self._aisles).issuperset(words(phrase))
        said = words(phrase)
        no_name = _NO_BEGINNING.issuperset(said[:1]) or not _TALK.isdisjoint(said)
        if (
            (vague and not is_its_own(phrase))
            or no_name
            or hearing.makes(phrase)
            or is_remark(phrase)
            or (diet(phrase) and not self._search.named(undieted(phrase)))
        ):
            return []
        named = self._search.named(phrase)
        if is_its_own(phrase):
            meant = [item for name in usual(phrase) for item in self._search.named(name)]
            named = [*_headed(phrase, named), *meant]
        diets = [d for d in sorted(hearing.diets) if all(violates(item, d) for item in named)]
        if named and diets:
            return [f"Not added, since it has to be {' and '.join(diets)}: {phrase}."]
        if named:
            return [f"Not added, since it was ruled out: {phrase}."]
        sure = request.outright or request.replaces
        if not sure and self._search.nearness(phrase) < _PRODUCT:
            return []
        return [f"The shop has nothing called '{phrase}'."]

    def offers(self, term: str, hearing: Hearing, decided: Collection[str]) -> list[Item]:
        """The best permitted items that are what the term's last word says: no vinegar for wine.

        Those that are labelled for the person's diets stand for all, where there are any. None
        where one of them is among the names that are `decided`: in the basket, it serves the term
        already. None for what the person wants to make, either.
        """
        head = " ".join(words(term)[-1:])
        if head in _VAGUE or hearing.makes(term) or hearing.spurns(term):
            return []
        offers = [i for i in self._found(term, hearing) if _is_a(i, head)]
        if hearing.diets:
            aisles = {item.category for item in _headed(head, offers)}
            such = [i for i in offers if i.category in aisles] or offers
            offers = [i for i in such if hearing.diets <= i.tags] or such
        offers = offers[:_PER_TERM]
        return [] if any(item.name in decided for item in offers) else offers

    def sells(self, phrase: str) -> bool:
        """Whether an item is what `phrase` names, by its head noun: no "rye" is rye bread."""
        _, kind = _labelled(phrase, self._tags)
        named = [] if is_vague(kind) else self._search.named(kind)
        fillets = self._search.named(f"{kind} fillets") if f"{kind} fillets" in usual(kind) else []
        return bool(fillets or _headed(kind, named))

    def _nearly(self, phrase: str) -> str:
        """`phrase` without slips of the pen, and without what it is counted in."""
        return self._search.translated(_IN_UNITS.sub("", self._search.mended(phrase)))

    def _is_one(self, item: Item, phrase: str) -> bool:
        """Whether the item may be what `phrase` ends with: "pita rolls" are, "egg rolls" not."""
        breads = {each.category for each in self._search.named("dinner rolls")}
        return not _ROLLS.search(phrase) or item.category in breads

    def _usual(self, phrase: str, hearing: Hearing, among: Sequence[Item]) -> list[Item]:
        """What people mean by a bare word, as far as it is `among` these; what fits diets first."""
        named = (self._search.named(name) for name in usual(phrase))
        kinds = [[item for item in kind if item in among] for kind in named]
        fit = [[item for item in kind if hearing.diets <= item.tags] for kind in kinds]
        none: list[Item] = []
        return next((kind for kind in (*fit, *kinds) if kind), none)

    def _found(self, term: str, hearing: Hearing) -> list[Item]:
        """What the search finds that is not ruled out; a diet is searched for by its name, too."""
        texts = [*(f"{name} {term}" for name in sorted(hearing.diets)), term]
        found = dict.fromkeys(item for text in texts for item in self._search.search(text, _DEPTH))
        return [item for item in found if _allowed(item, hearing)]


def is_vague(phrase: str) -> bool:
    """Whether no word of `phrase` says what is meant."""
    return _NO_PRODUCT.issuperset(words(phrase))


def taken(removal: Request, items: Sequence[Item]) -> list[Item]:
    """Those of `items` that a removal means; the name of an aisle stands for all of it."""
    aisle = [i for i in items if singulars(i.category) == singulars(removal.phrase)]
    if removal.every and aisle and not implied(removal.phrase, Refusal.HARMED):
        return aisle
    if removal.every:
        return [item for item in items if _is_a(item, removal.phrase)]
    return called(removal.phrase, items) or aisle


def called(phrase: str, items: Sequence[Item]) -> list[Item]:
    """Those of `items` that `phrase` names: exactly, by their head noun, or else by any word.

    What it begins with may be a label: "gluten-free pasta" is "Chickpea Pasta" that has this tag.
    """
    exact = [item for item in items if item.name.casefold() == phrase] or [
        item for item in items if singulars(item.name) == singulars(phrase)
    ]
    named = [item for item in items if _is_a(item, phrase)]
    heads = exact or _headed(phrase, named)
    if heads:
        return heads
    tags = {tag for item in items for tag in item.tags}
    label, kind = _labelled(phrase, tags)
    fit = items
    while label:
        fit = [item for item in fit if label in item.tags]
        label, kind = _labelled(kind, tags)
    return _headed(kind, [item for item in fit if _is_a(item, kind)]) or named


def _headed(phrase: str, items: Iterable[Item]) -> list[Item]:
    """Those of `items` that are what the last word of `phrase` says."""
    last = singulars(phrase)[-1:]
    return [i for i in items if last and last[0] in map(singular, head_nouns(i.name))]


def _labelled(phrase: str, tags: Iterable[str]) -> tuple[str, str]:
    """The tag that `phrase` begins with, and the rest of it; no tag where there is none."""
    said = words(phrase)
    for tag in tags:
        size = len(words(tag))
        if said[:size] == words(tag) and not is_vague(" ".join(said[size:])):
            return tag, " ".join(said[size:])
    return "", phrase


def _allowed(item: Item, hearing: Hearing) -> bool:
    return hearing.permits(item) and not hearing.drops(item.name)


def _is_a(item: Item, phrase: str) -> bool:
    """Whether the item's name has every word of the phrase."""
    return contains(singulars(item.name), singulars(phrase))


def _unlabelled(hearing: Hearing) -> Hearing:
    """The same where food need not be labelled."""
    return replace(hearing, strict=frozenset())
