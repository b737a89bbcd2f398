"""Reasons that people give, what they take out, and what they swap after an answer."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.types import Action
from shops import shop, talked

PASTA = {"Spaghetti": 1, "Long Grain White Rice": 1}


@pytest.mark.parametrize(
    "words",
    [
        "Take the rice out again, I still have a bag",
        "Take out the rice, I still have a bag",
        "Take the rice out, we already have two packs at home",
        "Remove the rice because we still have some",
        "Take the rice out, my husband bought a bag",
    ],
)
def test_a_reason_to_take_a_thing_out_asks_for_nothing(words: str) -> None:
    opened, told = talked(PASTA, words)
    assert (opened.basket, told) == ({"Spaghetti": 1}, [])


@pytest.mark.parametrize(
    "words", ["Take everything you guessed out", "take whatever you guessed out, please"]
)
def test_what_was_guessed_goes_where_the_verb_is_in_two_parts(words: str) -> None:
    opened = shop()
    for action in (*opened.requests(said("Rice")), Action("add item", "Lager Beer")):
        assert opened.step(action).ok
    turns = said("Rice", words)
    assert opened.is_order(turns)
    assert opened.requests(turns) == [Action("remove item", "Lager Beer")]


@pytest.mark.parametrize("words", ["take that beer thing out", "get rid of the odd stuff"])
def test_nothing_is_guessed_for_words_that_take_out(words: str) -> None:
    assert shop().is_order(said(words))


def test_no_vinegar_is_guessed_for_wine() -> None:
    vegan = said("We are having a vegan dinner with friends")
    offered = shop().actions(("red wine", "wine"), vegan)
    assert not [each.target for each in offered if "Vinegar" in each.target]


@pytest.mark.parametrize(
    "words",
    [
        "We also have a vegetarian coming",
        "there's a vegetarian coming too",
        "A friend is vegetarian",
    ],
)
def test_a_guests_diet_binds_guesses_alone(words: str) -> None:
    opened, _ = talked({}, words, "Two packs of ground beef")
    assert opened.basket == {"Ground Beef": 2}
    offered = opened.actions(("chicken", "burger"), said(words, "I want to host a dinner"))
    assert offered
    assert not any("Chicken" in each.target for each in offered)


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Vanilla ice cream", "Make it two tubs then"], {"Vanilla Ice Cream": 2}),
        (["Ketchup", "Take it out", "Put the ketchup back in as well"], {"Ketchup": 1}),
        (["Red wine", "What's the cheapest wine you have?", "I'll have that one instead"],
         {"Chianti Red Wine": 1}),
        (["A bottle of red wine would be nice too"], {"Merlot Red Wine": 1}),
        (["Pasta", "First swap the pasta for rice"], {"Long Grain White Rice": 1}),
        (["2 whole milk", "One of the milks should be oat milk"],
         {"Whole Milk": 1, "Oat Milk": 1}),
        (["2 whole milk", "Make one of them oat milk instead"],
         {"Whole Milk": 1, "Oat Milk": 1}),
        (["oat milk x2"], {"Oat Milk": 2}),
    ],
)  # fmt: skip
def test_what_is_said_in_a_few_words_more(utterances: list[str], basket: dict[str, int]) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("words", "refused", "diets"),
    [
        ("Give me something instead of milk, I'm allergic to it.", "milk", {"dairy-free"}),
        ("I want something instead of peanuts, my son is allergic.", "peanuts", {"nut-free"}),
        ("Fruit, my son got allergic to bananas.", "bananas", set()),
        ("Get pasta since my wife just got allergic to tomatoes.", "tomatoes", set()),
        ("Crackers, our son got told to avoid garlic.", "garlic", set()),
    ],
)
def test_no_reason_hides_what_harms(words: str, refused: str, diets: set[str]) -> None:
    hearing = hear([words])
    assert hearing.refuses(refused)
    assert hearing.diets == diets


@pytest.mark.parametrize(
    ("before", "words"),
    [
        ({"Whole Milk": 1}, "Put the milk back in."),
        ({"Large Eggs": 1}, "Milk I have enough."),
        ({"Large Eggs": 1}, "No salt, sugar we have plenty."),
        ({}, "If it is cheap, a bottle of wine would be nice."),
        ({}, "Unless it has nuts, a bag of granola would be nice."),
        ({"Whole Milk": 1, "Unsalted Butter": 1}, "Take everything I asked for out."),
    ],
)
def test_these_change_nothing(before: dict[str, int], words: str) -> None:
    assert talked(before, words)[0].basket == before


@pytest.mark.parametrize(
    "words", ["I want to buy it now, but only if it's under $5", "buy it only if it's under $5"]
)
def test_a_limit_on_the_purchase_is_a_budget_and_guesses_nothing(words: str) -> None:
    turns = said("Milk and whole chicken", words)
    opened = shop({"Whole Milk": 1, "Whole Chicken": 1})
    assert opened.is_order(turns)
    assert not opened.is_completion(turns[-1])
    told = opened.unmet(turns, [])
    assert told[0] == 'To have the basket bought, say "Buy the basket".'
    assert "above the $5.00 that you named" in told[1]


@pytest.mark.parametrize(
    "words", ["I want to throw a barbecue out in the garden", "We need food to take away tonight"]
)
def test_an_aim_that_sounds_like_taking_out_stays_one(words: str) -> None:
    assert not shop().is_order(said(words))


def test_labels_choose_among_what_a_term_names() -> None:
    vegan = said("I'm vegan", "I want to have a dinner")
    assert [a.target for a in shop().actions(("mozzarella",), vegan)] == ["Vegan Mozzarella Slices"]


@pytest.mark.parametrize(
    "words", ["Please buy it without the eggs.", "Buy it, but take out the eggs first."]
)
def test_an_order_to_buy_that_changes_the_basket_is_told_how_to_buy(words: str) -> None:
    opened, told = talked({"Whole Milk": 1, "Large Eggs": 1}, words)
    assert opened.basket == {"Whole Milk": 1}
    assert not opened.bought
    assert told[0] == 'To have the basket bought, say "Buy the basket".'


def test_how_much_a_pack_holds_is_told_as_it_is_added() -> None:
    (action,) = shop().requests(said("Six bottles of beer"))
    assert shop().step(action).observation == "Lager Beer (6 ct) added to the basket."
