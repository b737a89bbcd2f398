"""What people say they meant, and what they only tell of the past."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from shops import talked


@pytest.mark.parametrize(
    "said",
    [
        "We ordered pizza for tonight, so just drinks please",
        "I wanted a cake, but never mind",
        "I needed 2 eggs and got 12",
        "I ordered milk yesterday",
        "I like cats, not dogs",
        "I wanted 2 cakes last week",
    ],
)
def test_what_was_is_not_asked_for(said: str) -> None:
    assert talked({}, said)[0].basket == {}


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Add ground coffee", "ground, not instant"], None),
        (["Add eggs", "fresh, not frozen"], {"Large Eggs": 1}),
        (["Add bread", "rye, not white"], {"Rye Bread": 1}),
        (["Add milk", "chocolate, not vanilla"], {"Whole Milk": 1}),
        (["coffee", "decaf actually"], {"Decaf Ground Coffee": 1}),
        (["kale and apples", "make them organic"], {"Organic Kale": 1, "Organic Gala Apples": 1}),
        (["oat milk", "the normal one instead"], {"Whole Milk": 1}),
        (
            ["white bread, whole wheat flour", "swap the white bread for whole wheat"],
            {"Whole Wheat Flour": 1, "Whole Wheat Bread": 1},
        ),
        (
            [
                "bananas, half a dozen eggs",
                "a dozen eggs",
                "scratch the bananas and the half dozen eggs",
            ],
            {"Large Eggs": 1},
        ),
        (
            ["Get a vanilla ice cream for us and a vegan one for Tom"],
            {"Vanilla Ice Cream": 1, "Dairy-Free Vanilla Ice Cream": 1},
        ),
        (
            ["gluten free spaghetti", "swap the gluten-free spaghetti for the normal one"],
            {"Spaghetti": 1},
        ),
        (["add milk. wait no, make it oat milk"], {"Oat Milk": 1}),
        (["2 milk", "and the milk lactose free"], {"Lactose-Free Milk": 2}),
        (["butter", "the butter salted please"], {"Salted Butter": 1}),
        (["water", "sparkling"], {"Sparkling Water": 1}),
        (["rice, basmati"], {"Basmati Rice": 1}),
        (["toilet paper, 12 rolls"], {"Toilet Paper": 2}),
        (["24 rolls of toilet paper"], {"Toilet Paper": 4}),
        (["10 lemons no 8"], {"Lemons": 2}),
        (["eggs 12, milk 2, bread"], {"Large Eggs": 1, "Whole Milk": 2, "White Sandwich Bread": 1}),
        (["dishwasher tablets, the cheapest"], {"Dishwasher Tablets": 1}),
        (["bread", "yes two"], {"White Sandwich Bread": 2}),
        (["bread", "remove the bread", "actually keep the bread"], {"White Sandwich Bread": 1}),
        (["spaghetti", "eggs I have"], {"Spaghetti": 1}),
        (["add the eggs I have"], {"Large Eggs": 1}),
        (["sandwiches"], {}),
        (["peanut butter, nobody is allergic"], {"Creamy Peanut Butter": 1}),
        (["large pack of toilet paper, 24 rolls"], {"Toilet Paper": 4}),
        (["6 bagels", "make it a dozen"], {"Plain Bagels": 2}),
        (["half a dozen eggs", "make it a dozen"], {"Large Eggs Half Dozen": 2}),
        (["kale and apples", "are both organic?"], {"Kale": 1, "Gala Apples": 1}),
        (["the cheapest rice you have"], {"Long Grain White Rice": 1}),
        (
            ["two frozen pizzas, one margherita one pepperoni"],
            {"Frozen Margherita Pizza": 1, "Frozen Pepperoni Pizza": 1},
        ),
        (
            ["Add 2 whole milk and 3 plain yogurt", "I said milk, not yogurt"],
            {"Whole Milk": 2},
        ),
        (["Add plain yogurt", "I meant oat milk, not yogurt"], {"Oat Milk": 1}),
        (["Add 2 plain yogurt", "no, I meant oat milk"], {"Oat Milk": 2}),
        (["Add whole milk", "Oat milk, not whole milk."], {"Oat Milk": 1}),
        (["I wanted kale."], {"Kale": 1}),
        (["Add whole milk", "no, I meant remove the milk"], {}),
        (["Add whole milk", "oops, I meant remove it"], {}),
        (["Add whole milk", "no, I mean it"], {"Whole Milk": 1}),
        (["Add whole milk", "sorry, I meant for tomorrow"], {"Whole Milk": 1}),
        (["Add rye bread", "i wanted 2 loaves of bread"], {"Rye Bread": 2}),
        (["2 courgettes and some aubergines, please"], {"Zucchini": 2, "Eggplant": 1}),
    ],
)
def test_what_was_meant_takes_the_place_of_what_was_heard(
    utterances: list[str], basket: dict[str, int] | None
) -> None:
    before = talked({}, utterances[0])[0].basket
    opened, told = talked({}, *utterances)
    assert opened.basket == (before if basket is None else basket)
    assert not any("ditto" in note for note in told)


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Add 2 whole milk", "remove the milk, no, keep it"], {"Whole Milk": 2}),
        (["Add 2 whole milk", "Take out the milk. Actually, leave it."], {"Whole Milk": 2}),
        (["Add milk. No, don't."], {}),
        (["Add milk", "add kale and take out the milk, no, leave it"],
         {"Whole Milk": 1, "Kale": 1}),
        (["Add apple pie", "yes but take out the apple pie first"], {}),
        (["3 bottles of merlot", "2 wines instead of 3", "white bread not rye", "plain yogurt"],
         {"Merlot Red Wine": 2, "White Sandwich Bread": 1, "Plain Yogurt": 1}),
        (["cheddar and apple pie", "my kid is allergic to nuts", "ok"],
         {"Cheddar Cheese": 1, "Apple Pie": 1}),
    ],
)  # fmt: skip
def test_what_is_taken_back_at_once_is_not_done_and_nothing_comes_back(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["milk", "No, I meant oat milk"], {"Oat Milk": 1}),
        (["3 milk", "oat milk instead", "thanks"], {"Oat Milk": 3}),
        (["milk, tea", "oat milk instead"], {"English Breakfast Tea Bags": 1, "Oat Milk": 1}),
        (["orange juice and a pack of butter", "Sorry, apple juice instead."],
         {"Unsalted Butter": 1, "Apple Juice": 1}),
        (["bread", "brown bread instead, please"], {"Whole Wheat Bread": 1}),
        (["bread", "the brown one"], {"Whole Wheat Bread": 1}),
        (["a bottle of red wine", "Make that white wine instead."],
         {"Sauvignon Blanc White Wine": 1}),
        (["red wine, cheese", "Actually, white wine instead of the red one."],
         {"Cheddar Cheese": 1, "Sauvignon Blanc White Wine": 1}),
        (["whole milk, oat milk", "take the oat one out"], {"Whole Milk": 1}),
        (["rice", "brown rice please, not white"], {"Brown Rice": 1}),
        (["bread", "brown, not white"], {"Whole Wheat Bread": 1}),
        (["tea", "green"], {"Green Tea Bags": 1}),
        (["ground coffee", "ground, not instant"], {"House Blend Ground Coffee": 1}),
        (["chicken", "actually, make it turkey"], {"Whole Turkey": 1}),
        (["milk", "make it quick"], {"Whole Milk": 1}),
        (["tea", "nothing instead"], {"English Breakfast Tea Bags": 1}),
        (["tea", "Sunday instead"], {"English Breakfast Tea Bags": 1}),
        (["milk", "camel milk instead"], {"Whole Milk": 1}),
        (["whole milk", "Not whole milk, I said oat milk"], {"Oat Milk": 1}),
        (["white bread, not rye"], {"White Sandwich Bread": 1}),
        (["rye bread", "white bread, not rye"], {"White Sandwich Bread": 1}),
        (["for dinner, not lunch"], {}),
        (["Sunday, not Monday"], {}),
    ],
)  # fmt: skip
def test_what_comes_instead_takes_the_place_of_what_it_is_like(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


def test_what_comes_instead_of_one_of_several_things_is_asked() -> None:
    opened, told = talked({}, "milk, tea", "coffee instead")
    assert list(opened.basket)[:2] == ["Whole Milk", "English Breakfast Tea Bags"]
    assert told == ["It is not clear which thing you mean. Please name it."]


@pytest.mark.parametrize(
    "said",
    ["make it tomorrow", "tomorrow instead", "let's do tacos instead", "make it extra special",
     "make it enough for six", "make it worth it", "yes, not cheese", "thanks, not today",
     "perhaps not milk", "people could not drink milk", "not only milk", "make sure not to buy it",
     "milk, not sure which"],
)  # fmt: skip
def test_words_that_swap_no_things_take_nothing_out(said: str) -> None:
    assert "Whole Milk" in talked({}, "milk", said)[0].basket


@pytest.mark.parametrize(
    "said",
    ["He must not eat peanuts.", "Our daughter must not have nuts", "toddlers must not eat nuts"],
)
def test_what_must_not_be_eaten_is_no_swap(said: str) -> None:
    opened, told = talked({}, said, "add peanuts")
    assert "Salted Peanuts" not in opened.basket
    assert told == ["Not added, since it has to be nut-free: peanuts."]


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["bread", "make it rye"], {"Rye Bread": 1}),
        (["bread", "whole wheat instead"], {"Whole Wheat Bread": 1}),
        (["milk", "thanks", "make it skim"], {"Skim Milk": 1}),
        (["a cake", "make it chocolate"], {"Chocolate Fudge Cake": 1}),
        (["bread", "make it gluten-free"], {"Gluten-Free White Bread": 1}),
        (["chicken breasts, rice", "make it turkey"],
         {"Chicken Breasts": 1, "Long Grain White Rice": 1}),
        (["milk", "oat milk instead of whole milk", "thanks"], {"Oat Milk": 1}),
        (["milk", "not only milk but also eggs"], {"Whole Milk": 1, "Large Eggs": 1}),
        (["red wine, white wine", "no red"], {"Sauvignon Blanc White Wine": 1}),
        (["white rice, white bread and 3 packs of hot dogs", "brown rice instead of white"],
         {"White Sandwich Bread": 1, "Beef Hot Dogs": 3, "Brown Rice": 1}),
        (["white rice, white bread", "swap the white for brown rice"],
         {"White Sandwich Bread": 1, "Brown Rice": 1}),
        (["white rice, white bread", "swap white rice for brown"],
         {"White Sandwich Bread": 1, "Brown Rice": 1}),
        (["milk, diapers, bread and white rice",
          "make it semi skimmed milk, 3 of them, and brown rice instead of white"],
         {"Newborn Diapers": 1, "White Sandwich Bread": 1, "2% Reduced-Fat Milk": 3,
          "Brown Rice": 1}),
        (["lactose free milk", "beef hot dogs", "semi skimmed milk instead"],
         {"Beef Hot Dogs": 1, "2% Reduced-Fat Milk": 1}),
        (["green tea", "coffee", "tea instead"],
         {"Green Tea Bags": 1, "English Breakfast Tea Bags": 1}),
        (["red wine, red onions", "white wine instead of the red"],
         {"Red Onions": 1, "Sauvignon Blanc White Wine": 1}),
        (["whole milk, whole chicken", "oat milk instead of whole"],
         {"Whole Chicken": 1, "Oat Milk": 1}),
        (["tomatoes, basil", "canned tomatoes instead of fresh"],
         {"Fresh Basil": 1, "Diced Tomatoes": 1}),
        (["2 white bread", "brown instead of white"], {"Whole Wheat Bread": 2}),
        (["milk", "make it semi skimmed milk and add eggs"],
         {"2% Reduced-Fat Milk": 1, "Large Eggs": 1}),
        (["2 white bread", "pita bread instead of the white bread then, and eggs"],
         {"Pita Bread": 2, "Large Eggs": 1}),
        (["white bread", "pita bread instead of the white bread, and two unicorns for my husband"],
         {"Pita Bread": 1}),
        (["coffee, milk", "tea instead of coffee, and oat milk instead of milk"],
         {"English Breakfast Tea Bags": 1, "Oat Milk": 1}),
        (["fish", "remove the cod", "eggs"], {"Large Eggs": 1}),
        (["fish and rice", "chicken instead of the fish, my wife is allergic"],
         {"Long Grain White Rice": 1, "Whole Chicken": 1}),
        (["2 fish", "salmon instead"], {"Salmon Fillets": 2}),
        (["fish", "salmon instead", "cod fillets too", "eggs"],
         {"Salmon Fillets": 1, "Cod Fillets": 1, "Large Eggs": 1}),
        (["flour", "whole wheat instead of white"], {"Whole Wheat Flour": 1}),
        (["coffee", "decaf instead of regular"], {"Decaf Ground Coffee": 1}),
        (["milk", "almond instead of regular"], {"Whole Milk": 1, "Sliced Almonds": 1}),
        (["white bread and whole milk",
          "skim instead of whole milk and brown instead of white"],
         {"White Sandwich Bread": 1, "Skim Milk": 1}),
        (["rice", "instead of asking just add cheese"],
         {"Long Grain White Rice": 1, "Cheddar Cheese": 1}),
        (["bananas", "switch bananas for organic"], {"Organic Bananas": 1}),
        (["cola", "diet cola instead of regular"], {"Diet Cola": 1}),
        (["apples, granny smith apples", "remove everything I did not ask for"],
         {"Gala Apples": 1, "Granny Smith Apples": 1}),
    ],
)  # fmt: skip
def test_a_swap_takes_out_only_what_it_is_for(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "basket", "told"),
    [
        (["white rice", "wine instead of white"],
         {"Long Grain White Rice": 1, "Chianti Red Wine": 1},
         ["There was no white wine in the basket."]),
        (["milk", "rye bread, not white"],
         {"Whole Milk": 1, "Rye Bread": 1}, ["There was no white bread in the basket."]),
        (["eggs", "oat milk instead of milk"],
         {"Large Eggs": 1, "Oat Milk": 1}, ["There was no milk in the basket."]),
        (["rice", "instead of asking just add cheese"],
         {"Long Grain White Rice": 1, "Cheddar Cheese": 1}, []),
        (["3 milk", "oat milk instead of one of the milks"],
         {"Whole Milk": 3, "Oat Milk": 1}, []),
        (["milk, lactose free milk", "hot dogs", "oat milk instead"],
         {"Whole Milk": 1, "Lactose-Free Milk": 1, "Beef Hot Dogs": 1, "Oat Milk": 1},
         ["It is not clear which thing you mean. Please name it."]),
        (["white rice, green beans", "pears instead of green"],
         {"Long Grain White Rice": 1, "Green Beans": 1, "Pears": 1},
         ["It is not clear which thing you mean. Please name it."]),
    ],
)  # fmt: skip
def test_nothing_leaves_that_is_of_another_kind_and_that_is_told(
    utterances: list[str], basket: dict[str, int], told: list[str]
) -> None:
    opened, notes = talked({}, *utterances)
    assert (opened.basket, notes) == (basket, told)


@pytest.mark.parametrize(
    ("words", "basket"),
    [
        ("Make it half the chicken.", {"Chicken Breasts": 1}),
        ("half the chicken", {"Chicken Breasts": 1}),
        ("double the chicken, please", {"Chicken Breasts": 4}),
        ("half the turkey", {"Chicken Breasts": 2}),
    ],
)
def test_half_of_what_is_there_is_meant(words: str, basket: dict[str, int]) -> None:
    assert talked({"Chicken Breasts": 2}, words)[0].basket == basket


@pytest.mark.parametrize(
    ("first", "said", "basket"),
    [
        ("two rye bread", "sourdough instead of the rye, and only one", {"Sourdough Bread": 1}),
        ("two milk", "oat milk instead, just one", {"Oat Milk": 1}),
        ("two milk", "one oat milk instead of it", {"Oat Milk": 1}),
    ],
)
def test_how_many_take_the_place_of_others_is_as_said(
    first: str, said: str, basket: dict[str, int]
) -> None:
    assert talked({}, first, said)[0].basket == basket


def test_a_correction_behind_an_undo_is_of_nothing_older() -> None:
    said = ("add milk", "add sugar", "undo that", "no, I meant the butter")
    assert talked({}, *said)[0].basket == {"Whole Milk": 1, "Unsalted Butter": 1}


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["add milk", "make that two bottles please"], {"Whole Milk": 2}),
        (["add 3 bottles of milk", "remove one bottle"], {"Whole Milk": 2}),
        (["add 3 bottles of milk", "take a bottle out, please"], {"Whole Milk": 2}),
        (["add 3 milks", "put two of them back"], {"Whole Milk": 1}),
        (["add 3 milks", "fewer"], {"Whole Milk": 2}),
        (["add 3 milks", "don't remove one"], {"Whole Milk": 3}),
        (["add 3 milks", "I wouldn't take two out"], {"Whole Milk": 3}),
        (["add milk", "actually two"], {"Whole Milk": 2}),
        (["add milk", "no, three please"], {"Whole Milk": 3}),
        (["add milk", "how much does it cost?", "ok two of them"], {"Whole Milk": 2}),
        (["add kale", "add milk", "remove the last thing"], {"Kale": 1}),
    ],
)
def test_how_many_of_what_was_spoken_of_last(utterances: list[str], basket: dict[str, int]) -> None:
    opened, notes = talked({}, *utterances)
    assert (opened.basket, notes) == (basket, [])


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        ("no wait, oat milk", {"Oat Milk": 1}),
        ("oops, the oat milk please", {"Oat Milk": 1}),
        ("no, not that one, the oat milk", {"Oat Milk": 1}),
        ("wrong one, the kale", {"Kale": 1}),
        ("oops, I forgot the kale", {"Whole Milk": 1, "Kale": 1}),
        ("no wait, and kale", {"Whole Milk": 1, "Kale": 1}),
        ("no wait, keep it", {"Whole Milk": 1}),
        ("no wait, more", {"Whole Milk": 1}),
        ("oops, my bad", {"Whole Milk": 1}),
        ("oops, wrong one", {"Whole Milk": 1}),
        ("no wait", {"Whole Milk": 1}),
    ],
)
def test_what_is_said_behind_an_oops_takes_the_place_of_the_last(
    said: str, basket: dict[str, int]
) -> None:
    opened, notes = talked({}, "add milk", said)
    assert (opened.basket, notes) == (basket, [])


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        ("clear everything", {}),
        ("clear everything except the milk", {"Whole Milk": 1}),
        ("clear everything but the milk", {"Whole Milk": 1}),
        ("don't clear everything", {"Whole Milk": 1, "Kale": 1}),
    ],
)
def test_all_is_cleared_or_all_but_what_is_named(said: str, basket: dict[str, int]) -> None:
    assert talked({"Whole Milk": 1, "Kale": 1}, said)[0].basket == basket


@pytest.mark.parametrize(
    "said",
    [
        "we'd like to have a picnic on Sunday",
        "I want a barbecue for 6",
        "My daughter turns 7 and we want to have a party at home",
        "thanks bye",
        "that's too expensive, find a cheaper one",
    ],
)
def test_an_occasion_and_a_remark_are_no_things(said: str) -> None:
    opened, notes = talked({}, said)
    assert (opened.basket, [each for each in notes if "nothing called" in each]) == ({}, [])


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["add honey", "forget the honey", "add it again"], {"Clover Honey": 1}),
        (["add honey", "add it again"], {"Clover Honey": 1}),
        (["2 milk 1 rye bread 3 kale"], {"Whole Milk": 2, "Rye Bread": 1, "Kale": 3}),
        (["add 2 milk 3 kale please"], {"Whole Milk": 2, "Kale": 3}),
    ],
)
def test_what_comes_again_and_what_is_listed_without_commas(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["add apples", "add pears", "remove both"], {}),
        (["add apples", "add pears", "remove both", "add them back"],
         {"Gala Apples": 1, "Pears": 1}),
        (["add kale", "add apples and pears", "take both of them out"], {"Kale": 1}),
        (["add kale", "add apples", "add pears", "undo both"], {"Kale": 1}),
        (["add milk", "a second milk"], {"Whole Milk": 2}),
        (["add kale", "three kale is fine"], {"Kale": 3}),
        (["add 3 kale", "two is fine"], {"Kale": 2}),
        (["add ice cream", "not that one, strawberry"], {"Vanilla Ice Cream": 1}),
    ],
)  # fmt: skip
def test_both_a_second_and_how_many_will_do(utterances: list[str], basket: dict[str, int]) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["add kale", "put the kale back", "Hmm, no, wait. I do want the kale after all."],
         {"Kale": 1}),
        (["add milk", "add kale", "I don't want the milk, put it back"], {"Kale": 1}),
        (["add milk and kale", "I don't need the kale, take it out"], {"Whole Milk": 1}),
        (["add kale", "add milk", "I don't want it, put it back"], {"Kale": 1}),
        (["add pizza, soy sauce, kale and milk",
          "I never asked for pizza, soy sauce and milk. Get rid of all that."], {"Kale": 1}),
        (["add kale", "put the kale back", "add honey and milk",
          "I didn't ask for all that honey and milk, put it back."], {}),
        (["add milk", "Put the milk back, I'd rather have oat milk."], {"Oat Milk": 1}),
        (["add kale, milk and honey", "I only wanted the kale and the milk, the rest can go."],
         {"Kale": 1, "Whole Milk": 1}),
        (["add kale and milk", "Could you get the kale out?"], {"Whole Milk": 1}),
        (["I only want kale, milk and ricotta"],
         {"Kale": 1, "Whole Milk": 1, "Ricotta Cheese": 1}),
        (["add milk", "Kale I guess. But no pizza sauce please"], {"Whole Milk": 1, "Kale": 1}),
    ],
)  # fmt: skip
def test_what_is_wanted_after_all_rather_or_alone(
    utterances: list[str], basket: dict[str, int]
) -> None:
    opened = talked({}, *utterances)[0]
    assert opened.basket == basket
    assert opened.is_order([Turn("What?", each) for each in utterances])


@pytest.mark.parametrize(
    ("utterances", "told"),
    [
        (["I'm vegan", "forget that I'm vegan"], ["It need not be vegan any longer."]),
        (["I'm allergic to nuts", "It need not be nut-free"],
         ["It need not be nut-free any longer."]),
        (["I'm allergic to nuts", "Never mind the nuts, I outgrew it."],
         ['It still has to be nut-free. "It need not be nut-free" takes that back.']),
        (["I'm vegan", "add kale"], []),
    ],
)  # fmt: skip
def test_a_diet_that_binds_no_longer_is_told(utterances: list[str], told: list[str]) -> None:
    assert talked({}, *utterances)[1] == told


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        (["we have milk at home, take it out"], {"Kale": 1}),
        (["the milk is too expensive, remove it"], {"Kale": 1}),
        (["there's milk in the fridge already so remove it"], {"Kale": 1}),
        (["is the milk organic? if not, take it out"], {"Kale": 1}),
        (["how much is the milk?", "remove it"], {"Kale": 1}),
        (["do I have milk?", "make it two"], {"Whole Milk": 2, "Kale": 1}),
        (["my kids don't drink milk, take it out"], {"Kale": 1}),
        (["keep the milk, remove it"], {"Whole Milk": 1}),
        (["remove it, I only need milk"], {"Whole Milk": 1}),
        (["remove it"], {"Whole Milk": 1}),
    ],
)
def test_it_is_what_the_same_words_or_a_question_spoke_of(
    said: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, "add milk", "add kale", *said)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["add jam", "the jam should be raspberry"], {"Raspberry Jam": 1}),
        (["add bread", "and the bread must be gluten free"], {"Gluten-Free White Bread": 1}),
        (["add milk", "the milk should be cold"], {"Whole Milk": 1}),
        (["add tomatoes", "not those, cherry tomatoes"], {"Cherry Tomatoes": 1}),
        (["add 3 kale", "that's one too many"], {"Kale": 2}),
        (["pasta and sauce"], {"Fettuccine Egg Pasta": 1, "Marinara Pasta Sauce": 1}),
    ],
)
def test_what_a_thing_should_be_takes_its_place(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket
