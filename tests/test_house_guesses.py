"""Where the robot may guess, what it says where it does not, and how it takes things back."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from heard import robot_in


@pytest.mark.parametrize(
    "said",
    [
        ["cook an egg"],
        ["bring me a clean fork and a knife"],
        ["turn the light off"],
        ["Thanks! Now turn the light off, please."],
        ["why did you do that? put it back"],
        ["I'm hungry, so bring me the apple"],
        ["lock up the apple too"],
        ["do the dishes"],
        ["don't touch the eggs"],
        ["put the egg in the fridge", "the tomato too"],
        ["put the cups and the mug in the sink", "not that one, I meant only the mug"],
        ["can you put the apple in the fridge?"],
        ["is the fridge open?"],
    ],
)
def test_an_order_leaves_nothing_to_guess(said: list[str]) -> None:
    assert robot_in("Kitchen1").is_order([Turn("", each) for each in said])


@pytest.mark.parametrize(
    "said",
    [
        "tidy up a bit",
        "could you tidy up?",
        "I'm hungry",
        "it's too dark in here",
        "make me a sandwich",
        "set the table for 2",
        "I'd like breakfast",
        "I want a snack",
        "bring me something to eat",
        "put the apple away",
        "put the apple away and turn off the light",
        "Turn the light off. I'm hungry.",
        "clean up",
        "clear the table",
        "I don't like the mess",
        "the tomato too",
        "if you find the time, turn the light off",
        "yes please",
        "",
    ],
)
def test_an_aim_leaves_how_to_guess(said: str) -> None:
    assert not robot_in("Kitchen1").is_order([Turn("", said)])
