"""Wordings that strangers use to the robot, and what it does and says to them."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from heard import robot_in, told

LAMP = "desk lamp: no longer on"


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["Switch the lamp on the desk off."], {LAMP}),
        (["Turn the lamp on the desk off and the TV on, please."], {LAMP, "TV: on"}),
        (["Turn the lamp by the sofa off."], {LAMP}),
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
