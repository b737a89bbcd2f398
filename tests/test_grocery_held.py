"""Words that leave nothing to be guessed: taken back, put off, refused, asked; and money."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.hearing.limits import budget
from goalscope.envs.remarks import is_remark
from goalscope.types import Action
from shops import shop, talked
from talks import Talk

FULL = {"Whole Milk": 2, "Wild Rice": 1, "Large Eggs": 1}


@pytest.mark.parametrize(
    "utterance",
    [
        "i want to cancel",
        "I'd like to cancel, please",
        "undo",
        "cancel that",
        "go back",
        "i'm not ready to check out",
        "We aren't ready yet",
        "buy the basket tomorrow",
        "I'll order the basket next week",
        "shall we buy the basket?",
        "should I pay for the cart?",
        "no need for rice, we still have some",
        "We do not need the milk, there's plenty in the fridge of my neighbour",
        "I meant oat milk, not rye milk",
        "add eggs and buy the basket",
        "Skip the rice, it is from last year's harvest",
        "Is this shop open on Mondays? My boss wonders",
        "I changed my mind about the whole eggs business",
    ],
)
def test_nothing_is_guessed_where_words_call_off_put_off_refuse_ask_or_buy(utterance: str) -> None:
    assert is_remark(utterance) or shop(FULL).is_order(said("We need rice.", utterance))


@pytest.mark.parametrize(
    "utterance",
    [
        "I'd like to bake a cake, but my sister can't eat gluten",
        "I changed my mind, let's have a picnic",
        "Not the rice. We're having ten friends over.",
        "Cancel the rice, I want to make a curry",
        "We don't need rice, we love Italian food",
        "We are 12 kids",
        "From scratch, please, no cake mix",
        "Something hot, and no cilantro",
        "I said something sweet",
        "Remove the milk and surprise me",
        "Do you deliver? I need things for a barbecue",
        "We wait for our guests tomorrow",
        "chocolatey",
    ],
)
def test_an_aim_besides_is_guessed_for_and_so_is_an_answer(utterance: str) -> None:
    assert not shop(FULL).is_order(said("We need rice.", utterance))


@pytest.mark.parametrize(
    ("utterance", "basket", "told"),
    [
        ("add kale and buy the basket", {**FULL, "Kale": 1}, True),
        ("ok add kale then check out", {**FULL, "Kale": 1}, True),
        ("Two kale, then please pay.", {**FULL, "Kale": 2}, True),
        ("remove the rice and place the order", {"Whole Milk": 2, "Large Eggs": 1}, True),
        ("shall we buy the basket?", FULL, True),
        ("buy the basket tomorrow", FULL, True),
        ("add kale and order leeks", {**FULL, "Kale": 1, "Leeks": 1}, False),
        ("should I buy kale?", {**FULL, "Kale": 1}, False),
        ("I'm not ready to check out", FULL, False),
    ],
)
def test_a_purchase_in_other_words_is_not_done_and_how_is_told(
    utterance: str, basket: dict[str, int], told: bool
) -> None:
    opened, notes = talked(FULL, utterance)
    assert opened.basket == basket
    assert notes == (['To have the basket bought, say "Buy the basket".'] if told else [])
    assert not opened.is_completion(said(utterance)[-1])
    assert opened.is_order(said(utterance))


@pytest.mark.parametrize(
    ("utterance", "basket"),
    [
        ("2% milk actually", {"2% Reduced-Fat Milk": 1}),
        ("bananas tho", {"Bananas": 1}),
        ("kale lol, leeks haha", {"Kale": 1, "Leeks": 1}),
        ("no I dont have parmesan either, add some", {"Parmigiano Reggiano": 1}),
        ("a papaya asap, and limes btw", {"Papaya": 1, "Limes": 1}),
        ("either bananas or kale", {"Bananas": 1, "Kale": 1}),
        ("actually bananas", {"Bananas": 1}),
    ],
)
def test_small_words_at_the_end_say_nothing(utterance: str, basket: dict[str, int]) -> None:
    assert talked({}, utterance)[0].basket == basket


@pytest.mark.parametrize("utterance", ["im vegetarian btw", "I'm vegetarian, though", "vegetarian"])
def test_a_diet_is_heard_whatever_small_words_follow(utterance: str) -> None:
    assert talked({"Ground Beef": 1}, utterance)[0].basket == {}


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["no need for rice, we still have some"], {"Whole Milk": 2, "Large Eggs": 1}),
        (["No need of the eggs"], {"Whole Milk": 2, "Wild Rice": 1}),
        (["there's no need for any more milk, there is plenty"], FULL),
        (["we don't need rice, we have some"], {"Whole Milk": 2, "Large Eggs": 1}),
        (["no need to remove the rice"], FULL),
        (["no need for a receipt"], FULL),
        (["I meant oat milk, not eggs"], {"Whole Milk": 2, "Wild Rice": 1, "Oat Milk": 1}),
        (["I said kale not rice!"], {"Whole Milk": 2, "Large Eggs": 1, "Kale": 1}),
        (["Oat milk, not whole milk"], {"Wild Rice": 1, "Large Eggs": 1, "Oat Milk": 2}),
        (["I asked for camel milk, not rice"], FULL),
        (["I asked for kale, not wine"], {**FULL, "Kale": 1}),
        (["2 kale", "no i meant leeks", "thanks"], {**FULL, "Leeks": 2}),
        (["kale", "Sorry, I meant 3 leeks"], {**FULL, "Leeks": 3}),
        (["kale", "no, I meant camel milk"], {**FULL, "Kale": 1}),
        (["kale and limes", "sorry, I meant leeks"], {**FULL, "Kale": 1, "Limes": 1, "Leeks": 1}),
        (["kale", "no, I meant that as a joke"], {**FULL, "Kale": 1}),
        (["i wanted 2 packs of rice"], {**FULL, "Wild Rice": 2}),
        (["I asked for one milk"], {**FULL, "Whole Milk": 1}),
        (["add kale", "I asked for two"], {**FULL, "Kale": 2}),
        (["I wanted kale"], {**FULL, "Kale": 1}),
        (["we are 12 kids so 12 kale"], {**FULL, "Kale": 12}),
        (["There are 3 of us, so we need 3 kale"], {**FULL, "Kale": 3}),
        (["remove evrything"], {}),
    ],
)
def test_what_is_corrected_or_not_needed_is_mended(
    utterances: list[str], basket: dict[str, int]
) -> None:
    opened, _ = talked(FULL, *utterances)
    assert opened.basket == basket
    assert opened.is_order(said(*utterances)) or is_remark(utterances[-1])


@pytest.mark.parametrize(
    "utterance",
    ["I am vegan, not vegetarian", "it is sweet, not sour", "I need it today, not tomorrow",
     "the rice is brown, not white", "why not oats"],
)  # fmt: skip
def test_other_contrasts_take_nothing_out(utterance: str) -> None:
    opened, _ = talked({"Wild Rice": 1, "Kale": 1}, utterance)
    assert opened.basket == {"Wild Rice": 1, "Kale": 1}


@pytest.mark.parametrize(
    ("utterance", "item"),
    [
        ("cheddar", "Cheddar Cheese"),
        ("white bread", "White Sandwich Bread"),
        ("whipping cream", "Heavy Whipping Cream"),
        ("some brownies", "Chocolate Brownies"),
        ("vegan cheddar", "Vegan Shredded Cheddar"),
        ("gluten-free brownies", "Gluten-Free Brownies"),
        ("breadcrumbs", "Gluten-Free Breadcrumbs"),
        ("mozzarella slices", "Vegan Mozzarella Slices"),
    ],
)
def test_a_label_that_nobody_asked_for_is_less_plain(utterance: str, item: str) -> None:
    assert talked({}, utterance)[0].basket == {item: 1}


def test_what_the_basket_holds_or_a_diet_asks_for_stays_the_thing_that_is_meant() -> None:
    assert talked({"Vegan Shredded Cheddar": 1}, "another cheddar")[0].basket == {
        "Vegan Shredded Cheddar": 2
    }
    assert talked({}, "I'm vegan", "Cheddar, please")[0].basket == {"Vegan Shredded Cheddar": 1}


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["add kale", "undo", "thanks"], FULL),
        (["add kale", "2 leeks", "thanks", "Undo that, please!", "ok"], {**FULL, "Kale": 1}),
        (["add kale", "2 leeks", "undo", "undo the last step", "ok"], FULL),
        (["remove the rice", "cancel that", "add kale"], {**FULL, "Kale": 1}),
        (["no rice please", "do you have milk?", "go back a step", "ok"], FULL),
        (["I'm vegan", "take that back", "ok"], FULL),
        (["add kale", "put it back how it was"], FULL),
        (["I'm allergic to eggs. Add kale.", "undo"], {"Whole Milk": 2, "Wild Rice": 1}),
        (["add kale", "undo the kale"], FULL),
        (["add kale", "don't undo that"], {**FULL, "Kale": 1}),
        (["add kale", "i want to cancel"], {**FULL, "Kale": 1}),
    ],
)
def test_undo_takes_back_what_the_last_words_led_to(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked(FULL, *utterances)[0].basket == basket


def test_undo_takes_back_guesses_too() -> None:
    talk = Talk(shop(FULL))
    talk.say("add kale", guesses=[Action("add item", "Walnuts", 3)])
    assert talk.say("undo").notes == ('Taken back: "add kale".',)
    assert talk.env.basket == FULL


@pytest.mark.parametrize(
    ("utterances", "told"),
    [
        (["add kale", "i want to cancel"], 'say "Undo that"'),
        (["add kale", "what did you guess?"], "Guessed, not asked for: Whole Milk, Wild Rice"),
        (["milk, rice, eggs", "which ones were guessed"], "Guessed, not asked for: nothing."),
    ],
)
def test_what_to_say_instead_and_what_was_guessed_is_told(utterances: list[str], told: str) -> None:
    opened, (note,) = talked(FULL, *utterances)
    assert told in note
    assert opened.is_order(said(*utterances)) or is_remark(utterances[-1])


@pytest.mark.parametrize(
    "utterance",
    ["remove the guesses", "Please take your guesses out", "get rid of all the guessed items",
     "delete all your guesses", "throw the guesses away", "I didn't ask for that"],
)  # fmt: skip
def test_guesses_leave_the_basket_on_a_word(utterance: str) -> None:
    opened, told = talked(FULL, "add kale, and rice", utterance)
    assert opened.basket == {"Kale": 1, "Wild Rice": 1}
    assert told == []
    assert talked(FULL, "add kale", "don't remove the guesses")[0].basket == {**FULL, "Kale": 1}


LABELLED = {"Rye Bread": 1, "Gluten-Free White Bread": 1, "Vegan Butter": 1, "Bananas": 1}


@pytest.mark.parametrize(
    ("utterances", "gone"),
    [
        (["take out the gluten free stuff", "ok"], "Gluten-Free White Bread"),
        (["Take the gluten-free things out"], "Gluten-Free White Bread"),
        (["Get rid of all the vegan products, please"], "Vegan Butter"),
        (["A gluten-free picnic", "I said no gluten free stuff", "ok"], "Gluten-Free White Bread"),
        (["no vegan food, just normal kale"], "Vegan Butter"),
        (["I don't want vegan stuff"], "Vegan Butter"),
        (["we don't need vegan food"], ""),
        (["there is no vegan stuff in the basket"], ""),
        (["remove the organic stuff"], ""),
    ],
)
def test_what_is_refused_by_its_label_leaves_and_is_no_diet(
    utterances: list[str], gone: str
) -> None:
    opened, _ = talked(LABELLED, *utterances)
    assert {*LABELLED} - {*opened.basket} == ({gone} if gone else set()) | (
        {"Rye Bread"} if "picnic" in utterances[0] else set()
    )
    assert hear(utterances).diets == frozenset()


@pytest.mark.parametrize(
    ("utterance", "diet"),
    [
        ("no, vegan stuff please", "vegan"),
        ("only gluten-free stuff", "gluten-free"),
        ("No gluten, please", "gluten-free"),
        ("We cannot have gluten", "gluten-free"),
        ("nothing but organic food", "organic"),
    ],
)
def test_a_diet_is_still_heard(utterance: str, diet: str) -> None:
    assert hear([utterance]).diets == {diet}


def test_a_label_that_is_missed_takes_no_diet_back() -> None:
    assert hear(["I'm vegan", "there's no vegan stuff here!"]).diets == {"vegan"}
    assert hear(["I'm vegan", "no vegan stuff, please"]).diets == frozenset()


def test_nothing_that_fits_leaves_with_what_does_not() -> None:
    opened, _ = talked(LABELLED, "remove everything that is not gluten free")
    assert "Gluten-Free White Bread" in opened.basket


@pytest.mark.parametrize(
    ("utterances", "basket", "told"),
    [
        (["kale, tp, and limes"], {"Kale": 1, "Toilet Paper": 1, "Limes": 1}, ""),
        (["kale, zorbs, and limes"], {"Kale": 1, "Limes": 1}, "called 'zorbs'"),
        (["kale and a fish ladder"], {"Kale": 1}, "called 'fish ladder'"),
        (["kale, nothing fancy"], {"Kale": 1}, ""),
        (["kale, thanks a lot"], {"Kale": 1}, ""),
        (["zorbs"], {}, ""),
        (["bye"], {}, ""),
        (["add potatoes", "make it organic", "ok"], {"Organic White Potatoes": 1}, ""),
        (["3 kale", "can you make that organic?"], {"Organic Kale": 3}, ""),
        (
            ["3 kale, 2 papayas", "make the papayas organic"],
            {"Kale": 3, "Papaya": 2},
            "organic papaya",
        ),
        (["make it organic"], {}, "not clear"),
        (["kale, and everything organic"], {"Organic Kale": 1}, "to be organic"),
        (["no potato chips?", "yes please, 3 bags"], {"Salted Potato Chips": 3}, ""),
        (["do you have oat milk?", "two cartons"], {"Oat Milk": 2}, ""),
        (["add milk, 3 bottles, and kale"], {"Whole Milk": 3, "Kale": 1}, ""),
        (["kale", "4 boxes of them, please", "ok"], {"Kale": 4}, ""),
        (["3 bags"], {}, "not clear"),
        (["2 packs of trash bags"], {"Trash Bags": 2}, ""),
        (["some freezer bags"], {"Freezer Bags": 1}, ""),
        (["kale", "half the kale"], {"Kale": 1}, "1 x Kale is the least"),
        (["4 kale", "half the kale"], {"Kale": 2}, ""),
        (["kale", "actually keep the kale"], {"Kale": 1}, ""),
        (["kale", "no, ok, leave the kale"], {"Kale": 1}, ""),
    ],
)
def test_lists_amounts_and_what_it_is_are_heard_or_told(
    utterances: list[str], basket: dict[str, int], told: str
) -> None:
    opened, notes = talked({}, *utterances)
    assert opened.basket == basket
    assert told in " ".join(notes)
    assert bool(told) == bool(notes)


@pytest.mark.parametrize("utterance", ["i've 20 bucks", "i got 20 bucks", "I've got just $20"])
def test_what_one_has_is_what_it_may_cost(utterance: str) -> None:
    assert budget(utterance) == 20
    assert budget("I've 20 eggs") is None


@pytest.mark.parametrize(
    ("utterance", "told"),
    [
        ("6 grapes", ["Red Grapes: 6 x 1 kg."]),
        ("kale and two grapes", ["Red Grapes: 2 x 1 kg."]),
        ("6 apples", []),
        ("6 bags of grapes", []),
        ("2 kg of grapes", []),
        ("some grapes", []),
        ("12 limes", []),
        ("2 sugar", []),
        ("3 kale", []),
    ],
)
def test_pieces_that_come_by_the_kilogram_are_told_so(utterance: str, told: list[str]) -> None:
    assert talked({}, utterance)[1] == told


@pytest.mark.parametrize("thing", ["socks", "a headache", "gift cards", "aspirin", "the flu"])
def test_nothing_that_is_far_from_what_was_asked_for_is_offered(thing: str) -> None:
    assert shop().answer(f"Is there anything for {thing}?") == "The shop has nothing called that."
