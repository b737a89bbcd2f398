"""Which items of the shop a phrase or a search term means, and how many of them."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal, NotRequired, TypedDict

from goalscope.base.nouns import contains, head_nouns, names, singular, singulars, words
from goalscope.base.text import plain
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.dietary import Bounds, bounds_of, labelled, labelled_in
from goalscope.envs.grocery.diets import DIETS, finder
from goalscope.envs.grocery.search import WORDS, Search
from goalscope.language.amounts import figures, is_currency, word_value
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order

__all__ = ["MOST", "Choice", "packages", "without_percentage"]

MOST = 99
"""Units of one item that a basket holds at most."""

_PER_TERM = 5
"""Items offered for each search term."""

_VAGUE = frozenset(WORDS["vague"].split())
_SMALL = frozenset(WORDS["small"].split()) | frozenset(WORDS["empty"].split())
_ANY = frozenset(WORDS["any"].split())
_OF_ITS_OWN = frozenset(WORDS["own"].split())
_EXTREMES = {1: finder(WORDS["cheapest"]), -1: finder(WORDS["dearest"])}
_UNLIKE = [name.strip() for name in WORDS["unlike"].split(",")]
_USUAL = {word: names.split(", ") for word, names in WORDS["usual"].items()}

_DEPTH = 10
"""Best items of a search that count."""

_NAMED = 5
"""Items that an answer names at most."""

_LABELLED = 2
"""Most items of which an answer tells the labels."""

_LONGEST = 4
"""Most words of a phrase that a question mentions."""

_NEAR = 100
"""Items among which an answer looks for a thing."""

_GRAMS = {
    **dict.fromkeys(("kg", "kilo", "kilogram", "kilogramme"), 1000.0),
    **dict.fromkeys(("g", "gram", "gramme", "gr", "gm"), 1.0),
    **dict.fromkeys(("mg", "milligram", "milligramme"), 0.001),
    **dict.fromkeys(("lb", "pound"), 454.0),
    **dict.fromkeys(("oz", "ounce"), 28.35),
    **dict.fromkeys(("st", "stone"), 6350.0),
}
_MILLILITRES = {
    **dict.fromkeys(("l", "litre", "liter", "ltr"), 1000.0),
    **dict.fromkeys(("ml", "mil", "millilitre", "milliliter"), 1.0),
    **dict.fromkeys(("cl", "centilitre", "centiliter"), 10.0),
    **dict.fromkeys(("dl", "decilitre", "deciliter"), 100.0),
    **dict.fromkeys(("tsp", "teaspoon"), 5.0),
    **dict.fromkeys(("tbsp", "tablespoon"), 15.0),
    "floz": 29.57,
    "gill": 118.0,
    "cup": 237.0,
    **dict.fromkeys(("pt", "pint"), 473.0),
    **dict.fromkeys(("qt", "quart"), 946.0),
    **dict.fromkeys(("gal", "gallon"), 3785.0),
}
_FLUID = re.compile(r"\bfl(?:uid)?\.? ?(?:oz|ounce)(?:es|s)?\b", re.IGNORECASE)
_PACKAGES = frozenset(
    ("pack", "packet", "package", "pkg", "box", "bag", "carton", "case", "crate", "sixpack", "tray")
)
_PIECES = frozenset((
    "ball", "bar", "basket", "big", "block", "bone", "book", "bottle", "branch", "breast", "bulb",
    "bunch", "bundle", "cake", "can", "canister", "capsule", "card", "chub", "clove", "cob",
    "container", "count", "ct", "cube", "dispenser", "drum", "ea", "each", "ear", "fillet",
    "head", "item", "jar", "jug", "keg", "large", "leaf", "loaf", "log", "lot", "medium",
    "multipack", "nest", "net", "pad", "pc", "piece", "pk", "plate", "portion", "pot", "pouch",
    "punnet", "rack", "rasher", "ream", "reel", "ring", "roll", "sachet", "sack", "serving",
    "sheet", "side", "sleeve", "slice", "small", "spear", "sprig", "stalk", "stick", "strip",
    "tablet", "tin", "truckle", "tub", "tube", "unit", "wedge", "wheel", "whole", "x",
))  # fmt: skip
"""Units that are a piece of what there is; any other is told."""

_DOZENS = dict.fromkeys(("dozen", "doz", "dz"), 12.0) | {"gross": 144.0}
_NUMBERS = {**_DOZENS, "score": 20.0, "pair": 2.0, "half": 0.5, "quarter": 0.25}
_THIRTEEN = re.compile(r"\bbaker'?s? (?:dozen|doz|dz)\b")
_SIZE = re.compile(
    rf"(?:(\d+)\s*x\s*)?(\d+(?:\.\d+)?)\s*({'|'.join([*_GRAMS, *_MILLILITRES])})s?\b"
)
_PERCENT = r"(?:%|per ?cent|pct\.?)(?!\w)"
_PERCENTAGE = re.compile(rf"(?<![\w.])(\d+(?:\.\d+)?|[a-z]+)[ -]?{_PERCENT}", re.IGNORECASE)
_BEFORE_PERCENTAGE = re.compile(r"([0-9]{1,6}|[a-z]+) ([a-z]+) of ((?:[a-z]+ ){0,2}[\d.]+% .+)")
_HOLDS = re.compile(
    r"(\d+)(?:\s*x\s*\d|[\s-]*(?:ct|count|pack|pk|pcs|pieces)\b)|(?:pack|box|bag) of (\d+)"
    r"|.*, about (\d+)$"
)

_Counted = Literal["packages", "pieces", "dozens", "grams", "millilitres", "money", "unknown"]


class CountedThing(TypedDict):
    """A thing, and how many; see `Choice.counted`."""

    what: str
    quantity: NotRequired[float]


class Choice:
    """Chooses items of one catalogue for what is said."""

    def __init__(self, catalogue: Catalogue, search: Search) -> None:
        """Choose among the items of `catalogue` with the help of its `search`."""
        self._catalogue = catalogue
        self._names = {item.name.casefold(): item for item in catalogue.items}
        self._tags = {tag for item in catalogue.items for tag in item.tags} | {*DIETS}
        self._search = search

    def bounds(self, dialogue: DialogueState) -> Bounds:
        """The bounds that the limits of a dialogue come to here."""
        return bounds_of(dialogue, self._labels if dialogue.limits else frozenset())

    @cached_property
    def _labels(self) -> frozenset[str]:
        return labelled_in(self._catalogue)

    def meant(self, phrase: str, bounds: Bounds, basket: Collection[str] = ()) -> Item | None:
        """The item that a phrase means: by its exact name, in the basket, usual, or plainest.

        Among several, one that fits the diets of only some people is preferred. The "cheapest" and
        the "most expensive" of a kind go by the price of one unit.
        """
        sign, phrase = self._extreme(phrase)
        if sign:
            basket = ()
            aisle = [i for i in _of_aisle(phrase, self._catalogue.items) if bounds.permits(i)]
            if found := _at_price(sign, filter(bounds.suits, aisle)) or _at_price(sign, aisle):
                return found
        exact = self._names.get(" ".join(phrase.casefold().split()))
        if exact and bounds.permits(exact) and not sign:
            return exact
        if _is_vague(phrase):
            return None
        for text in dict.fromkeys((phrase, *self._nearly(phrase))):
            if found := self._meant(text, bounds, basket, sign):
                return found
        ending = filter(bounds.permits, self._search.ending(phrase))
        return max(ending, key=lambda item: len(words(item.name)), default=None)

    def _meant(
        self, phrase: str, bounds: Bounds, basket: Collection[str], sign: int
    ) -> Item | None:
        _, kind = _labelled(phrase, self._tags)
        diets = bounds.diets | bounds.some
        names = dict.fromkeys((phrase, kind))
        others = (i for name in names for i in self._search.named(name) if bounds.permits(i))
        every = list(dict.fromkeys([*self._found(phrase, bounds), *others]))
        if _OF_ITS_OWN.intersection(singulars(kind)[-1:]):
            every = [*_headed(kind, every), *self.usually(kind, every)]
        plain = [item for item in every if not self._search.labels(item, phrase)]
        named = _called(phrase, every)
        meant = [item for item in named if item.name in basket]
        usual_ones = self._usual_kind(kind, diets, every if kind == phrase else named)
        some_labelled = bool(diets) and any(diets <= labelled(item) for item in named)
        meant = meant or (not some_labelled and (usual_ones or _called(phrase, plain))) or named

        def unfit(item: Item) -> tuple[bool, bool, bool, tuple[int, ...]]:
            return (
                some_labelled and not diets <= labelled(item),
                not (diets <= labelled(item) or bounds.suits(item)),
                item not in usual_ones,
                self._search.plainness(item, phrase),
            )

        best = min(meant, key=unfit, default=None)
        if not sign or best is None:
            return best
        bare, fit = _fitting(phrase, every)
        headed = _headed(bare, [item for item in fit if _is_a(item, bare)])
        alike = [i for i in headed or named if i.category == best.category and _is(i, bare)]
        fitting = [item for item in alike if bounds.suits(item)]
        return _at_price(sign, fitting or alike) or best

    def _extreme(self, phrase: str) -> tuple[int, str]:
        """Whether a phrase asks for the cheapest (1) or dearest (-1) of something, or not (0).

        With it comes what it is, "" where that is anything.
        """
        said = " ".join(singulars(phrase))
        for sign, listed in _EXTREMES.items():
            if found := listed.search(said):
                rest = self._search.pruned(said[: found.start()] + said[found.end() :])
                is_any = (_ANY | _SMALL).issuperset(singulars(rest))
                return sign, "" if is_any else rest
        return 0, phrase

    def counted(self, phrase: str) -> CountedThing:
        """What a phrase is and how many, if it begins with a number that is no part of a name."""
        first, _, rest = phrase.partition(" ")
        number = float(first) if re.fullmatch(r"[0-9]{1,6}", first) else word_value(first)
        if not rest or number is None or self._search.named(phrase):
            return {"what": phrase}
        return {"what": rest, "quantity": float(number)}

    def held(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items`, such as a basket's, that a phrase means."""
        sign, kind = self._extreme(phrase)
        if sign:
            alike = (_of_aisle(kind, items) or self.held(kind, items)) if kind else items
            found = _at_price(sign, alike)
            return [found] if found else []
        for text in dict.fromkeys((phrase, *self._nearly(phrase))):
            if found := _called(text, items) or self.usually(text, items):
                return found
        return _of_aisle(phrase, items)

    def usually(self, phrase: str, items: Sequence[Item]) -> list[Item]:
        """Those of `items` that people mean by a bare word: cod, by "fish"."""
        return next(filter(None, (_called(each, items) for each in _usual(phrase))), list[Item]())

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

    def offers(self, term: str, bounds: Bounds, decided: Collection[str]) -> list[Item]:
        """The best permitted items that are what the term's last word says: no vinegar for wine.

        Those that are labelled for the person's diets stand for all, where there are any. None
        where one of them is among the names that are `decided`: in the basket, it serves the term
        already.
        """
        head = " ".join(words(term)[-1:])
        if _is_vague(head):
            return []
        diets = bounds.diets | bounds.some
        offers = [i for i in self._found(term, bounds) if bounds.surely_suits(i) and _is_a(i, head)]
        if diets:
            aisles = {item.category for item in _headed(head, offers)}
            such = [i for i in offers if i.category in aisles] or offers
            offers = [i for i in such if diets <= labelled(i)] or such
        offers = offers[:_PER_TERM]
        return [] if any(item.name in decided for item in offers) else offers

    def mentions(self, text: str) -> list[str]:
        """What of the shop a text names, in its words: the longest phrases that end names."""
        said, found = singulars(self._search.translated(text)), list[str]()
        while said:
            sizes = range(min(_LONGEST, len(said)), 0, -1) if said[0] not in _SMALL else ()
            size = next((size for size in sizes if self._is_here(" ".join(said[:size]))), 0)
            found += [" ".join(said[:size])] if size else []
            said = said[size or 1 :]
        return found

    def _is_here(self, phrase: str) -> bool:
        """Whether something here is what a phrase says."""
        is_vague = _is_vague(phrase) or phrase in _PACKAGES
        return not is_vague and bool(_headed(phrase, self._search.named(phrase)))

    def facts(self, what: str, basket: Mapping[str, int], bounds: Bounds) -> str:
        """The prices and labels of what a phrase means, and what rules it out."""
        near = self._search.search(what, _NEAR)
        sign, kind = self._extreme(what)
        found = [] if sign else _called(what, near)
        if sign and not kind:
            held = (item for item in self._catalogue.items if item.name in basket)
            ends = (_at_price(sign, held), _at_price(sign, self._catalogue.items))
            found = [*dict.fromkeys(item for item in ends if item)]
        few = len(found) <= _LABELLED
        if not (sign and found) and (item := self.meant(what, Bounds())):
            found = [*dict.fromkeys((item, *found))]  # an order for it would bring this one
        if not found:
            named = "; ".join(self._line(item, basket) for item in near[:_NAMED])
            return f'The shop has nothing called "{what}".{f" Near it: {named}." if named else ""}'
        found.sort(key=lambda item: item.name not in basket)
        listed = "; ".join(self._line(item, basket, labels=few) for item in found[:_NAMED])
        more = f"; and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        against = [
            f"{item.name}: {why}." for item in found[:_NAMED] if (why := bounds.against(item))
        ]
        against += [told] if (told := bounds.unknown(found[:_NAMED])) else []
        caution = ["I know only names and labels, so please read the packet."] if few else []
        return " ".join([f"The shop has {listed}{more}.", *against, *caution])

    def _line(self, item: Item, basket: Mapping[str, int], *, labels: bool = False) -> str:
        """An item with its price, perhaps its labels, and how many of it the basket holds."""
        unit = f" ({item.unit})" if item.unit not in ("", "each") else ""
        tags = f", labelled {', '.join(sorted(item.tags))}" if labels and item.tags else ""
        held = basket.get(item.name, 0)
        within = f", {held} in the basket" if held else ""
        return f"{item.name}{unit}, {self._catalogue.money(item.price)}{tags}{within}"

    def _nearly(self, phrase: str) -> Iterable[str]:
        """`phrase` in the shop's words, without words of no thing and slips of the pen."""
        translated = self._search.translated(phrase)
        yield translated
        yield self._search.translated(self._search.pruned(translated))
        mended = self._search.translated(self._search.mended(phrase))
        yield self._search.translated(self._search.pruned(mended))
        _, of, rest = phrase.partition(" of ")  # what a bottle holds
        if of:
            yield from self._nearly(rest)

    def _usual_kind(self, phrase: str, diets: Collection[str], among: Sequence[Item]) -> list[Item]:
        """What people mean by a bare word, as far as it is `among` these; what fits diets first."""
        named = (self._search.named(name) for name in _usual(phrase))
        kinds = [[item for item in kind if item in among] for kind in named]
        fit = [[item for item in kind if {*diets} <= labelled(item)] for kind in kinds]
        none: list[Item] = []
        return next((kind for kind in (*fit, *kinds) if kind), none)

    def _found(self, term: str, bounds: Bounds) -> list[Item]:
        """What the search finds that is not ruled out; a diet is searched for by its name, too."""
        diets = sorted(bounds.diets | bounds.some)
        texts = [*(f"{name} {term}" for name in diets), term]
        found = dict.fromkeys(item for text in texts for item in self._search.search(text, _DEPTH))
        return [item for item in found if bounds.permits(item)]


def _usual(phrase: str) -> Sequence[str]:
    """What people mean by `phrase` who name no kind: "bread" as "white sandwich bread"."""
    return _USUAL.get(phrase) or _USUAL.get(" ".join(singulars(phrase)), ())


def _of_aisle(phrase: str, items: Iterable[Item]) -> list[Item]:
    """Those of `items` whose category a phrase names."""
    return [item for item in items if singulars(item.category) == singulars(phrase) != []]


def _at_price(sign: int, items: Iterable[Item]) -> Item | None:
    """The cheapest (1) or dearest (-1) of some items; None where none has a price."""
    priced = [(item.price * sign, item) for item in items if item.price is not None]
    return min(priced, key=lambda each: each[0], default=(None, None))[1]


def _is(item: Item, kind: str) -> bool:
    """Whether an item is of the kind that its last word says: root beer is no beer."""
    return not any(_is_a(item, name) and not names(kind, name) for name in _UNLIKE)


def _is_vague(phrase: str) -> bool:
    """Whether no word of `phrase` says what is meant."""
    return _VAGUE.issuperset(singulars(phrase))


def _called(phrase: str, items: Sequence[Item]) -> list[Item]:
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
    kind, fit = _fitting(phrase, items)
    return _headed(kind, [item for item in fit if _is_a(item, kind)]) or named


def _fitting(phrase: str, items: Sequence[Item]) -> tuple[str, Sequence[Item]]:
    """`phrase` without the labels that it begins with, and those of `items` that carry them."""
    tags = {tag for item in items for tag in item.tags | labelled(item)}
    label, kind = _labelled(phrase, tags)
    while label:
        items = [item for item in items if label in item.tags | labelled(item)]
        label, kind = _labelled(kind, tags)
    return kind, items


def _headed(phrase: str, items: Iterable[Item]) -> list[Item]:
    """Those of `items` that are what the last word of `phrase` says."""
    last = singulars(phrase)[-1:]
    return [i for i in items if last and last[0] in map(singular, head_nouns(i.name))]


def _labelled(phrase: str, tags: Iterable[str]) -> tuple[str, str]:
    """The tag that `phrase` begins with, and the rest of it; no tag where there is none."""
    said = words(phrase)
    for tag in tags:
        size = len(words(tag))
        if size and said[:size] == words(tag) and not _is_vague(" ".join(said[size:])):
            return tag, " ".join(said[size:])
    return "", phrase


def _is_a(item: Item, phrase: str) -> bool:
    """Whether the item's name has every word of the phrase."""
    return contains(singulars(item.name), singulars(phrase))


def without_percentage(order: Order) -> Order:
    """An order whose percentage is part of a name, and no quantity: 2% milk, 70% chocolate.

    Of "3 cartons of 2% milk", the three are the quantity.
    """
    what, for_ = (_PERCENTAGE.sub(_percentage, each) for each in (order.what, order.for_))
    if order.quantity is None and (found := _BEFORE_PERCENTAGE.fullmatch(what)):
        number = float(found[1]) if found[1].isdecimal() else word_value(found[1])
        if number:
            quantity, unit = float(number), singular(found[2])
            return replace(order, what=found[3], for_=for_, quantity=quantity, unit=unit)
    if re.match(_PERCENT, order.unit, re.IGNORECASE):
        what = f"{order.quantity:g}% {what}"
        return replace(order, what=what, for_=for_, quantity=None, unit="")
    return replace(order, what=what, for_=for_)


def _percentage(found: re.Match[str]) -> str:
    number = found[1] if found[1][0].isdigit() else word_value(found[1])
    return found[0] if number is None else f"{number}%"


def packages(order: Order, item: Item) -> tuple[int, str]:
    """How many units of `item` an order comes to, at least 1 where it is not for none.

    Two dozen eggs are two of a unit "12 ct", six bagels one of "6 ct", ten bananas two of "1 kg,
    about 7", and 1.5 kg two of "1 kg". Where the unit does not say how many pieces it holds, a
    piece is taken for one unit, and so is a dozen of an item without a unit, or any weight or
    volume that the unit cannot be compared with. A bottle or a roll is a piece, a pack or a box a
    unit of the item, and a pack of six is six pieces. What a unit of no known name is, is told.

    Returns:
        The number, and a note where that is more than was ordered or nobody can tell; "" where it
        is what was ordered. No units come to a sum of money.
    """
    number, counted = _counted(order, item)
    unit, one, slack = _FLUID.sub("floz", figures(plain(item.unit)).lower()), 1.0, 0.0
    ordered = f"{1 if order.quantity is None else order.quantity:g} {order.unit}".strip()
    if counted == "money":
        return 0, f'I cannot tell how much {item.name} is "{ordered}". Please say how many.'
    if counted in ("grams", "millilitres"):
        size = _SIZE.match(unit)
        measures = _GRAMS if counted == "grams" else _MILLILITRES
        slack = 0.01
        one = int(size[1] or 1) * float(size[2]) * measures.get(size[3], 0) if size else 0.0
    elif counted in ("pieces", "dozens") and (found := _HOLDS.match(unit)):
        one = float(next(filter(None, found.groups())))
    elif counted == "dozens" and not unit:
        one = 12.0
    units = max(math.ceil(number / one - slack) if one else 1, int(order.quantity != 0))
    name = f"{item.name} ({item.unit})" if unit not in ("", "each") else item.name
    if not one or counted == "unknown":
        return units, f'I cannot tell how many {name} are "{ordered}", so I take {units}.'
    if order.quantity is None or units * one <= number * (1 + slack):
        return units, ""
    return units, f'{units} x {name} is more than the "{ordered}" that you asked for.'


def _counted(order: Order, item: Item) -> tuple[float, _Counted]:
    """The number, and what it counts."""
    number = 1.0 if order.quantity is None else order.quantity
    unit = _THIRTEEN.sub("13", _FLUID.sub("floz", plain(order.unit).casefold()))
    size, unit = _sized(singular(unit.strip(".")))
    number *= size
    if is_currency(order.unit) and unit not in _GRAMS:  # a pound is a weight here
        return number, "money"
    if unit in _GRAMS:
        return number * _GRAMS[unit], "grams"
    if unit in _MILLILITRES:
        return number * _MILLILITRES[unit], "millilitres"
    if not _DOZENS.keys().isdisjoint(map(singular, words(order.unit))):
        return number, "dozens"
    if size == 1 and _PACKAGES.intersection(unit.split()):
        return number, "packages"
    known = {*_PACKAGES, *_PIECES, *singulars(item.name), *singulars(item.unit)}
    is_known = size != 1 or not unit or unit.split()[-1] in known
    return number, "pieces" if is_known else "unknown"


def _sized(unit: str) -> tuple[float, str]:
    """What one of a unit holds, and of what: 6 of "pack" in "six pack", 500 "g" in "500 g bag"."""
    parts = re.findall(r"[0-9]{1,6}(?:\.[0-9]{1,3})?|[^\W\d_]+", unit)
    sizes = [
        float(part) if part[0].isdigit() else _NUMBERS.get(part) or word_value(part)
        for part in parts
    ]
    places = [place for place, each in enumerate(sizes) if each]
    if not places:
        return 1.0, _measure(" ".join(parts))
    size = min(math.prod(each for each in sizes if each), 1e6)
    after = _measure("".join(parts[places[-1] + 1 : places[-1] + 2]))
    return size, after if after in (*_GRAMS, *_MILLILITRES) else "pack"


def _measure(unit: str) -> str:
    """A unit in the singular: "lb" of "lbs"."""
    short = unit.removesuffix("s")
    return short if short in (*_GRAMS, *_MILLILITRES) else singular(unit)
