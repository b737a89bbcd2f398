"""What orders to the home robot come to: laws that hold for every verb in the embedded rooms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from goalscope.base.nouns import singulars
from goalscope.base.types import Action, StepResult
from goalscope.envs import Resolution
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.language.dialogue_state import DialogueState, fold
from goalscope.language.orders import Order, Reading, orders_from_text

FREE = DialogueState()


def pick(said: str, names: Sequence[str]) -> str:
    """The name with most words in common; of several, the one with the fewest others."""
    words = {*singulars(said)}
    shared = {name: len(words & {*singulars(name)}) for name in names}
    named = [name for name in names if shared[name]]
    return max(named, key=lambda name: (shared[name], -len(name.split())), default="")


def robot_in(scene: str = "Kitchen1") -> HomeRobot:
    return HomeRobot(HouseController(scene))


@pytest.fixture
def robot() -> HomeRobot:
    return robot_in()


def order(text: str) -> Order:
    (found,) = orders_from_text(text, HomeRobot.verbs)
    return found


def plan(robot: HomeRobot, text: str, dialogue: DialogueState = FREE) -> list[str]:
    return [str(action) for action in robot.resolve(order(text), dialogue, pick).actions]


def why(robot: HomeRobot, text: str, dialogue: DialogueState = FREE) -> str:
    """Why nothing is done for an order."""
    found = robot.resolve(order(text), dialogue, pick)
    assert found.actions == ()
    return found.why


def follow(robot: HomeRobot, *texts: str) -> list[StepResult]:
    """Resolve and take each order in turn; all must succeed."""
    results: list[StepResult] = []
    for text in texts:
        found = robot.resolve(order(text), FREE, pick)
        assert found.actions, (text, found.why)
        results += [robot.step(action) for action in found.actions]
    assert all(each.ok for each in results), results
    return results


def undone(
    robot: HomeRobot, results: list[StepResult], dialogue: DialogueState = FREE
) -> Resolution:
    return robot.resolve(Order("undo"), replace(dialogue, to_undo=tuple(results)), pick)


def after(*texts: str) -> DialogueState:
    return fold([Reading(tuple(order(text) for text in texts))])


def state(robot: HomeRobot, name: str) -> dict[str, Any]:
    (own,) = (own for own, each in robot.names.items() if each == name)
    return next(each for each in robot.metadata["objects"] if each["objectId"] == own)


DONE = [
    ("put apple | where fridge", "apple", "temperature", "Cold"),
    ("put apple", "apple", "isPickedUp", True),
    ("put apple | where me", "apple", "isPickedUp", True),
    ("open refrigerator", "fridge", "isOpen", True),
    ("turn on tap", "faucet", "isToggled", True),
    ("turn off light", "light switch", "isToggled", False),
    ("fill glass", "cup", "fillLiquid", "water"),
    ("fill glass | for red wine", "cup", "fillLiquid", "wine"),
    ("empty wine", "wine bottle", "isFilledWithLiquid", False),
    ("slice tomato", "tomato", "isSliced", True),
    ("cook potato", "potato 1", "isCooked", True),
    ("clean mug", "mug 1", "isDirty", False),
    ("break bowl", "bowl", "isBroken", True),
    ("make coffee", "mug 2", "fillLiquid", "coffee"),
    ("make toast", "slice of bread 1", "isCooked", True),
]


@pytest.mark.parametrize(("said", "name", "key", "value"), DONE)
def test_each_verb_does_what_it_says(
    robot: HomeRobot, said: str, name: str, key: str, value: Any
) -> None:
    follow(robot, said)
    assert state(robot, name)[key] == value


@pytest.mark.parametrize("verb", ["push", "pull"])
def test_furniture_is_moved(robot: HomeRobot, verb: str) -> None:
    before = dict(state(robot, "chair 1")["position"])
    follow(robot, f"{verb} chair")
    assert state(robot, "chair 1")["position"] != before


WHICH = [
    ("Kitchen1", "fill dirty mug", ["fill: mug 1"]),
    ("Kitchen1", "fill clean mug", ["fill: mug 2"]),
    ("Kitchen1", "fill mug | where cabinet", ["fill: mug 2"]),
    ("Kitchen1", "put mugs | where sink", ["put: mug 2 -> sink basin", "put: mug 1 -> sink basin"]),
    ("Kitchen1", "put knife | where counter", ["put: knife -> counter 1"]),
    ("Kitchen1", "turn on stove", ["turn on: stove burner 1"]),
    ("Kitchen1", "turn on burner 3", ["turn on: stove burner 3"]),
    ("Kitchen1", "slice potato 2", ["slice: potato 2"]),
    ("Kitchen1", "put plate 2 | where counter 2", ["put: plate 2 -> counter 2"]),
    ("Kitchen1", "put bowl | where stove", ["put: bowl -> stove burner 3"]),
    ("Kitchen1", "turn off everything", ["turn off: light switch"]),
    ("Kitchen1", "put fork | where bin", ["put: fork -> garbage can"]),
    ("LivingRoom1", "turn off lamp | where desk", ["turn off: desk lamp"]),
    ("LivingRoom1", "turn off lamps", ["turn off: floor lamp", "turn off: desk lamp"]),
    ("LivingRoom1", "put remote | where TV", ["put: remote control -> TV stand"]),
    ("Bathroom1", "turn on faucet | where bathtub", ["turn on: faucet 1"]),
]


@pytest.mark.parametrize(("scene", "said", "actions"), WHICH)
def test_which_of_several_things_is_meant(scene: str, said: str, actions: list[str]) -> None:
    assert sorted(plan(robot_in(scene), said)) == sorted(actions)


def test_as_many_are_meant_as_are_named(robot: HomeRobot) -> None:
    assert len(plan(robot, "put egg | where counter")) == 1
    assert len(plan(robot, "put eggs | 2 | where counter")) == 2
    assert len(plan(robot, "put food | where garbage")) > 5
    found = robot.resolve(order("put tomatoes | 3 | where fridge"), FREE, pick)
    assert (len(found.actions), found.why) == (1, "I found only 1 of 3 tomatoes.")
    found = robot.resolve(order("put potatoes | where me"), FREE, pick)
    assert (len(found.actions), found.why) == (1, "My hand holds one thing at a time.")


def test_the_same_thing_is_meant_again_while_there_is_something_to_do(robot: HomeRobot) -> None:
    follow(robot, "pick up mug 2")
    assert plan(robot, "put mug | where table") == ["put: mug 2 -> dining table"]
    assert plan(robot, "fill mug") == ["fill: mug 2"]
    follow(robot, "open drawer 1")
    assert plan(robot, "close drawer") == ["close: drawer 1"]
    assert plan(robot, "open drawer") == ["open: drawer 2"]


def test_what_is_held_goes_back_where_no_place_is_said(robot: HomeRobot) -> None:
    follow(robot, "pick up fork")
    assert plan(robot, "put fork") == ["put: fork -> drawer 2"]
    follow(robot, "put fork | where table")
    for back in ("back", "its place", "where it was", "where it came from"):
        assert plan(robot, f"put fork | where {back}") == ["put: fork -> drawer 2"]


def test_what_is_cut_stands_for_its_pieces(robot: HomeRobot) -> None:
    follow(robot, "slice tomato")
    assert why(robot, "slice tomato") == "The tomato is sliced already."
    moved = plan(robot, "put tomato | where fridge")
    assert len(moved) > 2
    assert all(each.startswith("put: slice of tomato") for each in moved)


def test_dishes_are_made_of_simpler_actions(robot: HomeRobot) -> None:
    assert plan(robot, "make toast | where me") == [
        "slice: bread",
        "put: slice of bread 1 -> toaster",
        "cook: slice of bread 1",
        "pick up: slice of bread 1",
    ]
    follow(robot, "make toast | 2 slice", "make toast | where plate")
    cooked = [o for o in robot.metadata["objects"] if o["isCooked"]]
    assert len(cooked) == 3
    follow(robot, "make coffee | 2", "cook eggs | 2 | where pan")
    assert sum(o["fillLiquid"] == "coffee" for o in robot.metadata["objects"]) == 2
    assert state(robot, "cracked egg 2")["isCooked"]
    assert not state(robot, "coffee machine")["isToggled"]


SO = [
    ("close fridge", "The fridge is closed already."),
    ("open vase", "There is no vase here."),
    ("turn on burner 9", "There is no burner 9 here."),
    ("put apple | where moon", "There is no moon here."),
    ("put apple | where counter", "The apple is on counter 2 already."),
    ("slice apple | where fridge", "There is no apple in or on the fridge."),
    ("put mugs | where window", "Nothing can be put in or on the window."),
    ("fill cup | for milk", "I cannot fill anything with milk."),
    ("make tea", "I cannot make tea here."),
    ("open", "Please say what I am to open."),
    ("put everything | where bin", "Please name the things that I am to put."),
]


def test_what_is_excepted_is_left_as_it_is(robot: HomeRobot) -> None:
    follow(robot, "open fridge", "open drawer 1", "open microwave")
    said = order("close everything | but fridge and drawer 1")
    found = robot.resolve(said, FREE.beside(said, [said]), pick)
    assert [*map(str, found.actions)] == ["close: microwave"]
    said = order("close everything | but safe")
    found = robot.resolve(said, FREE.beside(said, [said]), pick)
    assert (found.actions, found.why) == ((), "There is no safe here, so all stays as it is.")
    assert plan(robot, "close fridge", after("leave everything | but fridge")) == ["close: fridge"]


def test_a_number_belongs_to_a_name_or_names_nothing(robot: HomeRobot) -> None:
    assert why(robot, "put 2 | where sink") != ""
    assert plan(robot, "open cabinet 2") == ["open: cabinet 2"]
    assert plan(robot, "slice potato 1") == ["slice: potato 1"]
    assert why(robot, "break egg 7") == "There is no egg 7 here."


@pytest.mark.parametrize(("said", "told"), SO)
def test_why_nothing_is_done_is_one_sentence(robot: HomeRobot, said: str, told: str) -> None:
    assert why(robot, said) == told


FRUIT = ["put: apple -> fridge", "put: tomato -> fridge"]
BOUND = [
    ("leave mug", "clean mug 2", []),
    ("leave gold-rimmed plates", "put plate | where table", []),
    ("leave mug | where table", "put mugs | where sink", ["put: mug 2 -> sink basin"]),
    ("avoid potato | why taste", "put fruit | where fridge", FRUIT),
    ("avoid tomato | why taste", "put fruit | where fridge", FRUIT[:1]),
    ("leave fridge", "put apple | where fridge", []),
    ("leave everything", "open fridge", []),
    ("leave bread knife", "slice bread", ["slice: bread"]),
    ("leave stove", "turn on stove burner 1", []),
]


@pytest.mark.parametrize(("limit", "said", "actions"), BOUND)
def test_limits_bind_orders(robot: HomeRobot, limit: str, said: str, actions: list[str]) -> None:
    bound = after(limit)
    assert plan(robot, said, bound) == actions
    if not actions:
        assert robot.resolve(order(said), bound, pick).why
    assert robot.resolve(order(limit), bound, pick).actions == ()


@pytest.mark.parametrize(
    ("said", "thing", "left"),
    [
        ("put apple | where fridge", "apple", False),
        ("put apple | where fridge", "tomato", True),
        ("avoid fruit | why taste", "apple", False),
        ("leave fridge", "apple", True),
    ],
)
def test_nothing_ordered_or_ruled_out_is_done_unasked(
    robot: HomeRobot, said: str, thing: str, left: bool
) -> None:
    assert robot.actions(thing, FREE)
    found = robot.actions(thing, after(said))
    assert bool(found) == left
    assert not any(action.destination == "fridge" for action in found) or said != "leave fridge"


LASTING = [
    ([], Action("slice", "bread")),
    (["put potato | where microwave"], Action("turn on", "microwave")),
    (["put potato | where pan"], Action("turn on", "stove burner 1")),
    (["turn on stove burner 1"], Action("put", "potato 1", destination="pan")),
]


@pytest.mark.parametrize(("before", "action"), LASTING)
def test_what_nobody_can_undo_is_known_before(
    robot: HomeRobot, before: list[str], action: Action
) -> None:
    follow(robot, *before)
    assert robot.irreversible(action)
    assert robot.step(action).irreversible


@pytest.mark.parametrize(
    "texts",
    [
        ["fill cup", "turn on tap", "pick up apple"],
        ["open fridge", "close fridge", "open fridge"],
        ["put fork | where table", "put fork | where counter", "put fork | where table"],
        ["make coffee | where table"],
    ],
)
def test_undo_restores_what_was_newest_first(robot: HomeRobot, texts: list[str]) -> None:
    states: list[str] = [robot.state().text]
    rounds: list[list[StepResult]] = []
    for text in texts:
        rounds.append(follow(robot, text))
        states.append(robot.state().text)
    for results, before in zip(reversed(rounds), reversed(states[:-1]), strict=True):
        found = undone(robot, results)
        assert found.why == ""
        assert all(robot.step(action).ok for action in found.actions)
        assert robot.state().text == before


def test_undo_says_what_it_cannot_and_leaves_what_is_ruled_out(robot: HomeRobot) -> None:
    found = undone(robot, follow(robot, "slice bread", "open fridge"))
    assert [str(action) for action in found.actions] == ["close: fridge"]
    assert found.why == "I cannot undo that: slice the bread."
    found = undone(robot, follow(robot, "put apple | where table"), after("leave apple"))
    assert (found.actions, found.why) == ((), "I leave the apple alone, as you asked.")


ANSWERS = [
    ("ask apple", "The apple is on counter 2."),
    ("ask mugs", "Mug 2 is clean, empty and in cabinet 2. Mug 1 is dirty, empty and on the dining"
     " table."),
    ("ask lettuce | where fridge", "The lettuce is cold and in the fridge."),
    ("ask drawer 1", "Drawer 1 is closed; in it: the spatula."),
    ("ask anything open | about any", "Nothing is open here."),
    ("ask dirty | about any", "Mug 1 is dirty, empty and on the dining table."),
]  # fmt: skip


@pytest.mark.parametrize("asked", ["ask", "ask here", "ask room"])
def test_a_question_that_names_nothing_is_answered_by_what_is_here(robot, asked: str) -> None:
    status, things = robot.answer(order(asked), "What is in here?", FREE, pick).splitlines()
    assert status == "The robot's hand is empty. Nothing has been changed yet."
    assert things.startswith("Here: apple, bowl, bread,")
    told = robot.answer(order(asked), "What is dirty in here?", FREE, pick)
    assert told == "Mug 1 is dirty, empty and on the dining table."
    told = robot.answer(order(asked), "What is on the dining table?", FREE, pick)
    assert told.startswith("The dining table is on the floor; on it: the bowl, mug 1,")


@pytest.mark.parametrize(("said", "told"), ANSWERS)
def test_answers_state_facts(robot: HomeRobot, said: str, told: str) -> None:
    before = robot.state().fingerprint
    assert robot.answer(order(said), said, FREE, pick) == told
    assert robot.state().fingerprint == before


def test_how_many_there_are_is_said_first(robot: HomeRobot) -> None:
    told = robot.answer(order("ask mugs | about count"), "how many mugs?", FREE, pick)
    assert told.startswith("2 in all. Mug 2 is")


def test_an_answer_tells_of_six_things_at_most(robot: HomeRobot) -> None:
    assert robot.answer(order("ask food"), "food?", FREE, pick).count(" is ") == 6


def test_offers_are_nearest_first(robot: HomeRobot) -> None:
    assert {"egg", "apple", "mug"} <= {*robot.offers("", 99)}
    assert robot.offers("a cup of coffee", 2)[0] in ("coffee machine", "cup", "mug")
    assert len(robot.offers("fruit", 3)) == 3
