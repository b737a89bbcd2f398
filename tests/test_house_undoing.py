"""What of the things done in a room is taken back, and what is told of the rest."""

from __future__ import annotations

import pytest

from goalscope.taking_back import NOTHING
from goalscope.types import Action
from heard import robot_in, told
from talks import Talk

LAPTOP = {"laptop: now on the sofa"}


@pytest.mark.parametrize(
    "undo", ["undo", "Undo!", "undo it", "revert", "take that back", "undo the last thing",
             "please undo my last order", "undo the last change", "No, undo that."]
)  # fmt: skip
def test_to_undo_may_be_said_in_few_words(undo: str) -> None:
    said = ["turn off the desk lamp", "put the laptop on the sofa", undo]
    assert told("LivingRoom1", *said)[:2] == ({"desk lamp: no longer on"}, [])


def test_several_orders_are_undone_by_their_number() -> None:
    said = ["open drawer 1", "turn off the desk lamp", "put the laptop on the sofa"]
    assert told("LivingRoom1", *said, "undo the last two things")[0] == {"drawer 1: open"}
    assert told("LivingRoom1", *said, "undo the last 9 orders")[0] == set()


@pytest.mark.parametrize("said", ["undo the knot", "don't undo that", "I can undo it myself"])
def test_what_undoes_nothing(said: str) -> None:
    assert told("LivingRoom1", "put the laptop on the sofa", said)[0] == LAPTOP


def test_everything_is_undone_also_what_nobody_asked_for() -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    talk = Talk(robot)
    guesses = (
        Action("put", "newspaper", destination="sofa"),
        Action("turn off", "desk lamp"),
        Action("open", "drawer 1"),
        Action("put", "vase", destination="box"),
        Action("pick up", "remote control"),
    )
    talk.say("tidy up", guesses=guesses)
    talk.say("Open drawer 2")
    assert talk.say("undo everything").takes_back == (2, 1)
    assert "Nothing has been changed" in robot.status()
    assert not talk.say("thanks").results


def test_what_nobody_can_undo_is_told() -> None:
    said = ["slice the bread", "wash mug 1 and fill it with coffee", "undo everything"]
    changes, notes, _ = told("Kitchen1", *said)
    assert changes == {"bread: sliced", "mug 1: no longer dirty"}
    assert notes == ["I cannot undo that: clean mug 1.", "I cannot undo that: slice the bread."]
    assert told("Kitchen1", "undo everything")[1] == [NOTHING]
    assert told("Kitchen1", *said, "open the fridge")[0] == {*changes, "fridge: open"}


def test_a_guess_is_undone_and_then_nothing_is_told() -> None:
    robot = robot_in("Bedroom1")
    robot.reset()
    talk = Talk(robot)
    talk.say("open drawer 1")
    talk.say("tidy up the room", guesses=[Action("put", "book 1", destination="bed")])
    back = talk.say("undo that")
    done = [each.action for each in back.results]
    assert [(each.name, each.target) for each in done] == [("put", "book 1")]
    assert back.notes == ('Taken back: "tidy up the room".',)
    assert robot.status().splitlines()[2:] == ["- drawer 1: open"]
