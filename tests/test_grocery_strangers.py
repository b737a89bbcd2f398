"""Groceries as strangers type for them: in haste, politely, in parts, with second thoughts."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.envs.grocery.restrictions import violates
from goalscope.types import Action
from shops import CATALOGUE, shop, talked

FULL = {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1}


@pytest.mark.parametrize(
    ("basket", "utterances", "after"),
    [
        (
            {},
            ["hey could u grab me some bananas n a loaf of rye bread pls"],
            {"Bananas": 1, "Rye Bread": 1},
        ),
        (
            {},
            ["can i get 2 bottles of ketchup, a bag of gummy bears and uh some hummus"],
            {"Ketchup": 2, "Gummy Bears": 1, "Classic Hummus": 1},
        ),
        ({}, ["I'll take three baguettes please, thank you!"], {"Baguette": 3}),
        ({}, ["toss a couple of pineapples in the cart"], {"Pineapple": 2}),
        ({}, ["We're almost out of toothpaste and shampoo."], {"Toothpaste": 1, "Shampoo": 1}),
        ({}, ["Gimme a dozen eggs and a pint of sour cream"], {"Large Eggs": 1, "Sour Cream": 1}),
        ({}, ["Let me get the oat milk, two of them"], {"Oat Milk": 2}),
        (
            {},
            ["one watermelon would be nice, and maybe 2 cucumbers"],
            {"Watermelon": 1, "Cucumber": 2},
        ),
        (
            {},
            ["Please order four cans of tomato soup and six limes."],
            {"Tomato Soup": 4, "Limes": 2},
        ),
        (
            {},
            ["I'm making guacamole so I need avocados, limes, and fresh cilantro"],
            {"Avocados": 1, "Limes": 1, "Fresh Cilantro": 1},
        ),
        (
            {},
            ["do you mind adding a garlic bread and some butter popcorn?"],
            {"Garlic Bread": 1, "Butter Popcorn": 1},
        ),
        ({}, ["bananas x20, kale, 3x leeks"], {"Bananas": 3, "Kale": 1, "Leeks": 3}),
        ({}, ["I'd love some brie and a baguette to go with it."], {"Brie": 1, "Baguette": 1}),
        (
            {},
            ["my kids want lollipops, jelly beans and marshmallows"],
            {"Lollipops": 1, "Jelly Beans": 1, "Marshmallows": 1},
        ),
        (
            {},
            ["also need dish soap, sponges and trash bags for the house"],
            {"Dish Soap": 1, "Kitchen Sponges": 1, "Trash Bags": 1},
        ),
        (
            {},
            ["half a kilo of carrots and a kilo of yellow onions"],
            {"Carrots": 1, "Yellow Onions": 1},
        ),
        ({}, ["I want to buy honey. The wildflower one."], {"Wildflower Honey": 1}),
        (
            {},
            ["Could we have eggplant, zucchini as well as fennel please"],
            {"Eggplant": 1, "Zucchini": 1, "Fennel": 1},
        ),
        (
            {},
            [
                "it's taco night! get ground beef, taco shells, salsa verde, "
                "and shredded cheddar cheese"
            ],
            {
                "Ground Beef": 1,
                "Crunchy Corn Taco Shells": 1,
                "Salsa Verde": 1,
                "Shredded Cheddar Cheese": 1,
            },
        ),
        (
            {},
            ["stick some frozen waffles and maple syrup in there"],
            {"Frozen Waffles": 1, "Maple Syrup": 1},
        ),
        ({}, ["add 3 papayas, no wait, two"], {"Papaya": 2}),
        ({}, ["Add a leek... actually make that four leeks"], {"Leeks": 4}),
        ({}, ["I need ginger ale - sorry, I meant root beer"], {"Root Beer": 1}),
        ({}, ["two cauliflowers, scratch that, one cauliflower"], {"Cauliflower": 1}),
        (
            {},
            ["get me some ketchup. hmm on second thought, mayonnaise instead of ketchup"],
            {"Mayonnaise": 1},
        ),
        ({}, ["5 fennel bulbs please, oops I mean 3"], {"Fennel": 3}),
        ({}, ["bagels, plain bagels I mean"], {"Plain Bagels": 1}),
        ({}, ["add celery", "actually can you make it 3?"], {"Celery": 3}),
        ({}, ["2 papayas please", "hmm, one is enough"], {"Papaya": 1}),
        ({}, ["add celery and kale", "nah forget the kale"], {"Celery": 1}),
        ({}, ["I'd like a pomegranate", "one more please"], {"Pomegranate": 2}),
        ({}, ["some strawberries please", "the frozen ones rather"], {"Frozen Strawberries": 1}),
        (
            {},
            ["add capers", "no, i said capers and gherkins", "fine, just the capers then"],
            {"Capers": 1},
        ),
        ({}, ["sparkling water please", "not lime, plain"], {"Sparkling Water": 1}),
        (FULL, ["take the milk out pls"], {"Large Eggs": 1, "Bananas": 1}),
        (FULL, ["I don't need the eggs anymore"], {"Whole Milk": 2, "Bananas": 1}),
        (FULL, ["one milk is enough"], {"Whole Milk": 1, "Large Eggs": 1, "Bananas": 1}),
        (FULL, ["plz delete bananas & eggs"], {"Whole Milk": 2}),
        (
            FULL,
            ["Can you get rid of the eggs and get tofu instead? firm please"],
            {"Whole Milk": 2, "Bananas": 1, "Firm Tofu": 1},
        ),
        (FULL, ["drop one of the milks"], {"Whole Milk": 1, "Large Eggs": 1, "Bananas": 1}),
        (FULL, ["everything's wrong, start from scratch: just a pumpkin pie"], {"Pumpkin Pie": 1}),
        (FULL, ["hmm i think the bananas should go"], {"Whole Milk": 2, "Large Eggs": 1}),
        (FULL, ["Remove the dragon fruit"], {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1}),
        (FULL, ["cancel the milk and eggs"], {"Bananas": 1}),
        (FULL, ["swap the two milks for oat milk"], {"Large Eggs": 1, "Bananas": 1, "Oat Milk": 2}),
        (
            FULL,
            ["can you switch the eggs to brown eggs"],
            {"Whole Milk": 2, "Bananas": 1, "Brown Eggs": 1},
        ),
        (
            FULL,
            ["replace bananas with kiwis please"],
            {"Whole Milk": 2, "Large Eggs": 1, "Kiwis": 1},
        ),
        (
            FULL,
            ["swap the bananas for star fruit"],
            {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1},
        ),
        (
            FULL,
            ["Instead of whole milk could you do soy milk?"],
            {"Large Eggs": 1, "Bananas": 1, "Barista Soy Milk": 2},
        ),
        (FULL, ["bump the bananas up to 3"], {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 3}),
        (FULL, ["i need 4 milks in total not 2"], {"Whole Milk": 4, "Large Eggs": 1, "Bananas": 1}),
        (FULL, ["another dozen eggs please"], {"Whole Milk": 2, "Large Eggs": 2, "Bananas": 1}),
        (
            FULL,
            ["thanks a million, you're the best"],
            {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1},
        ),
        (
            FULL,
            ["is the milk fresh? my daughter drinks a lot of it"],
            {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1},
        ),
        (
            {},
            ["Hi! could I please have two baguettes and some goat cheese?"],
            {"Baguette": 2, "Goat Cheese": 1},
        ),
        (
            {},
            ["i wanna make pesto pasta, get me penne and basil pesto thx"],
            {"Penne": 1, "Basil Pesto": 1},
        ),
        (
            {},
            ["We need diapers (newborn), baby wipes and 2 packs of paper towels"],
            {"Newborn Diapers": 1, "Baby Wipes": 1, "Paper Towels": 2},
        ),
        ({}, ["Add a cucumbr"], {}),
        ({}, ["some bannanas and brocolli"], {"Bananas": 1, "Broccoli": 1}),
        (
            {},
            ["I would like to order 4 bottles of merlot red wine for the party"],
            {"Merlot Red Wine": 4},
        ),
        (
            {},
            ["ok so: 1 pumpkin, 3 leeks & a head of cauliflower"],
            {"Pumpkin": 1, "Leeks": 3, "Cauliflower": 1},
        ),
        ({}, ["milk chocolate bar, no sorry, white chocolate bar"], {"White Chocolate Bar": 1}),
        ({}, ["Could you find me ginger kombucha? Three of them."], {"Ginger Kombucha": 3}),
        ({}, ["halloumi please and if there's any, tempeh too"], {"Halloumi": 1, "Tempeh": 1}),
        ({}, ["add kale", "and two leeks", "make it four"], {"Kale": 1, "Leeks": 4}),
        ({}, ["add kale and two leeks", "make it four"], {"Kale": 1, "Leeks": 2}),
        (FULL, ["Sorry, I don't want eggs after all"], {"Whole Milk": 2, "Bananas": 1}),
        (
            FULL,
            ["put the eggs back, please, and get me quail eggs"],
            {"Whole Milk": 2, "Bananas": 1, "Quail Eggs": 1},
        ),
        (FULL, ["Only one milk please."], {"Whole Milk": 1, "Large Eggs": 1, "Bananas": 1}),
        (
            FULL,
            ["Replace the whole milk with 3 skim milks"],
            {"Large Eggs": 1, "Bananas": 1, "Skim Milk": 3},
        ),
        (
            FULL,
            ["trade the eggs for ostrich eggs"],
            {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1},
        ),
        (FULL, ["lets get rid of everything but the milk"], {"Whole Milk": 2}),
        (
            FULL,
            ["did you add the milk i asked for"],
            {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1},
        ),
        (FULL, ["remove them"], {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1}),
        (FULL, ["i changed my mind, no bananas"], {"Whole Milk": 2, "Large Eggs": 1}),
        (FULL, ["Thats all folks, nothing else"], {"Whole Milk": 2, "Large Eggs": 1, "Bananas": 1}),
        (
            {},
            ["need some halloumi, a jar of capers n two lemons asap"],
            {"Halloumi": 1, "Capers": 1, "Lemons": 1},
        ),
        (
            FULL,
            ["I'd prefer oat milk to whole milk"],
            {"Oat Milk": 2, "Large Eggs": 1, "Bananas": 1},
        ),
        (FULL, ["chuck out the bananas please"], {"Whole Milk": 2, "Large Eggs": 1}),
        (FULL, ["everything except the eggs can go"], {"Large Eggs": 1}),
        ({}, ["two cucumbers please", "sorry i meant three"], {"Cucumber": 3}),
        ({}, ["Can I have some zuchini and a cauliflower"], {"Zucchini": 1, "Cauliflower": 1}),
    ],
)
def test_what_strangers_type_is_understood(
    basket: dict[str, int], utterances: list[str], after: dict[str, int]
) -> None:
    assert talked(basket, *utterances)[0].basket == after


@pytest.mark.parametrize(
    ("utterances", "after", "told"),
    [
        (
            ["Swap the milk for camel milk"],
            FULL,
            ["The shop has nothing called 'camel milk'."],
        ),
        (
            ["Swap the milk for camel milk", "Thanks", "Add kale"],
            {**FULL, "Kale": 1},
            [],
        ),
        (
            ["Swap the milk for camel milk", "Then remove the milk."],
            {"Large Eggs": 1, "Bananas": 1},
            [],
        ),
        (
            ["Star fruit instead of the bananas"],
            FULL,
            ["The shop has nothing called 'star fruit'."],
        ),
        (
            ["Someone can't eat nuts. Replace the bananas with pistachios."],
            FULL,
            ["From now on", "Not added, since it has to be nut-free: pistachios."],
        ),
        (
            ["Swap one of the milks for oat milk"],
            {**FULL, "Whole Milk": 1, "Oat Milk": 1},
            [],
        ),
        (
            ["Swap the two milks for oat milk"],
            {"Large Eggs": 1, "Bananas": 1, "Oat Milk": 2},
            [],
        ),
        (
            ["Swap the two milks for one oat milk", "Thanks"],
            {"Large Eggs": 1, "Bananas": 1, "Oat Milk": 1},
            [],
        ),
        (["Add milk"], FULL, ["The basket holds 2 x Whole Milk already."]),
        (["Make it three"], FULL, ["It is not clear which thing you mean. Please name it."]),
        (["Add milk", "no, the other kind"], FULL, ["It is not clear which thing you mean."]),
        (["Add milk", "then not that one"], FULL, ["It is not clear which thing you mean."]),
        (
            ["Add kale, garlic and ketchup", "Make it three"],
            {**FULL, "Kale": 1, "Garlic": 1, "Ketchup": 1},
            ["It is not clear which thing you mean. Please name it."],
        ),
        (
            ["Add kale, garlic and ketchup", "Make them three"],
            {**FULL, "Kale": 3, "Garlic": 3, "Ketchup": 3},
            [],
        ),
        (["Add kale and garlic", "Take them out again"], FULL, []),
        (
            ["Add kale. No, no kale. Add garlic."],
            {**FULL, "Garlic": 1},
            ["From now on I add nothing called kale, unless you ask for it."],
        ),
        (["I need a frozen pizza", "the bananna ones"], None, ["The shop has nothing called"]),
    ],
)
def test_what_is_unclear_or_has_no_substitute_changes_nothing_and_is_told(
    utterances: list[str], after: dict[str, int] | None, told: list[str]
) -> None:
    opened, notes = talked(FULL, *utterances)
    assert after is None or opened.basket == after
    assert len(notes) == len(told)
    assert all(note.startswith(start) for note, start in zip(notes, told, strict=True))


@pytest.mark.parametrize(
    ("utterances", "after", "told"),
    [
        (["6 apples", "take out the bruised ones"], {"Gala Apples": 1}, ["There were no bruised"]),
        (
            ["6 apples, and drop the bruised ones"],
            {"Gala Apples": 1},
            ["There were no bruised"],
        ),
        (["4 yogurts", "remove two mango ones"], {"Plain Yogurt": 4}, ["There were no mango"]),
        (["Add bread", "Take out the white one", "ok"], {}, []),
        (
            ["Add rice", "Delete the brown one and add the wild one"],
            {"Long Grain White Rice": 1, "Wild Rice": 1},
            ["There was no brown rice"],
        ),
        (["Add milk", "The usual one"], {"Whole Milk": 1}, ["The basket holds 1 x"]),
        (["Add milk", "The cheapest one, please", "Thanks"], {"Whole Milk": 1}, []),
        (["Add milk", "I want a bigger one"], {"Whole Milk": 1}, ["The basket holds 1 x"]),
        (["Two milks, the usual ones"], {"Whole Milk": 2}, []),
        (
            ["Add milk", "We would like the purple ones"],
            {"Whole Milk": 1},
            ["The shop has nothing"],
        ),
        (["Add milk", "We like the purple ones", "Thanks"], {"Whole Milk": 1}, []),
        (["Add milk", "The purple one", "Remove the milk"], {}, []),
        (["I want apples, the purple ones"], {"Gala Apples": 1}, ["The shop has nothing"]),
        (["I want cauliflowers, the organic ones", "Ok"], {"Organic Cauliflower": 1}, []),
        (["Apples", "The purple ones", "No, the organic ones"], {"Organic Gala Apples": 1}, []),
        (["Three cauliflowers, organic ones"], {"Organic Cauliflower": 3}, []),
        (["Three cauliflowers", "The organic ones", "Ok"], {"Organic Cauliflower": 3}, []),
        (["Three cauliflowers", "No, two organic ones"], {"Organic Cauliflower": 2}, []),
        (
            ["Three cauliflowers", "And two organic ones"],
            {"Cauliflower": 3, "Organic Cauliflower": 2},
            [],
        ),
        (["Add pizza", "Make it the purple one"], None, ["The shop has nothing called 'purple"]),
        (["3 whole milk", "Swap it for camel milk"], {"Whole Milk": 3}, ["The shop has nothing"]),
        (["3 whole milk", "Swap it for soy milk", "Ok"], {"Barista Soy Milk": 3}, []),
        (["3 whole milk", "Swap it for 1 oat milk", "Ok"], {"Oat Milk": 1}, []),
        (["Eggs", "Swap the eggs for eggs", "Ok"], {"Large Eggs": 1}, []),
        (["Swap it for oat milk"], {}, ["It is not clear which thing you mean."]),
    ],
)
def test_which_ones_are_meant_takes_nothing_out_that_has_no_substitute(
    utterances: list[str], after: dict[str, int] | None, told: list[str]
) -> None:
    opened, notes = talked({}, *utterances)
    assert after is None or opened.basket == after
    assert len(notes) == len(told)
    assert all(note.startswith(start) for note, start in zip(notes, told, strict=True))


@pytest.mark.parametrize(
    "thought",
    [
        "I think of eggs",
        "I often think about eggs",
        "I think about the eggs",
        "I believe in free range eggs",
        "I think eggs or bananas",
        "I guess egg prices are rising",
        "I suppose the eggs were cheaper once",
        "I think all the eggs are for sale",
    ],
)
def test_what_people_think_is_not_asked_for(thought: str) -> None:
    assert talked({}, thought)[0].basket == {}


def test_nothing_is_kept_or_guessed_that_harms_a_person() -> None:
    opened = shop()
    for name in ("Buttermilk Pancake Mix", "Spreadable Butter", "Bananas"):
        assert opened.step(Action("add item", name, 1)).ok
    turns = said("No milk in it please, it gives my daughter a rash.")
    for action in opened.requests(turns):
        assert opened.step(action).ok
    assert opened.basket == {"Bananas": 1}
    offered = opened.actions(["milk", "butter", "pancake mix", "cheese", "cream"], turns)
    items = [item for action in offered if (item := CATALOGUE.get(action.target))]
    assert len(items) == len(offered) > 0
    assert not any(violates(item, "dairy-free") for item in items)
    turns = said("No milk in it please, it gives my daughter a rash.", "Get butter and cheese")
    added = [item for each in opened.requests(turns) if (item := CATALOGUE.get(each.target))]
    assert not any(violates(item, "dairy-free") for item in added)


@pytest.mark.parametrize(
    ("utterances", "after"),
    [
        (["6 packs of eggs", "Double that"], {"Large Eggs": 12}),
        (["6 packs of eggs", "Double the eggs", "Ok"], {"Large Eggs": 12}),
        (["6 packs of eggs", "I want twice as many eggs, please."], {"Large Eggs": 12}),
        (["6 packs of eggs", "Make it double"], {"Large Eggs": 12}),
        (["6 packs of eggs", "Half of that"], {"Large Eggs": 3}),
        (["6 packs of eggs", "Half the eggs, please", "Thanks"], {"Large Eggs": 3}),
        (["6 packs of eggs", "Halve the number of eggs"], {"Large Eggs": 3}),
        (["6 packs of eggs", "A bit less eggs"], {"Large Eggs": 5}),
        (["6 packs of eggs", "I want fewer eggs"], {"Large Eggs": 5}),
        (["Eggs", "Half of the eggs"], {"Large Eggs": 1}),
        (["60 packs of eggs", "Double the eggs"], {"Large Eggs": 99}),
        (["2 packs of eggs", "6 eggs"], {"Large Eggs": 2}),
        (["2 packs of eggs", "We have fish twice a week"], {"Large Eggs": 2}),
        (["2 packs of eggs", "Did you double the eggs?"], {"Large Eggs": 2}),
        (["2 packs of eggs", "Something with less sugar"], {"Large Eggs": 2}),
    ],
)
def test_twice_half_and_less_are_of_what_is_there(
    utterances: list[str], after: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == after


@pytest.mark.parametrize(
    ("complaint", "after"),
    [
        ("I didn't ask for that.", ["Large Eggs"]),
        ("I never wanted any of those things!", ["Large Eggs"]),
        ("Remove everything I didn't ask for", ["Large Eggs"]),
        ("Please take out what nobody asked for.", ["Large Eggs"]),
        ("Delete the things you guessed", ["Large Eggs"]),
        ("I didn't ask for bananas", ["Large Eggs", "Spreadable Butter"]),
        ("I never ordered any butter", ["Large Eggs", "Bananas"]),
        ("Remove everything", []),
        (
            "Why is there something I didn't ask for?",
            ["Large Eggs", "Bananas", "Spreadable Butter"],
        ),
        ("I asked for that.", ["Large Eggs", "Bananas", "Spreadable Butter"]),
    ],
)
def test_what_nobody_asked_for_goes_where_a_person_complains_of_it(
    complaint: str, after: list[str]
) -> None:
    opened = shop()
    turns = said("Two packs of eggs, please")
    for action in (
        *opened.requests(turns),
        Action("add item", "Bananas"),
        Action("add item", "Spreadable Butter"),
    ):
        assert opened.step(action).ok
    turns = said("Two packs of eggs, please", complaint)
    for action in opened.requests(turns):
        assert opened.step(action).ok
    assert [*opened.basket] == after
    assert not opened.actions(["banana", "butter"], turns) or complaint.startswith(
        ("Why", "I asked")
    )


@pytest.mark.parametrize(
    "said_so",
    [
        "Do any of these contain nuts? My son is allergic.",
        "Is there any nuts in it? I'm very allergic!",
        "Does it have nuts? She is allergic",
    ],
)
def test_an_allergy_is_to_what_was_just_asked_about(said_so: str) -> None:
    opened = shop()
    for name in ("Creamy Peanut Butter", "Bananas"):
        assert opened.step(Action("add item", name)).ok
    turns = said(said_so)
    for action in opened.requests(turns):
        assert opened.step(action).ok
    assert [*opened.basket] == ["Bananas"]
    offered = [each.target for each in opened.actions(["nuts", "almond", "bread"], turns)]
    items = [item for name in offered if (item := CATALOGUE.get(name))]
    assert len(items) == len(offered) > 0
    assert not any(violates(item, "nut-free") for item in items)


HOW = 'To have the basket bought, say "Buy the basket".'
EMPTY = "The basket is empty, so nothing is bought."


@pytest.mark.parametrize(
    ("basket", "words", "notes"),
    [
        (FULL, "No, I don't want anything else. Buy it please.", [HOW]),
        (FULL, "Yes, buy", [HOW]),
        (FULL, "purchase please", [HOW]),
        (FULL, "Buy the basket", [f"Guessed, not asked for: {', '.join(FULL)}."]),
        (FULL, "Can you buy it tomorrow?", []),
        (FULL, "Who buys it?", []),
        ({}, "Okay, buy it.", [EMPTY]),
        ({}, "Yes, buy", [EMPTY]),
    ],
)
def test_an_order_to_buy_that_buys_nothing_is_told(
    basket: dict[str, int], words: str, notes: list[str]
) -> None:
    opened, told = talked(basket, words)
    assert (opened.basket, told) == (basket, notes)
