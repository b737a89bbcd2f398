"""What is corrected or continued, and what was done once."""

from __future__ import annotations

import pytest

from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.taking_back import IDLE
from goalscope.types import Action, InvalidInputError, Turn
from heard import follow, robot_in, told, turns
from talks import Talk

LAMP = "desk lamp: no longer on"
LAPTOP = {"laptop: now on the sofa"}
PAPER = {"newspaper: now in the robot's hand"}


def test_what_was_met_once_is_not_met_anew() -> None:
    robot = robot_in("Bathroom1")
    robot.reset()
    said = turns("give me the toilet paper", "wash the cloth")
    for n in (1, 2):
        for action in robot.requests(said[:n]):
            assert robot.step(action).ok
    assert robot.step(Action("put", "toilet paper 2", destination="counter")).ok
    assert robot.requests([*said, *turns("thanks")]) == []
    assert robot.requests([*said, *turns("Task completed")]) == []
    assert robot.requests([*said, *turns("give me the toilet paper")]) != []


def test_an_order_that_was_never_met_waits_but_not_beyond_the_end() -> None:
    said = ["crack the egg and cook it", "yes"]
    ask = "May I cook cracked egg 1?"
    robot = robot_in("Kitchen1")
    robot.reset()
    robot.step(Action("break", "egg 1"))
    orders = [Turn("", said[0]), Turn("May I break egg 1?", "yes")]
    for later in ("great", "thanks"):
        plan = robot.requests([*orders, *turns(later)])
        assert [robot.permission(each, orders) for each in plan] == [ask]
    assert robot.requests([*orders, *turns("The task is complete.")]) == []


def test_an_order_is_for_the_one_thing_that_it_was_met_with() -> None:
    said = ["put the egg in the microwave", "crack egg 1 and fry it", "thanks"]
    assert told("Kitchen1", *said)[0] == {"egg 1: broken"}
    assert follow("Kitchen1", "put two plates in the sink", "put plate 1 on the table", "ok") == []


def test_what_was_so_from_the_start_is_not_kept_so() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    assert robot.requests(turns("close the fridge")) == []
    robot.step(Action("open", "fridge"))
    assert robot.requests(turns("close the fridge", "good")) == []
    assert robot.requests(turns("close the fridge")) == [Action("close", "fridge")]


def test_it_in_put_it_back_is_what_was_ordered_not_what_the_agent_asked_about() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    order = turns("Put the tomato in the fridge")
    robot.step(robot.requests(order)[0])
    coffee = "How about a cup of coffee?"
    back = robot.requests([*order, Turn(coffee, "Actually, no, put it back")])
    assert [each.target for each in back] == ["tomato"]
    wash = robot.requests([*order, Turn("Is the mug dirty?", "Yes, wash it")])
    assert [each.target for each in wash] == ["mug 1"]


@pytest.mark.parametrize(
    "later",
    [
        "No wait, the newspaper instead",
        "I mean the newspaper",
        "not the remote, the newspaper",
        "Sorry, the newspaper.",
        "bring me the newspaper instead",
    ],
)
def test_a_correction_is_done_instead(later: str) -> None:
    assert told("LivingRoom1", "bring me the remote", later) == (PAPER, [], "")


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (
            ["turn off the desk lamp", "the floor lamp instead"],
            {"floor lamp: no longer on"},
            [],
        ),
        (["put the laptop on the sofa", "put it on the desk instead"],
         {"laptop: now on the desk"}, []),
        (["put the laptop on the sofa", "No wait, put it on the desk"],
         {"laptop: now on the desk"}, []),
        (["put the laptop on the sofa", "I changed my mind, put it all back"], set(), []),
        (["put the laptop on the sofa", "the newspaper too"],
         {*LAPTOP, "newspaper: now on the sofa"}, []),
        (["put the laptop on the sofa", "the other one instead"], LAPTOP,
         ["I did not understand: the other one instead."]),
        (["put the laptop on the sofa", "I'd like tea instead"], LAPTOP, []),
        (["put the laptop on the sofa", "don't touch the other ones"], LAPTOP, []),
    ],
)  # fmt: skip
def test_corrections_put_back_what_they_replace(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("LivingRoom1", *said)[:2] == (changes, notes)


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["pour the wine into the cup", "make coffee"],
         {"cup: filled with wine", "mug 2: filled with coffee"}),
        (["make coffee", "pour the wine into the cup"],
         {"cup: filled with wine", "mug 2: filled with coffee"}),
        (["make coffee", "wash mug 1"], {"mug 2: filled with coffee", "mug 1: no longer dirty"}),
        (["make coffee", "put it on the table"],
         {"mug 2: filled with coffee, now on the dining table"}),
        (["pour the wine into the cup", "fill the cup with coffee"], {"cup: filled with wine"}),
        (["pour the wine into the cup", "undo"], set()),
    ],
)  # fmt: skip
def test_another_drink_takes_another_vessel(said: list[str], changes: set[str]) -> None:
    assert told("Kitchen1", *said)[0] == changes


BOTTLE = "spray bottle: now on the counter"
SPONGE = "sponge: now on the counter"
SOAP = "soap bottle: now on the counter"


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("And the sponge, it's in the drawer, I think. Then the liquid soap from the shelf.",
         {BOTTLE, SPONGE, SOAP}),
        ("The sponge, too", {BOTTLE, SPONGE}),
        ("then the soap bottle", {BOTTLE, SOAP}),
        ("and the sponge, which is probably in the cabinet", {BOTTLE, SPONGE}),
        ("It's in the drawer, I think", {BOTTLE}),
        ("The sponge is in the drawer.", {BOTTLE}),
        ("Where is the sponge? It's in the drawer, I guess.", {BOTTLE}),
    ],
)  # fmt: skip
def test_things_that_follow_continue_the_order_and_where_they_are_is_no_place_for_them(
    said: str, changes: set[str]
) -> None:
    assert told("Bathroom1", "put the spray bottle on the counter", said)[0] == changes


def test_which_one_is_not_meant_rules_nothing_out() -> None:
    order = "put the spray bottle and a cloth on the counter"
    said = "A clean cloth, I mean, not the one from the laundry"
    changes = {BOTTLE, "cloth 1: now on the counter"}
    already = ["Cloth 1 is on the counter already."]
    assert told("Bathroom1", order, said)[:2] == (changes, already)
    assert told("Bathroom1", order, "and the sponge", said)[:2] == ({*changes, SPONGE}, already)


def test_what_the_hand_holds_goes_back_first() -> None:
    said = ["put the sponge on the counter", "give me the toilet paper", "put it all back"]
    plan = follow("Bathroom1", *said)
    assert [each[:12] for each in plan] == ["put: toilet ", "put: sponge "]


@pytest.mark.parametrize(
    ("said", "note"),
    [
        ("use up all the toilet paper", "I cannot use up the toilet paper."),
        ("use up the spray", "I cannot use up the spray bottle."),
    ],
)
def test_what_cannot_be_used_up_is_told(said: str, note: str) -> None:
    assert told("Bathroom1", said)[:2] == (set(), [note])


def test_what_was_done_is_told() -> None:
    told("LivingRoom1", "put the laptop on the sofa")
    robot = robot_in("LivingRoom1")
    for question in ("What did you do?", "what have you done so far", "What has changed?"):
        assert robot.answer(question) == (
            "The robot's hand is empty. Changed so far: laptop: now on the sofa."
        )
    assert robot.answer("What did you mean?") is None
    robot.reset()
    assert "Nothing has been changed yet." in (robot.answer("what did you do?") or "")


def test_what_is_made_of_a_thing_is_told_when_it_is_cooked() -> None:
    turns_ = [Turn("", "crack egg 1 and cook it"), Turn("May I cook cracked egg 1?", "yes")]
    robot = robot_in("Kitchen1")
    robot.reset()
    for n in (1, 2):
        for action in (*robot.requests(turns_[:n]), *robot.requests(turns_[:n])):
            if not robot.permission(action, turns_[:n]):
                robot.step(action)
    assert robot.status().splitlines()[2:] == ["- egg 1: broken", "- cracked egg 1: cooked"]


def test_scenes_are_found_in_any_case() -> None:
    assert load_scene("kitchen1").name == load_scene("KITCHEN1").name == load_scene("Kitchen1").name
    with pytest.raises(InvalidInputError, match="There is no scene 'kitchen'"):
        load_scene("kitchen")


SINK = "now in the sink basin"


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (["open cabinet 1", "open all the cabinets", "undo that"], {"cabinet 1: open"}, []),
        (["open cabinet 1", "close all the cabinets", "undo that"], {"cabinet 1: open"}, []),
        (["open a cabinet", "open all the cabinets", "undo that"], {"cabinet 1: open"}, []),
        (["open all the cabinets", "close cabinet 1", "undo that"],
         {"cabinet 1: open", "cabinet 2: open", "cabinet 3: open"}, []),
        (["put mug 1 in the sink", "put all the mugs in the sink", "undo that"],
         {f"mug 1: {SINK}"}, []),
        (["put the mug in the sink", "put all the mugs in the fridge", "undo that"],
         {f"mug 2: {SINK}"}, []),
        (["put a mug in the sink", "fill it with water", "fill it with coffee"],
         {f"mug 2: filled with water, {SINK}"}, ["Mug 2 is filled already."]),
        (["fill the mug with coffee", "fill the mug with water", "undo that"],
         {"mug 2: filled with coffee"}, [IDLE]),
        (["open cabinet 1", "open cabinet 2", "close everything", "undo that"],
         {"cabinet 1: open", "cabinet 2: open"}, []),
        (["turn on the light", "turn everything off", "undo that"], set(), []),
        (["hang on a minute"], set(), []),
        (["open the fridge", "hold on just one second, please"], {"fridge: open"}, []),
        (["Hang on a minute, open the fridge"], {"fridge: open"}, []),
    ],
)  # fmt: skip
def test_what_earlier_words_asked_for_stays(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, notes)


@pytest.mark.parametrize(
    "said",
    [
        "throw the newspaper away. no, keep it",
        "bring me the remote, no, don\u2019t",
        "Put the newspaper on the armchair. Actually, leave it.",
    ],
)
def test_what_is_called_back_in_the_same_breath_is_not_done(said: str) -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    assert robot.requests(turns(said)) == []
    assert robot.is_order(turns(said))


@pytest.mark.parametrize(
    "said", ["bring me a cup of coffee please", "Could you get me some hot coffee?"]
)
def test_coffee_that_is_to_be_brought_is_made(said: str) -> None:
    assert any(each.startswith("fill with coffee: ") for each in follow("Kitchen1", said))
    assert follow("Kitchen1", "bring me a cup") == ["pick up: cup"]


@pytest.mark.parametrize(
    "said",
    [
        "not that book, the one on the desk",
        "no, the book from the desk",
        "wrong book. I meant the one on the desk",
        "I meant the book that is on the desk, please",
    ],
)
def test_another_thing_of_the_kind_by_its_place_takes_the_place_of_the_first(said: str) -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    talk = Talk(robot)
    talk.say("put the book on the sofa")
    done = [str(each.action) for each in talk.say(said).results]
    assert done == ["put: book 2 -> shelf 2", "put: book 1 -> sofa"]
    assert not talk.say("thanks").results


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["put the book on the sofa, no, the one on the desk"], {"book 1: now on the sofa"}),
        (["Put the book on the sofa. No, the one on the desk."], {"book 1: now on the sofa"}),
        (
            ["put the book on the sofa", "no, the one on the desk", "no, the one on the shelf"],
            {"book 2: now on the sofa"},
        ),
        (
            ["put the book on the sofa", "no, the one on the desk and turn on the TV"],
            {"book 1: now on the sofa", "TV: on"},
        ),
        (
            ["put the book on the sofa", "no, on the desk, and then turn on the TV"],
            {"book 2: now on the desk", "TV: on"},
        ),
        (
            ["put the book on the sofa", "no, the laptop and turn on the TV"],
            {"laptop: now on the sofa", "TV: on"},
        ),
        (
            ["bring me the book", "not that one, the one on the desk", "thanks"],
            {"book 1: now in the robot's hand"},
        ),
        (
            ["bring me the book", "not that one, the one on the desk", "undo that"],
            {"book 2: now in the robot's hand"},
        ),
    ],
)
def test_a_correction_holds_in_one_breath_with_orders(said: list[str], changes: set[str]) -> None:
    assert told("LivingRoom1", *said)[0] == changes


@pytest.mark.parametrize("said", ["make some toast and a coffee", "make a coffee and some toast"])
def test_coffee_beside_toast_is_made(said: str) -> None:
    changes, notes, _ = told("Kitchen1", said)
    assert any("filled with coffee" in each for each in changes)
    assert notes == ['I can cook the bread only once it is sliced: say "slice the bread".']


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("Kitchen1", ["put the mug in the sink", "and the other mug"],
         {f"mug 1: {SINK}", f"mug 2: {SINK}"}),
        ("Kitchen1", ["put the mug in the sink", "the other one too", "undo that", "thanks"],
         {f"mug 2: {SINK}"}),
        ("Kitchen1", ["put mug 1 in the sink", "the other one too"],
         {f"mug 1: {SINK}", f"mug 2: {SINK}"}),
        ("Bathroom1", ["turn on the shower", "turn off the water"], set()),
        ("Bathroom1", ["turn on the tap", "and off again"], set()),
        ("Kitchen1", ["could you bring me a glass of water?"],
         {"cup: filled with water, now in the robot's hand"}),
        ("Kitchen1", ["please don't bring me a glass of water"], set()),
        ("Kitchen1", ["I don't want you to bring me a glass of water"], set()),
        ("Kitchen1", ["bring me the mug next to the bowl"], {"mug 1: now in the robot's hand"}),
        ("Kitchen1", ["turn off the light", "bring me the book"], {"light switch: no longer on"}),
        ("LivingRoom1", ["turn off the lamp next to the sofa"], {"floor lamp: no longer on"}),
        ("LivingRoom1", ["turn off the lamp"], {"desk lamp: no longer on"}),
    ],
)  # fmt: skip
def test_which_thing_is_meant_by_what_is_said_of_it(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said)[0] == changes


@pytest.mark.parametrize(
    "said", ["crack it", "crack it into the bowl", "Open the window. Crack it"]
)
def test_what_is_cracked_is_an_egg(said: str) -> None:
    assert told("Kitchen1", "get an egg", said)[2] == "May I break egg 1?"


@pytest.mark.parametrize("said", ["pull it back", "push it again", "push the armchair"])
def test_what_was_pushed_is_not_pushed_again_and_that_is_told(said: str) -> None:
    assert told("LivingRoom1", "push the armchair", said)[1] == [
        "I have moved the armchair already."
    ]


def test_several_things_are_pushed_each_once() -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    talk = Talk(robot)
    done = [str(each.action) for each in talk.say("push both armchairs").results]
    assert done == ["push: armchair 1", "push: armchair 2"]
    assert not talk.say("thanks").results


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["turn the TV on and the lamp off"], {"TV: on", LAMP}),
        (["turn on the TV and the lamp off"], {"TV: on", LAMP}),
        (["turn the lamp off and the TV on"], {"TV: on", LAMP}),
        (["turn the lamp and the laptop off"], {LAMP, "laptop: no longer on"}),
        (["turn the TV on and put the remote on the sofa"],
         {"TV: on", "remote control: now on the sofa"}),
        (["put the laptop on the sofa", "put the remote on the sofa",
          "I never asked for the laptop. Put it back"], {"remote control: now on the sofa"}),
        (["put the laptop on the sofa", "I didn't ask for the laptop, put it back"], set()),
        (["put the laptop and the remote on the sofa", "I only wanted the laptop there"], LAPTOP),
    ],
)  # fmt: skip
def test_each_thing_is_turned_as_said_and_it_is_what_was_not_asked_for(
    said: list[str], changes: set[str]
) -> None:
    assert told("LivingRoom1", *said)[0] == changes


@pytest.mark.parametrize(
    "said",
    [
        "There's an apple on the counter, put it in the fridge",
        "I found an apple, could you put it in the fridge?",
        "I can't reach the apple. Put it in the fridge, please",
        "The apple is still out. Put it in the fridge",
    ],
)
def test_it_is_what_the_same_words_introduce(said: str) -> None:
    changes = told("Kitchen1", "put the egg in the bowl", said)[0]
    assert changes == {"egg 1: now in the bowl", "apple: now in the fridge"}


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("LivingRoom1", ["put the books on the coffee table", "not the one on the desk", "thanks"],
         {"book 2: now on the coffee table", "book 3: now on the coffee table"}),
        ("LivingRoom1", ["put all the books on the coffee table. Not the one on the desk"],
         {"book 2: now on the coffee table", "book 3: now on the coffee table"}),
        ("LivingRoom1",
         ["please don't move the credit card", "put the things on the dresser in the box"],
         {"vase: now in the box"}),
        ("LivingRoom1", ["I want to watch a movie"], set()),
        ("LivingRoom1", ["put the laptop on the sofa", "how nice is that?", "undo that"], set()),
    ],
)  # fmt: skip
def test_what_is_left_out_stays(scene: str, said: list[str], changes: set[str]) -> None:
    assert told(scene, *said)[0] == changes


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("Bedroom1", ["throw away the boots", "undo that"], set()),
        ("Bedroom1", ["throw away the boots", "put them back"], set()),
        ("Bedroom1", ["throw away the boots", "put the boots on the floor"], set()),
        ("Kitchen1", ["put the apple in the bowl", "put it on the table"],
         {"apple: now on the dining table"}),
        ("Kitchen1", ["put the apple on the floor", "throw it away", "put it on the floor"],
         {"apple: now on the floor"}),
    ],
)  # fmt: skip
def test_what_is_in_something_is_not_on_what_that_stands_on(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said)[0] == changes


@pytest.mark.parametrize(
    ("scene", "said", "changes"),
    [
        ("LivingRoom1", ["Never turn off the floor lamp.", "Turn off the lamp."],
         {"desk lamp: no longer on"}),
        ("Kitchen1", ["Don't put the apple on a plate on the dining table."], set()),
        ("Kitchen1", ["Bring me a mug of coffee, please."],
         {"mug 2: filled with coffee, now in the robot's hand"}),
        ("Kitchen1", ["slice the bread", "put slice of bread 1 and slice of bread 2 on plate 2"],
         {"bread: sliced", "slice of bread 1: now on plate 2", "slice of bread 2: now on plate 2"}),
        ("LivingRoom1", ["turn off the lamps"],
         {"floor lamp: no longer on", "desk lamp: no longer on"}),
        ("Kitchen1", ["put the tomato on a plate on the dining table"],
         {"plate 1: now on the dining table", "tomato: now on plate 1"}),
        ("Kitchen1", ["slice the bread", "put slice of bread 1 on plate 2"],
         {"bread: sliced", "slice of bread 1: now on plate 2"}),
    ],
)  # fmt: skip
def test_a_plate_goes_where_it_is_to_stand_and_pieces_that_left_the_rest_are_told(
    scene: str, said: list[str], changes: set[str]
) -> None:
    assert told(scene, *said)[0] == changes


def test_what_was_done_with_one_thing_is_told_of_that_alone() -> None:
    robot = robot_in("Bathroom1")
    robot.reset()
    assert robot.step(Action("put", "bar of soap 1", destination="sink basin")).ok
    assert robot.answer("What did you do with the soap?") == "bar of soap 1: now in the sink basin."
    assert robot.answer("What did you do with the towel?") == "I changed nothing about that."
    assert "cabinet 1" in (robot.answer("Is there any toilet paper left?") or "")


def test_of_several_things_to_be_brought_it_is_only_guessed_where_they_go() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    offers = robot.actions(["bread", "wine bottle", "cup"], turns("bring me the wine and the cup"))
    assert {each.name for each in offers} == {"put"}
    assert {each.target for each in offers} == {"wine bottle", "cup"}
    assert "cup" not in {each.destination for each in offers}
    later = turns("bring me the wine and the cup", "A bit of lettuce would be nice.")
    assert "lettuce" in {each.target for each in robot.actions(["lettuce"], later)}
