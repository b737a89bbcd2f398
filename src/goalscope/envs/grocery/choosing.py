"""Which items of the shop a phrase or a search term means."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from goalscope.base.nouns import head_nouns, head_words, names, singular, singulars, words
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.dietary import Bounds, labelled
from goalscope.envs.grocery.diets import DIETS, finder
from goalscope.envs.grocery.quantities import PACKAGES, without_percentage
from goalscope.envs.grocery.search import LABELS, OF_ITS_OWN, WORDS, Search
from goalscope.language.amounts import word_value
from goalscope.language.orders import Order

_CANS = frozenset({"can", "tin"})
_VAGUE = frozenset(WORDS["vague"].split())
_SMALL = frozenset(WORDS["small"].split()) | frozenset(WORDS["empty"].split())
_ANY = frozenset(WORDS["any"].split()) | _SMALL
_EXTREMES = {1: finder(WORDS["cheapest"]), -1: finder(WORDS["dearest"])}
_UNLIKE = [name.strip() for name in WORDS["unlike"].split(",")]
_USUAL = {word: names.split(", ") for word, names in WORDS["usual"].items()}

_JOINED = re.compile(r"(?:,| and | & )+ *")
_DEPTH = 10  # best items of a search that count
_PER_TERM = 5  # items offered for each search term
_NEAR = 100  # items among which an answer looks for a thing
_NAMED = 5  # items that an answer names at most
_LABELLED = 2  # most items of which an answer tells the labels
_LONGEST = 4  # most words of a phrase that a question mentions


class Chooser:
    """Chooses items of one catalogue for what is said."""

    def __init__(self, catalogue: Catalogue, search: Search) -> None:
        """Choose among the items of `catalogue` with the help of its `search`."""
        self._catalogue = catalogue
        self._names = {item.name.casefold(): item for item in catalogue.items}
        self._tags = catalogue.tags | {*DIETS}
        self._search = search

    def in_shop_words(self, order: Order) -> Order:
        """The order with what belongs to a name in the name: a percentage, or that it is canned."""
        order = without_percentage(order)
        canned = f"canned {order.what}"
        if singular(order.unit) in _CANS and (item := self.meant(canned, Bounds())):
            is_such = names(" ".join(head_words(item.name)), order.what)
            return replace(order, what=canned) if is_such else order
        return order

    def parts(self, order: Order) -> list[Order]:
        """An order for each thing that its phrase joins by "and", where no one thing is all that.

        "Red and green peppers" are red peppers and green peppers. The quantity is that of the
        first. What the shop does not have at all stays one phrase, such as "mac and cheese".
        """
        phrases = [each for each in _JOINED.split(order.what) if each]
        whole = self.meant(order.what, Bounds()) if len(phrases) > 1 else None
        if len(phrases) < 2 or (whole and _JOINED.search(whole.name.replace("-", " "))):
            return [order]
        for place, each in enumerate(phrases):
            item = self.meant(each, Bounds())
            if not (whole or item):
                return [order]
            if item and not (_headed(each, [item]) or _usual(each, [item])):
                phrases[place] = " ".join(dict.fromkeys((*words(each), words(order.what)[-1])))
        rest = (replace(order, what=each, quantity=None, unit="") for each in phrases[1:])
        return [replace(order, what=phrases[0]), *rest]

    def meant(self, phrase: str, bounds: Bounds, basket: Collection[Item] = ()) -> Item | None:
        """The item that a phrase means: by its exact name, in the basket, usual, or plainest.

        Among several, one that fits the diets of only some people is preferred. The "cheapest" and
        the "most expensive" of a kind go by the price of one unit.
        """
        sign, phrase = self._extreme(phrase)
        exact = self._names.get(" ".join(phrase.casefold().split()))
        if sign:
            basket = ()
            aisle = [i for i in _of_aisle(phrase, self._catalogue.items) if not bounds.against(i)]
            if found := _at_price(sign, filter(bounds.suits, aisle)) or _at_price(sign, aisle):
                return found
        elif exact and not bounds.against(exact):
            return exact
        if _is_vague(phrase):
            return None
        for text in self._search.spellings(phrase):
            if found := self._likeliest(text, bounds, basket, sign):
                return found
        ending = (item for item in self._search.ending(phrase) if not bounds.against(item))
        return max(ending, key=lambda item: len(words(item.name)), default=None)

    def _likeliest(
        self, phrase: str, bounds: Bounds, basket: Collection[Item], sign: int
    ) -> Item | None:
        """The item that a phrase most likely means in this spelling."""
        _, kind = _split(phrase, self._tags)
        diets = bounds.diets | bounds.some
        every = self._found(phrase, bounds)
        for name in dict.fromkeys((phrase, kind)):
            every += [item for item in self._search.named(name) if not bounds.against(item)]
        every = list(dict.fromkeys(every))
        if OF_ITS_OWN.intersection(singulars(kind)[-1:]):
            every = [*_headed(kind, every), *_usual(kind, every)]
        labels = LABELS.difference(singulars(phrase))
        plain = [item for item in every if labels.isdisjoint(singulars(item.name))]
        called = _called(phrase, every)
        usual = _usual(kind, every if kind == phrase else called, diets)
        usual.sort(key=lambda item: item.id)  # of equals, the first in the catalogue
        fit = [item for item in called if diets <= labelled(item)] if diets else []
        meant = [item for item in called if item in basket]
        meant = meant or (not fit and (usual or _called(phrase, plain))) or called

        def unfit(item: Item) -> tuple[bool, bool, bool, tuple[int, ...]]:
            return (
                bool(fit) and item not in fit,
                not (diets <= labelled(item) or bounds.suits(item)),
                item not in usual,
                self._search.plainness(item, phrase),
            )

        best = min(meant, key=unfit, default=None)
        if not sign or best is None:
            return best
        bare, alike = _fitting(phrase, every)
        alike = [
            item
            for item in _headed(bare, alike) or called
            if item.category == best.category
            and all(names(bare, other) or not names(item.name, other) for other in _UNLIKE)
        ]
        return _at_price(sign, list(filter(bounds.suits, alike)) or alike) or best

    def _found(self, term: str, bounds: Bounds) -> list[Item]:
        """What the search finds that is not ruled out; a diet is searched for by its name, too."""
        diets = sorted(bounds.diets | bounds.some)
        texts = [*(f"{name} {term}" for name in diets), term]
        found = dict.fromkeys(item for text in texts for item in self._search.search(text, _DEPTH))
        return [item for item in found if not bounds.against(item)]

    def _extreme(self, phrase: str) -> tuple[int, str]:
        """Whether a phrase asks for the cheapest (1) or dearest (-1) of something, or not (0).

        With it comes what it is, "" where that is anything.
        """
        said = " ".join(singulars(phrase))
        for sign, listed in _EXTREMES.items():
            if found := listed.search(said):
                rest = self._search.pruned(said[: found.start()] + said[found.end() :])
                return sign, "" if _ANY.issuperset(singulars(rest)) else rest
        return 0, phrase

    def counted(self, phrase: str) -> tuple[str, float | None]:
        """What a phrase is and how many, if it begins with a number that is no part of a name."""
        first, _, rest = phrase.partition(" ")
        number = float(first) if re.fullmatch(r"[0-9]{1,6}", first) else word_value(first)
        if not rest or number is None or self._search.named(phrase):
            return phrase, None
        return rest, float(number)

    def held(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items`, such as a basket's, that a phrase means."""
        sign, kind = self._extreme(phrase)
        if sign:
            alike = (_of_aisle(kind, items) or self.held(kind, items)) if kind else items
            found = _at_price(sign, alike)
            return [found] if found else []
        for text in self._search.spellings(phrase):
            if found := _called(text, items) or _usual(text, items):
                return found
        return _of_aisle(phrase, items)

    def lacking(self, phrase: str, bounds: Bounds) -> str:
        """Why nothing can be added for a phrase."""
        item = self.meant(phrase, Bounds())
        if _is_vague(self._extreme(phrase)[1]):
            may = f'"{phrase}" may be many things. ' if phrase else ""
            return f"{may}Please name a thing."
        if item is None:
            near = [each.name for each in self._search.search(phrase, 2)]
            return f'The shop has nothing called "{phrase}". Near it: {"; ".join(near)}.'
        return f'Not added, since {bounds.against(item)}: "{phrase}".'

    def offers(self, term: str, bounds: Bounds, decided: Collection[Item]) -> list[Item]:
        """The best permitted items that are what the term's last word says: no vinegar for wine.

        Those that are labelled for the person's diets stand for all, where there are any. None
        where one of them is among the items that are `decided`: in the basket, it serves the term
        already.
        """
        head = " ".join(words(term)[-1:])
        if _is_vague(head):
            return []
        diets = bounds.diets | bounds.some
        found = self._found(term, bounds)
        offers = [i for i in found if names(i.name, head) and bounds.surely_suits(i)]
        if diets:
            aisles = {item.category for item in _headed(head, offers)}
            such = [i for i in offers if i.category in aisles] or offers
            offers = [i for i in such if diets <= labelled(i)] or such
        offers = offers[:_PER_TERM]
        return [] if any(item in decided for item in offers) else offers

    def mentions(self, text: str) -> list[str]:
        """What of the shop a text names, in its words: the longest phrases that end names."""
        said, found = singulars(self._search.translated(text)), list[str]()
        while said:
            sizes = range(min(_LONGEST, len(said)), 0, -1) if said[0] not in _SMALL else ()
            phrases = (" ".join(said[:size]) for size in sizes)
            is_here = (
                p
                for p in phrases
                if not _is_vague(p) and p not in PACKAGES and _headed(p, self._search.named(p))
            )
            phrase = next(is_here, "")
            found += [phrase] if phrase else []
            said = said[len(phrase.split()) or 1 :]
        return found

    def facts(self, what: str, basket: Mapping[Item, int], bounds: Bounds) -> str:
        """The prices and labels of what a phrase means, and what rules it out."""
        near = self._search.search(what, _NEAR)
        sign, kind = self._extreme(what)
        found = [] if sign else _called(what, near)
        if sign and not kind:
            ends = (_at_price(sign, basket), _at_price(sign, self._catalogue.items))
            found = [*dict.fromkeys(item for item in ends if item)]
        few = len(found) <= _LABELLED
        if not (sign and found) and (item := self.meant(what, Bounds())):
            found = [*dict.fromkeys((item, *found))]  # an order for it would bring this one
        if not found:
            named = "; ".join(self._line(item, basket) for item in near[:_NAMED])
            return f'The shop has nothing called "{what}".{f" Near it: {named}." if named else ""}'
        found.sort(key=lambda item: item not in basket)
        listed = "; ".join(self._line(item, basket, labels=few) for item in found[:_NAMED])
        more = f"; and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        told = [f"The shop has {listed}{more}."]
        told += [f"{i.name}: {why}." for i in found[:_NAMED] if (why := bounds.against(i))]
        told.append(bounds.unknown(found[:_NAMED]))
        told.append("I know only names and labels, so please read the packet." if few else "")
        return " ".join(filter(None, told))

    def _line(self, item: Item, basket: Mapping[Item, int], *, labels: bool = False) -> str:
        """An item with its price, perhaps its labels, and how many of it the basket holds."""
        unit = f" ({item.unit})" if item.unit not in ("", "each") else ""
        tags = f", labelled {', '.join(sorted(item.tags))}" if labels and item.tags else ""
        within = f", {basket[item]} in the basket" if item in basket else ""
        return f"{item.name}{unit}, {self._catalogue.money(item.price)}{tags}{within}"


def _is_vague(phrase: str) -> bool:
    """Whether no word of `phrase` says what is meant."""
    return _VAGUE.issuperset(singulars(phrase))


def _of_aisle(phrase: str, items: Iterable[Item]) -> list[Item]:
    """Those of `items` whose category a phrase names."""
    return [item for item in items if singulars(item.category) == singulars(phrase) != []]


def _at_price(sign: int, items: Iterable[Item]) -> Item | None:
    """The cheapest (1) or dearest (-1) of some items; None where none has a price."""
    priced = [(item.price * sign, item) for item in items if item.price is not None]
    return min(priced, key=lambda each: each[0], default=(None, None))[1]


def _called(phrase: str, items: Sequence[Item]) -> list[Item]:
    """Those of `items` that `phrase` names: exactly, by their head noun, or else by any word.

    What it begins with may be a label: "gluten-free pasta" is "Chickpea Pasta" that has this tag.
    """
    exact = [item for item in items if item.name.casefold() == phrase.casefold()] or [
        item for item in items if singulars(item.name) == singulars(phrase)
    ]
    named = [item for item in items if names(item.name, phrase)]
    return exact or _headed(phrase, named) or _headed(*_fitting(phrase, items)) or named


def _headed(phrase: str, items: Iterable[Item]) -> list[Item]:
    """Those of `items` that are what the last word of `phrase` says."""
    last = singulars(phrase)[-1:]
    return [i for i in items if last and last[0] in map(singular, head_nouns(i.name))]


def _usual(phrase: str, items: Sequence[Item], diets: frozenset[str] = frozenset()) -> list[Item]:
    """Those of `items` that people mean by a bare word (cod by "fish"); what fits diets first."""
    usual = _USUAL.get(phrase) or _USUAL.get(" ".join(singulars(phrase)), ())
    kinds = [_called(each, items) for each in usual]
    fit = [[item for item in kind if diets <= labelled(item)] for kind in kinds]
    return next(filter(None, (*fit, *kinds)), list[Item]())


def _fitting(phrase: str, items: Sequence[Item]) -> tuple[str, Sequence[Item]]:
    """`phrase` without the labels that it begins with, and the `items` of that name with them."""
    tags = {tag for item in items for tag in item.tags | labelled(item)}
    label, kind = _split(phrase, tags)
    while label:
        items = [item for item in items if label in item.tags | labelled(item)]
        label, kind = _split(kind, tags)
    return kind, [item for item in items if names(item.name, kind)]


def _split(phrase: str, tags: Iterable[str]) -> tuple[str, str]:
    """The tag that `phrase` begins with, and the rest of it; no tag where there is none."""
    said = words(phrase)
    for tag in sorted(tags, key=len, reverse=True):
        size = len(words(tag))
        if size and said[:size] == words(tag) and not _is_vague(" ".join(said[size:])):
            return tag, " ".join(said[size:])
    return "", phrase
