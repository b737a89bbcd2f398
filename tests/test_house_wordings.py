"""Wordings that strangers use to the robot, and what it does and says to them."""

from __future__ import annotations

import pytest

from goalscope.types import Action, Turn
from heard import robot_in, told

LAMP = "desk lamp: no longer on"


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["Switch the lamp on the desk off."], {LAMP}),
        (["Turn the lamp on the desk off and the TV on, please."], {LAMP, "TV: on"}),
        (["Turn the lamp by the sofa off."], {"floor lamp: no longer on"}),
        (["Turn the lamp on the desk off", "Turn the lamp on the desk on"], set()),
        (["Don't switch the lamp on the desk off"], set()),
    ],
)
def test_a_particle_at_the_end_decides(said: list[str], changes: set[str]) -> None:
    assert told("LivingRoom1", *said)[:2] == (changes, [])


BINNED = "tissue box: now in the garbage can"


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["Throw away the newspaper. No, wait, not the newspaper, the tissue box."], {BINNED}),
        (["Throw away the newspaper. Not the newspaper, the tissue box."], {BINNED}),
        (["Throw away the newspaper. Actually, not the newspaper."], set()),
        (
            [
                "Put the newspaper on the sofa.",
                "Throw away the newspaper. No, wait, not the newspaper, the tissue box.",
            ],
            {"newspaper: now on the sofa", BINNED},
        ),
        (
            ["Toss out the tissue box and the newspaper. Not the newspaper, only the tissue box."],
            {BINNED},
        ),
        (["Throw away the newspaper.", "No, wait, not the newspaper, the tissue box."], {BINNED}),
    ],
)
def test_one_thing_takes_the_place_of_another(said: list[str], changes: set[str]) -> None:
    assert told("LivingRoom1", *said)[:2] == (changes, [])


LOST = "I do not know where to put the remote control."
SEATED = "pillow 1: now on armchair 1"


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (["Both pillows on the armchair, please."], {SEATED}, []),
        (
            ["Both pillows on the armchair, and the remote control on the desk, please."],
            {SEATED, "remote control: now on the desk"},
            [],
        ),
        (["Turn on the TV.", "Both pillows on the armchair, please."], {SEATED, "TV: on"}, []),
        (
            ["Both pillows on the armchair, and the remote control next to the TV, please."],
            {SEATED},
            [LOST],
        ),
        (
            ["Put both pillows on the armchair, and the remote control next to the TV."],
            {SEATED},
            [LOST],
        ),
        (
            ["Put the newspaper on the sofa, and the remote control next to it."],
            {"newspaper: now on the sofa", "remote control: now on the sofa"},
            [],
        ),
        (["The pillow on the armchair is nice."], set(), []),
    ],
)
def test_a_thing_and_a_place_with_please_are_an_order(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("LivingRoom1", *said)[:2] == (changes, notes)


def test_a_thing_and_a_place_with_please_leave_nothing_to_guess() -> None:
    said = "Both pillows on the armchair, and the remote control next to the TV, please."
    assert robot_in("LivingRoom1").is_order([Turn("", said)])
    assert not robot_in("LivingRoom1").is_order([Turn("", "The pillow on the armchair is nice.")])


EGG = "egg 1: now in the robot's hand"
ONE = "I can hold one thing at a time."


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (["Take two eggs out of the fridge."], {EGG}, [ONE]),
        (
            ["Take two eggs out of the fridge and put them on the plate."],
            {"egg 1: now on plate 1", "egg 2: now on plate 1"},
            [],
        ),
        (["Get the egg."], {EGG}, []),
    ],
)
def test_what_one_hand_cannot_hold_is_told(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, notes)


SLICE = "BreadSliced"


@pytest.mark.parametrize(
    ("order", "number"),
    [
        ("Put the slices on the dining table.", 6),
        ("Put two slices on the dining table.", 2),
        ("Put a slice on the dining table.", 1),
    ],
)
def test_slices_are_as_many_as_are_said(order: str, number: int) -> None:
    assert told("Kitchen1", "Slice the bread.", order)[1:] == ([], "")
    slices = [o for o in robot_in("Kitchen1").metadata["objects"] if o["objectType"] == SLICE]
    assert sum("DiningTable" in str(each["parentReceptacles"]) for each in slices) == number


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("Where did you put the knife?", "The knife is in drawer 2."),
        ("Have you seen my keys?", "I see no such thing here."),
        ("Have you seen the knife?", "The knife is in drawer 2."),
    ],
)
def test_where_things_are_is_told_however_it_is_asked(question: str, answer: str) -> None:
    assert told("Kitchen1") == (set(), [], "")
    assert robot_in("Kitchen1").answer(question) == answer


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("Put everything back.", {"TV: on"}),
        ("Put it all back where it was, please.", {"TV: on"}),
        ("Put the newspaper back.", {"TV: on", "desk lamp: no longer on"}),
    ],
)
def test_what_was_guessed_is_switched_back_with_everything(said: str, changes: set[str]) -> None:
    assert told("LivingRoom1", "Turn on the TV.")[0] == {"TV: on"}
    robot = robot_in("LivingRoom1")
    guesses = (
        Action("turn off", "desk lamp"),
        Action("put", "newspaper", destination="sofa"),
    )
    assert all(robot.step(each).ok for each in guesses)
    turns = [Turn("", "Turn on the TV."), Turn("", said)]
    results = [robot.step(each) for each in robot.requests(turns)]
    assert robot.unmet(turns, results) == []
    lines = robot.status().splitlines()
    assert {line.removeprefix("- ") for line in lines if line.startswith("- ")} == changes


@pytest.mark.parametrize(
    ("orders", "question", "answer"),
    [
        (["Wash mug 1."], "Did you wash it?", "Yes. Mug 1 is clean."),
        (["Wash mug 1."], "Did you slice it?", "No."),
        (["Slice the apple."], "Have you sliced it yet?", "Yes. The apple is sliced."),
        (
            ["Slice the apple.", "Put egg 3 in the fridge."],
            "Did you put it in the fridge?",
            "Yes. Egg 3 is in the fridge.",
        ),
        (["Wash the apple."], "Did you wash it?", "No."),
        (["Wash mug 1."], "Did you like it?", None),
    ],
)
def test_it_is_what_something_was_done_to_last(
    orders: list[str], question: str, answer: str | None
) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    for end in range(len(orders)):
        for action in robot.requests([Turn("", each) for each in orders[: end + 1]]):
            robot.step(action)
    assert robot.answer(question) == answer


WHERE = "I can hold one thing at a time: where should the cup and the mug go?"
BREAKFAST = {"bread: now on the dining table", "egg 1: now on the dining table"}


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (
            "Could you bring me the bread and an egg? I'll make it at the dining table.",
            BREAKFAST,
            [],
        ),
        ("Bring me the bread and an egg, I'm sitting at the dining table.", BREAKFAST, []),
        ("Bring me the bread. I'm at the dining table.", {"bread: now in the robot's hand"}, []),
        ("Bring me the cup and the mug. I'm not at the dining table.", set(), [WHERE]),
        ("Bring me the cup and the mug. I'll be on the phone.", set(), [WHERE]),
        ("Bring me the cup and the mug. I'll put the fork on the dining table.", set(), [WHERE]),
    ],
)
def test_several_things_are_brought_to_where_the_person_is(
    said: str, changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", said)[:2] == (changes, notes)


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("Bathroom1", ["light the candle", "put it out"], set()),
        ("Bathroom1", ["light the candle", "put the candle out please"], set()),
        ("Bathroom1", ["light the candle", "don't put the candle out"], {"candle: on"}),
        ("Bathroom1", ["run the water", "stop the water"], set()),
        ("Kitchen1", ["don't stop the tap"], set()),
        ("Kitchen1", ["don't heat up the potato"], set()),
    ],
)
def test_what_burns_or_runs_is_stopped(scene: str, said: list[str], changes: set[str]) -> None:
    assert told(scene, *said) == (changes, [], "")


@pytest.mark.parametrize(
    "said", ["heat up the potato", "warm the potato up please", "microwave the potato"]
)
def test_food_is_heated_only_with_leave(said: str) -> None:
    assert told("Kitchen1", said) == (set(), [], "May I cook potato 1?")


def test_things_that_are_so_already_are_told_where_each_is() -> None:
    _, notes, _ = told("LivingRoom1", "put the pillows on the armchair", "no, the other armchair")
    assert notes == ["Pillow 1 is on armchair 1 already. Pillow 2 is on armchair 2 already."]
