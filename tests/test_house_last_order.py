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
        "I wanted it on the sofa.",
        "Yes, but I said the sofa",
        "On second thought, the sofa.",
        "I changed my mind, the sofa please",
        "I'd prefer the sofa",
        "No, it belongs on the sofa",
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
        (["put the remote on the sofa", "no, under the desk", *["undo that"] * 2], set[str]()),
        (["put the pillow", "on the desk"], {"pillow 1: now on the desk"}),
        (["put the remote on the sofa", "No, not the sofa!", "on the desk"], ON_DESK),
        (["put the pen in the mug", "No, the box", "in the box"], {"pen: now in the box"}),
        (["put the remote on the sofa", "Wait", "the desk, please"], ON_DESK),
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
        (["Put the cup, the apple and the pan in the sink", "not the pan, the pot"],
         {f"{each}: now in the sink basin" for each in ("cup", "apple", "pot")}),
        (["Open the fridge.", "No, the apple."], {"fridge: open"}),
    ],
)  # fmt: skip
def test_another_thing_takes_the_place_of_one_in_any_of_the_last_orders(
    said: list[str], changes: set[str]
) -> None:
    assert told("Kitchen1", *said)[0] == changes


@pytest.mark.parametrize(
    "later", ["Nothing else, thanks", "No, that's all.", "no more", "Sorry, never mind"]
)
def test_who_wants_no_more_rules_out_nothing(later: str) -> None:
    assert told("LivingRoom1", "put the remote on the sofa", later) == (ON_SOFA, [], "")


@pytest.mark.parametrize(
    ("later", "changes"),
    [
        ("No, I said the tomato belongs on the shelf.", {"tomato: now on the shelf"}),
        ("I said that the tomato goes on the shelf", {"tomato: now on the shelf"}),
        ("As I said, put the tomato on the shelf", {"tomato: now on the shelf"}),
        ("I said nothing", set[str]()),
        ("I said stop", set[str]()),
        ("I never said the tomato", set[str]()),
    ],
)
def test_what_was_said_is_said_again(later: str, changes: set[str]) -> None:
    changes = {*changes, "cup: now on the shelf"}
    assert told("Kitchen1", "put the cup on the shelf", later)[0] == changes


IN_DRAWER = {"phone 1: now in drawer 2", "phone 2: now in drawer 2"}


@pytest.mark.parametrize(
    ("later", "changes"),
    [
        ("Oops, only phone 1, leave the other one where it was.", {"phone 1: now in drawer 2"}),
        ("Only phone 1. Put the other one back.", {"phone 1: now in drawer 2"}),
        ("just phone 2", {"phone 2: now in drawer 2"}),
        ("leave phone 2 where it was", {"phone 1: now in drawer 2"}),
        ("No, keep the phones where they were, please", set[str]()),
        ("leave the phones where they are", IN_DRAWER),
        ("leave phone 2 alone", IN_DRAWER),
        ("leave book 1 where it was", IN_DRAWER),
    ],
)
def test_what_should_have_been_left_where_it_was_goes_back(later: str, changes: set[str]) -> None:
    said = ["Put both phones in the drawer.", later]
    assert told("LivingRoom1", *said)[:2] == (changes, [])


def test_one_of_several_that_go_back_is_not_moved_twice() -> None:
    robot = robot_in("LivingRoom1")
    told("LivingRoom1", "Put both phones in the drawer.")
    said = [Turn("", "Put both phones in the drawer."), Turn("", "only phone 1")]
    assert [each.target for each in robot.requests(said)] == ["phone 2"]


def test_what_is_left_as_it_was_is_guessed_nowhere() -> None:
    said = [Turn("", "Tidy up, but leave phone 2 where it was")]
    robot = robot_in("LivingRoom1")
    robot.reset()
    assert "phone 2" not in {action.target for action in robot.actions(["phone"], said)}


def test_what_was_not_moved_is_not_told_to_be_where_it_was() -> None:
    notes = ["I cannot undo that: clean mug 1."]
    assert told("Kitchen1", "Wash the mug and put it on the table", "Could you undo that?") == (
        {"mug 1: no longer dirty"},
        notes,
        "",
    )


@pytest.mark.parametrize(
    ("order", "later"),
    [
        ("put the remote on the sofa", "on the moon, please"),
        ("put the remote on the sofa", "no, next to the vase"),
        ("put the remote on the sofa", "No, the box"),
        ("put the remote on the sofa", "under the sofa"),
        ("put the remote on the sofa", "sorry, the other one"),
        ("turn off the floor lamp", "no, the sofa"),
        ("put book 1 on the sofa", "No, the other book"),
        ("turn off the floor lamp", "Not there!"),
        ("bring me the laptop", "No, on the desk!"),
    ],
)
def test_a_correction_of_which_nothing_comes_is_told(order: str, later: str) -> None:
    changes = told("LivingRoom1", order)[0]
    note = f"I did not understand: {later.rstrip('!')}."
    assert told("LivingRoom1", order, later) == (changes, [note], "")
    assert robot_in("LivingRoom1").is_order([Turn("", order), Turn("", later)])


@pytest.mark.parametrize(
    "later",
    [
        "I'm hungry",
        "Sorry, my laptop is broken",
        "No, something light please",
        "Just a book and some tea",
        "with a nice book",
        "No, I like it bright",
        "In the evening I read a book",
    ],
)
def test_what_tells_of_wishes_is_no_correction(later: str) -> None:
    assert told("LivingRoom1", "turn off the desk lamp", later)[1] == []


def test_a_no_about_a_thing_that_is_named_first_is_not_about_the_last_order() -> None:
    said = ["put the egg in the fridge", "The apple? No, not in the fridge, I want it in the bowl."]
    assert told("Kitchen1", *said)[0] == {"egg 3: now in the fridge", "apple: now in the bowl"}


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["put egg 1 on the table", "only egg 1"], {"egg 1: now on the dining table"}),
        (["put egg 1 and the tomato on the table", "only egg 1"],
         {"egg 1: now on the dining table"}),
        (["put egg 1 on the table", "put egg 2 there too", "only egg 2"],
         {"egg 2: now on the dining table"}),
        (["open drawer 1", "only drawer 1"], {"drawer 1: open"}),
        (["turn on the stove", "only burner 1"], {"stove burner 1: on", "stove knob 1: on"}),
        (["put mug 1 on the counter", "leave the other mug where it was"],
         {"mug 1: now on counter 1"}),
        (["put two eggs on the table", "leave one egg where it was"],
         {f"egg {each}: now on the dining table" for each in (1, 2)}),
    ],
)  # fmt: skip
def test_what_alone_was_asked_for_is_not_taken_back(said: list[str], changes: set[str]) -> None:
    assert told("Kitchen1", *said)[0] == changes


@pytest.mark.parametrize(
    "later",
    [
        ["is the fridge open?", "no, the microwave"],
        ["Where is the apple?", "on the counter, please"],
        ["don't touch the apple", "in the bowl"],
        ["don't slice the apple", "no, the bread"],
        ["I want breakfast", "no, bread"],
        ["I want breakfast", "in the pan please"],
        ["actually a salad with tomato and lettuce"],
        ["no, bread with tomato"],
        ["Not too much bread"],
        ["Sorry for the mess on the table"],
        ["You should be able to find a mug on the table"],
    ],
)
def test_what_is_said_of_something_else_corrects_nothing(later: list[str]) -> None:
    said = ["put plate 1 on the table", *later]
    assert told("Kitchen1", *said)[:2] == ({"plate 1: now on the dining table"}, [])
    assert not robot_in("Kitchen1").is_order([Turn("", each) for each in said])


@pytest.mark.parametrize(
    ("said", "notes"),
    [
        (["slice the apple", "I said the apple"], ["The apple is sliced already."]),
        (["put the apple on the table and slice the bread", "I said the apple"],
         ["The apple is on the dining table already."]),
        (["fill the mug with water", "no, wine"], ["I did not understand: no, wine."]),
    ],
)  # fmt: skip
def test_what_is_said_again_is_of_its_own_order(said: list[str], notes: list[str]) -> None:
    assert told("Kitchen1", *said) == (told("Kitchen1", *said[:1])[0], notes, "")


def test_a_thing_that_is_named_first_goes_where_it_should_and_nothing_else_does() -> None:
    said = ["Put the pillow on the chair", "The laptop? Not on the chair, on the bed"]
    assert told("Bedroom1", *said)[0] == {"pillow 1: now on the chair", "laptop: now on the bed"}


@pytest.mark.parametrize(
    ("between", "changes", "notes"),
    [
        ("turn on the coffee machine", {"coffee machine: on"}, []),
        ("put the tomato in the fridge", {"tomato: now in the fridge"}, []),
        ("open drawer 2", {"drawer 2: open"}, []),
    ],
)
def test_a_place_that_is_named_wrong_is_that_of_the_order_that_named_it(
    between: str, changes: set[str], notes: list[str]
) -> None:
    said = ["put the bread on the dining table", between, "I meant the shelf, not the table."]
    found = told("Kitchen1", *said)
    assert found[0] == changes | {"bread: now on the shelf"}
    assert found[1] == notes


def test_a_wrong_place_that_no_order_named_undoes_nothing() -> None:
    found = told("Kitchen1", "turn on the coffee machine", "I meant the counter, not the table.")
    assert found[0] == told("Kitchen1", "turn on the coffee machine")[0]
    assert found[1] == ["I did not understand: i meant the counter, not the table."]


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("Bedroom1", ["put the book on the bed", "no, the other book"],
         {"book 2: now on the bed"}),
        ("Bedroom1", ["put book 1 on the bed", "not that one, the other one"],
         {"book 2: now on the bed"}),
        ("Bedroom1", ["put the pillow on the floor", "no, the other pillow", "no, the other one"],
         {"pillow 1: now on the floor"}),
        ("Bedroom1", ["bring me the book", "wrong one, the other one please"],
         {"book 2: now in the robot's hand"}),
        ("Kitchen1", ["bring me the knife", "not that one, the butter knife"],
         {"butter knife: now in the robot's hand"}),
        ("Kitchen1", ["bring me the knife", "no, the butter knife"],
         {"butter knife: now in the robot's hand"}),
        ("LivingRoom1", ["turn off the lamp", "no, the other one"],
         {"floor lamp: no longer on"}),
        ("LivingRoom1", ["put the pillow on the armchair", "no, the other armchair"],
         {"pillow 1: now on armchair 2"}),
        ("LivingRoom1",
         ["put the pillow on the armchair", "no, the other armchair", "no, the other pillow"],
         {"pillow 2: now on armchair 1"}),
    ],
)  # fmt: skip
def test_the_other_of_two_takes_the_place_of_the_first(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said) == (changes, [], "")


LIGHTS_OUT = {"floor lamp: no longer on", "light switch: no longer on"}


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("LivingRoom1", ["turn all the lights off", "not the desk lamp"], LIGHTS_OUT),
        ("LivingRoom1", ["turn all the lights off", "all but the desk lamp"], LIGHTS_OUT),
        ("LivingRoom1", ["turn all the lights off", "except the desk lamp", "undo that"],
         {*LIGHTS_OUT, "desk lamp: no longer on"}),
        ("LivingRoom1", ["put all the pillows on the sofa", "all but pillow 2"], set()),
        ("LivingRoom1", ["put the pillows on the floor. Not pillow 2."],
         {"pillow 1: now on the floor"}),
        ("Kitchen1", ["open all the drawers", "all but drawer 1"], {"drawer 2: open"}),
    ],
)  # fmt: skip
def test_what_was_not_meant_of_all_goes_back(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said)[0] == changes


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("LivingRoom1",
         ["turn the desk lamp off", "the floor lamp too", "turn them back on"], set()),
        ("LivingRoom1", ["turn the desk lamp off", "the floor lamp too", "turn it back on"],
         {"desk lamp: no longer on"}),
        ("LivingRoom1", ["put the book on the sofa", "and the laptop", "put them on the desk"],
         {"book 2: now on the desk", "laptop: now on the desk"}),
    ],
)  # fmt: skip
def test_they_are_what_an_order_was_for_and_what_was_added_to_it(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said) == (changes, [], "")


def test_the_burner_under_what_is_full_is_the_one_that_is_meant() -> None:
    said = ["fill the pot with water", "turn on the burner"]
    assert "stove burner 4: on" in told("Kitchen1", *said)[0]
    assert "stove burner 1: on" in told("Kitchen1", said[1])[0]


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ("Bedroom1", ["turn on the lamp", "no, the other lamp"]),
        ("LivingRoom1", ["open the drawer", "no, the other drawer"]),
        ("Bedroom1", ["put the book on the bed", "put the pillow on the floor",
                      "no, the other book"]),
    ],
)  # fmt: skip
def test_which_other_one_is_meant_is_not_guessed(scene: str, said: list[str]) -> None:
    before, _, _ = told(scene, *said[:-1])
    assert told(scene, *said) == (before, [f"I did not understand: {said[-1]}."], "")


def test_what_is_cut_has_no_other_one() -> None:
    changes, notes, _ = told("Kitchen1", "slice the tomato", "no, the other one")
    assert changes == {"tomato: sliced"}
    assert notes == ["I did not understand: no, the other one."]
