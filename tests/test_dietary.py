"""What is not known to fit a diet is never said to fit, and what is no food is left alone."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from fakes import WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import Action, StepResult
from goalscope.envs.grocery import Catalogue, GroceryShop, Item
from goalscope.envs.grocery.dietary import bounds_of, verdict
from goalscope.envs.grocery.diets import DIETS, read_label
from goalscope.envs.grocery.natures import nature
from goalscope.language.orders import Order
from shops import CATALOGUE, PICK, SEARCH, follow, shop, state_after

DATA = os.environ.get("GOALSCOPE_DATA")
ROWS = (
    ("Crème fraîche", "cheese & dairy"),
    ("Gruyère", "cheese & dairy"),
    ("Comté", ""),
    ("Skyr", "cheese & dairy"),
    ("Dulce de leche", "spreads"),
    ("Tzatziki", "dips"),
    ("Whole Milk", "dairy"),
    ("Oat Milk", "plant-based"),
    ("Tomato Soup", "canned"),
    ("Granola", "breakfast"),
    ("Carrots", "vegetables"),
    ("White Rice", "dry goods"),
    ("Round Cake Pan", "kitchenware"),
    ("Diapers", "baby"),
    ("AA Batteries", "household"),
)


def stocked(*rows: tuple[str, str] | tuple[str, str, str]) -> GroceryShop:
    """A shop of these names, categories and labels (semicolons between), without search terms."""
    return GroceryShop(
        Catalogue(
            Item(n, name, category, price=Decimal(n), tags=frozenset(filter(None, rest)))
            for n, (name, category, *labels) in enumerate(rows, 1)
            for rest in [";".join(labels).split(";")]
        )
    )


def judged(name: str, category: str = "", tags: str = "", diet: str = "dairy-free") -> str:
    labels = frozenset(tag.strip() for tag in tags.lower().split(";") if tag.strip())
    return verdict(Item(1, name, category, tags=labels), diet)


@pytest.mark.parametrize(
    ("label", "fits", "violates"),
    [
        ("contains milk", "", "dairy-free vegan"),
        ("Contains: milk, soy", "", "dairy-free soy-free vegan"),
        ("may contain traces of nuts", "", "nut-free"),
        ("Lactose-Free", "lactose-free", ""),
        ("GF", "gluten-free", ""),
        ("sans gluten", "gluten-free", ""),
        ("gluten & dairy free", "dairy-free gluten-free lactose-free", ""),
        ("free from gluten, milk", "dairy-free gluten-free lactose-free", ""),
        ("Suitable for vegans", "vegan", ""),
        ("V", "vegetarian", ""),
        ("contains barley", "", "gluten-free"),
        ("non-GMO vegan", "vegan", ""),
        ("Not suitable for vegetarians", "", "vegan vegetarian"),
        ("non-veg", "", "vegan vegetarian"),
        ("no nuts", "nut-free", ""),
        ("tree nut free", "", ""),
        ("Certified Kosher OU-D", "kosher", ""),
        ("100% organic", "organic", ""),
        ("made with organic wheat", "", "gluten-free"),
        ("unsuitable for coeliacs", "", "gluten-free"),
        ("source of iron", "", ""),
        ("vegan?", "", ""),
        ("nearly vegan", "", ""),
        ("vegan option", "", ""),
        ("vegan: false", "", ""),
        ("vegan \u2717", "", "vegan"),
        ("vegan recipe changed - now contains milk", "", "dairy-free vegan"),
        ("vegan=true", "vegan", ""),
    ],
)
def test_labels_are_read_in_all_their_spellings(label: str, fits: str, violates: str) -> None:
    claims = read_label(label.lower())
    assert (sorted(claims.fits), sorted(claims.violates)) == (fits.split(), violates.split())


@pytest.mark.parametrize(
    ("name", "category", "tags", "diet", "right"),
    [
        ("Crème Fraîche", "", "", "dairy-free", "violates"),
        ("GRUYÈRES", "", "", "dairy-free", "violates"),
        ("Saint-Nectaire", "cheese", "", "dairy-free", "violates"),
        ("Vieux Lille", "deli", "", "dairy-free", "unknown"),
        ("Tomato Soup", "", "", "dairy-free", "unknown"),
        ("Tomato Soup", "", "dairy free", "dairy-free", "fits"),
        ("Tomato Soup", "", "suitable for vegans", "dairy-free", "fits"),
        ("Tomato Soup", "Dairy-Free", "", "dairy-free", "fits"),
        ("Tomato Soup", "vegan & vegetarian", "", "vegan", "unknown"),
        ("Tomato Soup", "", "vegan;contains milk", "dairy-free", "violates"),
        ("Lactose-Free Milk", "dairy", "", "lactose-free", "fits"),
        ("Lactose-Free Milk", "dairy", "lactose-free", "dairy-free", "violates"),
        ("Arla Lactofree", "dairy", "lactose-free; contains milk", "lactose-free", "fits"),
        ("Arla Lactofree", "dairy", "lactose-free; contains milk", "dairy-free", "violates"),
        ("Infant Formula", "baby food", "contains milk", "lactose-free", "violates"),
        ("Organic Bananas, 1 kg", "", "", "dairy-free", "fits"),
        ("Raspberry", "cookies cakes", "", "nut-free", "unknown"),
        ("Banana Bread", "", "", "vegan", "unknown"),
        ("Eggs, Free Range, Large", "dairy & eggs", "", "dairy-free", "fits"),
        ("Eggs, Free Range, Large", "dairy & eggs", "", "vegan", "violates"),
        ("Pão de Queijo", "", "", "dairy-free", "violates"),
        ("Choco Krispies", "breakfast", "", "gluten-free", "unknown"),
        ("Oat Milk", "", "", "gluten-free", "unknown"),
        ("Oat Milk", "", "", "vegan", "fits"),
        ("Mandelhörnchen", "bakery", "", "nut-free", "unknown"),
        ("Nutella", "spreads", "", "nut-free", "violates"),
        ("Chicken Breast", "meat", "", "halal", "violates"),
        ("Chicken Breast", "meat", "HALAL CERTIFIED", "halal", "fits"),
        ("Chicken Dog Treats", "pet", "", "vegetarian", "violates"),
        ("Almond Body Lotion", "skin care", "", "nut-free", "violates"),
        ("Body Lotion", "skin care", "", "nut-free", "fits"),
    ],
)
def test_an_item_fits_only_where_that_is_known(name, category, tags, diet, right) -> None:
    assert judged(name, category, tags, diet) == right


@pytest.mark.parametrize(
    ("name", "category"),
    [
        ("Round Cake Pan", "kitchenware"),
        ("Cheese Grater", ""),
        ("Butter Knife", ""),
        ("Diapers", "baby"),
        ("Lemon Dish Soap", "cleaning products"),
        ("Milk Frother", "kitchen appliances"),
        ("Dog Food", "pet supplies"),
        ("Roses", "flowers"),
    ],
)
def test_what_is_no_food_breaks_no_diet_and_is_not_named(name: str, category: str) -> None:
    wanting = {diet for diet in DIETS if diet != "organic"}
    assert {diet for diet in wanting if judged(name, category, diet=diet) != "fits"} == set()


def test_no_item_is_said_to_fit_that_its_label_denies(figure) -> None:
    said = wrong = 0
    for diet in ("gluten-free", "vegan", "vegetarian", "dairy-free", "nut-free", "egg-free"):
        for item in CATALOGUE.items:
            if verdict(replace(item, tags=frozenset()), diet) == "fits":
                said += 1
                wrong += verdict(item, diet) != "fits"
    assert said > 3000, "else the test could not fail"
    assert wrong == 0
    figure(f"{said:,} times said to fit without labels: {wrong} wrongly")


@pytest.mark.skipif(not DATA, reason="GOALSCOPE_DATA (a folder of shops' CSVs) is unset")
def test_foods_are_hardly_ever_taken_for_other_things(figure) -> None:
    name = "instacart_products_aisles_departments.csv"
    with (Path(str(DATA)) / "grocery" / name).open(encoding="utf-8", newline="") as file:
        rows = [*csv.DictReader(file)]
    mixed = ("missing", "other", "babies", "personal care")
    foods, others = (
        [
            nature(row["product_name"], row["aisle"]) == "food"
            for row in rows
            if row["department"] not in mixed
            and row["aisle"] != "baking supplies decor"
            and (row["department"] in ("household", "pets")) == is_other
        ]
        for is_other in (False, True)
    )
    assert foods.count(False) / len(foods) < 0.003
    assert others.count(False) / len(others) > 0.9
    figure(
        f"{foods.count(False)} of {len(foods):,} foods taken for things, and "
        f"{others.count(True)} of {len(others):,} things for foods",
    )


def test_a_catalogue_of_labels_makes_what_lacks_a_mere_label_unfit() -> None:
    standing = state_after("only organic | why diet")
    eggs, apples = Item(1, "Bio Eggs", tags=frozenset(["organic"])), Item(2, "Apples")
    bounds = bounds_of(standing, Catalogue([eggs, apples]))
    assert [bool(bounds.against(item)) for item in (eggs, apples)] == [False, True]
    assert not bounds.unknown([eggs, apples])
    bare = bounds_of(standing, Catalogue([apples]))
    assert not bare.against(apples)
    assert bare.unknown([apples]) == "Not known to be organic: Apples."


LIMITS: Mapping[str, str] = {
    "avoid lactose | why allergy": "lactose-free",
    "avoid dairy | why allergy": "dairy-free",
    "avoid gluten | why diet": "gluten-free",
    "avoid nuts | why allergy": "nut-free",
    "avoid eggs | why allergy": "egg-free",
    "only vegan | why diet": "vegan",
    "only kosher | why diet": "kosher",
    "only halal | why diet": "halal",
}


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("for_whom", ["", " | for my son"])
def test_a_guess_is_known_to_fit_every_grave_limit(limit: str, for_whom: str) -> None:
    dialogue = state_after(limit.replace(" | why", f"{for_whom} | why"))
    opened = stocked(*ROWS)
    served = {
        action.target for name, _ in ROWS for action in opened.actions(name.casefold(), dialogue)
    }
    assert served >= {"Carrots", "White Rice", "Round Cake Pan", "AA Batteries"}
    for name in served:
        (item,) = (item for item in opened.catalogue.items if item.name == name)
        assert verdict(item, LIMITS[limit]) == "fits", name


def test_what_a_word_means_does_not_depend_on_what_is_known() -> None:
    """Else "wine" would be wine vinegar for people who cannot have milk."""
    opened = stocked(("Red Wine", "drinks"), ("Red Wine Vinegar", "oils & vinegar"))
    told = follow(opened, "avoid lactose | why allergy", "add wine; add cheapest wine")
    assert opened.basket == {"Red Wine": 1}
    assert told[-1] == "Not known to be lactose-free: Red Wine."


def test_a_mere_dislike_leaves_out_only_what_is_known_to_hold_the_thing() -> None:
    opened = stocked(*ROWS)
    dialogue = state_after("avoid dairy | why taste")
    assert opened.actions("soup", dialogue) == [Action("add item", "Tomato Soup")]
    assert opened.actions("skyr", dialogue) == []


@pytest.mark.parametrize(
    ("said", "basket", "told"),
    [
        ("add crème fraîche; add gruyère; add skyr", [], "it has to be lactose-free"),
        ("add tomato soup", ["Tomato Soup"], "Not known to be lactose-free: Tomato Soup."),
        ("add diapers; add cake pan; add carrots", ["Diapers", "Round Cake Pan", "Carrots"], ""),
        (
            "add granola; add carrots; add tomato soup",
            ["Granola", "Carrots", "Tomato Soup"],
            "Not known to be lactose-free: Granola. Not known to be lactose-free: Tomato Soup.",
        ),
        (
            "add carrots; swap carrots | for granola",
            ["Granola"],
            "Not known to be lactose-free: Granola.",
        ),
    ],
)
def test_what_is_not_known_to_fit_comes_only_if_ordered_and_is_named(said, basket, told) -> None:
    opened = stocked(*ROWS)
    notes = " ".join(follow(opened, "avoid lactose | why allergy", said))
    assert [*opened.basket] == basket
    assert told in notes
    assert bool(told) == bool(notes)
    asked = opened.answer(Order("ask"), "", state_after("avoid lactose | why allergy"), PICK)
    assert ("Not known to be" in asked) == ("Not known to be" in told)


@pytest.mark.parametrize(
    ("basket", "what", "told"),
    [
        (
            ["Carrots", "Diapers", "Tomato Soup", "Skyr"],
            "everything dairy-free",
            "Known to be dairy-free: Carrots, Diapers. Not known to be dairy-free: Tomato Soup. "
            "Not dairy-free: Skyr.",
        ),
        (["White Rice"], "vegan", "Known to be vegan: White Rice."),
        (["Granola"], "gf", "Not gluten-free: Granola."),
    ],
)
def test_a_question_about_a_diet_is_answered_for_the_basket(basket, what, told) -> None:
    opened = stocked(*ROWS)
    assert all(opened.step(Action("add item", name)).ok for name in basket)
    assert opened.answer(Order("ask", what), what, state_after(), PICK) == told


def test_a_limit_that_comes_late_names_what_it_leaves_in_the_basket() -> None:
    opened = stocked(*ROWS)
    assert all(opened.step(Action("add item", name)).ok for name in ("Granola", "Skyr", "Diapers"))
    notes = follow(opened, "add tomato soup; add skyr", "avoid dairy | why allergy")
    assert opened.basket == {"Diapers": 1, "Tomato Soup": 1}
    assert notes[-1] == "Not known to be dairy-free: Tomato Soup."


def test_an_allergy_to_what_is_no_diet_leaves_out_what_may_hold_it() -> None:
    opened = stocked(("Kiwis", "fruit"), ("Fruit Smoothie", "drinks"), ("Apples", "fruit"))
    dialogue = state_after("avoid kiwi | why allergy")
    assert [bool(opened.actions(n, dialogue)) for n in ("kiwis", "smoothie", "apples")] == [
        False,
        False,
        True,
    ]
    told = follow(opened, "avoid kiwi | why allergy", "add fruit smoothie; add apples")
    assert told == ['Not known to be free of "kiwi": Fruit Smoothie.']


def test_the_labels_of_a_users_catalogue_find_things_and_are_preferred() -> None:
    opened = stocked(
        ("Barilla Penne", "pasta", "contains wheat"),
        ("Penne", "pasta"),
        ("Rummo Penne", "pasta", "gf"),
    )
    assert follow(opened, "add gluten-free penne") == []
    assert opened.basket == {"Rummo Penne": 1}
    opened.reset()
    assert follow(opened, "avoid gluten | why allergy", "add penne") == []
    assert opened.basket == {"Rummo Penne": 1}


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        ("add salmon; add bananas; remove most expensive thing", ["Bananas"]),
        ("add salmon; add cod; add bananas; remove priciest fish", ["Cod Fillets", "Bananas"]),
        ("add cheapest wine", ["Chianti Red Wine"]),
        ("add most expensive olive oil", ["Organic Olive Oil"]),
        ("add cheapest milk; swap milk | for dearest milk", ["Organic Lactose-Free Milk"]),
        ("add beef; add milk; swap most expensive thing | for tofu", ["Whole Milk", "Firm Tofu"]),
        ("only vegan; add cheapest butter", ["Vegan Butter"]),
        ("add cheapest gluten-free bread", ["Gluten-Free White Bread"]),
        ("add cheapest fish", ["Cod Fillets"]),
        ("add cheapest cleaning", ["Kitchen Sponges"]),
        ("add most expensive thing", []),
    ],
)
def test_the_cheapest_and_the_dearest_are_found_by_price(said: str, basket: list[str]) -> None:
    opened = shop()
    follow(opened, said)
    assert [*opened.basket] == basket


def test_what_has_no_price_is_neither_cheapest_nor_dearest() -> None:
    items = [Item(1, "Red Wine", "wine"), Item(2, "White Wine", "wine", price=Decimal(3))]
    opened = GroceryShop(Catalogue(items))
    follow(opened, "add cheapest wine", "add red wine", "remove most expensive thing")
    assert opened.basket == {"Red Wine": 1}


@pytest.mark.parametrize(
    ("question", "read", "prices"),
    [
        ("Is oat milk cheaper than soy milk?", "ask oat milk", ["$3.09", "$3.29"]),
        ("what costs more, salmon fillets or cod fillets?", "ask salmon fillets", ["$8.39"]),
        ("how many eggs are in a box?", "ask eggs", [""]),
        ("what's the cheapest butter?", "ask cheapest butter", ["$3.09"]),
    ],
)
def test_a_question_about_two_things_is_answered_for_both(question, read, prices) -> None:
    agent = Agent(GroceryShop(CATALOGUE, search=SEARCH), WordModel(reads={question: read}))
    round = agent.step("", question)
    assert round.results == ()
    told = agent.ask()
    assert [price for price in prices if price not in told] == []
    if "costs" in question:
        assert "Cod Fillets" in told
    else:
        assert told.count("The shop has") == len(prices)


def test_what_the_person_named_is_not_told_as_a_guess() -> None:
    model = WordModel(
        {"Name what a person": "bake a birthday cake"},
        reads={"cake please": "aim", "with candles": "none"},
    )
    agent = Agent(GroceryShop(CATALOGUE, search=SEARCH), model)
    rounds = [
        agent.step("", "a birthday cake please, with candles"),
        agent.step("", "a birthday cake please"),
    ]
    guessed = [note for round in rounds for note in round.notes if note.startswith("Guessed")]
    named = [note for round in rounds for note in round.notes if note.startswith("Because")]
    assert guessed
    assert named
    assert "Candles" in " ".join(named)
    assert "Candles" not in " ".join(guessed)


def test_a_purchase_that_fails_does_not_end_the_task() -> None:
    class Closed(GroceryShop):
        def step(self, action: Action) -> StepResult:
            if action.name != "buy basket":
                return super().step(action)
            return StepResult(action, False, "The till is closed.", terminated=True)

    agent = Agent(Closed(CATALOGUE, search=SEARCH), WordModel(reads={"milk!": "add milk"}))
    agent.step("", "milk!")
    asked = agent.step("", "Buy the basket")
    failed = agent.step(asked.question, "yes")
    assert not failed.terminated
    assert "Not done: buy basket. The till is closed." in failed.notes


@pytest.mark.parametrize("label", ["-", "\u2014", "*", "\U0001f95b", "n/a", "?"])
def test_a_label_without_words_is_none(label: str) -> None:
    items = [Item(1, "Lamb Stew"), Item(2, "Bean Stew", tags=frozenset({label}))]
    dialogue = state_after("avoid milk | why allergy")
    found = GroceryShop(Catalogue(items)).resolve(Order("add", "lamb stew"), dialogue, PICK)
    assert [action.target for action in found.actions] == ["Lamb Stew"]
