"""Where the robot may guess, what it says where it does not, and how it takes things back."""

from __future__ import annotations

import pytest

from goalscope.envs.house.answers import ABLE
from goalscope.taking_back import IDLE, NOT_PLAIN, NOTHING
from goalscope.types import Action, Turn
from heard import heard, robot_in, told


@pytest.mark.parametrize(
    "said",
    [
        ["cook an egg"],
        ["bring me a clean fork and a knife"],
        ["turn the light off"],
        ["Thanks! Now turn the light off, please."],
        ["why did you do that? put it back"],
        ["I'm hungry, so bring me the apple"],
        ["lock up the apple too"],
        ["do the dishes"],
        ["don't touch the eggs"],
        ["put the egg in the fridge", "the tomato too"],
        ["put the cups and the mug in the sink", "not that one, I meant only the mug"],
        ["can you put the apple in the fridge?"],
        ["is the fridge open?"],
    ],
)
def test_an_order_leaves_nothing_to_guess(said: list[str]) -> None:
    assert robot_in("Kitchen1").is_order([Turn("", each) for each in said])


@pytest.mark.parametrize(
    "said",
    [
        "tidy up a bit",
        "could you tidy up?",
        "I'm hungry",
        "it's too dark in here",
        "make me a sandwich",
        "set the table for 2",
        "I'd like breakfast",
        "I want a snack",
        "bring me something to eat",
        "put the apple away",
        "put the apple away and turn off the light",
        "Turn the light off. I'm hungry.",
        "clean up",
        "clear up this mess",
        "I don't like the mess",
        "the tomato too",
        "if you find the time, turn the light off",
        "yes please",
        "",
    ],
)
def test_an_aim_leaves_how_to_guess(said: str) -> None:
    assert not robot_in("Kitchen1").is_order([Turn("", said)])


@pytest.mark.parametrize(
    "said",
    ["clear the table", "Can you clear off the counter?", "tidy the dining table for dinner"],
)
def test_nothing_else_is_guessed_for_an_order_to_clear_one_thing(said: str) -> None:
    for before in ((), ("open the fridge",)):
        assert robot_in("Kitchen1").is_order([Turn("", each) for each in (*before, said)])
        (note,) = told("Kitchen1", *before, said)[1]
        assert note.startswith("I did not understand: ")


HOW = ' Please say what goes where, as in "put the mug in the sink".'
CRACKED = 'I can cook an egg only once it is cracked: say "crack the egg".'
SLICED = 'I can cook the bread only once it is sliced: say "slice the bread".'


@pytest.mark.parametrize(
    ("said", "changes", "notes", "question"),
    [
        (["cook an egg"], set(), [CRACKED], ""),
        (["fry an egg in the pan"], set(), [CRACKED], ""),
        (["don't cook the egg"], set(), [], ""),
        (["crack the egg and cook it"], set(), [], "May I break egg 1?"),
        (["crack egg 1 and cook it"], {"egg 1: broken"}, [], "May I cook cracked egg 1?"),
        (["crack egg 1", "cook it"], {"egg 1: broken"}, [], "May I cook cracked egg 1?"),
        (["toast the bread"], set(), [SLICED], ""),
        (
            ["heat up some bread"],
            set(),
            ['I can cook the bread only once it is sliced: say "slice the bread".'],
            "",
        ),
        (["do the laundry"], set(), [f"I did not understand: do the laundry.{HOW}"], ""),
        (["I do the laundry"], set(), [], ""),
        (["do the lights work"], set(), [], ""),
        (["I'm going to break the bottle, slice the bread"], set(), [], ""),
        (["warm the milk"], set(), ["I did not understand: warm the milk."], ""),
        (["make me a sandwich"], set(), [f"I did not understand: make me a sandwich.{HOW}"], ""),
        (["set the table for 2"], set(), [f"I did not understand: set the table for 2.{HOW}"], ""),
        (["lock up the apple"], set(), ["There is no safe here."], ""),
        (["do the dishes"], {"mug 1: no longer dirty"}, [], ""),
        (["clean everything"], {"mug 1: no longer dirty"}, [], ""),
    ],
)
def test_what_cannot_be_done_is_told_with_what_would_do(
    said: list[str], changes: set[str], notes: list[str], question: str
) -> None:
    assert told("Kitchen1", *said) == (changes, notes, question)


def test_a_cracked_egg_is_cooked_and_carried() -> None:
    robot = robot_in("Kitchen1")
    told("Kitchen1", "crack egg 1, put it in the pan and cook the egg")
    cracked = [each for each in robot.metadata["objects"] if each["objectType"] == "EggCracked"]
    assert [each["isCooked"] for each in cracked] == [True]
    assert any("Pan" in place for place in cracked[0]["parentReceptacles"])


DARK = "light switch: no longer on"
APPLE = "apple: now in the fridge"
HELD = "apple: now in the robot's hand"
TABLE = "apple: now on the dining table"


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (["turn the light off", "turn it back on"], set(), []),
        (["turn the light off", "turn the lights back on, please"], set(), []),
        (["turn the light off", "switch back on the light"], set(), []),
        (["turn the light off", "undo that"], set(), []),
        (["open the fridge", "Oops, can you undo that please?"], set(), []),
        (["open the fridge", "thanks", "undo what you just did"], set(), []),
        (["bring me the apple", "undo it"], set(), []),
        (["put two plates on the table", "undo that"], set(), []),
        (["put the apple in the fridge", "turn the light off", "undo that"], {APPLE}, []),
        (
            ["put the apple in the fridge", "turn the light off", "undo that", "undo that"],
            set(),
            [],
        ),
        (
            ["put mug 2 in the sink", "put mug 2 on the table", "undo that"],
            {"mug 2: now in the sink basin"},
            [],
        ),
        (["put the apple in the fridge", "turn the light off", "undo everything"], set(), []),
        (
            ["put the apple in the fridge and open drawer 1", "put everything back how it was"],
            set(),
            [],
        ),
        (["put the apple and the tomato in the sink", "put everything back"], set(), []),
        (["put everything back"], set(), ["They are where they were already."]),
        (["open the fridge", "undo that", "open the fridge"], {"fridge: open"}, []),
        (["open the fridge", "don't undo that"], {"fridge: open"}, []),
        (["turn on the light", "undo that"], set(), [IDLE]),
        (
            ["clean mug 1", "undo that"],
            {"mug 1: no longer dirty"},
            ["I cannot undo that: clean mug 1."],
        ),
        (["undo that"], set(), [NOTHING]),
        (["open the fridge", "I didn't want that. Undo it."], set(), []),
        (["put the apple in the fridge", "take that back"], set(), []),
        (["take the apple back to the fridge"], {APPLE}, []),
        (["open the fridge", "undo that and turn the light off"], {DARK}, []),
        (["open the fridge", "undo that and turn the light off", "undo that"], set(), []),
        (["open the fridge", "if it is empty, undo that"], {"fridge: open"}, [NOT_PLAIN]),
        (
            ["open the fridge", "turn the light off", "don't touch the apple", "undo that"],
            {"fridge: open", DARK},
            [IDLE],
        ),
        (
            ["put the apple in the fridge", "put the apple in the fridge later", "undo that"],
            {APPLE},
            [IDLE],
        ),
        (["put the apple in the fridge", "I'm hungry", "undo that"], {APPLE}, [IDLE]),
        (["put the apple in the fridge", "I'm hungry", "undo that", "undo that"], set(), []),
        (["bring me the apple", "put it in the fridge", "undo that"], {HELD}, []),
        (["put the apple in the fridge", "undo that. Put it on the table"], {TABLE}, []),
    ],
)
def test_what_was_ordered_is_undone_or_told(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, notes)


def test_undoing_takes_leave_back() -> None:
    assert heard("slice the bread").permitted
    assert not heard("slice the bread", "undo that").permitted
    assert not heard("slice the bread", "open the fridge", "undo that").permitted


BOXED = ["put the phones and the laptop in the box"]
ONLY = {"laptop: now in the box"}
ALL = {*ONLY, "phone 1: now in the box", "phone 2: now in the box"}


@pytest.mark.parametrize(
    ("correction", "changes"),
    [
        ("not that one, I meant only the laptop", ONLY),
        ("No, sorry! I only meant the laptop.", ONLY),
        ("not the phones, just the laptop please", ONLY),
        ("only the laptop", ONLY),
        ("not the laptop", ALL - ONLY),
        ("not the laptop, I meant the watch", {"watch: now in the box"}),
        ("I just meant both phones", ALL - ONLY),
        ("not the watch, only the laptop", ALL),
    ],
)
def test_only_what_was_meant_stays(correction: str, changes: set[str]) -> None:
    assert told("LivingRoom1", *BOXED, correction)[0] == changes


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (
            ["not that one, I meant only the apple"],
            set(),
            ["I did not understand: not that one, I meant only the apple."],
        ),
        (
            ["put two eggs in the bowl", "I meant only one"],
            {"egg 1: now in the bowl", "egg 2: now in the bowl"},
            ["I did not understand: I meant only one."],
        ),
        (
            ["put the mug in the sink", "not that one, I meant mug 1"],
            {"mug 1: now in the sink basin"},
            [],
        ),
        (["open the fridge and the microwave", "only the fridge, please"], {"fridge: open"}, []),
        (
            ["slice the apple", "I only meant the bread"],
            {"apple: sliced"},
            ["I cannot undo that: slice the apple."],
        ),
        (["cook the potato and open the fridge", "I only meant the fridge"], {"fridge: open"}, []),
        (["cook the potato", "undo that"], set(), [IDLE]),
        (["put the apple in the fridge", "leave it there"], {APPLE}, []),
        (["put the apple in the fridge", "leave the apple where it is"], {APPLE}, []),
        (["put the apple in the fridge", "leave it there", "don't touch it"], set(), []),
        (["put the apple in the fridge", "leave it alone"], {APPLE}, []),
        (["put the apple in the fridge", "leave the apple", "I'm hungry"], {APPLE}, []),
    ],
)
def test_what_is_unclear_moves_nothing(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, notes)


def test_correcting_drops_leave() -> None:
    assert ("slice", "Apple", 1) in heard("slice an apple and open the fridge").permitted
    assert not heard("slice an apple and open the fridge", "I meant only the fridge").permitted


KNIFE = "I can hold one thing at a time: where should {} go?"


@pytest.mark.parametrize(
    ("said", "note"),
    [
        ("i wanted the fork and the butter knife", KNIFE.format("the fork and the butter knife")),
        ("I never got either knife", KNIFE.format("the knife")),
        ("I didn't get the knife", KNIFE.format("the knife")),
    ],
)
def test_what_was_not_brought_is_asked_for_again(said: str, note: str) -> None:
    assert told("Kitchen1", "bring me a clean fork and a knife", said) == (set(), [note], "")
    turns = [Turn("", "bring me a clean fork and a knife"), Turn("", said)]
    assert robot_in("Kitchen1").is_order(turns)


@pytest.mark.parametrize("said", ["I wanted the bread sliced", "I didn't get the bread sliced"])
def test_a_wish_of_the_past_gives_no_leave(said: str) -> None:
    assert not heard(said).permitted


@pytest.mark.parametrize(
    ("thing", "vessel"),
    [("lettuce", "mug"), ("knife", "bowl"), ("fork", "cup"), ("spatula", "mug"), ("bread", "cup")],
)
def test_nothing_is_put_unasked_where_it_would_stick_out(thing: str, vessel: str) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    offered = robot.actions([thing], [Turn("", f"I'll need the {vessel} and the {thing}")])
    kinds = {action.destination.split(" ")[0] for action in offered if action.name == "put"}
    assert kinds
    assert vessel not in kinds


def test_nothing_is_put_unasked_into_a_vessel_without_room() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    put = Action("put", "tomato", destination="bowl")
    assert put in robot.actions(["tomato"])
    assert robot.step(Action("put", "apple", destination="bowl")).ok
    assert put not in robot.actions(["tomato"])
    assert not robot.step(put).ok


@pytest.mark.parametrize(
    ("said", "answer"),
    [
        ("what can you do?", ABLE),
        ("ok, what else can you do for me", ABLE),
        ("how can you help me?", ABLE),
        ("where are the keys?", "The keys are on the side table."),
        ("what can you do with the box?", None),
        ("can you help?", None),
    ],
)
def test_questions_about_the_robot_and_plurals_are_answered(said: str, answer: str | None) -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    assert robot.answer(said) == answer


def test_many_things_are_told_in_the_plural() -> None:
    robot = robot_in("LivingRoom1")
    robot.reset()
    assert robot.step(Action("pick up", "keys")).observation == "The keys are in the robot's hand."
    assert told("Kitchen1", "bring me the keys")[1] == ["There are no keys here."]


MUG = "mug 2: filled with coffee"


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["make us some coffee, please"], {f"{MUG}, now on counter 1"}),
        (["make me a coffee", "bring it to me"], {f"{MUG}, now in the robot's hand"}),
        (["make coffee"], {MUG}),
        (["don't make me a coffee"], set()),
        (["make me a coffee later"], set()),
        (["I'll make me a coffee"], set()),
    ],
)
def test_what_is_made_for_a_person_stands_ready(said: list[str], changes: set[str]) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, [])


def test_several_things_go_where_the_goals_tell_if_there_was_talk_of_a_place() -> None:
    kitchen = robot_in("Kitchen1")
    first = Turn("", "Could you bring me the bread and an egg? I'll make it at the dining table.")
    assert not kitchen.is_order([first, Turn("", "I need a plate as well, and the knife.")])
    assert kitchen.is_order([Turn("", "I need a plate as well, and the knife.")])


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (
            ["Put the tomato in the fridge", "The apple too, it's getting far too warm."],
            {"tomato: now in the fridge", "apple: now in the fridge"},
        ),
        (["Turn everything off", "Oh wait, leave the light on, for the cat."], set()),
        (["Leave the fridge open, please"], {"fridge: open"}),
        (
            ["The apple goes in the fridge and the egg goes to the sink"],
            {"apple: now in the fridge", "egg 1: now in the sink basin"},
        ),
        (
            ["Make me a coffee", "Leave the coffee alone"],
            {"mug 2: filled with coffee, now on counter 1"},
        ),
        (["Put the apple in the sink, it's dirty"], {"apple: now in the sink basin"}),
    ],
)
def test_a_reason_after_an_order_changes_nothing(said: list[str], changes: set[str]) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, [])


def test_what_was_guessed_is_told_and_taken_back_on_ones_word() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    none, ask = "Guessed, not asked for: nothing.", [Turn("", "What did you guess?")]
    assert robot.is_order(ask)
    assert robot.unmet(ask, ()) == [none]
    for action in robot.requests([Turn("", "open the fridge")]):
        assert robot.step(action).ok
    for guess in (
        Action("put", "potato 1", destination="mug 2"),
        Action("turn on", "coffee machine"),
        Action("clean", "mug 1"),
    ):
        assert robot.step(guess).ok
    said = [Turn("", "open the fridge"), Turn("", "I'm hungry")]
    (note,) = robot.unmet([*said, *ask], ())
    assert note == "Guessed, not asked for: potato 1, coffee machine, mug 1."
    back = [*said, *ask, Turn("", "Undo what you guessed.")]
    assert robot.is_order(back)
    assert {action.target for action in robot.requests(back)} == {"potato 1", "coffee machine"}
    assert all(robot.step(action).ok for action in robot.requests(back))
    assert robot.status().splitlines()[2:] == ["- fridge: open", "- mug 1: no longer dirty"]
    assert robot.unmet(back, ()) == ["I cannot undo that: clean the mug."]
    assert robot.unmet([*back, *ask], ()) == ["Guessed, not asked for: mug 1."]


def test_a_guess_about_a_thing_that_was_asked_for_before_is_a_guess() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    said = [Turn("", "bring me the spoon"), Turn("", "put the butter knife back")]
    assert all(robot.step(action).ok for action in robot.requests(said[:1]))
    for name in ("spoon", "butter knife"):
        assert robot.step(Action("put", name, destination="sink basin")).ok
    asks = [*said, Turn("", "I'm hungry"), Turn("", "what did you guess?")]
    assert robot.unmet(asks, ()) == ["Guessed, not asked for: spoon, butter knife."]


@pytest.mark.parametrize(
    "said",
    [
        "get the milk out of the fridge",
        "no, the other plate",
        "that's the wrong mug, I meant mug 2",
        "I don't drink coffee, wash the mug or put it away",
        "careful with the knife and the fork",
        "don't open the fridge, the microwave or the cabinet",
        "open drawer 1 and do the zorb with the plate",
    ],
)
def test_nothing_is_guessed_for_what_orders_corrects_refuses_or_warns(said: str) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    kinds = ("mug", "plate", "knife", "apple")
    assert not robot.actions(kinds, [Turn("", said)])
    assert robot.actions(kinds, [Turn("", said), Turn("", "I'm hungry")])


@pytest.mark.parametrize(
    "said",
    [
        "I'd like to make breakfast, but don't use the microwave",
        "No, I want to cook dinner",
        "get everything ready for dinner",
        "put the apple away",
    ],
)
def test_an_aim_or_an_open_place_leaves_something_to_guess(said: str) -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    assert robot.actions(("apple",), [Turn("", said)])


@pytest.mark.parametrize(
    ("said", "changes", "notes"),
    [
        (["slice the bread on the plate"], set(), ["There is no bread at the plate."]),
        (["slice the bread on the counter"], {"bread: sliced"}, []),
        (
            ["slice the bread on the plate", "put it on the plate and slice it"],
            {"bread: sliced"},
            [],
        ),
        (["put the bread on the plate and slice the bread on the plate"], {"bread: sliced"}, []),
        (["break egg 1 into the bowl"], {"egg 1: now in the bowl"}, []),
        (["put the cup on the table and open drawer 1", "no, the mug instead of the cup"],
         {"mug 2: now on the dining table", "drawer 1: open"}, []),
        (["put the cup on the table", "not the cup, leave it"], set(), []),
        (["put the cup on the table", "undo that too"], set(), []),
        (["put the apple in the fridge", "Careful, the pan is hot. Don't touch it."], {APPLE}, []),
        (["put the cup on the table", "undo the last thing you did"], set(), []),
    ],
)  # fmt: skip
def test_no_part_of_an_order_or_correction_is_dropped(
    said: list[str], changes: set[str], notes: list[str]
) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, notes)


def test_why_a_thing_does_not_go_somewhere_is_said_in_plain_words() -> None:
    robot = robot_in("Kitchen1")
    robot.reset()
    result = robot.step(Action("put", "pan", destination="toaster"))
    assert (result.ok, result.observation) == (False, "the pan does not go in or on the toaster")
