"""What people say who only shop: how they begin, contrast, and let a thing go."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from shops import talked


@pytest.mark.parametrize(
    ("held", "said", "after"),
    [
        ({"Brown Rice": 1}, ["Arborio rice, not brown rice, and no ravioli please"],
         {"Arborio Risotto Rice": 1}),
        ({"Chocolate Milk": 1},
         ["No, I want a dozen eggs and two litres of normal milk, not chocolate milk"],
         {"Large Eggs": 1, "Whole Milk": 2}),
        ({}, ["Let's start with a loaf of wholemeal bread and two litres of milk"],
         {"Whole Wheat Bread": 1, "Whole Milk": 2}),
        ({"Dishwasher Tablets": 1}, ["Actually I've still got dishwasher tablets, so not those"],
         {}),
        ({}, ["how much is the laundry detergent?", "I'll take it, and some sponges"],
         {"Laundry Detergent": 1, "Kitchen Sponges": 1}),
        ({}, ["Add milk", "add crisps", "Fine, the crisps can go as well"], {"Whole Milk": 1}),
        ({}, ["Sauvignon Blanc", "A cheaper bottle of white wine, if there is one"],
         {"Pinot Grigio White Wine": 1}),
        ({"Unsalted Butter": 1}, ["she's off dairy"], {}),
        ({}, ["a whole chicken and chicken livers", "Drop the chicken livers",
              "take out all I didn't ask for"], {"Whole Chicken": 1}),
    ],
)  # fmt: skip
def test_it_is_done_as_people_say_it(
    held: Mapping[str, int], said: list[str], after: Mapping[str, int]
) -> None:
    assert talked(held, *said)[0].basket == after


def test_a_limit_may_stand_behind_its_thing() -> None:
    opened, notes = talked({}, "I need batteries, but only if they're under five dollars.")
    assert opened.basket == {"AA Batteries": 1}
    assert notes == ["Above the $5.00 that you named: AA Batteries, $6.09."]
