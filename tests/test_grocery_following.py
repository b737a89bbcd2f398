"""What people say in ordinary talk, which means what it does by what was said before."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from shops import shop, talked

HELD = {"Party Hats": 1, "Large Eggs": 1, "Edible Gold Glitter": 1, "Orange Juice": 1}


@pytest.mark.parametrize(
    ("basket", "utterances", "after"),
    [
        (HELD, ["Take out the glitter and the eggs, I didn't ask for those."],
         {"Party Hats": 1, "Orange Juice": 1}),
        (HELD, ["Remove the hats. I never asked for them!"],
         {"Large Eggs": 1, "Edible Gold Glitter": 1, "Orange Juice": 1}),
        (HELD, ["I didn't ask for those."], {}),
        (HELD, ["We'd better have three bottles of the orange juice."],
         {**HELD, "Orange Juice": 3}),
        (HELD, ["Take out the eggs", "And the hats and the glitter. And the orange juice."], {}),
        (HELD, ["Take out the eggs", "And the milk please"],
         {"Party Hats": 1, "Edible Gold Glitter": 1, "Orange Juice": 1, "Whole Milk": 1}),
        ({}, ["a cake", "I'd rather have the chocolate fudge cake."], {"Chocolate Fudge Cake": 1}),
        ({}, ["a cake", "I'd rather have pizza."],
         {"Vanilla Sponge Cake": 1, "Frozen Margherita Pizza": 1}),
        ({"Carrot Cake": 1},
         ["a cake", "Two packs of plates. Is there a chocolate cake instead of the carrot cake?",
          "Yes, swap it for the chocolate one."],
         {"Paper Plates": 2, "Chocolate Fudge Cake": 1}),
        ({"Brown Rice": 1, "Pizza Sauce": 1},
         ["I already have rice at home so you can leave that out."], {"Pizza Sauce": 1}),
        ({"Fresh Cilantro": 1, "Garlic": 1}, ["no coriander, it tastes like soap to her"],
         {"Garlic": 1}),
        ({"Merlot Red Wine": 1},
         ["How much is the parmesan?", "Ok, a pack of that. And make it two bottles of wine."],
         {"Merlot Red Wine": 2, "Parmigiano Reggiano": 1}),
        (HELD, ["I don't think we need hats or glitter for tacos."],
         {"Large Eggs": 1, "Orange Juice": 1}),
        (HELD, ["I don't think we'll need any eggs"],
         {"Party Hats": 1, "Edible Gold Glitter": 1, "Orange Juice": 1}),
        (HELD, ["I don't think we have enough eggs"], HELD),
        ({}, ["Morning! I need milk"], {"Whole Milk": 1}),
        ({}, ["milk and bread", "Is the bread whole grain?", "I'd prefer wholemeal."],
         {"Whole Milk": 1, "Whole Wheat Bread": 1}),
        ({}, ["Then some coffee as well, decaf if you have it."], {"Decaf Ground Coffee": 1}),
        ({}, ["milk, purple if you have it"], {"Whole Milk": 1}),
        ({}, ["milk and bread", "What kinds of bread do you have?",
              "Then the whole wheat bread instead of the white one please."],
         {"Whole Milk": 1, "Whole Wheat Bread": 1}),
        ({}, ["Could I get a dessert, something like tiramisu?"], {"Tiramisu": 1}),
    ],
)  # fmt: skip
def test_it_is_understood_as_people_mean_it(
    basket: dict[str, int], utterances: list[str], after: dict[str, int]
) -> None:
    assert talked(basket, *utterances)[0].basket == after


@pytest.mark.parametrize(
    ("basket", "utterances", "after"),
    [
        ({}, ["bread", "I'd prefer gluten-free", "add pasta"],
         {"Gluten-Free White Bread": 1, "Chickpea Pasta": 1}),
        ({}, ["ice cream", "I'd prefer dairy-free"], {"Dairy-Free Vanilla Ice Cream": 1}),
        ({"Whole Milk": 1}, ["take out the milk, maybe something like oat milk"], {}),
        ({"Whole Milk": 1}, ["remove the milk, oat if you have it"], {}),
        (HELD, ["Don't order it without the eggs"], HELD),
        (HELD, ["We don't want to order it without the hats"], HELD),
        (HELD, ["milk please", "Take out the rest, I didn't ask for it"], {"Whole Milk": 1}),
        (HELD, ["Remove the hats and everything else. I didn't ask for that"], {}),
        (HELD, ["Take those out, I didn't ask for them"], {}),
        ({"Large Eggs": 1}, ["Take out the eggs", "and the brown eggs instead"],
         {"Brown Eggs": 1}),
        ({"Large Eggs": 1}, ["Take out the eggs", "And the oat milk for my coffee"],
         {"Oat Milk": 1}),
        ({"Large Eggs": 1, "Bananas": 1}, ["Take out the eggs", "and the rest stays"],
         {"Bananas": 1}),
        ({"Bananas": 3}, ["make it 2 bananas"], {"Bananas": 2}),
        ({"Large Eggs": 2}, ["make it 3 eggs"], {"Large Eggs": 3}),
        ({"Lemons": 3}, ["2 lemons, not 3"], {"Lemons": 2}),
        ({}, ["Add cookies, I want to leave them out for santa"], {"Shortbread Cookies": 1}),
        ({"Brown Rice": 1}, ["I have rice, and please leave it"], {"Brown Rice": 1}),
        ({}, ["chips, chocolate if you have it"],
         {"Salted Potato Chips": 1, "Milk Chocolate Bar": 1}),
        ({}, ["fish fingers", "I'd rather have fish"],
         {"Frozen Breaded Fish Fingers": 1, "Cod Fillets": 1}),
    ],
)  # fmt: skip
def test_it_is_not_understood_as_more_than_that(
    basket: dict[str, int], utterances: list[str], after: dict[str, int]
) -> None:
    assert talked(basket, *utterances)[0].basket == after


@pytest.mark.parametrize(
    ("said", "bound"),
    [
        ("No meat, anything like salami", ["From now on it has to be vegetarian."]),
        ("No nuts, anything like almonds", ["From now on it has to be nut-free."]),
        ("no meat, something like tofu", ["From now on it has to be vegetarian."]),
        ("I'm not a vegan personally", []),
    ],
)
def test_what_is_refused_stays_refused(said: str, bound: list[str]) -> None:
    opened, notes = talked({}, said)
    assert (opened.basket, notes) == ({}, bound)


def test_a_diet_of_others_still_binds_what_is_guessed() -> None:
    opened, notes = talked({}, "She's vegan.", "And a bit of yoghurt for me, I'm not vegan myself.")
    assert opened.basket == {"Plain Yogurt": 1}
    assert [each.startswith("As only some are vegan, only what I guess") for each in notes] == [
        True
    ]


def test_what_is_not_needed_must_be_named() -> None:
    opened, notes = talked(HELD, "Remove anything we don't need for pancakes.")
    assert opened.basket == HELD
    assert notes == ["It is not clear which thing you mean. Please name it."]


def test_what_was_to_make_way_for_nothing_was_asked_for_still() -> None:
    held = {"Large Eggs": 1, "Paper Plates": 1}
    said = ["some plates", "swap them for purple plates", "Take out all that I didn't ask for"]
    assert talked(held, *said)[0].basket == {"Paper Plates": 1}


@pytest.mark.parametrize(
    ("said", "question", "told"),
    [
        ("She's vegan", "Is everything vegan apart from the yoghurt?",
         "Listed as vegan: Garam Masala. I know"),
        ("", "How much would it be without the yoghurt?",
         "Without Plain Yogurt the total is $2.19."),
        ("My budget is 20 dollars", "How much is it now, and what's over my budget?",
         "The total is $5.18, which leaves $14.82 of the $20.00"),
        ("", "My budget is 20 dollars, how much do I have left?",
         "The total is $5.18, which leaves $14.82 of the $20.00"),
        ("", "Has the yoghurt got gluten in it?", "Listed as gluten-free: Plain Yogurt."),
        ("", "Have you got vegan butter or margarine?", "The shop has Vegan Butter, $4.19."),
        ("", "What nut-free things do you sell?",
         "The shop has 310 things labelled as nut-free, such as Bananas; "),
        ("", "Is there a chocolate cake instead of the carrot cake?",
         "The shop has Chocolate Fudge"),
        ("What kinds of ricotta do you have?", "Which one of those is cheapest?",
         "The cheapest is Ricotta Cheese"),
        ("One of the kids is allergic to peanuts.",
         "Is the yoghurt safe for the kid with the allergy?", "I cannot tell whether this is nut-"),
    ],
)  # fmt: skip
def test_what_is_asked_is_answered(said: str, question: str, told: str) -> None:
    opened = shop({"Plain Yogurt": 1, "Garam Masala": 1})
    answer = opened.answer(question, [Turn("", said), Turn("", question)])
    assert (answer or "").startswith(told)


@pytest.mark.parametrize(
    ("said", "after"),
    [
        ("a bag of flour, the big bag if you have it", {"All-Purpose Wheat Flour": 1}),
        ("rice, but the large bag please", {"Long Grain White Rice": 1}),
        ("Get the biggest bag of rice you have", {"Long Grain White Rice": 1}),
        ("milk, the small one, and eggs", {"Whole Milk": 1, "Large Eggs": 1}),
    ],
)
def test_which_size_is_no_thing(said: str, after: dict[str, int]) -> None:
    opened, notes = talked({}, said)
    assert opened.basket == after
    assert notes == ["I do not choose by size: what is added says how much it is."]
