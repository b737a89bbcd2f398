"""Any shop's CSV loads, or is refused with its cause and the remedy."""

from __future__ import annotations

import os
from decimal import Decimal
from pathlib import Path

import pytest

from goalscope.base.types import InvalidInputError
from goalscope.envs.grocery import Catalogue

DATA = os.environ.get("GOALSCOPE_DATA")
real = pytest.mark.skipif(not DATA, reason="GOALSCOPE_DATA (a folder of shops' CSVs) is unset")


def load(folder: Path, content: str | bytes, **options: object) -> Catalogue:
    path = folder / "shop.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return Catalogue.load(path, **options)  # type: ignore[arg-type]


def test_the_shipped_catalogue_is_a_supermarket_with_prices() -> None:
    ours = Catalogue.load()
    assert len(ours) > 1000
    assert ours.notes == ()
    assert all(item.price and item.price > 0 and item.unit and item.category for item in ours.items)


@pytest.mark.parametrize(
    ("name", "tag", "has"),
    [
        ("Almond Flour", "gluten-free", True),
        ("All-Purpose Wheat Flour", "gluten-free", False),
        ("Beef Liver", "source of iron", True),
        ("Whole Milk", "vegan", False),
        ("Lager Beer", "gluten-free", False),
    ],
)
def test_tags_state_facts(name: str, tag: str, *, has: bool) -> None:
    item = Catalogue.load().get(name)
    assert item is not None
    assert (tag in item.tags) is has


@pytest.mark.parametrize(
    ("cell", "price"),
    [
        ("$56.99 ", "56.99"),
        ("$32.99through-$83.99", "32.99"),
        ("1,299.00", "1299.00"),
        ("1.299,00", "1299.00"),
        ("2,49 \u20ac", "2.49"),
        ("$.99", "0.99"),
        ("Rs 20/-", "20"),
        ("1'299.00", "1299.00"),
        ("1\u2019299.00", "1299.00"),
        ("1\u202f299,00 kr", "1299.00"),
        ("1,23,456.00", "123456.00"),
        ("12.50 each", "12.50"),
        ("10-12 \u20ac", "10"),
        ("$2.49 USD", "2.49"),
        ("\uffe52\uff0c480", "2480"),
        ("3,000\uc6d0", "3000"),
        ("45 \u0e1a\u0e32\u0e17", "45"),
        ("25.000\u0111", "25000"),
        ("1.234.500 VND", "1234500"),
        ("$2.49ea", "2.49"),
        ("1.295,-", "1295"),
        ("CHF 1\u2019250.\u2013", "1250"),
        ("60,- kr", "60"),
        ("\xa51.299", None),
        ("1.299", None),
        ("1.2.3", None),
        ("$1.5k", None),
        ("2 for $5", None),
        ("99\u00a2", None),
        ("$2.49 EUR", None),
        ("(5.00)", None),
        ("", None),
        ("-5.00", None),
        ("9" * 5000, None),
    ],
)
def test_prices_are_read_as_printed_or_not_at_all(
    tmp_path: Path, cell: str, price: str | None
) -> None:
    quoted = cell.replace('"', '""')
    item = load(tmp_path, f'name,price\nTea,"{quoted}"\n').items[0]
    assert item.price == (None if price is None else Decimal(price))


def test_columns_are_found_by_usual_headings_or_given(tmp_path: Path) -> None:
    text = "Sub Category,Price,Title,Other\nBakery,$3,Bread,Loaf\n"
    item = load(tmp_path, text).items[0]
    assert (item.name, item.category, item.price) == ("Bread", "Bakery", Decimal(3))
    assert load(tmp_path, text, columns={"name": "Other"}).items[0].name == "Loaf"


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_separator_and_byte_order_mark_do_not_matter(tmp_path: Path, separator: str) -> None:
    text = separator.join(["name", "price"]) + "\n" + separator.join(["Tea", "2"]) + "\n"
    assert load(tmp_path, b"\xef\xbb\xbf" + text.encode()).items[0].price == Decimal(2)


def test_currency_comes_from_the_file(tmp_path: Path) -> None:
    text = "name,price,currency\nTea,2,\u20ac\n"
    assert load(tmp_path, text).money(Decimal("1234.5")) == "\u20ac1,234.50"
    assert load(tmp_path, text).money(None) == "no price"


@pytest.mark.parametrize(
    ("cell", "shown"),
    [
        ("\u20ac2.49", "\u20ac2.49"),
        ("12,50 kr", "kr 12.50"),
        ("Rs. 20", "Rs.20.00"),
        ("\u20b8500", "\u20b8500.00"),
        ("2.49", "$2.49"),
    ],
)
def test_a_price_is_shown_in_its_own_currency(tmp_path: Path, cell: str, shown: str) -> None:
    shop = load(tmp_path, f'name,price\nTea,"{cell}"\n')
    assert shop.money(shop.items[0].price) == shown


@pytest.mark.parametrize(
    ("cells", "shown", "told"),
    [
        (["\u20ac2", "$3"], ["\u20ac2.00", "no price"], "not in \u20ac but in $"),
        (["$3", "\u20ac2", "\u20ac5"], ["no price", "\u20ac2.00", "\u20ac5.00"], "but in $"),
        (["$2", "CA$3", "4"], ["$2.00", "no price", "$4.00"], "not in $ but in CA$"),
        (["\u20b920", "Rs. 30"], ["\u20b920.00", "\u20b930.00"], ""),
        (["2 for $5", "$3"], ["no price", "$3.00"], 'not understood, such as "2 for $5"'),
        (["2,49", "1.299"], ["$2.49", "$1,299.00"], ""),
        (["2.49", "2,49", "1.299"], ["$2.49", "$2.49", "no price"], 'such as "1.299"'),
        (["$12.990", "$3.490", "$990"], ["$12,990.00", "$3,490.00", "$990.00"], ""),
        (["1.234.567", "1.500"], ["$1,234,567.00", "$1,500.00"], ""),
        (["1.500", "12.345,6", "1,500"], ["no price", "$12,345.60", "no price"], '"1.500"'),
        (["12.345,60", "1,500"], ["$12,345.60", "no price"], '"1,500"'),
        (["1.299 Ft", "599 Ft"], ["Ft 1,299.00", "Ft 599.00"], ""),
        (["1.500", "1,500", "3"], ["no price", "no price", "$3.00"], "2 prices were not"),
        (["1,234,567", "2,49", "1.500"], ["$1,234,567.00", "$2.49", "no price"], '"1.500"'),
        (["DKK 5", "Kr. 12,95", "5"], ["DKK 5.00", "DKK 12.95", "DKK 5.00"], ""),
        (["kr 5", "7 NOK", "8 SEK"], ["NOK 5.00", "NOK 7.00", "no price"], "SEK"),
        (["\xa5198", "20 CNY"], ["CNY 198.00", "CNY 20.00"], ""),
    ],
)  # fmt: skip
def test_prices_of_a_catalogue_are_of_one_kind_or_told(
    tmp_path: Path, cells: list[str], shown: list[str], told: str
) -> None:
    rows = "".join(f'Tea {place},"{cell}"\n' for place, cell in enumerate(cells))
    shop = load(tmp_path, f"name,price\n{rows}")
    assert [shop.money(item.price) for item in shop.items] == shown
    assert told in " ".join(shop.notes)
    assert bool(shop.notes) is bool(told)


def test_a_column_of_two_currencies_is_told(tmp_path: Path) -> None:
    shop = load(tmp_path, "name,price,currency\nTea,2,USD\nRye,3,EUR\nOil,4,USD\n")
    assert [shop.money(item.price) for item in shop.items] == ["USD 2.00", "no price", "USD 4.00"]
    assert "1 prices are not in USD but in EUR: they do not count." in shop.notes


@pytest.mark.parametrize(
    ("currency", "cell", "price"),
    [("VND", "25.000", "25000"), ("KRW", "3,000", "3000"), ("KWD", "1.250", "1.250")],
)
def test_a_stated_currency_tells_whether_there_are_decimals(
    tmp_path: Path, currency: str, cell: str, price: str
) -> None:
    rows = f'Tea,"{cell}",{currency}\nOil,"{cell.replace("5", "6")}",{currency}\n'
    assert load(tmp_path, f"name,price,currency\n{rows}").items[0].price == Decimal(price)


def test_names_lose_control_and_invisible_characters(tmp_path: Path) -> None:
    text = 'name\n"Dark\n \x1b[31mRye\u202e\u200b Bread"\n' + "x" * 5000 + "\n"
    first, second = load(tmp_path, text).items
    assert first.name == "Dark [31mRye Bread"
    assert len(second.name) == 120


def test_repeated_names_are_told_apart(tmp_path: Path) -> None:
    text = "name,unit,brand\nTea,20 ct,A\nTea,40 ct,A\nTea,40 ct,B\nTea,40 ct,B\n\n,1,2\n"
    shop = load(tmp_path, text)
    assert [i.name for i in shop.items] == ["Tea", "Tea (40 ct)", "Tea (B)", "Tea (2)"]
    assert "1 rows without a name were left out." in shop.notes


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "no column for the names"),
        (b"name\n", "no rows with a name"),
        (b"name,price,price\nTea,2,3\n", "2 columns 'price', and one is wanted for the price"),
        (b"name,Unit Price,unit_price,unit-price\nTea,1,2,3\n", "3 columns 'Unit Price'"),
        (b"colour,weight\nred,2\n", "'colour', 'weight'"),
        (b"name\nTea\0\n", "NUL"),
        ("name\nTea\n".encode("utf-16"), "UTF-16|UTF-8"),
        ("name\nCaf\u00e9\n".encode("latin-1"), "0xe9 in line 2"),
        (b'name\n"' + b"x" * 10_000_000 + b'"\n', "begins in line 2.*very long cell"),
        (b'name,price\n"Tea,2\nMilk,3\nBread,4\n', "begins in line 2: .*quotation mark"),
        (b'name,price\r\nTea,2\r\n\r\n"Milk,3\r\nBread,4\r\n', "begins in line 4: "),
        (b'name,price\nTea,2\n"Milk,3\n"Bread",4\n', "begins in line 3: "),
        (b'name,note\nTea,"fresh\nleaves"\n"Milk,"1 l"\n', "begins in line 4: "),
        (b'"name,price\nTea,2\n', "begins in line 1: "),
        (b'name;price\nPan "small";2\n"Pan 5" steel";3\n', "begins in line 3: "),
        (b'name,price\n"Tea,2\nMilk,3"\nBread,4\n', "line 2: 1 cell for 2 columns"),
        (b"name,price\nTea,2\nTea, green,3\n", "begins in line 3: 3 cells for 2 columns"),
    ],
)
def test_what_cannot_load_is_refused_with_its_cause(
    tmp_path: Path, content: bytes, told: str
) -> None:
    with pytest.raises(InvalidInputError, match=told):
        load(tmp_path, content)


def test_cells_may_hold_line_breaks_separators_and_quotation_marks(tmp_path: Path) -> None:
    text = (
        'name,note,price\n"Pan, 5"" wide","for\n\n""eggs""",3\nPan "small",,2\nTea\n,,\nMilk,,4,\n'
    )
    shop = load(tmp_path, text)
    assert [item.name for item in shop.items] == ['Pan, 5" wide', 'Pan "small"', "Tea", "Milk"]
    assert [item.price for item in shop.items] == [Decimal(3), Decimal(2), None, Decimal(4)]


def test_a_wrong_column_option_is_refused_naming_the_right_ones(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="Its columns are: 'name'"):
        load(tmp_path, "name\nTea\n", columns={"name": "Title"})
    with pytest.raises(InvalidInputError, match="no catalogue column 'titel'"):
        load(tmp_path, "name\nTea\n", columns={"titel": "name"})


def test_a_heading_given_or_used_twice_is_refused_and_another_is_not(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="2 columns 'Title'"):
        load(tmp_path, "Title,Title\nTea,Rye\n", columns={"name": "Title"})
    text = "name,x,x,price,price,cost\nTea,1,2,3,4,5\n"
    assert load(tmp_path, text, columns={"price": "cost"}).items[0].price == Decimal(5)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(InvalidInputError, match=r"is not readable: .*a CSV file"):
            Catalogue.load(path)


@real
@pytest.mark.parametrize(
    ("file", "count"),
    [
        ("costco_grocery_dataset.csv", 1757),
        ("BigBasket_Products_27555.csv", 27554),
        ("instacart_products_aisles_departments.csv", 39115),
    ],
)
def test_real_catalogues_load_with_unique_names(file: str, count: int) -> None:
    shop = Catalogue.load(Path(DATA or "") / "grocery" / file)
    assert len({item.name for item in shop.items}) == len(shop) == count
    assert not any("\n" in item.name for item in shop.items)
