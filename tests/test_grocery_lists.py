"""Shopping lists, what refers to what was spoken of before, and questions about the basket."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.types import Action
from shops import talked


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["strawberries and milk", "yes, all but the strawberries"], {"Whole Milk": 1}),
        (["A can of chickpeas, please."], {"Canned Chickpeas": 1}),
        (["three cans of kidney beans"], {"Canned Kidney Beans": 3}),
        (["four cans of tomato soup and a tin of tuna"],
         {"Tomato Soup": 4, "Canned Tuna in Water": 1}),
        (["two bottles of apple juice", "I didn't ask for the guessed things, take them out."],
         {"Apple Juice": 2}),
        (["rice, noodles, milk"],
         {"Long Grain White Rice": 1, "Udon Noodles": 1, "Whole Milk": 1}),
        (["rice", "Instead of the rice, noodles."], {"Udon Noodles": 1}),
        (["3 milk", "Only one milk will do."], {"Whole Milk": 1}),
        (["Two packs of butter, one salted and one unsalted, please."],
         {"Salted Butter": 1, "Unsalted Butter": 1}),
        (["potatoes, 6 eggs and some cheese, whichever is cheapest"],
         {"White Potatoes": 1, "Large Eggs": 1, "Cheddar Cheese": 1}),
        (["chicken", "I changed my mind, rice instead of the chicken."],
         {"Long Grain White Rice": 1}),
        (["Good morning. It's for the weekly shopping. I need eggs"], {"Large Eggs": 1}),
        (["rice 2kg"], {"Long Grain White Rice": 2}),
        (["add rice (2 kg), please"], {"Long Grain White Rice": 2}),
        (["milk 2 litres, eggs, flour 500 g and sugar (1kg)"],
         {"Whole Milk": 2, "Large Eggs": 1, "All-Purpose Wheat Flour": 1, "Cane Sugar": 1}),
        (["chicken breasts, 1kg"], {"Chicken Breasts": 1}),
        (["rice 2kg", "make it 3 kg"], {"Long Grain White Rice": 3}),
        (["Please get me six eggs", "By the way, I'm vegan."], {"Egg Replacer Powder": 1}),
        (["6 yoghurts", "I'm lactose intolerant"], {"Soy Yogurt": 6}),
        (["Do you have oat milk?", "I'll take two of those."], {"Oat Milk": 2}),
        (["Do you have oat milk?", "How much is it?", "I'll take two"], {"Oat Milk": 2}),
        (["Do you sell peanut butter?", "Great, I'll take one."], {"Creamy Peanut Butter": 1}),
        (["Do you have oat milk?", "I'll take it"], {"Oat Milk": 1}),
        (["is there rye bread?", "I'll take it"], {"Rye Bread": 1}),
        (["what's the cheapest wine?", "take that one"], {"Chianti Red Wine": 1}),
        (["milk", "I'll take it"], {"Whole Milk": 1}),
        (["get milk. Actually never mind, I have some. But eggs!"], {"Large Eggs": 1}),
        (["add milk and eggs, never mind the milk"], {"Large Eggs": 1}),
        (["avocados", "avocados to 4 please"], {"Avocados": 4}),
        (["vegan here, making chili tonight", "ground beef and rice"],
         {"Long Grain White Rice": 1}),
        (["red wine and beer", "two bottles of each"],
         {"Merlot Red Wine": 2, "Lager Beer": 2}),
        (["any gluten free bread?", "ok one of those"], {"Gluten-Free White Bread": 1}),
        (["got any oat milk?", "add it anyway"], {"Oat Milk": 1}),
        (["any discounts?", "any chance you could add milk?"], {"Whole Milk": 1}),
        (["no meat on weekdays", "fish for friday"], {}),
        (["add cod", "salmon not cod"], {"Salmon Fillets": 1}),
        (["vanilla ice cream, vanilla extract", "chocolate ice cream instead of vanilla"],
         {"Pure Vanilla Extract": 1, "Chocolate Ice Cream": 1}),
        (["hey, just some milk", "2 litres"], {"Whole Milk": 2}),
        (["drinks - cola and lemonade, 3 bottles each"], {"Cola": 3, "Lemonade": 3}),
        (["dips: hummus and guacamole"], {"Classic Hummus": 1, "Guacamole": 1}),
        (["paper plates and cups, a sliced white loaf"],
         {"Paper Plates": 1, "Paper Cups": 1, "White Sandwich Bread": 1}),
        (["butter", "she's lactose intolerant now"], {"Vegan Butter": 1}),
        (["I already have flour", "and eggs too"], {}),
        (["I already have flour", "and eggs"], {"Large Eggs": 1}),
        (["I've got eggs at home", "and add jam too"], {"Strawberry Jam": 1}),
        (["biscuits x3", "no wait, that's too many, just one"], {"Digestive Biscuits": 1}),
        (["corn tortillas", "swap the corn tortillas for flour ones"],
         {"Soft Flour Tortillas": 1}),
        (["milk", "make it 2 litres instead of 1"], {"Whole Milk": 2}),
        (["spaghetti", "actually make it penne instead of spaghetti"], {"Penne": 1}),
        (["2 milk", "only one, please"], {"Whole Milk": 1}),
        (["eggs", "two dozen"], {"Large Eggs": 2}),
        (["two dozen eggs", "just one dozen"], {"Large Eggs": 1}),
        (["bananas, not the organic ones"], {"Bananas": 1}),
        (["a tin of peas, 3 cans of tomatoes"], {"Canned Green Peas": 1, "Diced Tomatoes": 3}),
        (["soy sauce, milk", "take out the soy sauce I didn't order"], {"Whole Milk": 1}),
        (["milk", "scrap that"], {}),
        (["wine", "take the chianti out", "thanks"], {}),
        (["wine", "take the chianti out", "wine"], {"Merlot Red Wine": 1}),
        (["gluten-free pasta", "remove the chickpea pasta", "ok"], {}),
        (["eggs, milk", "I'm vegan", "ok"], {"Egg Replacer Powder": 1, "Barista Soy Milk": 1}),
        (["do you have gluten free pasta?", "add two of them"], {"Chickpea Pasta": 2}),
        (["milk", "another one, please"], {"Whole Milk": 2}),
        (["What's the cheapest cheese?", "add three"], {"Ricotta Cheese": 3}),
        (["Is there organic milk?", "I'll take two"], {"Organic Whole Milk": 2}),
        (["organic vegan milk"], {"Organic Oat Milk": 1}),
        (["I'm coeliac", "vegan bread"], {}),
        (["two bottles of apple juice",
          "I don't need the things that you guessed, please take them out."], {"Apple Juice": 2}),
        (["milk 2l and eggs, my daughter is allergic to nuts"],
         {"Whole Milk": 2, "Large Eggs": 1}),
        (["eggs and bacon, nobody is vegetarian"], {"Large Eggs": 1, "Smoked Bacon": 1}),
        (["bananas, my kids are 3 and 5"], {"Bananas": 1}),
        (["milk, he is vegan"], {"Barista Soy Milk": 1}),
        (["remove the milk, my son can't have it"], {}),
        (["12 normal hot dog rolls and 2 gluten free ones"], {"Hot Dog Buns": 2}),
        (["milk - 1l x4, butter - 250g x2"], {"Whole Milk": 4, "Unsalted Butter": 2}),
        (["sausage rolls and egg rolls"], {}),
        (["brioche rolls, 2 ciabatta rolls and pita rolls"],
         {"Brioche Buns": 1, "Ciabatta": 2, "Pita Bread": 1}),
        (["2 bread rolls and paper towel rolls"], {"Dinner Rolls": 1, "Paper Towels": 1}),
        (["rice 500g x2, pasta 2x500g, milk 1l x 3"],
         {"Long Grain White Rice": 1, "Fettuccine Egg Pasta": 4, "Whole Milk": 3}),
        (["500g. of beef mince and 1kg. potatoes"], {"Ground Beef": 1, "White Potatoes": 1}),
        (["eggs, nut free obviously"], {"Large Eggs": 1}),
        (["weekly shop: milk, eggs"], {"Whole Milk": 1, "Large Eggs": 1}),
        (["put 3 packs of burger buns in, normal ones"], {"Hamburger Buns": 3}),
        (["can you put some milk in?"], {"Whole Milk": 1}),
        (["put the milk in the fridge"], {}),
        (["breakfast sausages", "remove the breakfast sausages",
          "I want the breakfast sausages back"], {"Breakfast Sausages": 1}),
        (["milk", "i want to put the milk back"], {}),
        (["cream cheese", "instead of the cream cheese a soy yogurt or something for the sauce"],
         {"Soy Yogurt": 1}),
        (["juice boxes for the kids", "remove the orange juice", "eggs"], {"Large Eggs": 1}),
    ],
)  # fmt: skip
def test_lists_amounts_and_what_was_spoken_of(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("Did I get the butter?", "Yes: 1 x Unsalted Butter."),
        ("Have you added the milk yet?", "No, the basket holds nothing of that name."),
        ("How many bottles of apple juice do I have?", "The basket holds 2 x Apple Juice."),
        ("How many bottles of apple juice did you get?", "The basket holds 2 x Apple Juice."),
        ("Which apple juice is it?", "The basket holds 2 x Apple Juice."),
        ("How many eggs do I have now?", "No, the basket holds nothing of that name."),
        ("Do I have everything for a cake?", None),
        ("Do I have to pay now?", None),
        ("Did I get everything?", None),
    ],
)
def test_what_is_in_the_basket_is_told(question: str, answer: str | None) -> None:
    opened, _ = talked({}, "butter and two bottles of apple juice")
    told = opened.answer(question)
    assert told == answer
    assert opened.answer("What do you have in the basket?") == opened.status()
    assert (opened.answer("What's in the basket?") or "").startswith("The basket holds")


@pytest.mark.parametrize(
    ("words", "basket"),
    [
        ("no, wait, I still need garlic and a bit of basil", {"Garlic": 1, "Fresh Basil": 1}),
        ("and a little cream", {"Heavy Whipping Cream": 1}),
        ("and I'm missing sugar", {"Cane Sugar": 1}),
        ("Don't buy it yet, I have to ask my husband.", {}),
        ("A can of black beans, please.", {"Canned Black Beans": 1}),
        ("Anything cheaper than the milk?", {}),
        ("Take everything out that I didn't ask for.", {}),
    ],
)
def test_an_afterthought_is_an_order_and_nothing_is_guessed_for_it(
    words: str, basket: dict[str, int]
) -> None:
    opened, _ = talked({}, words)
    assert opened.basket == basket
    assert opened.is_order(said(words))


def test_after_guesses_had_to_go_nothing_is_guessed_until_an_aim_is_stated() -> None:
    said_before = ["A party for ten friends", "Please remove everything you guessed."]
    opened, _ = talked({}, *said_before)
    assert opened.actions(["salsa"], said(*said_before, "I still need garlic")) == []
    assert opened.actions(["salsa"], said(*said_before, "I'd like to make a Mexican dinner")) != []


@pytest.mark.parametrize(
    "asked",
    ["milk 2l and eggs, my daughter is allergic to nuts", "juice boxes for the kids", "brocoli"],
)
def test_what_was_asked_for_in_other_words_is_not_guessed(asked: str) -> None:
    opened, told = talked({}, asked, "what did you guess?")
    assert opened.basket
    assert told == ["Guessed, not asked for: nothing."]


def test_what_was_asked_for_is_not_asked_for_anew() -> None:
    opened, told = talked({}, "milk 2l", "i did ask for milk")
    assert opened.basket == {"Whole Milk": 2}
    assert told == ["The basket holds 2 x Whole Milk already."]


def test_of_several_things_of_one_name_the_first_was_asked_for() -> None:
    opened, _ = talked({}, "milk")
    for name in ("Oat Milk", "Walnuts"):
        opened.step(Action("add item", name))
    turns = said("milk", "What did you guess?", "Please remove everything you guessed.")
    assert opened.unmet(turns[:2], []) == ["Guessed, not asked for: Oat Milk, Walnuts."]
    assert [action.target for action in opened.requests(turns)] == ["Oat Milk", "Walnuts"]


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        ("take out the stuff I never asked for", {"Whole Milk": 1}),
        ("remove what I did not ask for", {"Whole Milk": 1}),
        ("I don't want things nobody asked for", {"Whole Milk": 1}),
        ("I don't need everything I asked for", {"Walnuts": 1, "Whole Milk": 1}),
    ],
)
def test_what_nobody_asked_for_goes_and_nothing_else(said: str, basket: dict[str, int]) -> None:
    assert talked({"Walnuts": 1}, "milk", said)[0].basket == basket
