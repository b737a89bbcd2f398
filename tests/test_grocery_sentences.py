"""Whole sentences, as people say them, and what the basket holds after them."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from fakes import said
from goalscope.envs.grocery import Catalogue, GroceryShop, Item, load_profiles
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.search import Search
from goalscope.types import Action, Profile

CATALOGUE = Catalogue.load()
SEARCH = Search(CATALOGUE)
ODD = [
    "Mac & Cheese, 2 ct", "Ben & Jerry's Ice Cream, 16 fl oz", "7-Up, 12 x 330 ml",
    "1/2 Gallon Tea", "Milk, 2%, 1 Gallon", "No Salt Added Peas (15 oz)", "Baby Back Ribs",
    "Bread, White, and Butter", "Take Out Boxes", "Instead of Coffee", "Half & Half",
    "I Can't Believe It's Not Butter!",
    "Half and Half", "Eggs? Yes! 12", "Just Mayo", "Milk", "Milk Chocolate", "Three Musketeers",
    "Chips, 4.5 lbs", "Chips 4.5 lbs",
]  # fmt: skip
"""Names that a grammar of requests would take apart."""

FRUIT = {"Bananas": 1, "Cucumber": 2, "Papaya": 1}


def opened(
    basket: Mapping[str, int], catalogue: Catalogue = CATALOGUE, search: Search = SEARCH
) -> GroceryShop:
    shop = GroceryShop(catalogue, search=search)
    for name, number in basket.items():
        assert shop.step(Action("add item", name, number)).ok
    return shop


def heard(shop: GroceryShop, *utterances: str) -> list[str]:
    """Say it all, with what is asked for outright done after each; what the shop tells of."""
    told: list[str] = []
    for number in range(1, len(utterances) + 1):
        turns = said(*utterances[:number])
        results = [shop.step(action) for action in shop.requests(turns)]
        assert all(result.ok for result in results)
        told = shop.unmet(turns, results)
    return told


@pytest.mark.parametrize(
    ("sentence", "basket"),
    [
        ("Remove the bananas, the cucumbers and the papaya", {}),
        ("Remove the bananas, the cucumbers, and the papaya.", {}),
        ("remove bananas, cucumber, papaya", {}),
        ("Get rid of the bananas & the papaya", {"Cucumber": 2}),
        ("Remove:\n- bananas\n- papaya", {"Cucumber": 2}),
        ("Could you take the bananas, the cucumbers and the papaya out of the basket?", {}),
        ("Take the bananas and the papaya out, and add 2 heads of garlic",
         {"Cucumber": 2, "Garlic": 2}),
        ("remove the bananas, the papaya, and get me 3 pineapples",
         {"Cucumber": 2, "Pineapple": 3}),
        ("remove the bananas, two pineapples and some garlic please",
         {"Cucumber": 2, "Papaya": 1, "Pineapple": 2, "Garlic": 1}),
        ("no papaya, two pineapples and garlic please",
         {"Bananas": 1, "Cucumber": 2, "Pineapple": 2, "Garlic": 1}),
        ("remove bananas add garlic", {"Cucumber": 2, "Papaya": 1, "Garlic": 1}),
        ("I don't want the bananas, the cucumbers or the papaya", {}),
        ("Bananas out, please.", {"Cucumber": 2, "Papaya": 1}),
        ("I changed my mind about the bananas, take them out", {"Cucumber": 2, "Papaya": 1}),
        ("Would you mind taking the bananas out?", {"Cucumber": 2, "Papaya": 1}),
        ("The papaya is not needed", {"Bananas": 1, "Cucumber": 2}),
        ("put the papaya back and put garlic in the basket instead",
         {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
        ("Keep the bananas but lose the papaya", {"Bananas": 1, "Cucumber": 2}),
        ("Remove everything except the bananas and the papaya", {"Bananas": 1, "Papaya": 1}),
        ("Don't remove the bananas", FRUIT),
        ("Please don't take the bananas out", FRUIT),
        ("Why did you add the bananas?", FRUIT),
    ],
)  # fmt: skip
def test_what_is_to_leave_the_basket_is_heard_whole(sentence: str, basket: dict[str, int]) -> None:
    shop = opened(FRUIT)
    heard(shop, sentence)
    assert shop.basket == basket


@pytest.mark.parametrize(
    ("sentence", "basket"),
    [
        ("Swap the papaya for garlic", {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
        ("Could you swap out the papaya for a pineapple?",
         {"Bananas": 1, "Cucumber": 2, "Pineapple": 1}),
        ("Replace the bananas and the papaya with two pineapples",
         {"Cucumber": 2, "Pineapple": 2}),
        ("change the papaya to garlic, please", {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
        ("Garlic instead of the papaya", {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
        ("Instead of the papaya I'd like garlic", {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
        ("I'd rather have garlic than papaya", {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
        ("Pineapple rather than papaya please", {"Bananas": 1, "Cucumber": 2, "Pineapple": 1}),
        ("Scratch the papaya. Garlic instead.", {"Bananas": 1, "Cucumber": 2, "Garlic": 1}),
    ],
)  # fmt: skip
def test_one_thing_takes_the_place_of_another(sentence: str, basket: dict[str, int]) -> None:
    shop = opened(FRUIT)
    heard(shop, sentence)
    assert shop.basket == basket


@pytest.mark.parametrize(
    ("sentence", "cucumbers"),
    [
        ("change the 2 cucumbers to 4", 4),
        ("Make that 4 cucumbers.", 4),
        ("Make it one cucumber instead of two", 1),
        ("Make the cucumbers three", 3),
        ("Let's have 5 cucumbers instead of 2", 5),
        ("Only 1 cucumber, please.", 1),
        ("I only need one cucumber", 1),
        ("Just one cucumber please, not two", 1),
        ("Reduce the cucumbers to 1", 1),
        ("Add 2 more cucumbers", 4),
        ("another cucumber please", 3),
        ("I'd like one more cucumber", 3),
        ("remove one of the cucumbers", 1),
        ("Take one of the cucumbers out", 1),
        ("One cucumber less, please", 1),
        ("Please remove both cucumbers", 0),
        ("Remove the two cucumbers", 0),
        ("I need three cucumbers in total", 3),
        ("3 cucumbers. Sorry, 4 cucumbers.", 4),
        ("3 cucumbers, no wait, make it five", 5),
        ("cucumbers x 3", 3),
        ("cucumbers (3), garlic (1)", 3),
    ],
)
def test_numbers_change_what_is_there(sentence: str, cucumbers: int) -> None:
    shop = opened(FRUIT)
    heard(shop, sentence)
    assert shop.basket.get("Cucumber", 0) == cucumbers
    assert shop.basket["Papaya"] == 1


@pytest.mark.parametrize(
    ("sentences", "basket"),
    [
        (["Add ketchup", "Make it three"], {"Ketchup": 3}),
        (["I need 2 ketchups", "two more", "Great"], {"Ketchup": 4}),
        (["Add ketchup", "Actually, take that out", "and add garlic"], {"Garlic": 1}),
        (["4 cucumbers", "remove one of the cucumbers", "Thanks, add a papaya"],
         {"Cucumber": 3, "Papaya": 1}),
        (["no papaya", "ok, add a papaya again"], {"Papaya": 1}),
        (["Add bananas and garlic, no, I mean ketchup"], {"Bananas": 1, "Ketchup": 1}),
        (["Two heads of garlic. Wait, three. And no papaya."], {"Garlic": 3}),
        (["Can you put 3 cucumbers and 4 papayas in my basket please"],
         {"Cucumber": 3, "Papaya": 4}),
        (["macaroni and cheese dinner, and salt and vinegar potato chips"],
         {"Macaroni and Cheese Dinner": 1, "Salt and Vinegar Potato Chips": 1}),
        (["Start over: two pineapples and ketchup"], {"Pineapple": 2, "Ketchup": 1}),
    ],
)  # fmt: skip
def test_later_words_change_earlier_ones(sentences: list[str], basket: dict[str, int]) -> None:
    shop = opened({})
    heard(shop, *sentences)
    assert shop.basket == basket


def test_exact_name_means_that_item_alone() -> None:
    shop = opened({"Olive Oil": 1, "Extra Virgin Olive Oil": 1, "Garlic Bread": 1})
    heard(shop, "Remove the Olive Oil and add garlic")
    assert shop.basket == {"Extra Virgin Olive Oil": 1, "Garlic Bread": 1, "Garlic": 1}


@pytest.mark.parametrize("names", [None, ODD], ids=["shipped", "odd"])
def test_every_item_is_removed_and_added_by_its_name(names: list[str] | None) -> None:
    catalogue, search = CATALOGUE, SEARCH
    if names:
        catalogue = Catalogue(Item(i, name) for i, name in enumerate(names, 1))
        search = Search(catalogue)
    wrong: list[str] = []
    for place, item in enumerate(catalogue.items):
        others = {each.name: 1 for each in search.named(item.name)[:3] if each != item}
        forms = [
            (f"Remove the {item.name}", 2, 0),
            (f"Please take the {item.name} out of the basket.", 1, 0),
        ]
        if names or place % 10 == 0:
            forms += [(f"Remove one of the {item.name}", 2, 1), (f"Add {item.name}", 0, 1)]
        for sentence, before, after in forms:
            shop = opened({**others, **({item.name: before} if before else {})}, catalogue, search)
            told = heard(shop, sentence)
            if told or shop.basket != {**others, **({item.name: after} if after else {})}:
                wrong.append(sentence)
    assert wrong == []


@pytest.mark.parametrize(
    ("sentences", "told"),
    [
        (["Add dragon fruit and garlic"], ["The shop has nothing called 'dragon fruit'."]),
        (["Remove the kimchi and the papaya"], ["There was no kimchi in the basket."]),
        (["Take the radishes out"], ["There were no radishes in the basket."]),
        (["Add 150 leeks"], ["The basket holds at most 99 of one item: Leeks."]),
        (["98 pineapples", "5 more pineapples"],
         ["The basket holds at most 99 of one item: Pineapple."]),
        (["My sister can't eat gluten.", "Add rye bread"],
         ["Not added, since it has to be gluten-free: rye bread."]),
        (["I'm allergic to nuts", "Some pistachios and garlic, please"],
         ["Not added, since it has to be nut-free: pistachios."]),
    ],
)  # fmt: skip
def test_what_was_not_done_is_told(sentences: list[str], told: list[str]) -> None:
    assert heard(opened(FRUIT), *sentences) == told


@pytest.mark.parametrize(
    "sentence",
    [
        "I want to bake a birthday cake for my nephew.",
        "Something for dinner tonight, please",
        "I need some food and drinks",
        "Could you get me a few things for breakfast?",
        "From scratch, please.",
        "Thanks so much, that looks great!",
        "Yep",
        "I'd like fruit and vegetables",
        "My daughter turns six and I need butter",
        "Can you help me?",
        "A birthday needs candles, too, and some garlic for the grown-ups.",
    ],
)
def test_nothing_is_missed_that_is_no_product(sentence: str) -> None:
    assert heard(opened(FRUIT), sentence) == []


@pytest.mark.parametrize(
    ("sentence", "diets"),
    [
        ("My partner doesn't eat pork.", "pork-free"),
        ("No nuts, please", "nut-free"),
        ("Two of them eat no meat, so garlic would be good.", "vegetarian"),
        ("We're vegan, and my son can't have gluten", "gluten-free and vegan"),
    ],
)
def test_a_restriction_that_is_heard_is_told_once(sentence: str, diets: str) -> None:
    assert heard(opened(FRUIT), sentence) == [f"From now on it has to be {diets}."]
    assert heard(opened(FRUIT), sentence, sentence) == []


@pytest.mark.parametrize("profile", load_profiles(), ids=lambda profile: profile.name)
def test_shipped_shoppers_miss_nothing(profile: Profile) -> None:
    for number in range(1, len(profile.replies) + 1):
        told = heard(opened({}), *profile.replies[:number])
        assert not any(
            note for note in told if not note.startswith(("Not labelled as", "From now on"))
        )


def test_words_of_refused_things_and_of_containers_lead_to_nothing() -> None:
    sentence = "Take the pizza and the hot dog buns out, and add 2 loaves of bread, a bag of apples"
    shop = opened({"Hot Dog Buns": 1})
    assert shop.mentioned([sentence]) == ["bread", "apples"]
    assert not {"hot dogs", "dog buns", "buns"} & set(shop.kinds(sentence, 20))
    assert shop.kinds("Remove the dog biscuits", 5) == []
    heard(shop, sentence)
    turns = said(sentence)
    assert all(shop.actions([term], turns) == [] for term in ("hot dog buns", "dog buns", "buns"))
    assert shop.mentioned(["Salt and Vinegar Potato Chips"]) == ["potato chips"]


@pytest.mark.parametrize(
    ("sentence", "diets"),
    [
        ("She can't eat gluten, sorry, dairy as well", {"gluten-free", "dairy-free"}),
        ("He is allergic to nuts, I mean peanuts", {"nut-free"}),
        ("Remove the Gluten-Free Bagels and the Dairy-Free Vanilla Ice Cream", set()),
        ("Swap the Vegan Butter for Organic Salted Butter", set()),
    ],
)
def test_corrections_take_no_restriction_back_and_names_state_none(
    sentence: str, diets: set[str]
) -> None:
    assert hear([sentence], CATALOGUE.names).diets == diets


def test_what_was_taken_out_does_not_come_back_unasked() -> None:
    shop = opened({})
    turns = ["I need bread and garlic", "Remove the White Sandwich Bread"]
    heard(shop, *turns, "Thanks.")
    assert shop.basket == {"Garlic": 1}
    assert shop.actions(["bread", "white sandwich bread"], said(*turns)) == []
    heard(shop, *turns, "Add another bread")
    assert len(shop.basket) == 2
    assert "White Sandwich Bread" not in shop.basket


def test_unclear_removal_is_told_and_takes_nothing() -> None:
    shop = opened(FRUIT)
    (told,) = heard(shop, "Remove it")
    assert "not clear" in told
    assert shop.basket == FRUIT


@pytest.mark.parametrize(
    ("sentence", "told"),
    [
        ("bring me the nicest tomatoes that you have", ["Nothing was done about: tomatoes."]),
        ("can you put the cheese next to it?", ["Nothing was done about: cheese."]),
        ("add kale and deliver it by noon", ["Nothing was done about: deliver it by noon."]),
        ("add kale, wrap it as a gift", ["Nothing was done about: wrap it as a gift."]),
        ("deliver it", ["Nothing was done about: deliver it."]),
        ("add pork chops and call it a day", []),
        ("put cheese on my shopping list please", ["Nothing was done about: cheese."]),
    ],
)  # fmt: skip
def test_what_is_ordered_and_not_heard_is_told(sentence: str, told: list[str]) -> None:
    assert heard(opened({}), sentence) == told


@pytest.mark.parametrize(
    "sentence",
    [
        "I'd like to make pancakes with milk and eggs",
        "we're making tacos tonight",
        "my kids love strawberries",
        "i need wine to go with the steak",
        "no need to add bread, we have bread",
        "get me ingredients for tomato soup",
        "we have milk at home",
        "do you have honey?",
        "The pears need not be organic",
        "two loaves of bread and a dozen eggs please, also a bag of apples",
        "remove the milk because we have oat milk at home",
        "put chicken in the oven tonight, need potatoes",
        "put some cheese on the pizza",
        "i need milk, not eggs",
        "i need flour but have eggs",
        "get some ketchup, no wait, mayonnaise",
        "i want cheese but not the blue one",
    ],
)
def test_talk_that_is_no_order_or_was_heard_tells_of_nothing_undone(sentence: str) -> None:
    assert not any("Nothing was done" in told for told in heard(opened({}), sentence))
