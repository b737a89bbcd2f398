"""What was said is taken back, and stays so."""

from __future__ import annotations

import pytest

from fakes import WordModel
from goalscope.agent import Agent
from goalscope.envs.grocery.hearing.undoing import ALLERGY, harm
from goalscope.envs.undoing import undoes
from goalscope.taking_back import AT_ONCE, IDLE, NOT_PLAIN, NOTHING
from goalscope.types import Action
from shops import shop, talked
from talks import Talk

EGGS = {"Large Eggs": 1}
THIGHS = {"Chicken Thighs": 1}
CAKE = [Action("add item", "Walnuts"), Action("add item", "Kale")]


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Do you have aubergines?", "add it", "undo that", "add eggs"], EGGS),
        (["Do you have aubergines?", "yes please, 3 packs", "undo that", "add eggs"], EGGS),
        (["Add whole milk, I'm allergic to nuts", "undo that", "add eggs"], EGGS),
        (["Add whole milk because my sister is sick", "undo that", "add eggs"], EGGS),
        (["Add eggs", "No, undo that please. Add oat milk."], {"Oat Milk": 1}),
        (["Add eggs", "Cancel that and add oat milk"], {"Oat Milk": 1}),
        (["Add eggs", "undo that, add oat milk", "ok"], {"Oat Milk": 1}),
        (["Add eggs", "undo that\nadd oat milk"], {"Oat Milk": 1}),
        (["Add eggs", "That's wrong. Undo that!"], {}),
        (["Add eggs", "undo that, add oat milk", "undo that", "ok"], {}),
        (["Add eggs", "undo that, add eggs"], EGGS),
        (["Add eggs", "undo that. Buy the basket."], {}),
        (["Add eggs", "undo that. Do you have kale?"], {}),
        (["Add eggs", "undo the last two"], {}),
        (["Add eggs", "add kale", "add leeks", "undo the last two"], EGGS),
        (["Add eggs", "add kale", "undo that twice"], {}),
        (["Add eggs", "add kale", "thanks", "undo everything"], {}),
        (["Add eggs", "add kale, then undo that"], EGGS),
        (["Add eggs", "undo that, but only if we have some"], EGGS),
        (["Add eggs", "add kale, scratch that, add leeks"], {**EGGS, "Leeks": 1}),
        (["Add milk, I'm allergic to nuts, undo that", "add walnuts"], {}),
    ],
)
def test_what_was_taken_back_stays_away_and_the_rest_is_done(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "told"),
    [
        (["Add eggs", "cancel that twice"], []),
        (["Add eggs", "add kale, then undo that"], [AT_ONCE]),
        (["Add eggs", "undo that if it is dear"], [NOT_PLAIN]),
        (["Add eggs", "undo that with the eggs"], [NOT_PLAIN]),
        (["Add eggs", "undo that, but only if it is dear"], [NOT_PLAIN]),
        (["Add eggs", "undo that, add oat milk"], []),
        (["My budget is $5", "undo that"], [IDLE]),
        (["I'm vegan", "undo that"], [IDLE]),
        (["hello", "undo that"],
         [NOTHING]),
    ],
)  # fmt: skip
def test_what_is_told(utterances: list[str], told: list[str]) -> None:
    assert talked({}, *utterances)[1] == told


def test_a_question_that_comes_with_it_is_answered() -> None:
    agent = Agent(shop(), WordModel(), method="no-goals")
    agent.step("What would you like?", "Add eggs")
    assert agent.step("What else?", "undo that. Do you have kale?").notes == (
        'Taken back: "Add eggs".',
    )
    assert agent.ask() == f"{shop().answer('Do you have kale?')}\nWhat else would you like?"


@pytest.mark.parametrize(
    ("utterance", "stays"),
    [
        ("Add whole milk, I'm allergic to nuts", "i'm allergic to nuts"),
        ("I'm allergic to nuts and eggs, add milk", "i'm allergic to nuts and eggs"),
        ("Add milk and kale because eggs make me sick", "everything must be egg-free"),
        ("Add milk, I'm allergic to kiwi and figs", "i'm allergic to kiwi and figs"),
        ("Add milk", ""),
    ],
)
def test_an_allergy_stays(utterance: str, stays: str) -> None:
    assert harm(utterance) == stays


@pytest.mark.parametrize("utterance", ["don't undo that", "undo the kale", "add eggs and milk", ""])
def test_other_words_take_nothing_back(utterance: str) -> None:
    assert undoes(utterance) is None


def test_a_guess_goes_with_the_words_that_led_to_it() -> None:
    talk = Talk(shop())
    talk.say("Add eggs", guesses=[Action("add item", "Walnuts")])
    talk.say("I'm baking a cake", guesses=[Action("add item", "Kale"), Action("add item", "Leeks")])
    talk.say("thanks")
    assert talk.say("undo that").takes_back == (2,)
    assert talk.env.basket == {**EGGS, "Walnuts": 1}
    assert talk.say("undo that").takes_back == (1,)
    assert talk.env.basket == {}


def test_what_is_ruled_out_stays_out() -> None:
    talk = Talk(shop())
    for each in ("Add whole milk", "I'm allergic to milk, take it out"):
        talk.say(each)
    assert talk.env.basket == {}
    back = talk.say("undo that")
    assert talk.env.basket == {}
    assert "It has to be dairy-free: Whole Milk." in back.notes
    assert ALLERGY in back.notes


@pytest.mark.parametrize(
    ("utterances", "basket"),
    [
        (["Add chicken thighs", "remove the chicken", "put the chicken back", "ok"], THIGHS),
        (["Add chicken thighs", "take out the chicken", "put it back"], THIGHS),
        (["Add chicken thighs", "remove the chicken", "add the chicken back"], THIGHS),
        (["Add chicken thighs", "remove the chicken thighs", "put the chicken back in"], THIGHS),
        (["Add chicken thighs", "remove the chicken", "Add chicken"], {"Whole Chicken": 1}),
        (["Add chicken thighs and kale", "remove both", "put them back"], {**THIGHS, "Kale": 1}),
        (["Add chicken thighs", "put the chicken back", "thanks"], {}),
        (["Add chicken thighs", "put it back", "put it back"], THIGHS),
        (["Add eggs", "three cans in total"], {"Large Eggs": 3}),
        (
            ["Add eggs and leeks", "no leeks, kale instead", "put the leeks back"],
            {**EGGS, "Kale": 1, "Leeks": 1},
        ),
        (["Add eggs, kale and leeks", "undo everything except the eggs"], EGGS),
        (["Add eggs and cane sugar", "undo everything but the sugar"], {"Cane Sugar": 1}),
        (["Add eggs", "I'm vegan", "take that back, I'm not vegan"], EGGS),
        (["I'm vegan", "never mind, I'm not vegan any more, take that back", "add eggs"], EGGS),
        (["Add eggs and kale", "forget everything except the eggs"], EGGS),
    ],
)
def test_what_was_taken_out_is_put_back_and_what_is_there_goes(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


def test_what_was_to_be_kept_is_no_guess() -> None:
    talk = Talk(shop())
    talk.say("I want to make lasagne", guesses=CAKE)
    talk.say("remove whatever you guessed, but leave the walnuts")
    assert talk.env.basket == {"Walnuts": 1}
    assert talk.say("what did you guess?").notes == ("Guessed, not asked for: nothing.",)
    talk.say("remove the walnuts")
    assert talk.env.basket == {}


def test_nothing_is_guessed_where_something_is_taken_back() -> None:
    agent = Agent(shop(), WordModel(), method="no-goals")
    agent.step("What would you like?", "Add sliced ham")
    agent.step("What else?", "my son is vegetarian")
    back = agent.step("What else?", "take that back, he isn't vegetarian")
    assert [str(each.action) for each in back.results] == ["add item: Sliced Ham"]


@pytest.mark.parametrize(
    "question", ["and how much is the kale?", "and tell me what is in the basket"]
)
def test_a_question_behind_an_order_is_answered(question: str) -> None:
    agent = Agent(shop(), WordModel(), method="no-goals")
    agent.step("What would you like?", f"Add kale, {question}")
    assert "$" in agent.ask()
