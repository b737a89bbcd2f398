"""What was ruled out, or is to be asked about first, no order alone gets done for good."""

from __future__ import annotations

import pytest

from heard import heard, robot_in
from talks import Talk


def said_in_kitchen(*said: str) -> Talk:
    robot = robot_in("Kitchen1")
    robot.reset()
    talk = Talk(robot, "What would you like me to do?")
    for each in said:
        talk.query = talk.say(each).question or talk.query
    return talk


@pytest.mark.parametrize(
    "wish",
    [
        "Don't slice anything without asking me",
        "You may not slice anything. Ask me first.",
        "Ask me before you slice or break anything",
        "please ask before cutting anything",
        "I want to be asked before you cut anything",
        "no cutting without my ok",
        "don't do anything irreversible without asking",
        "check with me before you cut the bread",
        "don't slice anything",
        "don't slice the bread",
        "leave the bread whole",
    ],
)
def test_an_order_after_the_wish_is_asked_about_and_a_yes_gets_it_done(wish: str) -> None:
    talk = said_in_kitchen(wish)
    assert not talk.rounds[-1].results
    asked = talk.say("Slice the bread")
    assert (asked.results, asked.question) == ((), "May I slice the bread?")
    talk.query = asked.question
    assert [str(each.action) for each in talk.say("yes").results] == ["slice: bread"]


def test_the_wish_to_be_asked_holds_for_the_next_thing_too() -> None:
    talk = said_in_kitchen("ask me before you cut anything", "slice the bread", "yes")
    assert talk.say("slice the tomato").question == "May I slice the tomato?"


def test_the_wish_holds_for_what_it_names_alone_and_not_once_it_is_taken_back() -> None:
    talk = said_in_kitchen("ask me before slicing the bread")
    assert [str(each.action) for each in talk.say("slice the tomato").results] == ["slice: tomato"]
    talk = said_in_kitchen("don't slice anything without asking", "undo that", "slice the bread")
    assert [str(each.action) for each in talk.rounds[-1].results] == ["slice: bread"]


def test_what_is_said_of_anything_else_spares_what_was_just_ordered() -> None:
    talk = said_in_kitchen("put the apple in the fridge and don't move anything else")
    assert [str(each.action) for each in talk.rounds[-1].results] == ["put: apple -> fridge"]
    hearing = heard("put the apple in the fridge and leave everything else where it is")
    assert hearing.wanted
    assert ("", "Bread") in hearing.refused
    assert not heard("put the apple in the fridge. No wait, don't do anything").wanted


def test_what_is_to_be_cut_on_a_thing_named_before_is_cut_only_there() -> None:
    talk = said_in_kitchen("put plate 1 on the table and slice the bread on it")
    assert [str(each.action) for each in talk.rounds[-1].results] == [
        "put: plate 1 -> dining table"
    ]
    assert talk.rounds[-1].notes == ("There is no bread at the plate.",)
    talk = said_in_kitchen("put the bread on plate 1 and slice it there")
    assert [str(each.action) for each in talk.rounds[-1].results][-1] == "slice: bread"
