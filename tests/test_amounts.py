"""Amounts are what was said or written, or nothing: never silently another number."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.envs.grocery import GroceryShop
from goalscope.language.amounts import figures, is_currency, numbers_in, same_currency, sums_in
from goalscope.language.orders import orders_to_text
from goalscope.language.reader import Reader
from goalscope.models.opening import open_reader


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    """The shipped one, in the shop."""
    opened, taught = open_reader()
    with closing(opened):
        yield Reader(opened, GroceryShop.verbs, taught=taught)


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("one hundred and twenty eggs", "120 eggs"),
        ("two thousand five hundred", "2500"),
        ("twenty-one lemons and thirty limes", "21 lemons and 30 limes"),
        ("lemons twenty and five limes", "lemons 20 and five limes"),
        ("1,000 g of flour", "1000 g of flour"),
        ("2'000 g of rice", "2000 g of rice"),
        ("2,5 kg", "2.5 kg"),
        ("2 doz. eggs and a Dz bagels", "2 dozen eggs and a dozen bagels"),
        ("1.500,00 g", "1500 g"),
        ("1.000 g flour, 12.500 grams of rice", "1000 g flour, 12500 grams of rice"),
        ("a 1.500-ml jug and 2.000ml", "a 1500-ml jug and 2000ml"),
        ("1.50 g, 1,500 g, 2.500 kg, 0.500 g", "1.50 g, 1500 g, 2.500 kg, 0.500 g"),
        ("1/2 kg and 1 1/2 l and ½ kg and 2½ l", "0.5 kg and 1.5 l and 0.5 kg and 2.5 l"),
        ("$1,250.50", "$1250.5"),
        ("€1.250,50", "€1250.5"),
        ("1 250,50 €", "1250.5 €"),
        ("$1.250", "$1250"),
        ("$1.5k", "$1500"),
        ("twelve pounds fifty", "12.5 pounds"),
        ("12 dollars and 50 cents please", "12.5 dollars please"),
        ("thirty-two dollars and fifty cents tops", "32.5 dollars tops"),
        ("٣٠ eggs", "30 eggs"),
        ("2 pounds 8 ounces of flour", "2.5 pounds of flour"),
        ("1 kg 500 g of rice", "1.5 kg of rice"),
        ("two kilos 250 grams", "2.25 kilos"),
        ("14 lb 8oz or 1 litre 250 ml", "14.5 lb or 1.25 litre"),
        ("1 kg, 500 g of rice and 2 lb 300 g", "1 kg, 500 g of rice and 2 lb 300 g"),
    ],
)
def test_amounts_are_read_in_plain_figures(typed: str, read: str) -> None:
    assert figures(typed) == read


@pytest.mark.parametrize(
    "typed",
    [
        "Seven Up, two of those, the second drawer, no one, half a dozen",
        "a hundred eggs, a few hundred, hundreds and thousands, a thousand island dressing",
        "twelve fifty, six thirty, nineteen ninety nine",
        "1.250 kg, v1.2, 1.2.3, items 1,2,3, 24/7, 50/50, 1/64th, the party on 5/11",
        "5.-6. May, the 2.-floor, 3/-x",
        "2 500 g bags, A4, a 4k tv, 12 dollars, 50 eggs, 12 pounds 50 eggs, $12.50, $ 30, ₹500",
    ],
)
def test_what_is_plain_or_no_one_amount_stays(typed: str) -> None:
    assert figures(typed) == typed


PARTS = ["one", "hundred", "octillion", "and", "1,5", "$", "½", "€", "kr", "k", "50", ".", "pounds"]


@given(st.text() | st.lists(st.sampled_from(PARTS)).map(" ".join))
def test_no_text_breaks_it(text: str) -> None:
    read = figures(text)
    assert all(each.amount >= 0 for each in sums_in(read))
    assert all(number >= 0 for number in numbers_in(text))


@pytest.mark.parametrize(
    ("text", "sums"),
    [
        ("$ 30", [("30", "$")]),
        ("30 CHF or CHF 40", [("30", "CHF"), ("40", "CHF")]),
        ("Rs. 500", [("500", "Rs.")]),
        ("US $20 - 20 US dollars", [("20", "US $"), ("20", "US dollars")]),
        ("$20-$30", [("20", "$"), ("30", "$")]),
        ("300kr, 5 euros, 7 quid", [("300", "kr"), ("5", "euros"), ("7", "quid")]),
        ("30 crates, 5 kg, 12 eggs, 7 krakens, 3 tops", []),
    ],
)
def test_sums_of_money_have_their_currency(text: str, sums: list[tuple[str, str]]) -> None:
    assert sums_in(text) == [
        type(found)(Decimal(amount), currency)
        for found, (amount, currency) in zip(sums_in(text), sums, strict=True)
    ]


@pytest.mark.parametrize(
    ("said", "shop", "same"),
    [
        ("dollars", "$", True),
        ("US dollars", "$", True),
        ("Canadian dollars", "$", False),
        ("dollars", "CA$", True),
        ("Euro", "€", True),
        ("quid", "£", True),
        ("rupees", "Rs.", True),
        ("CHF", "francs", True),
        ("CHF", "€", False),
        ("¥", "$", False),
        ("doubloons", "$", False),
        ("doubloon", "Doubloon", True),
    ],
)
def test_currencies_are_one_by_any_name(said: str, shop: str, *, same: bool) -> None:
    assert same_currency(said, shop) is same
    assert is_currency(said) is ("doubloon" not in said)


@pytest.mark.parametrize(
    ("said", "orders"),
    [
        ("one hundred and twenty eggs", "add eggs | 120"),
        ("add eighty eight limes and forty-four lemons", "add limes | 88\nadd lemons | 44"),
        ("1,000 g of flour", "add flour | 1000 g"),
        ("2,5 litres of milk", "add milk | 2.5 litre"),
        ("1.500 g rice", "add rice | 1500 g"),
        ("1/2 kg flour", "add flour | 0.5 kg"),
        ("2 dz. bagels", "add bagels | 2 dozen"),
        ("my budget is seventy dollars", "budget | 70 dollar"),
        ("I can spend a hundred dollars", "budget | 100 dollar"),
        ("keep it under $1,250.50", "budget | 1250.5 $"),
        ("my budget is €1.250,50", "budget | 1250.5 €"),
        ("my budget is $1.5k", "budget | 1500 $"),
        ("my budget is ₹500", "budget | 500 ₹"),
        ("my budget is CHF 30.\u2013", "budget | 30 CHF"),
        ("no more than twelve pounds fifty please", "budget | 12.5 pound"),
        ("$10 of cheese", "add cheese | 10 $"),
        ("just 3 avocados", "add avocados | 3"),
        ("a six pack of coke", "add coke | 1 six pack"),
        ("a 6-pack of cola", "add cola | 1 6-pack"),
        ("a 24 pack of water", "add water | 1 24-pack"),
        ("3 six packs of lager", "add lager | 3 6-pack"),
        ("two packs of six yoghurts", "add yoghurts | 2 pack of 6"),
    ],
)
def test_the_reader_reads_the_amount_that_was_said(reader: Reader, said: str, orders: str) -> None:
    assert orders_to_text(reader.read(said).orders) == orders
