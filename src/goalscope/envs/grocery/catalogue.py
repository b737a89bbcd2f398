"""Catalogues of items, read from the built-in one or from any shop's CSV file."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from importlib.resources import files
from pathlib import Path

from goalscope.invisible import without_invisible
from goalscope.types import InvalidInputError

__all__ = ["Catalogue", "Item"]

_LONGEST = 120
"""Maximum length of a name, a category, a unit or a tag."""

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

_NUMBER = r"(\.\d+|\d+(?:[.,]\d+)*)"
_RANGE = re.compile(
    _NUMBER + r"(?:\s*(?:through|to|[-\u2013\u2014]))+\s*[^\d\s]{0,3}\s*" + _NUMBER, re.IGNORECASE
)
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
_SINGLE = re.compile(
    r"^[^\d.,\-\u2212]*(?:(?<=[a-z])\.\s*)?" + _NUMBER + r"(?![\d.,]*e[+-]?\d)", re.IGNORECASE
)


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
        currency: Symbol to print before a price.
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
        return "no price" if amount is None else f"{self.currency}{amount:,.2f}"

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
        source = (
            files("goalscope.envs.grocery") / "data" / "catalogue.csv"
            if path is None
            else Path(path)
        )
        label = Path(str(source)).name
        try:
            raw = source.read_bytes()
        except OSError as error:
            raise InvalidInputError(
                f"Cannot read the catalogue {label}: {error.strerror or error}. Name a CSV file."
            ) from None
        rows = _rows(_decoded(raw, label), label)
        headings = next(rows, list[str]())
        where = _placed(headings, columns or {}, label)
        return _collected(rows, where, label)


def _decoded(raw: bytes, label: str) -> str:
    if b"\0" in raw:
        raise InvalidInputError(
            f"The catalogue {label} has a NUL byte at position {raw.index(0)}: it is not a "
            "text file, or is UTF-16. Save it as CSV in UTF-8."
        )
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InvalidInputError(
            f"The catalogue {label} is not UTF-8: byte {raw[error.start]:#04x} in line {line}. "
            'Save it as UTF-8 (in a spreadsheet: "CSV UTF-8").'
        ) from None


def _rows(text: str, label: str) -> Iterator[list[str]]:
    heading = text.partition("\n")[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=heading.count))
    try:
        yield from reader
    except csv.Error as error:
        raise InvalidInputError(
            f"The catalogue {label} is not valid CSV near line {reader.line_num}: {error}. "
            "Look for an unclosed quotation mark, or a very long cell."
        ) from None


def _placed(headings: list[str], columns: Mapping[str, str], label: str) -> dict[str, int]:
    """Where each of our columns is in a row."""
    unknown = sorted(set(columns) - set(_COLUMNS))
    if unknown:
        raise InvalidInputError(
            f"There is no catalogue column {unknown[0]!r}. The columns are {', '.join(_COLUMNS)}."
        )
    found = ", ".join(repr(_clean(h)) for h in headings[:20] if h.strip()) or "none"
    plain = [" ".join(re.split(r"[\s_\-]+", _clean(h).casefold())) for h in headings]
    where: dict[str, int] = {}
    for column, usual in _COLUMNS.items():
        if column in columns:
            wanted = _clean(columns[column])
            exact = [i for i, heading in enumerate(headings) if _clean(heading) == wanted]
            if not exact:
                raise InvalidInputError(
                    f"The catalogue {label} has no column {wanted!r} for the {column}. "
                    f"Its columns are: {found}."
                )
            where[column] = exact[0]
        else:
            known = [plain.index(h) for h in usual if h in plain]
            if known:
                where[column] = known[0]
    if "name" not in where:
        raise InvalidInputError(
            f"The catalogue {label} has no column for the names. Its columns are: {found}. "
            'Name it, such as --column name=Title, or columns={"name": "Title"}.'
        )
    return where


def _collected(rows: Iterable[list[str]], where: Mapping[str, int], label: str) -> Catalogue:
    items: list[Item] = []
    currency = ""
    taken: set[str] = set()
    counts = {"nameless": 0, "ranges": 0, "unpriced": 0, "renamed": 0}
    for row in rows:
        cells = {c: _clean(row[i]) if i < len(row) else "" for c, i in where.items()}
        if not cells["name"]:
            counts["nameless"] += any(cell.strip() for cell in row)
            continue
        unit = cells.get("unit", "")
        price, is_range = _price(cells.get("price", ""))
        counts["ranges"] += is_range
        counts["unpriced"] += price is None
        name = _unique(cells["name"], (unit, cells.get("brand", "")), taken)
        counts["renamed"] += name != cells["name"]
        taken.add(name)
        tags = frozenset(t for t in map(str.strip, cells.get("tags", "").lower().split(";")) if t)
        items.append(Item(len(items) + 1, name, cells.get("category", ""), unit, price, tags))
        currency = currency or cells.get("currency", "")
    if not items:
        raise InvalidInputError(f"The catalogue {label} has no rows with a name. Check the file.")
    sentences = {
        "nameless": "{} rows without a name were left out.",
        "ranges": "{} prices were ranges; the lower end is used.",
        "unpriced": "{} items have no price.",
        "renamed": "{} repeated names were told apart by unit, brand or number.",
    }
    notes = [s.format(counts[key]) for key, s in sentences.items() if counts[key]]
    return Catalogue(items, currency=(currency or "$")[:4], notes=notes)


def _clean(text: str) -> str:
    """`text` on one line, without control and invisible characters, cut at `_LONGEST`."""
    shown = without_invisible(_CONTROL.sub(" ", text[: 20 * _LONGEST]))
    return " ".join(shown.split())[:_LONGEST].rstrip()


def _unique(name: str, suffixes: Iterable[str], taken: set[str]) -> str:
    if name not in taken:
        return name
    number = 2
    for suffix in suffixes:
        if suffix and (told := f"{name} ({suffix})") not in taken:
            return told
    while (told := f"{name} ({number})") in taken:
        number += 1
    return told


def _price(cell: str) -> tuple[Decimal | None, bool]:
    """The price in `cell`, or None; and whether it was the lower end of a range."""
    if match := _RANGE.search(cell):
        return min(_decimal(match[1]), _decimal(match[2])), True
    match = _SINGLE.match(cell)
    return (_decimal(match[1]), False) if match and len(match[1]) <= 12 else (None, False)


def _decimal(digits: str) -> Decimal:
    """A number with either decimal sign: 1,299.00 or 1.299,00 or 2,49."""
    head, mark, tail = digits.rpartition("," if digits.rfind(",") > digits.rfind(".") else ".")
    is_decimal = digits.count(".") == 1 if mark == "." else len(tail) < 3
    if mark and is_decimal:
        return Decimal(f"{re.sub(r'[.,]', '', head) or 0}.{tail}")
    return Decimal(re.sub(r"[.,]", "", digits))
