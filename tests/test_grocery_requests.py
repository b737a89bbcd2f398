"""What a person asks for, refuses, and may not eat is read from their own words."""

from __future__ import annotations

import pytest

from goalscope.envs.grocery.amounts import Request, packages
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.hearing.diets import diet
from goalscope.envs.grocery.hearing.requests import Refusal, amount, clears, unwanted, wanted
from goalscope.envs.grocery.hearing.rewording import heard
from goalscope.envs.grocery.restrictions import DIETS, violates


def asked_for(said: str) -> list[Request]:
    return [request for clause in heard(said) for request in wanted(clause)]


def refused_in(said: str) -> dict[str, Refusal]:
    return {thing: how for clause in heard(said) for thing, how in unwanted(clause).items()}


@pytest.mark.parametrize(
    ("said", "asked"),
    [
        ("I want two dozen eggs", [("eggs", 24)]),
        ("3 bags of chips please", [("chips", 3)]),
        ("a couple of bars of dark chocolate", [("dark chocolate", 2)]),
        ("I need flour, eggs and milk", [("flour", 1), ("eggs", 1), ("milk", 1)]),
        ("two cans of black beans, 6 avocados and some limes",
         [("black beans", 2), ("avocados", 6), ("limes", 1)]),
        ("Can you add birthday candles?", [("birthday candles", 1)]),
        ("don't forget the eggs", [("eggs", 1)]),
        ("no, add eggs", [("eggs", 1)]),
        ("no nuts please, and add butter", [("butter", 1)]),
        ("take out the butter and add oat milk", [("oat milk", 1)]),
        ("I'd like a chocolate cake for 24 people", [("chocolate cake", 1)]),
        ("I don't want the sprinkles", []),
        ("It's for my nephew's birthday, he turns six", []),
        ("she can't eat gluten", []),
        ("", []),
        ("We could do with some bread", [("bread", 1)]),
        ("I fancy some ice cream tonight", [("ice cream", 1)]),
        ("I nearly forgot the butter!", [("butter", 1)]),
        ("twenty-four bagels and half a dozen lemons", [("bagels", 24), ("lemons", 6)]),
        ("two hundred napkins", [("napkins", 200)]),
        ("a pound cake", [("pound cake", 1)]),
        ("milk\neggs\n", [("milk", 1), ("eggs", 1)]),
        ("oat milk for a vegan colleague", [("oat milk", 1)]),
        ("Bread, please. And 2 lemons.", [("bread", 1), ("lemons", 2)]),
        ("I don't need more eggs", []),
        ("What we need is rice and corn", [("rice", 1), ("corn", 1)]),
    ],
)  # fmt: skip
def test_what_is_asked_for_is_heard(said: str, asked: list[tuple[str, int]]) -> None:
    assert [(r.phrase, r.quantity) for r in asked_for(said)] == asked


@pytest.mark.parametrize(
    ("said", "asked"),
    [
        ("We've got rice and beans, we only need corn.", ["corn"]),
        ("Please get onions, I already have garlic and oil", ["onions"]),
        ("Do you have any tofu?", []),
        ("Have you got rye bread?", []),
        ("Did you add the milk?", []),
        ("What does the butter cost?", []),
        ("Can I have three limes?", ["limes"]),
        ("May I get some tofu?", ["tofu"]),
        ("Would you please add rice?", ["rice"]),
        ("How about some cheese?", ["cheese"]),
    ],
)
def test_what_is_there_or_in_question_is_not_asked_for(said: str, asked: list[str]) -> None:
    assert [request.phrase for request in asked_for(said)] == asked


@pytest.mark.parametrize(
    ("said", "lacking"),
    [
        ("We don't have any bread or butter at home.", ["bread", "butter"]),
        ("I have no flour left", ["flour"]),
        ("We have no milk left, so milk please", ["milk"]),
        ("I'm out of coffee", ["coffee"]),
        ("We've run out of eggs and sugar.", ["eggs", "sugar"]),
        ("Haven't got any nuts", ["nuts"]),
        ("There is no cheese in the fridge", ["cheese"]),
    ],
)
def test_lacking_is_needing_and_not_refusing(said: str, lacking: list[str]) -> None:
    assert [request.phrase for request in asked_for(said)] == lacking
    assert not refused_in(said)
    assert diet(said) == set()


@pytest.mark.parametrize(
    ("said", "refused"),
    [
        ("no nuts", ["nuts"]),
        ("without dairy", ["dairy"]),
        ("I don't want the sprinkles", ["sprinkles"]),
        ("take out the butter", ["butter"]),
        ("take the butter out", ["butter"]),
        ("she can't eat gluten", ["gluten"]),
        ("he is allergic to peanuts", ["peanuts"]),
        ("use oat milk instead of milk", ["milk"]),
        ("no nuts, eggs, or dairy", ["nuts", "eggs", "dairy"]),
        ("remove the milk and add eggs", ["milk"]),
        ("Forget the shrimp", ["shrimp"]),
        ("We can leave out the olives", ["olives"]),
        ("Let's skip the wine and drop the cheese", ["wine", "cheese"]),
        ("Please do not forget the wine", []),
        ("Don't skip the olives", []),
        ("She cannot have eggs", ["eggs"]),
        ("no, add eggs", []),
        ("no problem, eggs are fine", []),
        ("don't forget the eggs", []),
        ("I want eggs", []),
    ],
)
def test_what_is_refused_is_heard(said: str, refused: list[str]) -> None:
    assert list(refused_in(said)) == refused


@pytest.mark.parametrize(
    ("said", "named"),
    [
        ("my friend is a celiac", {"gluten-free"}),
        ("im vegan and my son cant have nuts", {"vegan", "nut-free"}),
        ("she can't eat gluten", {"gluten-free"}),
        ("we are all vegetarian", {"vegetarian"}),
        ("no meat or dairy", {"vegetarian", "dairy-free"}),
        ("My son is allergic to peanuts", {"nut-free"}),
        ("everything must be organic", {"organic"}),
        ("I'm lactose intolerant", {"dairy-free"}),
        ("it does not have to be organic", set()),
        ("I am not vegan, add gluten-free bread", set()),
        ("my brother has a shellfish allergy", {"shellfish-free"}),
        ("the girls are allergic to prawns, sesame and tofu",
         {"shellfish-free", "sesame-free", "soy-free"}),
        ("Allergies: almonds, anchovies", {"nut-free", "fish-free"}),
        ("egg or milk allergies", {"egg-free", "dairy-free"}),
        ("he reacts badly to hazelnuts", {"nut-free"}),
        ("Take out the eggs and drop the sugar", set()),
        ("please leave out the nuts", {"nut-free"}),
        ("nobody is allergic to nuts", set()),
        ("We only buy organic.", {"organic"}),
        ("Everything we eat is organic", {"organic"}),
        ("nothing that isn't organic", {"organic"}),
        ("Organic, please!", {"organic"}),
        ("Could you keep the dinner vegetarian?", {"vegetarian"}),
        ("I'm baking gluten-free muffins", {"gluten-free"}),
        ("a dairy-free birthday cake", {"dairy-free"}),
        ("we are cooking for a vegan friend", {"vegan"}),
        ("my sister is vegan and the guests are gluten-free", {"vegan", "gluten-free"}),
        ("one of us is vegan and the guests are gluten-free", {"gluten-free"}),
        ("no nut products please, and no dairy stuff", {"nut-free", "dairy-free"}),
        ("And 2 organic pears, please.", set()),
        ("soy milk for our vegan neighbour", set()),
        ("unsweetened cocoa, honey and syrup", set()),
        ("organic baby food", set()),
        ("the carrots should be organic", set()),
        ("Is it organic?", set()),
        ("Do you have vegan food?", set()),
        ("eggs and milk", set()),
    ],
)  # fmt: skip
def test_restrictions_are_heard(said: str, named: set[str]) -> None:
    assert diet(said) == named


@pytest.mark.parametrize(
    "said",
    [
        "Actually it need not be organic.",
        "Forget organic",
        "Not everything has to be organic",
        "nothing needs to be organic any more",
        "non-organic is fine",
        "it doesn't matter whether it's organic",
        "I want everything to be organic... no, it doesn't have to be organic",
    ],
)
def test_later_words_take_a_diet_back(said: str) -> None:
    assert diet(said, frozenset({"organic", "vegan"})) == {"vegan"}
    assert refused_in(said).keys() <= {"organic"}


@pytest.mark.parametrize("said", ["The pears need not be organic", "no organic milk, please"])
def test_words_about_one_thing_take_no_diet_back(said: str) -> None:
    assert diet(said, frozenset({"organic"})) == {"organic"}


@pytest.mark.parametrize(
    ("restriction", "name", "tags", "violated"),
    [
        ("gluten-free", "All-Purpose Flour", "", True),
        ("gluten-free", "Gluten Free Flour", "", False),
        ("gluten-free", "Almond Flour", "", False),
        ("gluten-free", "Almond Flour Cookies", "", True),
        ("gluten-free", "Lager Beer", "", True),
        ("gluten-free", "Root Beer", "", False),
        ("gluten-free", "Penne", "gluten-free", False),
        ("gluten-free", "Large Eggs", "", False),
        ("dairy-free", "Almond Milk", "", False),
        ("dairy-free", "Milk Chocolate Bar", "", True),
        ("dairy-free", "Peanut Butter", "", False),
        ("dairy-free", "Milk Chocolate with Oats", "", True),
        ("dairy-free", "Coconut Milk Chocolate", "", False),
        ("dairy-free", "Butter Biscuits with Cashews", "", True),
        ("egg-free", "Mini Quiches", "", True),
        ("egg-free", "Free-Range Eggs", "", True),
        ("gluten-free", "Brioches", "", True),
        ("shellfish-free", "King Prawns", "", True),
        ("shellfish-free", "Oyster Mushrooms", "", False),
        ("fish-free", "Anchovies in Oil", "", True),
        ("fish-free", "Sushi Rice", "", False),
        ("soy-free", "Firm Tofu", "", True),
        ("sesame-free", "Tahini", "", True),
        ("vegan", "Plant-Based Sausages", "", False),
        ("vegan", "Clover Honey", "", True),
        ("vegetarian", "Chicken Wings", "", True),
        ("vegetarian", "Black Bean Soup", "", False),
        ("nut-free", "Donuts", "", False),
        ("nut-free", "Almond Flour", "", True),
        ("egg-free", "Eggplant", "", False),
        ("organic", "Whole Milk", "", True),
        ("organic", "Organic Whole Milk", "", False),
        ("halal", "Pork Chops", "", True),
        ("halal", "Halal Beef Steak", "", False),
        ("sugar-free", "Cane Sugar", "", True),
    ],
)
def test_tags_decide_and_names_otherwise(
    restriction: str, name: str, tags: str, *, violated: bool
) -> None:
    item = Item(1, name, tags=frozenset(filter(None, [tags])))
    assert violates(item, restriction) is violated


@pytest.mark.parametrize("restriction", sorted(DIETS))
def test_every_restriction_is_heard_by_its_own_name(restriction: str) -> None:
    assert restriction in diet(f"It has to be {restriction}, please.")


@pytest.mark.parametrize(
    ("said", "unit", "number"),
    [
        ("two dozen eggs", "12 ct", 2),
        ("two dozen eggs", "", 2),
        ("8 bagels", "6 ct", 2),
        ("3 bags of bagels", "6 ct", 3),
        ("2 milks", "1 L", 2),
        ("500 napkins", "1 ct", 99),
        ("1.5 kg of flour", "1 kg", 2),
        ("half a kilo of rice", "1 kg", 1),
        ("750g pasta", "500 g", 2),
        ("two pounds of ham", "", 1),
        ("one and a half litres of milk", "500 ml", 3),
        ("2 kg of milk", "1 L", 1),
        ("half a dozen eggs", "12 ct", 1),
        ("a dozen lemons", "each", 12),
        ("twenty bagels", "6 ct", 4),
    ],
)
def test_quantities_count_packages(said: str, unit: str, number: int) -> None:
    (request,) = asked_for(said)
    assert packages(request, Item(1, "x", unit=unit)) == number


def test_a_request_is_at_least_one_package() -> None:
    assert packages(Request("eggs", 1), Item(1, "x", unit="0 ct")) == 1


@pytest.mark.parametrize(
    ("thing", "said", "quantity", "counted"),
    [
        ("orange juice", "I'd say 3 bottles of orange juice, some cola.", 3, "pieces"),
        ("blueberries", "Two packs of blueberries please, fresh ones.", 2, "packages"),
        ("lemonade", "2 lemonades. No: make it four bottles of lemonade.", 4, "pieces"),
        ("eggs", "For two people. He likes eggs with 3 slices of toast.", 1, "pieces"),
        ("rolls", "a dozen rolls, she said", 12, "dozens"),
        ("tea", "nothing of the kind", 1, "pieces"),
    ],
)
def test_amount_of_a_thing_is_found_in_any_sentence(thing, said, quantity, counted) -> None:
    request = amount(thing, said)
    assert (request.quantity, request.counted) == (quantity, counted)


@pytest.mark.parametrize(
    ("said", "whole"),
    [
        ("Actually forget it, take everything out.", True),
        ("Please empty the basket.", True),
        ("Remove everything from my basket!", True),
        ("Don't empty the basket.", False),
        ("Remove everything but the eggs.", False),
        ("Everything is from scratch.", False),
    ],
)
def test_whole_basket_is_emptied_on_the_persons_word(said: str, whole: bool) -> None:
    assert any(map(clears, heard(said))) is whole


def test_thing_whose_name_ends_like_a_verb_is_heard() -> None:
    assert [r.phrase for r in asked_for("I want to buy tulips and a watering can.")] == [
        "tulips",
        "watering can",
    ]
