"""Several orders in one breath: what is done in the shipped rooms, and what is told of the rest."""

from __future__ import annotations

import pytest

from goalscope.types import Turn
from heard import robot_in, told


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (
            "Wash the dirty mug and put it in the cabinet",
            ["mug 1: no longer dirty, now in cabinet 1"],
        ),
        (
            "Put the apple in the fridge, close it and turn off the light",
            ["apple: now in the fridge", "light switch: no longer on"],
        ),
        (
            "Rinse the mug, fill it with water and set it on the table",
            ["mug 1: no longer dirty, filled with water"],
        ),
        (
            "Fill the mug with coffee and set it on the table",
            ["mug 2: filled with coffee, now on the dining table"],
        ),
        (
            "Put the egg on the counter in the fridge, and while you're at it, the tomato too",
            ["egg 3: now in the fridge", "tomato: now in the fridge"],
        ),
        (
            "Please put the bread in the fridge. After that, wash the mug.",
            ["bread: now in the fridge", "mug 1: no longer dirty"],
        ),
        ("Put the mug in the sink and wash it", ["mug 1: no longer dirty, now in the sink basin"]),
        (
            "Put the pot in the sink and fill it with water, then put it on the stove",
            ["pot: filled with water, now on stove burner 3"],
        ),
        (
            "Put the fork and the spoon in the sink, and then put them on the table",
            ["fork: now on the dining table", "spoon: now on the dining table"],
        ),
        (
            "Where is the mug? Wash it and put it on the counter.",
            ["mug 1: no longer dirty, now on counter 1"],
        ),
        (
            "Wash the mug but leave the plates alone, and put the bowl in the sink",
            ["mug 1: no longer dirty", "bowl: now in the sink basin"],
        ),
        (
            "Switch the light off after you've put the bread away in the cabinet",
            ["light switch: no longer on", "bread: now in cabinet 1"],
        ),
        (
            "Once you have washed the mug, put it in the sink",
            ["mug 1: no longer dirty, now in the sink basin"],
        ),
        (
            "Put a mug on the counter and a mug in the sink",
            ["mug 2: now on counter 1", "mug 1: now in the sink basin"],
        ),
        (
            "Put the plates on the table, one fork next to them, and wine in the cup",
            [
                *("plate 1: now on the dining table", "plate 2: now on the dining table"),
                *("fork: now on the dining table", "cup: filled with wine"),
            ],
        ),
        (
            "Move the potato on the counter to the fridge and the tomato from the counter"
            " to the table",
            ["potato 1: now in the fridge", "tomato: now on the dining table"],
        ),
        (
            "Please get rid of the egg on the counter and turn the light off, would you?",
            ["egg 3: now in the garbage can", "light switch: no longer on"],
        ),
        (
            "Everything on the dining table goes in the sink, and meanwhile water the plant",
            [
                *("mug 1: now in the sink basin", "bowl: now in the sink basin"),
                *("salt shaker: now in the sink basin", "pepper shaker: now in the sink basin"),
                "plant: filled with water",
            ],
        ),
        (
            "Empty the wine bottle and throw it out",
            ["wine bottle: emptied, now in the garbage can"],
        ),
        (
            "Go to the fridge, open it, grab the egg and place it on the plate",
            ["fridge: open", "egg 1: now on plate 1"],
        ),
        (
            "The bread goes in the cabinet, the apple in the fridge and the mug in the sink",
            ["bread: now in cabinet 1", "apple: now in the fridge", "mug 2: now in the sink basin"],
        ),
        (
            "Put everything on the counter in the fridge, but leave the sponge, the soap bottle and"
            " the paper towel",
            [
                f"{name}: now in the fridge"
                for name in ("bread", "tomato", "potato 1", "potato 2", "apple", "egg 3")
            ],
        ),
        (
            "Open the fridge, take out the lettuce, and slice it",
            ["fridge: open", "lettuce: sliced"],
        ),
        (
            "Get the sharp knife and put it next to the sink, in the sink",
            ["knife: now in the sink basin"],
        ),
    ],
)
def test_every_part_of_what_is_said_in_a_kitchen_is_done(said: str, changes: list[str]) -> None:
    assert told("Kitchen1", said) == (set(changes), [], "")


def test_what_is_brought_and_was_clean_is_told_so() -> None:
    plates = {"plate 1: now on the dining table", "plate 2: now on the dining table"}
    notes = ["Plate 1, plate 2 are clean already."]
    said = "Wash both plates, then put them on the dining table"
    assert told("Kitchen1", said) == (plates, notes, "")


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        (
            "LivingRoom1",
            "Turn off the desk lamp and the floor lamp, then close the laptop",
            ["desk lamp: no longer on", "floor lamp: no longer on", "laptop: no longer open"],
        ),
        (
            "LivingRoom1",
            "Put the book on the desk on the shelf and the pen with it",
            ["book 1: now on shelf 1", "pen: now on shelf 1"],
        ),
        (
            "LivingRoom1",
            "Pick up everything on the coffee table and put it on the desk",
            ["laptop: now on the desk", "phone 2: now on the desk", "newspaper: now on the desk"],
        ),
        (
            "LivingRoom1",
            "Put the phone on the sofa on the desk, and the phone on the coffee table in the"
            " drawer.",
            ["phone 1: now on the desk", "phone 2: now in drawer 2"],
        ),
        (
            "LivingRoom1",
            "Put the keys in the drawer, the watch on the desk and the credit card in the box",
            ["keys: now in drawer 2", "watch: now on the desk", "credit card: now in the box"],
        ),
        (
            "LivingRoom1",
            "The book on the desk goes on the shelf and the pencil in the drawer",
            ["book 1: now on shelf 1", "pencil: now in drawer 2"],
        ),
        (
            "Bathroom1",
            "Put the soap in the sink, and the towel in the hamper",
            ["bar of soap 1: now in the sink basin", "towel: now in the laundry hamper"],
        ),
        (
            "Bedroom1",
            "Wash the mug, but not the cloth, and put the teddy bear on the chair",
            ["mug: no longer dirty", "teddy bear: now on the chair"],
        ),
        (
            "Bedroom1",
            "Take the dirty mug from the desk and wash it, and then put the pen and the pencil in"
            " the drawer",
            ["mug: no longer dirty", "pen: now in drawer 1", "pencil: now in drawer 1"],
        ),
    ],
)
def test_every_part_of_what_is_said_elsewhere_is_done(
    scene: str, said: str, changes: list[str]
) -> None:
    assert told(scene, said) == (set(changes), [], "")


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (
            ["Wash the mug and put it in the sink.", "Thanks!", "Put the mug on the shelf."],
            ["mug 1: no longer dirty, now on the shelf"],
        ),
        (
            ["Put the mug in the sink.", "Wash it.", "Now put it back in the cabinet."],
            ["mug 2: now in cabinet 1"],
        ),
        (
            ["Put the fork in the sink, and then put it on the table.", "Great.", "Good."],
            ["fork: now on the dining table"],
        ),
        (
            ["Put the egg on the counter in the fridge.", "Thank you.", "Good."],
            ["egg 3: now in the fridge"],
        ),
        (
            ["Put everything on the shelf in the fridge.", "Now put the cup on the shelf.", "Ok."],
            ["wine bottle: now in the fridge", "cup: now on the shelf"],
        ),
    ],
)
def test_what_was_done_stays_so_in_later_rounds(said: list[str], changes: list[str]) -> None:
    assert told("Kitchen1", *said) == (set(changes), [], "")


def test_slices_that_are_asked_for_in_the_same_breath_are_put_where_they_should_be() -> None:
    assert told("Kitchen1", "Slice the tomato and put a slice on the plate.")[1:] == ([], "")
    places = {
        str(each["parentReceptacles"])
        for each in robot_in("Kitchen1").metadata["objects"]
        if each["objectType"] == "TomatoSliced"
    }
    assert sum("Plate" in place for place in places) == 1


@pytest.mark.parametrize(
    ("said", "notes"),
    [
        ("Slice the bread and wash the dirty plate", ["There is no dirty plate here."]),
        ("Wash the guitar", ["There is no guitar here."]),
        ("Wash the mug, and play the guitar", ["I did not understand: play the guitar."]),
        ("Put the unicorn in the sink", ["There is no unicorn here."]),
        ("Turn off the light and feed the cat", ["I did not understand: feed the cat."]),
        ("Fill the kettle and put it on the stove", ["There is no kettle here."]),
        (
            "Put the laptop in the fridge, open the safe and turn on the TV.",
            ["There is no laptop here.", "There is no safe here.", "There is no TV here."],
        ),
        ("Water the plant and then close the window", ["I cannot close the window."]),
        ("Put the apple on the tomato", ["I cannot put anything in or on the tomato."]),
        (
            "Put the fridge on the table and slice the plate.",
            ["I cannot carry the fridge.", "I cannot slice the plate."],
        ),
        ("Put away the apple", ["I do not know where to put the apple."]),
        (
            "Bring me the mug and the plate.",
            ["I can hold one thing at a time: where should the mug and the plate go?"],
        ),
        ("Put three mugs on the counter", ["I see only 2 of these here: mug."]),
        ("Put all plates on the table in the sink", ["There is no plate at the dining table."]),
        (
            "Put the plates on the table and the forx in the sink.",
            ["There is no forx here."],
        ),
    ],
)
def test_what_an_order_did_not_get_is_told(said: str, notes: list[str]) -> None:
    assert told("Kitchen1", said)[1] == notes


@pytest.mark.parametrize(
    ("scene", "said", "changes", "notes"),
    [
        ("Kitchen1", "Turn on the light", [], ["The light switch is on already."]),
        ("Kitchen1", "Open the fridge and close it", [], ["The fridge is closed already."]),
        (
            "Kitchen1",
            "Put the lettuce in the fridge and wash the plates.",
            [],
            ["The lettuce is in the fridge already.", "Plate 1, plate 2 are clean already."],
        ),
        (
            "LivingRoom1",
            "Turn off the TV and the floor lamp",
            ["floor lamp: no longer on"],
            ["The TV is off already."],
        ),
        ("Kitchen1", "Fill the wine bottle", [], ["The wine bottle is filled already."]),
        ("Kitchen1", "Put the apple in the fridge and close it", ["apple: now in the fridge"], []),
        ("Kitchen1", "Wash the mugs", ["mug 1: no longer dirty"], []),
        (
            "Kitchen1",
            "Bring me the apple.|Pick up the apple.",
            ["apple: now in the robot's hand"],
            ["I hold the apple already."],
        ),
    ],
)
def test_what_is_so_already_is_told(
    scene: str, said: str, changes: list[str], notes: list[str]
) -> None:
    assert told(scene, *said.split("|")) == (set(changes), notes, "")


@pytest.mark.parametrize(
    "said",
    [
        "I'd like to have breakfast soon",
        "thanks, that is great",
        "my wife comes home at six",
        "We had pasta yesterday and it was lovely",
        "The kids broke the vase this morning",
        "It's cold in here, isn't it?",
        "I have a guest over tonight and she is vegetarian",
        "You are doing a great job, keep going",
        "I usually eat an apple after lunch",
        "My brother will bring the wine",
        "The fridge makes a strange noise",
        "I can wash the plate myself",
        "I'll slice the bread later",
        "Wash the mug tomorrow, please",
        "Don't touch the guitar",
        "Take your time",
        "Give me a moment",
        "Have a nice day",
        "Should I wash the guitar?",
        "Wash the mug",
        "Slice the bread, but only if you are sure.",
    ],
)
def test_ordinary_talk_and_what_is_done_or_waits_get_no_sentence(said: str) -> None:
    assert told("Kitchen1", said)[1] == []


def test_what_waits_for_leave_is_not_told_as_undone() -> None:
    changes, notes, question = told(
        "Kitchen1", "After you slice the bread, put the knife in the sink"
    )
    assert (changes, notes) == ({"knife: now in the sink basin"}, [])
    assert question == "May I slice the bread?"


@pytest.mark.parametrize(
    "said",
    [
        "and " * 900,
        "Put " * 400,
        ", " * 1000,
        "whole " * 330,
        "after you " * 200,
        "mug, " * 400,
        "mug or " * 280,
        "wash the x, " * 150,
        "".join(f"wash the x{n}y. " for n in range(99)),
        "\u2603 slice \x00 it",
    ],
)
def test_hostile_words_are_read_in_the_end(said: str) -> None:
    changes, notes, _ = told("Kitchen1", said)
    assert not changes
    assert len(notes) <= 7
    assert all(len(note) < 120 for note in notes)


@pytest.mark.parametrize(
    "said",
    [
        "Where was the mug after you put the apple in the fridge?",
        "The kitchen was a mess after you opened the fridge.",
        "I got angry after you threw the apple away.",
        "Did the lettuce wilt after you opened the fridge?",
        "What happens after you put the apple in the sink?",
        "What did you do after you broke the egg?",
        "I was sad once you sliced the bread.",
        "Why was it wet after you cleaned the plate?",
        "After you sliced the apple, I cried.",
        "Don't do anything after you open the fridge.",
        "Never open the fridge after you clean the plate.",
        "I hate it. Once you opened the fridge, it smelled.",
        "Was it ok after you moved the pan to the sink?",
        "Before dinner, after you washed the plate, we ate.",
        "My wife left after you dropped the bowl in the sink!",
        "Guests complained after you put the bowl in the garbage can.",
        "Clean plates were in the sink after you opened the fridge.",
        "Light was bad after you opened the fridge.",
        "Keep the fridge closed after you opened it.",
        "Forget what I said after you opened the fridge.",
        "After you have opened the fridge, don't put the apple in it.",
        "You put the apple in the fridge after you opened it?",
        "You put the apple in the fridge when I was out?",
        "You put the apple in the fridge?!",
        "Slice 0 apples.",
        "Slice zero apples.",
        "Slice no apples.",
        "Slice 0 eggs and break 0 eggs",
        "Break 0 eggs.",
        "Put 0 apples in the fridge.",
        "Wash zero of the plates.",
    ],
)
def test_what_is_asked_told_forbidden_or_wanted_of_none_is_not_done(
    said: str,
) -> None:
    assert told("Kitchen1", said)[::2] == (set(), "")


@pytest.mark.parametrize(
    ("said", "plan"),
    [
        (
            "Put the apple in the fridge after you've opened the microwave.",
            ["open: microwave", "put: apple -> fridge"],
        ),
        (
            "Could you put the apple in the fridge after opening the microwave?",
            ["open: microwave", "put: apple -> fridge"],
        ),
        (
            "Once you have filled the pot, could you put it in the sink?",
            ["fill: pot", "put: pot -> sink basin"],
        ),
        (
            "Ok robot, once you open the microwave, put the apple in it",
            ["open: microwave", "put: apple -> microwave"],
        ),
        ("Put zero eggs and the apple in the fridge", ["put: apple -> fridge"]),
    ],
)
def test_what_is_to_be_done_first_is_done_first(said: str, plan: list[str]) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    assert [str(action) for action in robot.requests([Turn("", said)])] == plan
