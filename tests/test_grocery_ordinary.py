"""What people say who only shop: how they begin, contrast, and let a thing go."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from shops import shop, talked
from talks import Talk


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


def test_what_is_wanted_only_below_a_price_is_not_bought_above_it() -> None:
    words = "I need milk and batteries, but only if they're under five dollars."
    opened, notes = talked({}, words)
    assert opened.basket == {"Whole Milk": 1}
    assert notes == ["Not added, above $5.00: AA Batteries, $6.09."]
    assert talked({}, words, "add eggs")[0].basket == {"Whole Milk": 1, "Large Eggs": 1}
    assert "AA Batteries" in talked({}, words, "add the batteries anyway")[0].basket
    assert "AA Batteries" in talked({}, words.replace("five", "seven"))[0].basket


HELD = {"Large Eggs": 1, "Whole Milk": 1, "Oat Milk": 1, "Gummy Bears": 1}


@pytest.mark.parametrize(
    "words",
    [
        "take out the apples and whole wheat bread, not oat milk",
        "We drink whole milk, not oat milk, and eat eggs",
        "I already have eggs and whole milk, not oat milk",
        "You don't have to take out what may contain nuts",
        "No need to remove things that may contain nuts",
        "Should I remove anything that may contain nuts?",
        "The store had to remove all products that might contain nuts",
        "Remove anything that may contain nuts, but keep the gummy bears",
        "Leave out everything that might have expired",
        "delete everything not labelled organic",
        "remove what I don't know",
        "remove everything that isn't marked down",
        "remove anything that may contain milkshakes",
        "I can't start with wine",
        "Let's not start with wine",
        "My husband will start with beer, I won't drink",
        "The label is off dairy",
        "We can't wait until she's off dairy",
        "My dog is off meat",
        "The kids can go too",
    ],
)
def test_what_only_sounds_like_it_changes_nothing(words: str) -> None:
    basket = talked(HELD, "My son is allergic to nuts", words)[0].basket
    assert basket == HELD


def test_what_no_label_tells_is_left_to_names() -> None:
    opened, notes = talked(
        {**HELD, "Canned Tuna in Water": 1}, "remove anything that may contain fish"
    )
    assert opened.basket == HELD
    assert notes[0] == "From now on it has to be fish-free."


def test_another_thing_is_no_substitute_for_one_without_a_label() -> None:
    strict = "We are allergic to nuts. Take out everything that isn't labelled nut-free"
    for thing in ("coffee", "cake", "bread", "tea", "pasta"):
        opened, notes = talked({}, strict, f"add {thing}")
        assert opened.basket == {}
        assert notes == [f"Not added, since it is not labelled as nut-free: {thing}."]


@pytest.mark.parametrize(
    ("said", "after"),
    [
        (["Take out everything I didn't ask for", "Put the napkins back, I did want those."],
         {"Paper Napkins": 1}),
        (["add milk", "Take out all I didn't ask for", "put the milk back"], {}),
        (["Put the napkins back"], {"Hot Sauce": 1}),
        (["the hot sauce has to go as well"], {"Paper Napkins": 1}),
        (["napkins and hot sauce", "add milk", "Remove the milk and everything you just guessed."],
         {"Paper Napkins": 1, "Hot Sauce": 1}),
        (["some ears of corn and a green apple"],
         {"Paper Napkins": 1, "Hot Sauce": 1, "Sweet Corn Cobs": 1, "Granny Smith Apples": 1}),
    ],
)  # fmt: skip
def test_things_come_and_go_as_people_say_it(said: list[str], after: Mapping[str, int]) -> None:
    assert talked({"Paper Napkins": 1, "Hot Sauce": 1}, *said)[0].basket == after


def test_why_nobody_asked_is_no_thing() -> None:
    opened, notes = talked({"Hot Sauce": 1}, "Take out the hot sauce, nobody asked for it")
    assert (opened.basket, notes) == ({}, [])


def test_a_diet_that_chooses_is_named() -> None:
    said = ["I'm lactose intolerant", "Add a pack of cheddar for my son, please."]
    opened, notes = talked({}, *said)
    assert opened.basket == {"Vegan Shredded Cheddar": 1}
    assert notes == ["As it has to be dairy-free: Vegan Shredded Cheddar."]
    _, notes = talked({}, *said, "Swap the vegan shredded cheddar for regular cheddar.")
    assert notes[0] == "As it has to be dairy-free: Vegan Shredded Cheddar."


def test_what_a_diet_keeps_from_coming_back_is_told_so() -> None:
    talk = Talk(shop())
    for words in ("add bread flour", "My sister has coeliac disease", "undo that"):
        talk.say(words)
    assert "It has to be gluten-free: Bread Flour." in talk.rounds[-1].notes
