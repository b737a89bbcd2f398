"""Catalogues of items, read from the built-in one or from any shop's CSV file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from importlib.resources import files
from itertools import chain, count
from pathlib import Path

from goalscope.base.inputs import read_csv
from goalscope.base.text import plain, without_invisible
from goalscope.base.types import InvalidInputError
from goalscope.language.amounts import (
    APART,
    DIGITS,
    MARK,
    NOUN,
    Money,
    codes_of,
    is_ambiguous,
    plain_digits,
    same_currency,
    value_of,
)

_LONGEST = 120  # characters of a name, a category, a unit or a tag
_QUOTED = 30  # characters of a price that a note quotes, and of a currency

_COLUMNS: Mapping[str, tuple[str, ...]] = {
    "name": ("name", "product name", "product", "title", "product title", "item", "item name"),
    "category": ("category", "sub category", "subcategory", "aisle", "department", "section"),
    "unit": ("unit", "size", "pack size", "package size", "weight"),
    "price": ("price", "sale price", "unit price", "current price", "market price", "cost"),
    "tags": ("tags", "labels", "dietary"),
    "brand": ("brand", "brand name"),
    "currency": ("currency", "currency symbol"),
}
"""The usual headings of each column, likeliest first."""

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
_THROUGH = re.compile(r"(?:\s*(?:through|to|-)\s*)+(?=\S)", re.IGNORECASE)
"""Between the two ends of a range of prices."""

_UNDIVIDED = frozenset({"HUF", "IDR", "JPY", "KRW", "VND"})
"""Currencies that nobody writes with decimals."""

_IN_THOUSANDTHS = frozenset({"BHD", "IQD", "JOD", "KWD", "LYD", "OMR", "TND"})
"""Currencies with three decimals."""

_OTHER = {".": ",", ",": "."}

_PRICE = re.compile(
    rf"(?P<before>{MARK})? ?(?P<digits>\.\d+|{APART}|{DIGITS}) ?(?P<after>{MARK}|{NOUN})?"
    r"(?: ?/? ?(?:each|ea\.?))?"
)
_DASHED = re.compile(
    rf"(?<!\d)(?<!\d[.,'/])({APART}|{DIGITS})(?:([.,])[-\u2013-\u2015]{{1,2}}|/-)"
    rf"(?:(?![\w-])|(?={MARK}|{NOUN}))"
)
"""Sums with a dash for no cents: 30.- or 1.295,- or 30/-."""


@dataclass(frozen=True, slots=True)
class Item:
    """An item of the shop.

    Attributes:
        id: Position in the catalogue, from 1.
        name: Unique in its catalogue, at most 120 characters on one line, no control characters.
        category: The aisle, such as "baking"; empty if there is none.
        unit: The size of one unit, such as "1 kg" or "12 ct"; empty if unknown.
        price: Price of one unit in the catalogue's currency; None if there is none.
        tags: Facts in lower case, such as "gluten-free" or "source of iron".
    """

    id: int
    name: str
    category: str = ""
    unit: str = ""
    price: Decimal | None = None
    tags: frozenset[str] = frozenset()


class Catalogue:
    """Items with unique names, in the order of their file.

    Attributes:
        items: All items.
        currency: Symbol or code to print before a price.
        tags: All tags of the items.
        notes: Notes on what was adapted while loading, one sentence each.
    """

    def __init__(
        self, items: Iterable[Item], *, currency: str = "$", notes: Sequence[str] = ()
    ) -> None:
        """Keep `items`.

        Raises:
            InvalidInputError: There are no items, or two have the same name.
        """
        self.items = tuple(items)
        self.currency = currency
        self.notes = tuple(notes)
        self.tags = frozenset(tag for item in self.items for tag in item.tags)
        if not self.items:
            raise InvalidInputError("The catalogue has no items. Add at least one row with a name.")
        self._by_name = {item.name: item for item in self.items}
        if len(self._by_name) != len(self.items):
            raise InvalidInputError("Two items of the catalogue have the same name.")

    def __len__(self) -> int:
        """How many items there are."""
        return len(self.items)

    def get(self, name: str) -> Item | None:
        """The item of exactly this name."""
        return self._by_name.get(name)

    def money(self, amount: Decimal | None) -> str:
        """`amount` formatted, such as "$4.50", or "no price"."""
        gap = " " if self.currency[-1:].isalpha() else ""
        return "no price" if amount is None else f"{self.currency}{gap}{amount:,.2f}"

    @classmethod
    def load(
        cls,
        path: Path | str | None = None,
        *,
        columns: Mapping[str, str] | None = None,
    ) -> Catalogue:
        """Read a CSV file with a heading row; commas, semicolons or tabs between the cells.

        Args:
            path: The file, UTF-8. None reads the built-in catalogue.
            columns: The heading of each field, such as `{"name": "Title", "price": "Price"}`. The
                fields are name, category, unit, price, tags, brand and currency; those left out are
                found by their usual headings. Only a name is required.

        Raises:
            InvalidInputError: The file cannot be read, or has no heading for the names.
        """
        built_in = files("goalscope.envs.grocery") / "data" / "catalogue.csv"
        source = built_in if path is None else Path(path)
        label = f"The catalogue {Path(str(source)).name}"
        rows = read_csv(source, label)
        where = _placed(next(rows, list[str]()), columns or {}, label)
        cells = [
            {column: _clean(row[i]) if i < len(row) else "" for column, i in where.items()}
            for row in rows
        ]
        return _collected(cells, label)


def _placed(headings: list[str], columns: Mapping[str, str], label: str) -> dict[str, int]:
    """Where each of our columns is in a row."""
    unknown = sorted(set(columns) - set(_COLUMNS))
    if unknown:
        raise InvalidInputError(
            f"There is no catalogue column {unknown[0]!r}. The columns are {', '.join(_COLUMNS)}."
        )
    found = ", ".join(repr(_clean(h)) for h in headings[:20] if h.strip()) or "none"
    headed = [" ".join(re.split(r"[\s_\-]+", _clean(h).casefold())) for h in headings]
    where: dict[str, int] = {}
    for column, usual in _COLUMNS.items():
        if column in columns:
            wanted = _clean(columns[column])
            exact = [i for i, heading in enumerate(headings) if _clean(heading) == wanted]
            if not exact:
                raise InvalidInputError(
                    f"{label} has no column {wanted!r} for the {column}. Its columns are: {found}."
                )
        else:
            heading = next((h for h in usual if h in headed), None)
            exact = [i for i, each in enumerate(headed) if each == heading]
        if len(exact) > 1:
            raise InvalidInputError(
                f"{label} has {len(exact)} columns {_clean(headings[exact[0]])!r}, "
                f"and one is wanted for the {column}. Give each another heading."
            )
        if exact:
            where[column] = exact[0]
    if "name" not in where:
        raise InvalidInputError(
            f"{label} has no column for the names. Its columns are: {found}. "
            'Name it, such as --column name=Title, or columns={"name": "Title"}.'
        )
    return where


def _collected(rows: Sequence[Mapping[str, str]], label: str) -> Catalogue:
    """The catalogue of rows, which have a cell for each column that there is."""
    named = [row for row in rows if row["name"]]
    if not named:
        raise InvalidInputError(f"{label} has no rows with a name. Check the file.")
    prices, currency, told = _prices(
        [(row.get("price", ""), row.get("currency", "")) for row in named]
    )
    items: dict[str, Item] = {}
    renamed = 0
    for row, price in zip(named, prices, strict=True):
        name, unit = row["name"], row.get("unit", "")
        sized = (f"{name} ({each})" for each in (unit, row.get("brand", "")) if each)
        numbered = (f"{name} ({number})" for number in count(2))
        unique = next(each for each in chain((name,), sized, numbered) if each not in items)
        renamed += unique != name
        tags = frozenset(t for t in map(str.strip, row.get("tags", "").lower().split(";")) if t)
        item = Item(len(items) + 1, unique, row.get("category", ""), unit, price, tags)
        items[unique] = item
    notes = [f"{n} rows without a name were left out." for n in [len(rows) - len(named)] if n]
    notes += told
    if renamed:
        notes.append(f"{renamed} repeated names were told apart by unit, brand or number.")
    return Catalogue(items.values(), currency=currency, notes=notes)


def _prices(
    paid: Sequence[tuple[str, str]],
) -> tuple[Sequence[Decimal | None], str, list[str]]:
    """The prices of all rows, since one alone does not tell what its marks mean.

    Args:
        paid: What each row has for the price and for the currency.

    Returns:
        The price of each row, None for no price; the currency of most; and notes on what was not
        understood, or is in another currency, and so is no price.
    """
    mark = _decimal_mark({cell for cell, _ in paid})
    known = {pair: _price(pair[0], mark, pair[1]) for pair in dict.fromkeys(paid)}
    read = [known[pair] for pair in paid]
    stated = [
        money.currency if money and money.currency else _printed(currency)
        for money, (_, currency) in zip(read, paid, strict=True)
    ]
    counts = Counter[str]()
    for money, name in zip(read, stated, strict=True):
        counts[name] += 1 if money else 0
    names = [name for name, _ in counts.most_common() if name]
    priced = [name for name in names if counts[name]]
    main = _main(priced or names)
    others = [name for name in priced if not same_currency(name, main)]
    amounts = [
        money.amount if money and name not in others else None
        for money, name in zip(read, stated, strict=True)
    ]
    wrong = [cell for (cell, _), money in zip(paid, read, strict=True) if cell and not money]
    example = wrong[0][:_QUOTED] if wrong else ""
    ranges = sum(
        bool(money) and len(_ends(cell)) == 2 for (cell, _), money in zip(paid, read, strict=True)
    )
    told = [
        (ranges, "prices were ranges; the lower end is used."),
        (len(wrong), f'prices were not understood, such as "{example}".'),
        (
            sum(counts[name] for name in others),
            f"prices are not in {main} but in {', '.join(others)}: they do not count.",
        ),
        (amounts.count(None), "items have no price."),
    ]
    return amounts, main[:_QUOTED], [f"{n} {text}" for n, text in told if n]


def _main(names: Sequence[str]) -> str:
    """The currency of most, by its code where another price tells it: DKK of "kr." and "DKK".

    Args:
        names: All that are named, the most frequent first.
    """
    main = names[0] if names else "$"
    codes = [name for name in names if codes_of(name) == [name.upper()]]
    may = [code for code in codes if code.upper() in codes_of(main)]
    return may[0] if may and not same_currency(may[0], main) else main


def _price(cell: str, mark: str, currency: str) -> Money | None:
    """The price in a cell, or the lower end of a range of prices; None where it is anything else.

    Args:
        cell: The cell.
        mark: The one before decimals in the column; "" if unknown.
        currency: The one that the row states; "" for none.
    """
    ends: list[Money] = []
    for found in map(_PRICE.fullmatch, _ends(cell)):
        if found is None:
            return None
        named = sorted(
            filter(None, (found["before"], found["after"])), key=lambda n: len(codes_of(n))
        )
        stated = named[0] if named else currency
        last = re.sub(r"[^.,]", "", found["digits"])[-1:]
        before_decimals = mark
        if stated.strip().upper() in _IN_THOUSANDTHS:
            before_decimals = last
        elif _UNDIVIDED.issuperset(codes_of(stated) or ("",)):
            before_decimals = _OTHER.get(last, "")
        value = value_of(found["digits"], before_decimals)
        if value is None or (len(named) == 2 and not same_currency(named[1], named[0])):
            return None
        ends.append(Money(value, named[0] if named else ""))
    names = [each.currency for each in ends if each.currency]
    if len(ends) > 2 or (names and not same_currency(names[-1], names[0])):
        return None
    return Money(min(each.amount for each in ends), names[0] if names else "")


def _ends(cell: str) -> list[str]:
    """The two ends of a range, or the one price; "12,-" and "12/-" are 12."""
    return _THROUGH.split(_printed(cell))


def _decimal_mark(cells: Iterable[str]) -> str:
    """The mark before decimals in a column of prices, "." or ","; "" if it is not known.

    The comma of "2,49" tells it, and so do the points of "1.234.567". Of 1,299 alone, the comma is
    taken for one between thousands, and so is the point where several prices are like 1.299. It is
    not known where the cells contradict: one of 1.500 and 1,500 must have decimals, and 1,500 may
    be either number beside 12.345,60.
    """
    decimals, thousands, unclear = set[str](), set[str](), set[str]()
    several = set[str]()
    for match in (each for cell in cells for each in re.finditer(DIGITS, _printed(cell))):
        if parted := re.fullmatch(r"(.*)([.,])(\d+)", match[0]):
            if is_ambiguous(parted):
                unclear.add(parted[2])
                several.add(match[0])
            else:
                thousands |= {*parted[1]} & {".", ","}
                decimals |= {parted[2]} - {*parted[1]}
    if max(map(len, (unclear, decimals, thousands))) == 2 or decimals & thousands:
        return ""
    if thousands and decimals & unclear:
        return ""
    if decimals:
        return decimals.pop()
    parts = thousands or (unclear if "," in unclear or len(several) > 1 else set[str]())
    return _OTHER[parts.pop()] if parts else ""


def _printed(text: str) -> str:
    """A cell as price takes it: plain, on one line, with zeros for a dash: "30.00" for "30.-"."""
    line = plain_digits(" ".join(plain(text).split()))
    return _DASHED.sub(lambda found: f"{found[1]}{found[2]}00" if found[2] else found[1], line)


def _clean(text: str) -> str:
    """`text` on one line, without control and invisible characters, cut at `_LONGEST`."""
    shown = without_invisible(_CONTROL.sub(" ", text[: 20 * _LONGEST]))
    return " ".join(shown.split())[:_LONGEST].rstrip()
