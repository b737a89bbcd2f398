"""Which items of the shop a person's phrases and the agent's search terms mean."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from goalscope.envs.grocery.bounds import Bounds
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.search import Search
from goalscope.envs.grocery.synonyms import is_its_own, usual
from goalscope.words import contains, head_nouns, singular, singulars, words

__all__ = ["Choice", "called"]

_PER_TERM = 5
"""Items offered for each search term."""

_VAGUE = frozenset({
    "food", "meal", "dinner", "lunch", "breakfast", "drink", "item", "thing", "stuff", "snack",
    "grocery", "something", "anything", "everything", "fruit", "vegetable", "veggie", "dessert",
    "ingredient", "one", "set",
})  # fmt: skip
"""Words too general to choose an item by."""

_DEPTH = 10
"""Best items of a search that count."""


class Choice:
    """Chooses items of one catalogue for what is said."""

    def __init__(self, catalogue: Catalogue, search: Search) -> None:
        """Choose among the items of `catalogue` with the help of its `search`."""
        self._names = {item.name.casefold(): item for item in catalogue.items}
        self._tags = {tag for item in catalogue.items for tag in item.tags}
        self._search = search

    def meant(self, phrase: str, bounds: Bounds, basket: Collection[str] = ()) -> Item | None:
        """The item that a phrase means: by its exact name, in the basket, usual, or plainest.

        Among several, one that fits the diets of only some people is preferred.
        """
        exact = self._names.get(" ".join(phrase.casefold().split()))
        if exact and bounds.permits(exact):
            return exact
        if is_vague(phrase):
            return None
        for text in dict.fromkeys((phrase, *self._nearly(phrase))):
            if found := self._meant(text, bounds, basket):
                return found
        ending = filter(bounds.permits, self._search.ending(phrase))
        return max(ending, key=lambda item: len(words(item.name)), default=None)

    def _meant(self, phrase: str, bounds: Bounds, basket: Collection[str]) -> Item | None:
        _, kind = _labelled(phrase, self._tags)
        diets = bounds.diets | bounds.some
        names = dict.fromkeys((phrase, kind))
        others = (i for name in names for i in self._search.named(name) if bounds.permits(i))
        every = list(dict.fromkeys([*self._found(phrase, bounds), *others]))
        if is_its_own(kind):
            every = [*_headed(kind, every), *self.usually(kind, every)]
        plain = [item for item in every if not self._search.labels(item, phrase)]
        named = called(phrase, every)
        meant = [item for item in named if item.name in basket]
        usual_ones = self._usual(kind, diets, every if kind == phrase else named)
        labelled = bool(diets) and any(diets <= item.tags for item in named)
        meant = meant or (not labelled and (usual_ones or called(phrase, plain))) or named

        def unfit(item: Item) -> tuple[bool, bool, bool, tuple[int, ...]]:
            return (
                labelled and not diets <= item.tags,
                not (diets <= item.tags or bounds.suits(item)),
                item not in usual_ones,
                self._search.plainness(item, phrase),
            )

        return min(meant, key=unfit, default=None)

    def held(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items`, such as a basket's, that a phrase means."""
        for text in dict.fromkeys((phrase, *self._nearly(phrase))):
            if found := called(text, items) or self.usually(text, items):
                return found
        return [item for item in items if singulars(item.category) == singulars(phrase)]

    def usually(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items` that people mean by a bare word: cod, by "fish"."""
        return next(filter(None, (called(each, items) for each in usual(phrase))), list[Item]())

    def lacking(self, phrase: str, bounds: Bounds) -> str:
        """Why nothing can be added for a phrase."""
        item = self.meant(phrase, Bounds())
        if is_vague(phrase):
            may = f'"{phrase}" may be many things. ' if phrase else ""
            return f"{may}Please name a thing."
        if item is None:
            near = [each.name for each in self._search.search(phrase, 2)]
            return f'The shop has nothing called "{phrase}". Near it: {"; ".join(near)}.'
        return f'Not added, since {bounds.against(item)}: "{phrase}".'

    def offers(self, term: str, bounds: Bounds, decided: Collection[str]) -> list[Item]:
        """The best permitted items that are what the term's last word says: no vinegar for wine.

        Those that are labelled for the person's diets stand for all, where there are any. None
        where one of them is among the names that are `decided`: in the basket, it serves the term
        already.
        """
        head = " ".join(words(term)[-1:])
        if is_vague(head):
            return []
        diets = bounds.diets | bounds.some
        offers = [i for i in self._found(term, bounds) if bounds.suits(i) and _is_a(i, head)]
        if diets:
            aisles = {item.category for item in _headed(head, offers)}
            such = [i for i in offers if i.category in aisles] or offers
            offers = [i for i in such if diets <= i.tags] or such
        offers = offers[:_PER_TERM]
        return [] if any(item.name in decided for item in offers) else offers

    def _nearly(self, phrase: str) -> Iterable[str]:
        """`phrase` in the shop's words, without words of no thing and slips of the pen."""
        translated = self._search.translated(phrase)
        yield translated
        yield self._search.translated(self._search.pruned(translated))
        mended = self._search.translated(self._search.mended(phrase))
        yield self._search.translated(self._search.pruned(mended))

    def _usual(self, phrase: str, diets: Collection[str], among: Sequence[Item]) -> list[Item]:
        """What people mean by a bare word, as far as it is `among` these; what fits diets first."""
        named = (self._search.named(name) for name in usual(phrase))
        kinds = [[item for item in kind if item in among] for kind in named]
        fit = [[item for item in kind if {*diets} <= item.tags] for kind in kinds]
        none: list[Item] = []
        return next((kind for kind in (*fit, *kinds) if kind), none)

    def _found(self, term: str, bounds: Bounds) -> list[Item]:
        """What the search finds that is not ruled out; a diet is searched for by its name, too."""
        diets = sorted(bounds.diets | bounds.some)
        texts = [*(f"{name} {term}" for name in diets), term]
        found = dict.fromkeys(item for text in texts for item in self._search.search(text, _DEPTH))
        return [item for item in found if bounds.permits(item)]


def is_vague(phrase: str) -> bool:
    """Whether no word of `phrase` says what is meant."""
    return _VAGUE.issuperset(singulars(phrase))


def called(phrase: str, items: Sequence[Item]) -> list[Item]:
    """Those of `items` that `phrase` names: exactly, by their head noun, or else by any word.

    What it begins with may be a label: "gluten-free pasta" is "Chickpea Pasta" that has this tag.
    """
    exact = [item for item in items if item.name.casefold() == phrase.casefold()] or [
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


def _is_a(item: Item, phrase: str) -> bool:
    """Whether the item's name has every word of the phrase."""
    return contains(singulars(item.name), singulars(phrase))
