"""What numbers count: pieces, packs, or what the number before them did."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from shops import shop, talked


@pytest.mark.parametrize(
    ("utterances", "after"),
    [
        (["6 bananas"], {"Bananas": 1}),
        (["10 bananas"], {"Bananas": 2}),
        (["2 kg of bananas"], {"Bananas": 2}),
        (["3 tomatoes and 5 potatoes"], {"Roma Tomatoes": 1, "White Potatoes": 1}),
        (["6 eggs", "Make it 18"], {"Large Eggs": 2}),
        (["24 eggs", "No, 12"], {"Large Eggs": 1}),
        (["6 eggs", "12 eggs instead of 6"], {"Large Eggs": 1}),
        (["a dozen eggs", "18 is enough"], {"Large Eggs": 2}),
        (["a dozen eggs", "Make it two"], {"Large Eggs": 2}),
        (["2 packs of eggs", "Make it three"], {"Large Eggs": 3}),
        (["2 packs of eggs", "Make it 3 eggs"], {"Large Eggs": 3}),
        (["eggs", "Make it 3"], {"Large Eggs": 3}),
        (["eggs", "Make it 12 eggs"], {"Large Eggs": 1}),
        (["6 bananas", "Make it 8 bananas"], {"Bananas": 2}),
    ],
)
def test_a_number_counts_what_people_count(utterances: list[str], after: dict[str, int]) -> None:
    assert talked({}, *utterances)[0].basket == after


@pytest.mark.parametrize(
    ("utterances", "after"),
    [
        (["two loaves of sourdough", "rye instead of the sourdough"], {"Rye Bread": 2}),
        (["milk and bread", "Actually, make that sourdough"],
         {"Whole Milk": 1, "Sourdough Bread": 1}),
        (["bread and milk", "make it sourdough"], {"Whole Milk": 1, "Sourdough Bread": 1}),
        (["milk and bread", "make the bread sourdough"], {"Whole Milk": 1, "Sourdough Bread": 1}),
        (["6 oat milk", "soy instead please"], {"Barista Soy Milk": 6}),
        (["milk and bread", "make it tomorrow"], {"Whole Milk": 1, "White Sandwich Bread": 1}),
    ],
)  # fmt: skip
def test_a_sort_alone_is_of_what_was_asked_for(
    utterances: list[str], after: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == after


@pytest.mark.parametrize(
    ("utterances", "told"),
    [
        (["No crisps please"], "From now on I add nothing called potato chip, unless you ask"),
        (["Keep it under $60"], "From now on all of it may cost $60.00."),
        (["Keep it under $60", "Never mind the budget"], "From now on it may cost any sum."),
        (["Add eggs and flour", "Buy it without the eggs"], 'To have the basket bought, say "Buy'),
    ],
)
def test_what_binds_from_now_on_is_told(utterances: list[str], told: str) -> None:
    (note,) = talked({}, *utterances)[1]
    assert note.startswith(told)


@pytest.mark.parametrize(
    ("said", "known"),
    [
        ("", "I heard of no allergy."),
        ("I'm vegan", "I heard of no allergy. By what you said it has to be vegan."),
        ("I'm allergic to kiwi", "Nothing comes in that is called kiwi."),
        ("I'm allergic to nuts", "By what you said it has to be nut-free."),
        ("No mushrooms", "You do not want: mushrooms."),
    ],
)
def test_it_says_which_allergies_it_knows_of(said: str, known: str) -> None:
    question = "Which allergies do you know about?"
    assert shop().answer(question, [Turn("", said), Turn("", question)]) == known
