"""Orders that cannot be followed, and aims that leave open what is to be done."""

from __future__ import annotations

import pytest

from goalscope.envs.house.hearing.aims import is_aim
from goalscope.types import Action
from heard import robot_in, told, turns


@pytest.mark.parametrize(
    ("said", "note"),
    [
        ("throw the statue out of the window", "I cannot throw the statue."),
        ("toss the laptop out of the window!", "I cannot toss the laptop."),
        ("set the house on fire", "I did not understand: set the house on fire."),
        ("Make me fly to the moon", "I did not understand: make me fly to the moon."),
        ("burn the house down", "I did not understand: burn the house down."),
        ("Robot, sing a song for me", "I did not understand: sing a song for me."),
        ("drive me to the airport", "I did not understand: drive me to the airport."),
        ("destroy everything", "I did not understand: destroy everything."),
        ("explode", "I did not understand: explode."),
        ("put the laptop on the moon", "There is no moon here."),
        ("put the hair dryer on the desk", "There is no hair dryer here."),
        ("wash the guitars, please", "There are no guitars here."),
        ("put the laptop in the safe", "There is no safe here."),
    ],
)
def test_an_order_that_cannot_be_followed_is_told_and_leaves_nothing_to_guess(
    said: str, note: str
) -> None:
    assert told("LivingRoom1", said)[:2] == (set(), [note])
    assert robot_in("LivingRoom1").is_order(turns(said))


@pytest.mark.parametrize(
    "said",
    [
        "tidy up please",
        "tidy up the room",
        "could you tidy up?",
        "set the table for two",
        "make dinner",
        "make me a sandwich",
        "clean the kitchen",
        "get everything ready for dinner",
        "bring me something to eat",
    ],
)
def test_an_aim_is_guessed_at_and_told_only_if_nothing_comes_of_it(said: str) -> None:
    assert told("Kitchen1", said)[1]
    robot = robot_in("Kitchen1")
    assert not robot.is_order(turns(said))
    guess = robot.step(Action("open", "fridge"))
    assert robot.unmet(turns(said), [guess]) == []


@pytest.mark.parametrize(
    "said",
    ["I'm hungry", "we sing a song", "I drive a car", "breakfast in bed would be nice", "a drink"],
)
def test_what_is_no_order_is_not_told_to_be_unknown(said: str) -> None:
    assert told("Kitchen1", said)[1] == []
    assert not robot_in("Kitchen1").is_order(turns(said))


@pytest.mark.parametrize(
    "said",
    ["throw the statue away", "throw the statue out", "toss the statue into the garbage can"],
)
def test_throwing_away_is_possible(said: str) -> None:
    assert told("LivingRoom1", said)[0] == {"statue: now in the garbage can"}


@pytest.mark.parametrize("said", ["set the table", "make me a sandwich", "tidy up", "clean up"])
def test_aims(said: str) -> None:
    assert is_aim(said)


@pytest.mark.parametrize(
    "said",
    ["set the house on fire", "make me fly", "set the oven to 200", f"set {'a' * 2000}!", "fly"],
)
def test_no_aims(said: str) -> None:
    assert not is_aim(said)


@pytest.mark.parametrize(
    "said", ["Toast and a fried egg, please", "a fried egg please", "Could I have some toast?"]
)
def test_food_that_is_only_named_is_an_order_to_make_it(said: str) -> None:
    _, notes, _ = told("Kitchen1", said)
    assert all("only once it is" in note for note in notes)
    assert notes
