"""What was said is taken back, and stays so."""

from __future__ import annotations

import pytest

from fakes import said
from goalscope.envs.grocery.undoing import besides_undoing, standing
from goalscope.types import Action
from shops import shop, talked

EGGS = {"Large Eggs": 1}
BY_ITSELF = 'Nothing is taken back. Say "Undo that" by itself.'


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
        (["Add eggs", "undo the last two"], EGGS),
        (["Add eggs", "add kale, then undo that"], {**EGGS, "Kale": 1}),
        (["Add eggs", "undo that, but only if we have some"], EGGS),
    ],
)
def test_what_was_taken_back_stays_away_and_the_rest_is_done(
    utterances: list[str], basket: dict[str, int]
) -> None:
    assert talked({}, *utterances)[0].basket == basket


@pytest.mark.parametrize(
    ("utterances", "told"),
    [
        (["Add eggs", "undo the last two"], [BY_ITSELF]),
        (["Add eggs", "cancel that twice"], [BY_ITSELF]),
        (["Add eggs", "add kale, then undo that"], [BY_ITSELF]),
        (["Add eggs", "undo that, add oat milk"], []),
        (["My budget is $5", "undo that"], ["That is taken back, and the basket stays as it is."]),
        (["I'm vegan", "undo that"], ["That is taken back, and the basket stays as it is."]),
        (["hello", "undo that"],
         ["There is nothing that I can take back. Please say what is to change."]),
        (["Add eggs", "add kale", "undo that. Buy the basket."],
         ['To have the basket bought, say "Buy the basket".']),
    ],
)  # fmt: skip
def test_what_is_told(utterances: list[str], told: list[str]) -> None:
    opened, notes = talked({}, *utterances)
    assert notes == told
    assert not opened.is_completion(said(*utterances)[-1])


def test_a_question_that_comes_with_it_is_answered() -> None:
    _, (answer,) = talked({}, "Add eggs", "undo that. Do you have kale?")
    assert answer == shop().answer("Do you have kale?")


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
    assert standing((utterance, "undo that")) == ((stays, ""), 0)


@pytest.mark.parametrize("utterance", ["don't undo that", "undo the kale", "add eggs and milk", ""])
def test_other_words_take_nothing_back(utterance: str) -> None:
    assert besides_undoing(utterance) is None


def test_after_a_restart_the_words_stand() -> None:
    opened = shop({**EGGS, "Whole Milk": 1})
    turns = said("Add eggs", "add whole milk", "undo that")
    assert opened.requests(turns) == []
    (told,) = opened.unmet(turns, [])
    assert "What the basket held before is not known." in told
    turns = said("Add eggs", "add whole milk", "undo that", "remove the guesses")
    assert opened.requests(turns) == []
    turns = said("Add eggs", "add whole milk", "undo that", "add kale", "undo that")
    assert opened.requests(turns[:4]) == [Action("add item", "Kale")]
    assert opened.step(Action("add item", "Kale")).ok
    assert opened.requests(turns) == [Action("remove item", "Kale")]


def test_another_episode_of_the_same_words_has_its_own_baskets() -> None:
    opened = shop()
    turns = said("Add eggs", "add kale", "undo that")
    for guess in ("Walnuts", "Whole Milk"):
        opened.reset()
        for number in (1, 2, 3):
            for action in opened.requests(turns[:number]):
                assert opened.step(action).ok
            if number == 1:
                assert opened.step(Action("add item", guess)).ok
        assert opened.basket == {**EGGS, guess: 1}
