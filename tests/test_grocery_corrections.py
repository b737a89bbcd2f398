"""What people say they meant, and what they only tell of the past."""

from __future__ import annotations

import pytest

from shops import talked


@pytest.mark.parametrize(
    "said",
    [
        "We ordered pizza for tonight, so just drinks please",
        "I wanted a cake, but never mind",
        "I needed 2 eggs and got 12",
        "I ordered milk yesterday",
        "I like cats, not dogs",
        "I wanted 2 cakes last week",
    ],
)
def test_what_was_is_not_asked_for(said: str) -> None:
    assert talked({}, said)[0].basket == {}


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Add ground coffee", "ground, not instant"], None),
        (["Add eggs", "fresh, not frozen"], {"Large Eggs": 1}),
        (["Add bread", "brown, not white"], {"Rye Bread": 1}),
        (
            ["Add 2 whole milk and 3 plain yogurt", "I said milk, not yogurt"],
            {"Whole Milk": 2},
        ),
        (["Add plain yogurt", "I meant oat milk, not yogurt"], {"Oat Milk": 1}),
        (["Add 2 plain yogurt", "no, I meant oat milk"], {"Oat Milk": 2}),
        (["Add whole milk", "Oat milk, not whole milk."], {"Oat Milk": 1}),
        (["I wanted kale."], {"Kale": 1}),
        (["Add whole milk", "no, I meant remove the milk"], {}),
        (["Add whole milk", "oops, I meant remove it"], {}),
        (["Add whole milk", "no, I mean it"], {"Whole Milk": 1}),
        (["Add whole milk", "sorry, I meant for tomorrow"], {"Whole Milk": 1}),
        (["Add rye bread", "i wanted 2 loaves of bread"], {"Rye Bread": 2}),
        (["2 courgettes and some aubergines, please"], {"Zucchini": 2, "Eggplant": 1}),
    ],
)
def test_what_was_meant_takes_the_place_of_what_was_heard(
    utterances: list[str], basket: dict[str, int] | None
) -> None:
    before = talked({}, utterances[0])[0].basket
    opened, told = talked({}, *utterances)
    assert opened.basket == (before if basket is None else basket)
    assert not any("ditto" in note for note in told)


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Add 2 whole milk", "remove the milk, no, keep it"], {"Whole Milk": 2}),
        (["Add 2 whole milk", "Take out the milk. Actually, leave it."], {"Whole Milk": 2}),
        (["Add milk. No, don't."], {}),
        (["Add milk", "add kale and take out the milk, no, leave it"],
         {"Whole Milk": 1, "Kale": 1}),
        (["Add apple pie", "yes but take out the apple pie first"], {}),
        (["3 bottles of merlot", "2 wines instead of 3", "white bread not rye", "plain yogurt"],
         {"Merlot Red Wine": 2, "Plain Yogurt": 1}),
        (["cheddar and apple pie", "my kid is allergic to nuts", "ok"],
         {"Cheddar Cheese": 1, "Apple Pie": 1}),
    ],
)  # fmt: skip
def test_what_is_taken_back_at_once_is_not_done_and_nothing_comes_back(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket
