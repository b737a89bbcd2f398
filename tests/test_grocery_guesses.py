"""What the shop guesses, and what it does not: orders, questions and hinted diets."""

from __future__ import annotations

import time

import pytest

from fakes import said
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.restrictions import violates
from goalscope.types import Action, Turn
from shops import CATALOGUE, shop, talked

TERMS = ("cheese", "flour", "chocolate", "burger", "milk", "bread", "wine", "chicken")


@pytest.mark.parametrize(
    "utterance",
    [
        "2 cans of tuna, a jar of olives and a dozen eggs",
        "6 bananas, 2 lbs of chicken breast and a bag of rice",
        "i want 2 milk",
        "2 milk, that's it",
        "double the milk",
        "make it three",
        "i don't like rye, can i have white bread instead",
        "only the lasagne, 2 of them, and nothing else",
        "no coffee syrup please, and why coconut oil?",
        "actually forget the crackers",
        "that is way over 20 dollars!",
        "no meat at all, please",
        "one less egg",
        "I'm allergic to nuts",
        "My son is allergic to nuts.",
        "I'm vegan",
        "Everything must be organic.",
        "Nothing else",
        "Stop adding things",
        "My budget is 25",
        "Never mind the budget",
        "I'd like camel milk",
        "yes, 2 milks",
        "Take out the bananas, please. Thanks!",
        "Why did you add cheese? Remove it.",
        "Swap the milk for oat milk",
        "We have milk at home already.",
        "do you have wine? which is the cheapest?",
        "buy it",
    ],
)
def test_orders_refusals_questions_and_remarks_say_exactly_what_is_to_be_done(
    utterance: str,
) -> None:
    assert shop({"Whole Milk": 1}).is_order(said("I need some milk.", utterance))


@pytest.mark.parametrize(
    "utterance",
    [
        "I want to bake a cake for Sunday",
        "We're having 10 kids over",
        "I have guests tomorrow",
        "surprise me",
        "something sweet",
        "2 milk and something sweet",
        "we love spicy food",
        "We like Italian food, no pork",
        "what would go with tuna?",
        "I need stuff for breakfast",
        "I need snacks for a party under $30",
        "vegan burgers for a bbq, no gluten, 6 people",
        "I'd like to bake something for my sister who can't eat gluten",
        "no nuts please, I want to cook a curry",
        "I'm vegan and want a nice dinner",
        "I'm making guacamole, so I need avocados",
        "yes",
        "Ok, sure",
        "",
    ],
)
def test_aims_tastes_and_a_bare_yes_do_not(utterance: str) -> None:
    assert not shop({"Whole Milk": 1}).is_order(said("I need some milk.", utterance))


@pytest.mark.parametrize(
    ("utterance", "diet"),
    [
        ("vegan burgers for a bbq", "vegan"),
        ("I need some gluten-free bread for a guest", "gluten-free"),
        ("my lactose-intolerant aunt is coming for dinner", "dairy-free"),
        ("There will be vegetarian friends too", "vegetarian"),
    ],
)
def test_guesses_obey_diets_that_are_hinted_at(utterance: str, diet: str) -> None:
    opened = shop()
    for turns in (said(utterance), said(utterance, "I want to have a nice evening")):
        items = [CATALOGUE.get(each.target) for each in opened.actions(TERMS, turns)]
        assert items
        assert not any(item is None or violates(item, diet) for item in items)


def test_outright_requests_and_denials_are_bound_by_no_hint() -> None:
    turns = said("vegan burgers for a bbq", "Add 2 packs of ground beef")
    assert Action("add item", "Ground Beef", 2) in shop().requests(turns)
    assert "vegan" not in hear(["vegan burgers for a bbq", "It need not be vegan"]).hinted


FULL = {
    "Large Eggs": 3,
    "Whole Milk": 2,
    "Coconut Milk": 1,
    "Shredded Coconut": 1,
    "Chicken Breasts": 1,
    "Chocolate Chip Cookies": 1,
    "Ground Beef": 1,
    "Walnuts": 1,
}


ANIMAL = ("Large Eggs", "Whole Milk", "Chicken Breasts", "Ground Beef")


def without(*gone: str) -> dict[str, int]:
    return {name: number for name, number in FULL.items() if name not in gone}


@pytest.mark.parametrize(
    ("utterances", "after"),
    [
        (
            ["only the lasagne, 2 of them, and nothing else", "Thanks"],
            {"Frozen Vegetable Lasagne": 2},
        ),
        (["Just the eggs, nothing else", "ok"], {"Large Eggs": 3}),
        (["only 2 packs of eggs and nothing else please"], {"Large Eggs": 2}),
        (["just eggs and walnuts, and nothing else"], {"Large Eggs": 3, "Walnuts": 1}),
        (["cancel the order", "ok"], {}),
        (["Please cancel everything"], {}),
        (["forget the whole thing"], {}),
        (["Scrap the whole order!", "2 kale"], {"Kale": 2}),
        (["did you cancel the order?"], FULL),
        (["I never said cancel the order"], FULL),
        (["forget it"], FULL),
        (["take out anything coconut", "ok"], without("Coconut Milk", "Shredded Coconut")),
        (["remove everything with nuts"], without("Walnuts")),
        (["Remove everything containing milk"], without("Whole Milk", "Coconut Milk")),
        (["get rid of all the coconut things"], without("Coconut Milk", "Shredded Coconut")),
        (["take out all the meat", "ok"], without("Chicken Breasts", "Ground Beef")),
        (
            ["take out the chicken, the cookies, and anything coconut"],
            without(
                "Chicken Breasts", "Chocolate Chip Cookies", "Coconut Milk", "Shredded Coconut"
            ),
        ),
        (["one less egg", "ok"], {**FULL, "Large Eggs": 2}),
        (["an egg less"], {**FULL, "Large Eggs": 2}),
        (["20 dollars of cheese, please"], {**FULL, "Cheddar Cheese": 1}),
        (["just the usual, nothing else"], FULL),
        (["only a few things, nothing else"], FULL),
        (
            ["only vegan food and nothing else, please", "ok"],
            without(*ANIMAL, "Chocolate Chip Cookies"),
        ),
        (["I suppose the eggs were cheaper once"], FULL),
        (["The milk is cheaper now"], FULL),
        (["2 kale, that's it"], {**FULL, "Kale": 2}),
    ],
)
def test_what_is_to_leave_leaves_and_nothing_else(
    utterances: list[str], after: dict[str, int]
) -> None:
    opened, told = talked(FULL, *utterances)
    assert opened.basket == after
    assert not any(note for note in told if not note.startswith(("Not labelled as", "From now on")))


@pytest.mark.parametrize(
    "words", ["\U0001f469\u200d\U0001f467 for us", "], help in", "Oat Milk, $"]
)
def test_signs_that_are_no_words_are_nothing_to_buy(words: str) -> None:
    assert set(talked({}, words)[0].basket) <= {"Oat Milk"}


@pytest.mark.parametrize(
    ("query", "utterances", "after"),
    [
        ("What else?", ["do you have oat milk?", "yes, add it"], {"Oat Milk": 1}),
        ("What else?", ["do you have oat milk?", "Add it, please.", "ok"], {"Oat Milk": 1}),
        ("Shall I add some oat milk?", ["yes, add it please"], {"Oat Milk": 1}),
        (
            "The shop has Oat Milk.",
            ["Do you have oat milk?", "Great, please buy it."],
            {"Oat Milk": 1},
        ),
        ("The shop has Oat Milk.", ["Eggs", "Buy it."], {"Large Eggs": 1}),
        ("In the basket.", ["Is oat milk in the basket?", "Buy it."], {}),
        ("Would you like cheese or eggs?", ["yes, add it"], {}),
        ("What else?", ["yes, add it"], {}),
    ],
)
def test_it_is_what_the_question_was_about(
    query: str, utterances: list[str], after: dict[str, int]
) -> None:
    opened = shop()
    turns: list[Turn] = []
    for utterance in utterances:
        turns.append(Turn(query, utterance))
        for action in [] if opened.answer(utterance) else opened.requests(turns):
            assert opened.step(action).ok
    assert opened.basket == after
    opened.step(Action("add item", "Walnuts"))
    turns.append(Turn("What else?", "Remove everything I didn't ask for"))
    for action in opened.requests(turns):
        assert opened.step(action).ok
    assert opened.basket == after


@pytest.mark.parametrize(
    "utterance",
    [
        "buy it",
        "yes, buy",
        "purchase please",
        "order now",
        "I'll take it all",
        "done, pay",
        "take them",
    ],
)
def test_who_seems_to_buy_is_told_the_words_and_gets_nothing_else(utterance: str) -> None:
    opened = shop({"Walnuts": 1})
    turns = [Turn("Shall I add some oat milk?", utterance)]
    assert opened.requests(turns) == []
    assert opened.is_order(turns)
    told = opened.unmet(turns, [])
    ends = opened.is_completion(turns[-1])
    assert told == ["Guessed, not asked for: Walnuts." if ends else opened.permission(BUY, turns)]


BUY = Action("buy basket")


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("What can you do?", 'say "Buy the basket".'),
        ("what do you sell?", "The shop sells: produce, baking, dairy,"),
        ("is the lasagne free of nuts?", "I cannot tell whether this is nut-free: Frozen Veg"),
        ("Is the lasagne vegan?", "please read the label."),
        ("is the milk safe for a vegan?", "Not vegan: Whole Milk."),
        ("Does the granola contain nuts?", "Not nut-free: "),
        (
            "does anything in there contain dairy?",
            "Listed as dairy-free: Oat Milk. Not dairy-free: Whole Milk.",
        ),
        ("is anything in the basket vegan?", "Listed as vegan: Oat Milk. Not vegan: Whole Milk."),
        ("is there dairy in my basket?", "Not dairy-free: Whole Milk."),
        ("what in my basket contains lactose?", "Not dairy-free: Whole Milk."),
        ("which sausages are gluten free?", "I cannot tell whether these are gluten-free: Italian"),
        ("which sausages contain gluten?", "I cannot tell whether these are gluten-free: Italian"),
        (
            "which of the yogurts are dairy-free?",
            "Listed as dairy-free: Soy Yogurt, Coconut Yogurt. Not dairy-free: ",
        ),
        ("which apples are organic?", "Listed as organic: Organic Gala Apples"),
        ("which meat is halal?", "Not labelled as halal: Beef Stew Meat"),
        ("is everything vegan?", "Not vegan: Whole Milk."),
        ("is oat milk ok for my lactose intolerant aunt?", "Listed as dairy-free: Oat Milk."),
        ("do you have wine? which is the cheapest?", "The cheapest is Chianti Red Wine, $11.09."),
        ("what's the cheapest milk?", "The cheapest is Whole Milk, $1.79."),
        ("is there anything cheaper than the sparkling wine?", "The cheapest is Chianti"),
        ("Which is the cheapest?", "say of what"),
        ("what's the most expensive thing?", "In the basket the most expensive is Oat Milk, $3.09"),
        ("which is the cheapest item in there?", "In the basket the cheapest is Whole Milk"),
        ("Do you have parmesan?", "The shop has Parmigiano Reggiano, $6.49."),
        ("Do you have camel milk?", "Near it: Whole Milk"),
        ("Do you have gruyere?", "The shop has nothing called that."),
    ],
)
def test_short_questions_get_short_answers(question: str, answer: str) -> None:
    told = shop({"Whole Milk": 2, "Oat Milk": 1}).answer(question)
    assert told is not None
    assert answer in told


@pytest.mark.parametrize(
    "words",
    ["what would go with tuna?", "are you vegan?", "is the unicorn vegan?", "Is it ok with you?",
     "which wine is good for fish?", "which chocolate contains nuts?",
     "which unicorns are vegan?", "which sausages are best?", "what is vegan?", "which day is it?",
     "would you mind adding bread without nuts?", "the cheapest wine, please", "is milk good?"],
)  # fmt: skip
def test_what_nobody_can_answer_from_names_is_left_to_the_agent(words: str) -> None:
    assert shop({"Whole Milk": 2}).answer(words) is None


@pytest.mark.parametrize(
    ("utterances", "after", "told"),
    [
        (
            ["2 sparkling wine, kale", "something cheaper than the sparkling wine", "ok"],
            {"Chianti Red Wine": 2, "Kale": 1},
            "",
        ),
        (["sparkling wine", "something cheaper please", "ok"], {"Chianti Red Wine": 1}, ""),
        (["sparkling wine", "find something cheaper for the wine"], {"Chianti Red Wine": 1}, ""),
        (["smoked salmon", "can you find a cheaper one?"], {"Smoked Salmon": 1}, "cheaper"),
        (["milk", "cheaper milk"], {"Whole Milk": 1}, "cheaper: Whole Milk, $1.79."),
        (["cheaper milk please", "ok"], {"Whole Milk": 1}, ""),
        (["milk and kale", "something cheaper"], {"Whole Milk": 1, "Kale": 1}, "not clear"),
        (["milk", "is there anything cheaper?"], {"Whole Milk": 1}, ""),
    ],
)
def test_something_cheaper_takes_the_place_of_what_is_dear(
    utterances: list[str], after: dict[str, int], told: str
) -> None:
    opened, notes = talked({}, *utterances)
    assert opened.basket == after
    assert told in " ".join(notes)
    assert bool(notes) == bool(told)


def test_the_cheaper_thing_obeys_what_was_ruled_out() -> None:
    opened, _ = talked({}, "2 almond granola", "No oats, please", "something cheaper")
    assert all("Oat" not in name for name in opened.basket)


@pytest.mark.parametrize(
    "part",
    ["i ", "the total ", "keep it ", "under $1 ", "20 ", "spend ", "budget is ", "i have $2 ",
     "don't add anything ", "stop adding all ", "1,000", "twenty ", "buy it ", "please ",
     "anything with ", "only ", "only a nothing else ", "cancel the ", "cheaper ", "is the ",
     "something cheaper than ", "yes ", "add it ", "there is ", "as well ", "make it a, ",
     "a instead of b and ", "5 x 5 x ", "500g. of ", "i want a back in ", "none of my ",
     "which of the one ", "wine under $1 ", "some snack, max $5 ", "my shop "],
)  # fmt: skip
def test_no_long_input_takes_ages(part: str) -> None:
    start = time.process_time()
    turns = said(part * (10_000 // len(part)))
    opened = shop()
    opened.is_order(turns)
    opened.unmet(turns, [])
    opened.answer(turns[0].utterance)
    assert time.process_time() - start < 20  # a pattern that backtracks takes hours


PIZZA = "Frozen Margherita Pizza"


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Just the cheapest shampoo and a toothpaste"], {"Shampoo": 1, "Toothpaste": 1}),
        (["12 cans of beer"], {"Lager Beer": 2}),
        (["2 bottles of ketchup and 6 cans of tuna"], {"Ketchup": 2, "Canned Tuna in Water": 6}),
        (["whole wheat bread then"], {"Whole Wheat Bread": 1}),
    ],
)
def test_cans_in_packs_the_cheapest_and_then(utterances: list[str], basket: dict[str, int]) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("words", "left"),
    [
        ("Why did you put that in? I don't want it.", ["Large Eggs"]),
        ("I only asked for one thing, take the rest out.", ["Large Eggs"]),
        ("My daughter is vegan.", ["Egg Replacer Powder", "Paper Plates"]),
        ("Why is that so? I don't want coffee.", ["Large Eggs", "Paper Plates", PIZZA]),
    ],
)
def test_what_was_guessed_leaves_with_these_words(words: str, left: list[str]) -> None:
    opened = shop()
    for action in (*opened.requests(said("Eggs, please")), Action("add item", "Paper Plates")):
        assert opened.step(action).ok
    assert opened.step(Action("add item", PIZZA)).ok
    for action in opened.requests(said("Eggs, please", words)):
        assert opened.step(action).ok
    assert sorted(opened.basket) == sorted(left)


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Milk and eggs", "Remove the milk. Buy it now."], {"Large Eggs": 1}),
        (["Milk and eggs", "Actually no milk. Just buy it."], {"Large Eggs": 1}),
        (["Eggs", "Add rye bread. Pay now."], {"Large Eggs": 1, "Rye Bread": 1}),
        (["Get the cheapest peanut butter"], {"Creamy Peanut Butter": 1}),
        (["Cheaper ice cream please"], {"Vanilla Ice Cream": 1}),
        (["Milk", "Does the milk contain nuts? Then remove the milk"], {}),
        (["5 whole milk", "Halve the milk", "Add eggs"], {"Whole Milk": 3, "Large Eggs": 1}),
        (["5 whole milk", "Make the milk 2", "Add eggs"], {"Whole Milk": 2, "Large Eggs": 1}),
        (
            ["5 whole milk, 3 oat milk", "Make the oat milk 1", "Ok"],
            {"Whole Milk": 5, "Oat Milk": 1},
        ),
    ],
)
def test_what_is_said_beside_or_later_takes_nothing_back(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket
