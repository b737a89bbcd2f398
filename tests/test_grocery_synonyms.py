"""One thing under several names, on both sides of an ocean."""

from __future__ import annotations

import pytest

from goalscope.envs.grocery.synonyms import _KINDS, translator, usual
from goalscope.envs.grocery.words import singulars
from shops import CATALOGUE, SEARCH, talked


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        ("2 bags of crisps and an aubergine", {"Salted Potato Chips": 2, "Eggplant": 1}),
        ("Get semi-skimmed milk, please.", {"2% Reduced-Fat Milk": 1}),
        ("Add Parmesan and a courgette", {"Parmigiano Reggiano": 1, "Zucchini": 1}),
        ("I need loo rolls, nappies and washing-up liquid",
         {"Toilet Paper": 1, "Newborn Diapers": 1, "Dish Soap": 1}),
        ("brown bread", {"Whole Wheat Bread": 1}),
    ],
)  # fmt: skip
def test_what_people_call_it_is_found(said: str, basket: dict[str, int]) -> None:
    opened, told = talked({}, said)
    assert (opened.basket, told) == (basket, [])


def test_questions_and_mentions_are_translated_too() -> None:
    opened, _ = talked({}, "Add crisps.")
    assert "Salted Potato Chips" in (opened.answer("How much are the crisps?") or "")
    assert opened.mentioned(["crisps"]) == ["potato chips"]


@pytest.mark.parametrize(
    "text",
    [
        "A crisp white wine",
        "sweet potatoes",
        "biscuits",
        "I'd like a crisper salad",
        "",
    ],
)
def test_other_words_stand_as_they_are(text: str) -> None:
    assert SEARCH.translated(text) == text


@pytest.mark.parametrize("item", CATALOGUE.items, ids=lambda item: item.name)
def test_no_name_of_the_shop_is_changed(item) -> None:
    assert SEARCH.translated(item.name) == item.name


def test_each_shop_has_words_of_its_own() -> None:
    british = translator({"aubergine", "nappy", "crisps"}.__contains__)
    assert british("Eggplants, potato chips and a diaper") == "aubergine, crisps and a nappy"
    assert translator(lambda name: False)("eggplants") == "eggplants"


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        ("bread, rice and flour",
         {"White Sandwich Bread": 1, "Long Grain White Rice": 1, "All-Purpose Wheat Flour": 1}),
        ("peppers", {"Red Bell Peppers": 1}),
        ("salt and pepper", {"Sea Salt": 1, "Ground Black Pepper": 1}),
        ("onions, chips, tomatoes",
         {"Yellow Onions": 1, "Salted Potato Chips": 1, "Roma Tomatoes": 1}),
        ("rye bread and wild rice", {"Rye Bread": 1, "Wild Rice": 1}),
        ("My son is allergic to peanuts. Bread, please", {"White Sandwich Bread": 1}),
        ("I am gluten intolerant. Bread, please", {"Gluten-Free White Bread": 1}),
        ("gluten-free bread, organic bread",
         {"Gluten-Free White Bread": 1, "Organic White Sandwich Bread": 1}),
        ("gluten free pasta and dairy-free yoghurt", {"Chickpea Pasta": 1, "Soy Yogurt": 1}),
        ("cereal bars and veggie burgers",
         {"Peanut Butter Granola Bars": 1, "Plant-Based Burgers": 1}),
        ("tacos, cocktail napkins and a vodka pasta sauce",
         {"Crunchy Corn Taco Shells": 1, "Cocktail Napkins": 1, "Vodka Pasta Sauce": 1}),
        ("some vegan burgers", {"Black Bean Burgers": 1}),
        ("wraps and oatmeal", {"Spinach Wraps": 1, "Rolled Oats": 1}),
        ("I'm vegan. Cheese, please", {"Vegan Cream Cheese": 1}),
    ],
)  # fmt: skip
def test_a_bare_word_means_what_most_people_mean(said: str, basket: dict[str, int]) -> None:
    assert talked({}, said)[0].basket == basket


@pytest.mark.parametrize("thing", ["vodka", "cider", "sushi", "margarine", "hamburgers"])
def test_what_is_only_named_after_a_thing_is_not_that_thing(thing: str) -> None:
    opened, told = talked({}, f"Add {thing} and eggs")
    assert opened.basket == {"Large Eggs": 1}
    assert told == [f"The shop has nothing called '{thing}'."]


@pytest.mark.parametrize("kind", sorted(_KINDS))
def test_what_is_usual_holds_the_bare_word_or_is_of_its_aisle_and_is_sold(kind: str) -> None:
    names = usual(kind)
    bare = set(singulars(kind)[-1:])
    for name in names:
        aisles = {item.category for item in SEARCH.named(name)}
        compound = any(kind.startswith(word) for word in singulars(name))
        same = SEARCH.translated(f"fresh {kind}") == name
        assert bare <= set(singulars(name)) or aisles == {kind} or compound or same
    assert any(map(SEARCH.named, names))
