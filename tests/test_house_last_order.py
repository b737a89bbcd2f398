"""What corrects the last order: another place, another thing, another of several orders."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from heard import robot_in, told

ON_SOFA = {"remote control: now on the sofa"}
ON_DESK = {"remote control: now on the desk"}


@pytest.mark.parametrize(
    "later",
    [
        "Oh no, I meant the sofa, not the coffee table.",
        "I meant on the sofa, not on the coffee table.",
        "No, on the sofa.",
        "on the sofa, please",
        "on the sofa",
        "no, the sofa",
        "Sorry, the sofa!",
        "the sofa instead",
        "Not there, on the sofa.",
        "Not the coffee table. The sofa.",
        "I said the sofa.",
        "Thanks. No, on the sofa, I mean.",
    ],
)
def test_what_was_put_last_goes_to_the_place_that_is_named_instead(later: str) -> None:
    said = ["Put the remote on the coffee table", later]
    assert told("LivingRoom1", *said) == (ON_SOFA, [], "")
    assert robot_in("LivingRoom1").is_order([Turn("", each) for each in said])


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["put the remote on the sofa and the pen on the coffee table", "No, on the desk."],
         {*ON_SOFA, "pen: now on the desk"}),
        (["put the remote on the sofa and the pen on the coffee table",
          "I meant the desk, not the sofa"], {*ON_DESK, "pen: now on the coffee table"}),
        (["put the remote and the pen on the sofa", "No, on the desk. And open drawer 1."],
         {*ON_DESK, "pen: now on the desk", "drawer 1: open"}),
        (["put a book on the coffee table", "not the coffee table, the desk"],
         {"book 2: now on the desk"}),
        (["put the pen in drawer 1", "no, drawer 3"], {"pen: now in drawer 3"}),
        (["put the pen in the box", "rather in drawer 3, please", "and the pencil"],
         {"pen: now in drawer 3", "pencil: now in drawer 3"}),
        (["put the remote on the sofa", "No, the desk", "undo that"], ON_SOFA),
        (["put the pillow", "on the desk"], {"pillow 1: now on the desk"}),
    ],
)  # fmt: skip
def test_only_what_was_put_where_it_should_not_be_moves_on(
    said: list[str], changes: set[str]
) -> None:
    assert told("LivingRoom1", *said)[:2] == (changes, [])


@pytest.mark.parametrize(
    "later",
    [
        "the sofa is dirty",
        "Thanks, open the box",
        "in the kitchen, please",
        "we sit on the sofa",
        "is it on the sofa?",
        f"no, the sofa{' ' * 200}a",
    ],
)
def test_other_words_about_a_place_move_nothing(later: str) -> None:
    assert told("LivingRoom1", "put the remote on the desk", later)[0] == ON_DESK


@pytest.mark.parametrize(
    ("query", "later"),
    [
        ("Should I put the pillow on the chair?", "No, on the sofa."),
        ("Where would you like to sit?", "On the sofa."),
        ("Shall I bring you the newspaper?", "No, the watch."),
    ],
)
def test_what_answers_another_question_corrects_nothing(query: str, later: str) -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    order = Turn("", "put the remote on the desk")
    assert all(robot.step(action).ok for action in robot.requests([order]))
    assert robot.requests([order, Turn(query, later)]) == []


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["Put the apple in the fridge and close it.",
          "Sorry, I meant the tomato, not the apple."], {"tomato: now in the fridge"}),
        (["Put the apple in the fridge and close it.", "not the apple, the tomato"],
         {"tomato: now in the fridge"}),
        (["Put the apple in the fridge and close it.", "Not the apple but the tomato."],
         {"tomato: now in the fridge"}),
        (["Put the apple in the fridge and close it.", "the tomato too"],
         {"apple: now in the fridge", "tomato: now in the fridge"}),
        (["Put the apple in the fridge and open the microwave.", "I meant the tomato"],
         {"tomato: now in the fridge", "microwave: open"}),
        (["Wash the cup and put it in the sink.", "sorry, mug 1, not the cup"],
         {"mug 1: no longer dirty, now in the sink basin"}),
        (["Open the fridge.", "No, the microwave."], {"microwave: open"}),
        (["Open the fridge.", "No, the apple."], {"fridge: open"}),
    ],
)  # fmt: skip
def test_another_thing_takes_the_place_of_one_in_any_of_the_last_orders(
    said: list[str], changes: set[str]
) -> None:
    assert told("Kitchen1", *said)[0] == changes


@pytest.mark.parametrize("later", ["Nothing else, thanks", "No, that's all.", "no more"])
def test_who_wants_no_more_rules_out_nothing(later: str) -> None:
    assert told("LivingRoom1", "put the remote on the sofa", later) == (ON_SOFA, [], "")
