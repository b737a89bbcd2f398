"""When the shop is to guess nothing, and what a budget allows."""

from __future__ import annotations

from decimal import Decimal

import pytest

from fakes import said
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.hearing.limits import budget, guesses
from shops import CATALOGUE, shop, talked

TERMS = ("cheese", "flour", "chocolate", "burger", "milk", "bread", "wine", "chicken")


@pytest.mark.parametrize(
    "utterance",
    [
        "stop adding things",
        "Stop adding things I didn't ask for!",
        "please don't add anything I don't ask for",
        "never add anything that I haven't asked for",
        "Only add what I ask for.",
        "don't guess",
        "No, nothing else, thanks",
        "No suggestions, please",
        "don't surprise me",
        "You keep adding stuff I didn't ask for, stop!",
        "I said nothing else",
    ],
)
def test_guessing_stops_until_the_person_asks_for_ideas(utterance: str) -> None:
    opened = shop()
    assert opened.actions(TERMS, said("I want to bake a cake"))
    assert not opened.actions(TERMS, said(utterance))
    assert not opened.actions(TERMS, said(utterance, "I want to bake a cake"))
    assert opened.actions(TERMS, said(utterance, "Any ideas for a cake?"))
    assert opened.actions(TERMS, said(utterance, "Surprise me"))
    assert [each.target for each in opened.requests(said(utterance, "Add 3 lemons"))] == ["Lemons"]


@pytest.mark.parametrize(
    "utterance",
    [
        "don't add anything with nuts",
        "stop adding milk",
        "nothing else but milk",
        "don't put the eggs on the milk",
        "why did you suggest that?",
        "I guess we need milk",
    ],
)
def test_what_is_said_of_one_thing_stops_no_guessing(utterance: str) -> None:
    assert guesses(utterance)
    assert not guesses(utterance, before=False)


@pytest.mark.parametrize(
    ("utterance", "most"),
    [
        ("I don't want to spend more than 20 dollars", "20"),
        ("under $30, please", "30"),
        ("my budget is 25", "25"),
        ("We're on a budget of 1,200 euros", "1200"),
        ("a $25.50 budget", "25.50"),
        ("at most 40 euros", "40"),
        ("twenty dollars at most", "20"),
        ("keep it below 15", "15"),
        ("Please don't go over 30.", "30"),
        ("The total should be under 50", "50"),
        ("I only have 20 bucks", "20"),
        ("I need snacks for a party under $30", "30"),
        ("milk, eggs, bread, under $30", "30"),
        ("some milk and eggs, max $30", "30"),
        ("a party for ten, under $100", "100"),
        ("dinner for four under $30", "30"),
        ("i want a curry tonight, max $15", "15"),
        ("I want a vegetarian lasagna, max $20", "20"),
        ("i need a full shop, max $80", "80"),
        ("snacks $5 or less", "5"),
        ("Add 2 milk, and don't spend more than 20", "20"),
    ],
)
def test_a_budget_is_heard_and_is_no_thing_to_buy(utterance: str, most: str) -> None:
    assert budget(utterance) == Decimal(most)
    assert budget("My budget is 99.", Decimal(1)) == 99
    assert budget("Never mind the budget", Decimal(1)) is None
    heard = hear([utterance])
    assert heard.budget == Decimal(most)
    assert not any("dollar" in r.phrase or r.quantity > 2 for r in heard.wanted)
    assert hear([utterance, "Forget about the budget."]).budget is None


@pytest.mark.parametrize(
    "utterance",
    [
        "20 dollars of cheese",
        "wine under $10",
        "and some snack for school, max $5",
        "snacks for max $5",
        "an apple pie, at most $6",
        "Add a wine, $10 max",
        "a bottle of wine for less than $10",
        "spend at most 5 dollars on cheese",
        "no more than $3 each",
        "no more than 3 lemons",
        "2 pounds of beef at most",
        "keep it under 20 items",
        "How much is 20 dollars?",
        "I have 2 eggs",
        "that is way over 20 dollars!",
    ],
)
def test_other_numbers_are_no_budget(utterance: str) -> None:
    assert budget(utterance) is None
    assert budget(utterance, Decimal(7)) == 7


@pytest.mark.parametrize(
    ("utterance", "basket", "told"),
    [
        ("a wine under $10 and milk", {"Chianti Red Wine": 1, "Whole Milk": 1},
         ["Above the $10.00 that you named: Chianti Red Wine, $11.09."]),
        ("a wine under $20", {"Chianti Red Wine": 1}, []),
        ("a toy for max $5", {}, ["The shop has nothing called 'toy'."]),
        ("steak $30 or less, potatoes", {"Sirloin Steak": 1, "White Potatoes": 1}, []),
        ("apples and some snack for school, max $5", {"Gala Apples": 1},
         ["No limit for one thing is watched, so please look at the price: $5.00."]),
    ],
)  # fmt: skip
def test_a_limit_for_one_thing_is_none_of_the_basket_s_and_is_told(
    utterance: str, basket: dict[str, int], told: list[str]
) -> None:
    opened, notes = talked({}, utterance)
    assert (opened.basket, notes) == (basket, told)


def test_nothing_is_guessed_beyond_the_budget_and_what_is_above_it_is_told() -> None:
    opened = shop({"Bananas": 1})
    turns = said("I don't want to spend more than 20 dollars")
    offered = opened.actions(TERMS, turns)
    assert offered
    prices = [item.price or 0 for each in offered if (item := CATALOGUE.get(each.target))]
    assert all(opened.total + price <= 20 for price in prices)
    assert opened.unmet(turns, []) == ["From now on all of it may cost $20.00."]
    assert not opened.actions(TERMS, said("My budget is 3 dollars"))
    turns = said(*[turn.utterance for turn in turns], "40 packs of eggs")
    assert not opened.actions(TERMS, turns)
    (action,) = opened.requests(turns)
    results = [opened.step(action)]
    (told,) = opened.unmet(turns, results)
    assert told == f"The basket comes to ${opened.total:,.2f}, above the $20.00 that you named."
    assert opened.unmet([*turns, *said("Thanks")], []) == []
    lifted = opened.unmet([*turns, *said("Never mind the budget")], results)
    assert lifted == ["From now on it may cost any sum."]


@pytest.mark.parametrize(
    "words",
    [
        "I'm allergic to anything with nuts",
        "Don't add anything I don't ask for and no nuts",
        "Don't add anything with nuts",
        "Never add things that contain nuts",
        "Stop adding stuff, no nuts!",
        "Nothing else with nuts, please",
        "Nothing else, and no nuts, under $30",
        "Only lemons and nothing else, I'm allergic to nuts",
        "My budget is 20 and my son is allergic to nuts",
    ],
)
def test_no_limit_hides_an_allergy(words: str) -> None:
    assert hear([words]).diets == {"nut-free"}


def test_all_that_is_guessed_at_once_stays_within_the_budget() -> None:
    opened = shop()
    turns = said("We have friends over for football, I want to spend at most 30 dollars.")
    assert not opened.is_order(turns)
    terms = ["wine", "cheese", "chips", "salsa", "bread", "shrimp", "cake", "cookies"]
    offers = [opened.actions([term], turns) for term in terms]
    found = [CATALOGUE.get(each[0].target) for each in offers if each]
    assert len(found) > 3
    assert sum(item.price or 0 for item in found if item) <= 30
