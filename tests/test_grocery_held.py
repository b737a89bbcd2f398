"""Words that leave nothing to be guessed: taken back, put off, refused, asked; and money."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.envs.remarks import is_remark
from shops import shop, talked

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
