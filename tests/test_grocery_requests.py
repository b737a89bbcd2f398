"""What a person asks for, refuses, and may not eat is read from their own words."""

from __future__ import annotations

import pytest

from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.diets import DIETS, diet, violates
from goalscope.envs.grocery.requests import Request, packages, unwanted, wanted


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
    ],
)  # fmt: skip
def test_what_is_asked_for_is_heard(said: str, asked: list[tuple[str, int]]) -> None:
    assert [(r.phrase, r.quantity) for r in wanted(said)] == asked


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
        ("no, add eggs", []),
        ("no problem, eggs are fine", []),
        ("don't forget the eggs", []),
        ("I want eggs", []),
    ],
)
def test_what_is_refused_is_heard(said: str, refused: list[str]) -> None:
    assert unwanted(said) == refused


@pytest.mark.parametrize(
    ("said", "named"),
    [
        ("my friend is a celiac", {"gluten-free"}),
        ("she can't eat gluten", {"gluten-free"}),
        ("we are all vegetarian", {"vegetarian"}),
        ("no meat or dairy", {"vegetarian", "dairy-free"}),
        ("My son is allergic to peanuts", {"nut-free"}),
        ("everything must be organic", {"organic"}),
        ("I'm lactose intolerant", {"dairy-free"}),
        ("it does not have to be organic", set()),
        ("I am not vegan, add gluten-free bread", {"gluten-free"}),
        ("eggs and milk", set()),
    ],
)
def test_restrictions_are_heard(said: str, named: set[str]) -> None:
    assert diet(said) == named


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
    ],
)
def test_quantities_count_packages(said: str, unit: str, number: int) -> None:
    (request,) = wanted(said)
    assert packages(request, Item(1, "x", unit=unit)) == number


def test_a_request_is_at_least_one_package() -> None:
    assert packages(Request("eggs", 1), Item(1, "x", unit="0 ct")) == 1
