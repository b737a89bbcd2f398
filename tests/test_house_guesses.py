"""Where the robot may guess, what it says where it does not, and how it takes things back."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from heard import heard, robot_in, told


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


CRACKED = 'I can cook an egg only once it is cracked: say "crack the egg".'
SLICED = 'I can cook the bread only once it is sliced: say "slice the bread".'
NOTHING = "I do not know what to undo: tell me what should be as it was."


@pytest.mark.parametrize(
    ("said", "changes", "notes", "question"),
    [
        (["cook an egg"], set(), [CRACKED], ""),
        (["fry an egg in the pan"], set(), [CRACKED], ""),
        (["don't cook the egg"], set(), [], ""),
        (["crack the egg and cook it"], set(), [], "May I break egg 1?"),
        (["crack egg 1 and cook it"], {"egg 1: broken"}, [], "May I cook cracked egg 1?"),
        (["crack egg 1", "cook it"], {"egg 1: broken"}, [], "May I cook cracked egg 1?"),
        (["toast the bread"], set(), [SLICED], ""),
        (["heat up some bread"], set(), ["I did not understand: heat up some bread."], ""),
        (["warm the milk"], set(), ["I did not understand: warm the milk."], ""),
        (["make me a sandwich"], set(), ["I did not understand: make me a sandwich."], ""),
        (["set the table for 2"], set(), ["I did not understand: set the table for 2."], ""),
        (["lock up the apple"], set(), ["There is no safe here."], ""),
        (["do the dishes"], {"mug 1: no longer dirty"}, [], ""),
        (["clean everything"], {"mug 1: no longer dirty"}, [], ""),
    ],
)
def test_what_cannot_be_done_is_told_with_what_would_do(
    said: list[str], changes: set[str], notes: list[str], question: str
) -> None:
    assert told("Kitchen1", *said) == (changes, notes, question)


def test_a_cracked_egg_is_cooked_and_carried() -> None:
    robot = robot_in("Kitchen1")
    told("Kitchen1", "crack egg 1, put it in the pan and cook the egg")
    cracked = [each for each in robot.metadata["objects"] if each["objectType"] == "EggCracked"]
    assert [each["isCooked"] for each in cracked] == [True]
    assert any("Pan" in place for place in cracked[0]["parentReceptacles"])


DARK = "light switch: no longer on"
APPLE = "apple: now in the fridge"


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (["turn the light off", "turn it back on"], set(), []),
        (["turn the light off", "turn the lights back on, please"], set(), []),
        (["turn the light off", "switch back on the light"], set(), []),
        (["turn the light off", "undo that"], set(), []),
        (["open the fridge", "Oops, can you undo that please?"], set(), []),
        (["open the fridge", "thanks", "undo what you just did"], set(), []),
        (["bring me the apple", "undo it"], set(), []),
        (["put two plates on the table", "undo that"], set(), []),
        (["put the apple in the fridge", "turn the light off", "undo that"], {APPLE}, []),
        (
            ["put the apple in the fridge", "turn the light off", "undo that", "undo that"],
            set(),
            [],
        ),
        (
            ["put mug 2 in the sink", "put mug 2 on the table", "undo that"],
            {"mug 2: now in the sink basin"},
            [],
        ),
        (["put the apple in the fridge", "turn the light off", "undo everything"], set(), []),
        (
            ["put the apple in the fridge and open drawer 1", "put everything back how it was"],
            set(),
            [],
        ),
        (["put the apple and the tomato in the sink", "put everything back"], set(), []),
        (["put everything back"], set(), ["They are where they were already."]),
        (["open the fridge", "undo that", "open the fridge"], {"fridge: open"}, []),
        (["open the fridge", "don't undo that"], {"fridge: open"}, []),
        (["turn on the light", "undo that"], set(), ["There is nothing to undo."]),
        (
            ["clean mug 1", "undo that"],
            {"mug 1: no longer dirty"},
            ["I cannot undo that: clean the mug."],
        ),
        (["undo that"], set(), [NOTHING]),
        (
            ["put the apple in the fridge", "I'm hungry", "undo that", "undo that"],
            {APPLE},
            [NOTHING],
        ),
    ],
)
def test_what_was_ordered_is_undone_or_told(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, notes)


def test_undoing_takes_leave_back() -> None:
    assert heard("slice the bread").permitted
    assert not heard("slice the bread", "undo that").permitted
    assert not heard("slice the bread", "open the fridge", "undo that").permitted
