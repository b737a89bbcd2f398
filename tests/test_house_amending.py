"""Another place, and how a thing is to be, in words that are no order by themselves."""

from __future__ import annotations

import pytest

from heard import told


@pytest.mark.parametrize(
    "amends",
    [
        "No, better on the counter.",
        "On second thought, on the counter.",
        "Better on the counter.",
        "Hmm, the counter instead.",
        "Or rather on the counter.",
    ],
)
def test_a_better_place_takes_the_place_of_the_one_before(amends: str) -> None:
    bowl = ({"bowl: now on counter 1"}, [], "")
    assert told("Kitchen1", "Put the bowl on the dining table.", amends) == bowl
    apple = f"Put the apple in the sink. {amends}"
    assert told("Kitchen1", apple) == (set(), ["The apple is on counter 2 already."], "")


def test_who_is_coming_is_no_thing_to_look_for() -> None:
    said = "Put the knife in the drawer, the kids are coming."
    assert told("Kitchen1", said)[1] == told("Kitchen1", "Put the knife in the drawer")[1]


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("Bedroom1", ["Is the box closed? Otherwise close it."], {"box: no longer open"}),
        ("Bedroom1", ["Is the safe closed? Otherwise open it."], {"safe: open"}),
        (
            "LivingRoom1",
            ["Is the desk lamp on? If it is, please turn it off."],
            {"desk lamp: no longer on"},
        ),
        ("Bedroom1", ["Put both pillows on the chair", "No, both on the bed."], set()),
    ],
)
def test_how_a_thing_is_to_be_is_heard_behind_a_question(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said) == (changes, [], "")


@pytest.mark.parametrize("said", ["take the wand", "bring the spare roll"])
def test_it_is_never_what_stood_before_a_thing_that_is_not_here(said: str) -> None:
    first, then = "put cloth 1 in the sink", f"{said} and put it on the toilet"
    changes, notes, _ = told("Bathroom1", first, then)
    assert changes == {"cloth 1: now in the sink basin"}
    assert notes[1:] == ["I did not understand: put it on the toilet."]


@pytest.mark.parametrize(
    ("scene", "said", "after"),
    [
        ("Bathroom1", ["The candle, is it lit? If not light it"], {"candle: on"}),
        ("Bathroom1", ["Is the candle lit? If not, light it."], {"candle: on"}),
        ("Bedroom1", ["Lock the credit card away in the safe"], {"credit card: now in the safe"}),
        ("Bedroom1", ["Put the watches in the safe", "Oh, not watch 1, I need that in the morning"],
         {"watch 2: now in the safe"}),
        ("Bedroom1", ["Sit the teddy bear on the chair"], {"teddy bear: now on the chair"}),
    ],
)  # fmt: skip
def test_it_is_done_as_people_say_it(scene: str, said: list[str], after: set[str]) -> None:
    assert told(scene, *said)[0] == after


@pytest.mark.parametrize(
    ("scene", "said", "after"),
    [
        ("Kitchen1", ["turn on the microwave", "take out the pizza", "turn it off"], set()),
        ("Kitchen1", ["turn on stove burner 1", "shut it off"], set()),
        ("Kitchen1", ["Open the fridge, take the milk and close it"], set()),
        ("Kitchen1", ["put mug 2 in the sink", "take the wand", "put it on the table"],
         {"mug 2: now on the dining table"}),
        ("Bedroom1", ["Put the phone on the bed", "No, not the bed, I need it on the desk"],
         {"phone: now on the desk"}),
        ("Bedroom1", ["No, not the watch, I need it here, put the phone in the safe instead"],
         {"phone: now in the safe"}),
        ("Bedroom1", ["Lock the door and put watch 1 in the safe"], {"watch 1: now in the safe"}),
    ],
)  # fmt: skip
def test_what_only_sounds_like_it_is_heard_as_before(
    scene: str, said: list[str], after: set[str]
) -> None:
    assert told(scene, *said)[0] == after
