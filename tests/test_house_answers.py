"""What the home robot answers from the metadata."""

from __future__ import annotations

import pytest

from goalscope.envs.house.answers import answered
from goalscope.types import Turn
from heard import robot_in, told
from talks import Talk

HOUSE = [
    {
        "objectId": "Fridge|1",
        "objectType": "Fridge",
        "receptacle": True,
        "openable": True,
        "isOpen": False,
    },
    {"objectId": "CounterTop|1", "objectType": "CounterTop", "receptacle": True},
    {"objectId": "Egg|1", "objectType": "Egg", "parentReceptacles": ["Fridge|1"]},
    {
        "objectId": "Mug|1",
        "objectType": "Mug",
        "parentReceptacles": ["CounterTop|1"],
        "isDirty": True,
    },
    {"objectId": "Mug|2", "objectType": "Mug", "isPickedUp": True, "isDirty": False},
]


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("Where is the egg?", "The egg is in the fridge."),
        ("where are the mugs", "Mug 1 is on the counter; mug 2 is in my hand."),
        ("Is the fridge open?", "No."),
        ("is the refrigerator closed", "Yes."),
        ("Which is it?", None),
        ("Are the mugs dirty?", "Yes: mug 1."),
        ("What is in the fridge?", "There: egg."),
        ("What's on the counter?", "There: mug 1."),
        ("is there an egg in the fridge?", "Yes: egg."),
        ("Is the egg on the counter?", "No."),
        ("do you have a knife?", "I see no such thing here."),
        ("How many mugs are there?", "2."),
        ("what are you holding?", "I am holding: mug 2."),
        ("Can you put the mug in the fridge?", None),
        ("could you open the fridge?", None),
        ("do you have a minute?", None),
        ("what should we cook?", None),
        ("put the mug away", None),
        ("", None),
    ],
)
def test_questions_are_answered_from_the_metadata(question: str, answer: str | None) -> None:
    assert answered(question, HOUSE) == answer


SLICED = [
    {"objectId": "Bread|1", "objectType": "Bread", "isSliced": True, "pickupable": True},
    {"objectId": "Bread|1|Bread_0", "objectType": "Bread", "isSliced": False, "pickupable": True},
    {"objectId": "Vase|1", "objectType": "Vase", "isBroken": True, "pickupable": True},
]


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("Where is the bread?", "Bread 1 is in the room."),
        ("How many breads are there?", "1."),
        ("Is the bread sliced?", "Yes: bread."),
        ("Is the vase broken?", "Yes."),
        ("Where is the vase?", "The vase is broken."),
        ("Where is the safe?", "I see no such thing here."),
    ],
)
def test_what_is_in_pieces_is_left_out_unless_asked_about(question: str, answer: str) -> None:
    named = {"Bread|1": "bread", "Bread|1|Bread_0": "bread 1", "Vase|1": "vase"}
    assert answered(question, SLICED, named) == answer


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("Did you move the apple?", "Yes. The apple is on counter 2."),
        ("Have you put the apple in the fridge yet?", "Yes. The apple is on counter 2."),
        ("Did you put the apple in the microwave?", "No. The apple is on counter 2."),
        ("have you moved the tomato", "No. The tomato is on counter 1."),
        ("What did you throw away?", "Bread."),
        ("Have you thrown away the bread?", "Yes. The bread is in the garbage can."),
        ("What did you put in the fridge?", "Apple."),
        ("What have you sliced?", "Nothing."),
        ("Did you wash the mug?", "Yes. Mug 1 is clean."),
        ("Did you wash mug 2?", "Mug 2 is clean."),
        ("Have you closed the fridge?", "The fridge is closed."),
        ("Ok, did you open the window?", "No."),
        ("did you open the microwave?", "Yes, but that is no longer so."),
        ("Did you move anything?", "Yes: apple, bread."),
        ("Did you break the vase?", "I see no such thing here."),
        ("Did you move the guitar?", "I see no such thing here."),
        ("Did you like it?", None),
        ("Have you seen the spoon?", "The spoon is in drawer 2."),
        ("Did you leave the window open?", None),
        ("What did you mean?", None),
        ("Did you close the fridge? If not, close it.", None),
        (f"Did you move {'the apple and ' * 500}it?", None),
    ],
)
def test_what_was_done_is_told_by_the_acts(question: str, answer: str | None) -> None:
    orders = (
        "put the apple in the fridge",
        "open the microwave",
        "close the microwave",
        "wash mug 1",
        "throw the bread away",
    )
    told("Kitchen1", *orders, "put the apple back")
    assert robot_in("Kitchen1").answer(question) == answer


@pytest.mark.parametrize(
    ("said", "question", "answer"),
    [
        ([], "which mug is dirty?", "Mug 1."),
        ([], "Is anything still on?", "Light switch."),
        ([], "is anything broken?", "None."),
        (["open cabinet 1"], "which cabinets are open now?", "Cabinet 1."),
        (["put the knife on the table"], "where did you put it?",
         "The knife is on the dining table."),
        (["open cabinet 1"], "What's in it?", "There: plate 1, plate 2."),
        (["put the knife on the table"], "Is it dirty?", "No."),
        ([], "where did you put it?", None),
        ([], "which mug is the best?", None),
    ],
)  # fmt: skip
def test_what_is_in_a_state_and_what_was_acted_on_last(
    said: list[str], question: str, answer: str | None
) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    talk = Talk(robot)
    for each in said:
        talk.say(each)
    assert robot.answer(question) == answer


@pytest.mark.parametrize(
    ("said", "answer"),
    [
        (["where's the fork?", "and the bowl?"], "The bowl is on the dining table."),
        (["is the fridge open?", "and the fork?", "what about the microwave?"], "No."),
        (["clean the plate", "is it clean now?"], "Yes: plate 1, plate 2."),
        (["wash the mug", "put the apple in the fridge", "where is it?"],
         "The apple is in the fridge."),
        (["put the apple in the fridge", "is it closed?"], "Yes."),
        (["where are the plates?", "are they clean?"], "Yes: plate 1, plate 2."),
        (["and the fridge?"], None),
        (["put the apple in the fridge", "and the bread?"], None),
    ],
)  # fmt: skip
def test_what_a_question_is_about_was_said_before(said: list[str], answer: str | None) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    talk = Talk(robot)
    for each in said[:-1]:
        talk.say(each)
    turns = [*(round.turn for round in talk.rounds), Turn("", said[-1])]
    assert robot.answer(said[-1], turns) == answer


def test_where_somebody_left_a_thing_is_where_it_is() -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    where = robot.answer("Where are my keys?")
    assert where is not None
    assert robot.answer("Where did I leave my keys?") == where
    assert robot.answer("Where have I put the keys?") == where
