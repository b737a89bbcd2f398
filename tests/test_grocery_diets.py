"""What is guessed, and what is taken, for people with diets."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.hearing.diets import diet, waves_off
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.restrictions import violates
from goalscope.types import Turn
from shops import CATALOGUE, shop, talked


@pytest.mark.parametrize(
    ("restriction", "name", "expected"),
    [
        ("vegan", "White Chocolate Chips", True),
        ("vegan", "Butter Shortbread", True),
        ("vegan", "Chocolate Fudge Cake", True),
        ("vegan", "Vegan Chocolate Cake", False),
        ("vegan", "Dark Chocolate Bar", False),
        ("vegetarian", "Sea Bass Fillets", True),
        ("dairy-free", "Apple Danishes", True),
        ("dairy-free", "Round Cake Pan", False),
        ("dairy-free", "English Muffins", False),
        ("egg-free", "Carrot Cake", True),
        ("egg-free", "Pancake Syrup", False),
        ("gluten-free", "Rolled Oats", True),
        ("gluten-free", "Organic Oat Milk", False),
        ("gluten-free", "Onion Rings", True),
    ],
)
def test_names_tell_what_is_baked_with_milk_eggs_or_flour(
    restriction: str, name: str, expected: bool
) -> None:
    assert violates(Item(1, name), restriction) is expected


@pytest.mark.parametrize("restriction", ["vegan", "vegetarian", "dairy-free", "gluten-free"])
def test_what_is_labelled_for_a_diet_is_guessed_before_what_only_may_fit(restriction: str) -> None:
    opened, turns = shop(), said(f"I'm having friends over. It must be {restriction}.")
    for term in ("cookies", "bread", "chocolate", "chips", "crackers", "burgers", "napkins"):
        items = [CATALOGUE.get(each.target) for each in opened.actions([term], turns)]
        tagged = [item is not None and restriction in item.tags for item in items]
        assert all(tagged) or not any(tagged)


def test_of_what_is_asked_for_the_labelled_one_is_taken() -> None:
    assert talked({}, "I'm vegan. Add chocolate chips.")[0].basket == {"Vegan Chocolate Chips": 1}
    assert talked({}, "Add dark chocolate chips.")[0].basket == {"Dark Chocolate Chips": 1}


BASKET = {"Rye Bread": 1, "Whole Milk": 2, "Gluten-Free Chocolate Cake": 1}


@pytest.mark.parametrize(
    ("said", "left"),
    [
        ("Remove the Gluten-Free Chocolate Cake.", {"Rye Bread": 1, "Whole Milk": 2}),
        ("Take the gluten-free cake out", {"Rye Bread": 1, "Whole Milk": 2}),
        ("Change everything to gluten-free", {"Whole Milk": 2, "Gluten-Free Chocolate Cake": 1}),
        ("Make them all vegan, please.", {"Rye Bread": 1}),
    ],
)
def test_a_label_of_what_is_to_leave_is_no_diet_and_one_for_all_is(
    said: str, left: dict[str, int]
) -> None:
    assert talked(BASKET, said)[0].basket == left


def test_what_is_not_labelled_for_an_allergy_is_told_of_once() -> None:
    held = {"Carrot Cake": 1, "Gala Apples": 1, "Paper Plates": 1}
    heeded = "From now on it has to be nut-free."
    told = "Not labelled as nut-free: Carrot Cake. Please read what is in it."
    assert talked(held, "my kid is allergic to nuts")[1] == [heeded, told]
    assert talked(held, "my kid is allergic to nuts", "ok")[1] == []
    assert talked({"Gala Apples": 1}, "my kid is allergic to nuts")[1] == [heeded]


@pytest.mark.parametrize(
    "said",
    [
        ["One of my friends is vegan, the others eat anything", "Tom, he's the vegan"],
        ["One of us is vegan", "she's vegan, so oat milk for her"],
        ["She's the only vegan"],
        ["Only Tom is vegan"],
        ["I'm vegan", "Only my sister is vegan"],
        ["Tom is vegan, the rest of us eat everything"],
        ["my friend Mia is vegan, the others aren't"],
    ],
)
def test_a_diet_of_one_binds_no_order(said: list[str]) -> None:
    opened, _ = talked({}, *said, "butter")
    assert "Unsalted Butter" in opened.basket
    assert "Vegan Butter" in talked({}, *said, "we are all vegan", "butter")[0].basket


@pytest.mark.parametrize(
    "said",
    [
        "oh wait, no nuts, Jim's allergic",
        "wait no nuts please",
        "no nuts, my son's allergic",
        "no nuts, Jim is allergic",
        "hold on, no nuts, my son is allergic",
        "hmm no nuts, please. Kim can't have them",
        "Tom avoids nuts",
    ],
)
def test_what_is_refused_behind_a_pause_is_not_bought(said: str) -> None:
    opened, told = talked({}, "walnuts", said, "mixed nuts")
    assert opened.basket == {}
    assert told == ["Not added, since it has to be nut-free: mixed nuts."]


def test_a_warning_names_all_that_an_answer_does() -> None:
    said = "My son is allergic to nuts. Add chicken nuggets, frozen fries and paper plates."
    opened, told = talked({}, said)
    unsure = "Frozen Chicken Nuggets, Frozen French Fries"
    assert told[1] == f"Not labelled as nut-free: {unsure}. Please read what is in it."
    turns = [Turn("", said)]
    for question in (
        "is everything nut-free?",
        "is everything in the basket safe for him?",
        "what can he not eat in the basket?",
        "what is in the basket that my son can't eat?",
    ):
        assert unsure in (opened.answer(question, turns) or "")
    assert "nut-free" in (opened.answer("what allergies do you know about?", turns) or "")
    assert opened.answer("can I have milk?", turns) is None


@pytest.mark.parametrize(
    ("said", "diet", "thing"),
    [
        ("one kid is coeliac", "gluten-free", "Salted Potato Chips"),
        ("my wife is allergic to eggs", "egg-free", "White Sandwich Bread"),
        ("my son is allergic to fish", "fish-free", "White Sandwich Bread"),
    ],
)
def test_every_allergy_has_its_warning(said: str, diet: str, thing: str) -> None:
    (note,) = talked({}, said, f"add {thing}")[1]
    assert note == f"Not labelled as {diet}: {thing}. Please read what is in it."


@pytest.mark.parametrize("said", ["I'm allergic to kiwi", "no kiwis, I'm allergic"])
def test_an_allergy_to_any_thing_stands_though_it_is_asked_for(said: str) -> None:
    assert talked({}, "kiwis", said)[0].basket == {}
    opened, told = talked({}, said, "add kiwis")
    assert opened.basket == {}
    assert told == ["Not added, since it was ruled out: kiwis."]
    assert talked({}, said, "I'm not allergic to kiwi", "kiwis")[0].basket == {"Kiwis": 1}
    assert talked({}, "no kiwis", "kiwis")[0].basket == {"Kiwis": 1}


def test_a_total_is_told_beside_the_budget() -> None:
    opened, _ = talked({}, "my budget is $20", "milk")
    turns = [Turn("", "my budget is $20")]
    left = "The total is $1.79, which leaves $18.21 of the $20.00 that you named."
    assert opened.answer("how much of my budget is left?", turns) == left
    assert opened.answer("am I still within my budget?", turns) == left
    assert opened.answer("what's the total?") == "The total is $1.79."


@pytest.mark.parametrize(
    "words",
    [
        "nobody is vegetarian",
        "Nobody's vegetarian.",
        "none of us is vegetarian",
        "None of my guests are vegetarian",
        "noone is vegetarian here, so add chicken",
        "nobody in my family is vegetarian",
        "nobody at the party is vegetarian",
        "neither my husband nor i are vegetarian",
        "we aren't vegetarian",
        "not vegetarian",
    ],
)
def test_a_diet_that_nobody_follows_is_none_and_is_taken_back(words: str) -> None:
    assert not diet(words)
    assert not diet(words, frozenset({"vegetarian"}))


@pytest.mark.parametrize(
    "words",
    [
        "none of these are vegan",
        "none of the dishes is vegan",
        "nobody else is vegan",
        "he's not vegan",
        "my son is not vegan any more",
    ],
)
def test_a_diet_of_some_is_neither_stated_nor_taken_back_by_a_denial(words: str) -> None:
    assert not diet(words)
    assert diet(words, frozenset({"vegan"})) == {"vegan"}


@pytest.mark.parametrize(
    ("words", "diets"),
    [
        ("nobody told you i'm vegan", {"vegan"}),
        ("nobody is vegan but my wife is vegetarian", {"vegetarian"}),
        ("not vegan, vegetarian", {"vegetarian"}),
        ("my sister is vegan", {"vegan"}),
        ("pasta, they have to be vegan", {"vegan"}),
        ("none of us is vegan except my daughter", {"vegan"}),
        ("nobody is vegan but me", {"vegan"}),
        ("nobody is vegan, only my husband", {"vegan"}),
    ],
)
def test_who_denies_a_diet_of_one_may_state_it_of_another(words: str, diets: set[str]) -> None:
    assert diet(words, frozenset({"vegan"}) - diets) == diets


@pytest.mark.parametrize(
    ("words", "basket"),
    [
        (["i eat everything but i'm allergic to nuts", "granola"], []),
        (["careful with the nuts, my son is allergic", "granola"], []),
        (["peanuts, my son is allergic", "granola"], []),
        (["be careful with nuts", "granola"], []),
        (["nobody is allergic to nuts except my son", "granola"], []),
        (["i like everything but please no nuts"], []),
        (["i eat everything but my daughter can't have gluten", "bread"],
         ["Gluten-Free White Bread"]),
        (["bread, gluten free please"], ["Gluten-Free White Bread"]),
        (["milk and bread, gluten free obviously"], ["Gluten-Free White Bread", "Whole Milk"]),
        (["my wife eats everything except fish", "tuna and rice"], ["Long Grain White Rice"]),
        (["i like everything except mushrooms, pizza please"], ["Frozen Margherita Pizza"]),
        (["my kids eat everything except peas, carrots and fish"], []),
        (["we eat everything but pork and we need 2 chickens"], ["Whole Chicken"]),
        (["my son eats everything but nuts because he's allergic, granola please"], []),
        (["milk and eggs", "i like everything but the milk"], ["Large Eggs", "Whole Milk"]),
        (["careful with the eggs, they break", "add milk"], ["Whole Milk"]),
        (["the eggs, they are broken"], []),
    ],
)  # fmt: skip
def test_what_harms_somebody_is_heard_in_many_words(words: list[str], basket: list[str]) -> None:
    assert sorted(talked({}, *words)[0].basket) == basket


def test_what_is_not_labelled_is_told_of_all_that_comes_later_and_before_the_purchase() -> None:
    said = ["One of my guests is allergic to nuts.", "2 packs of flour tortillas", "milk"]
    note = "Not labelled as nut-free: Soft Flour Tortillas. Please read what is in it."
    heeded = "From now on it has to be nut-free."
    assert [talked({}, *said[:number])[1] for number in (1, 2, 3)] == [[heeded], [note], []]
    assert talked({}, *said, "Buy the basket")[1] == [note]


@pytest.mark.parametrize(
    "said",
    [
        "forget that I'm vegan",
        "ok, never mind the vegan part",
        "please ignore the vegan diet",
    ],
)
def test_a_diet_that_is_waved_off_stands_no_more(said: str) -> None:
    assert diet(said, diet("I'm vegan")) == frozenset()


@pytest.mark.parametrize(
    "said",
    [
        "don't forget that I'm vegan",
        "never forget that I am vegan",
        "did you forget that I'm vegan?",
        "you seem to forget that I'm vegan",
        "don't ignore my vegan diet",
        "why do you ignore the vegan rule?",
    ],
)
def test_a_diet_that_is_not_to_be_forgotten_stands(said: str) -> None:
    assert diet(said, diet("I'm vegan")) == {"vegan"}


@pytest.mark.parametrize(
    ("said", "bound"),
    [
        ("undo the allergy", True),
        ("I'm not allergic to nuts", True),
        ("nuts are fine", True),
        ("forget about the nut allergy", True),
        ("don't forget about the nut allergy", False),
        ("nobody is allergic to eggs", False),
        ("nobody else is allergic to nuts", False),
        ("remove the nuts", False),
        ("the prices are fine", False),
        ("are nuts ok?", False),
    ],
)
def test_what_seems_to_take_an_allergy_back_is_told_how_to(said: str, bound: bool) -> None:
    assert waves_off(said, diet("I'm allergic to nuts")) == ({"nut-free"} if bound else set())


def test_who_eats_no_pork_gets_no_sausage_that_is_of_pork_as_a_rule() -> None:
    opened, _ = talked({}, "I don't eat pork", "add sausages and breakfast sausages")
    assert "Italian Sausages" not in opened.basket
    assert "Breakfast Sausages" not in opened.basket


def test_a_diet_of_some_binds_only_what_is_guessed() -> None:
    said = ["two chickens and milk", "One of my guests is vegan, the rest of us eat meat"]
    opened, told = talked({}, *said)
    held = {"Whole Chicken": 2, "Whole Milk": 1}
    assert opened.basket == held
    assert told == [
        "As only some are vegan, only what I guess will be vegan; what you name is added as you "
        'name it. For all to be so, say "everything must be vegan".'
    ]
    assert hear(said).hinted == {"vegan"}
    opened, _ = talked({}, *said, "ground beef please")
    assert opened.basket == {**held, "Ground Beef": 1}
    opened, _ = talked({}, *said, "everything must be vegan")
    assert opened.basket == {"Barista Soy Milk": 1}


@pytest.mark.parametrize(
    ("said", "basket"),
    [
        (["no nut products please", "granola"], {}),
        (["baby wipes, baby potatoes, party hats",
          "no party stuff please, and no baby stuff either"], {"Baby Potatoes": 1}),
        (["baby wipes, baby potatoes", "take all the baby things out"], {"Baby Potatoes": 1}),
        (["ground beef", "hmm, not beef, make it turkey mince"], {"Ground Turkey": 1}),
        (["ground beef", "not beef, turkey mince instead"], {"Ground Turkey": 1}),
        (["chips", "the chips weren't my idea, drop those"], {}),
        (["tacos on Friday", "no wait, add bread first"],
         {"Crunchy Corn Taco Shells": 1, "White Sandwich Bread": 1}),
    ],
)  # fmt: skip
def test_kinds_that_are_refused_and_corrections_are_heard(
    said: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *said)[0].basket == basket


def test_what_may_have_a_thing_is_told_of_the_basket() -> None:
    opened, _ = talked({}, "eggs, rice")
    answer = opened.answer("what's in the basket that could have eggs?") or ""
    assert answer.startswith("Listed as egg-free: Long Grain White Rice. Not egg-free: Large Eggs.")


@pytest.mark.parametrize(
    "words",
    [
        "Can you leave out anything you can't be sure is free of nuts?",
        "No, take out everything that isn't labelled nut-free",
        "Please remove anything that might contain nuts.",
        "Take out the unlabelled ones",
    ],
)
def test_only_what_is_labelled_stays_where_that_is_asked_for(words: str) -> None:
    held = {"Gummy Bears": 1, "Paper Plates": 1, "Large Eggs": 1}
    opened, notes = talked(held, "My son is allergic to nuts", "add syrup", words)
    assert opened.basket == {"Paper Plates": 1, "Large Eggs": 1}
    assert notes == ["From now on I add no food that is not labelled as nut-free."]
    said = ["My son is allergic to nuts", words, "add syrup and napkins"]
    opened, notes = talked(held, *said)
    assert opened.basket == {"Paper Plates": 1, "Large Eggs": 1, "Paper Napkins": 1}
    assert notes == ["Not added, since it is not labelled as nut-free: syrup."]
    offers = opened.actions(["syrup", "gummy bears", "banana"], [Turn("", each) for each in said])
    assert {each.target for each in offers} <= {"Bananas", "Organic Bananas"}


def test_nothing_is_guessed_where_only_what_is_labelled_may_stay() -> None:
    said = ["My son is allergic to nuts. A party!", "Remove what isn't labelled nut-free"]
    turns = [Turn("", each) for each in said]
    assert shop().actions(["banana"], turns) == []
    assert shop().actions(["banana"], turns[:1]) != []
