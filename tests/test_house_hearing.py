"""What the home robot hears: requests and refusals."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path

import pytest

from goalscope.envs.house.hearing.hear import (
    Request,
    hear,
)
from goalscope.envs.house.simulator.object_types import object_types
from goalscope.types import Turn
from heard import TYPES, heard, put, scene


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        (
            "Put the apple and the tomato in the fridge.",
            [
                Request("put", ("Apple",), ("Fridge",)),
                Request("put", ("Tomato",), ("Fridge",)),
            ],
        ),
        (
            "could you move all the electronics to the desk?",
            [Request("put", ("CellPhone", "Laptop"), ("Desk",), every=True)],
        ),
        ("turn off the TV", [Request("turn off", ("Television",))]),
        ("Turn the telly off please", [Request("turn off", ("Television",))]),
        (
            "turn on the lights",
            [Request("turn on", ("DeskLamp", "LightSwitch"), every=True)],
        ),
        ("open the window blinds", [Request("open", ("Blinds",), every=True)]),
        ("close the drawer", [Request("close", ("Drawer",))]),
        ("bring me the mug", [Request("pick up", ("Mug",))]),
        (
            "There are two pencils. They all belong on the dining table",
            [Request("put", ("Pencil",), ("DiningTable",), every=True, number=2)],
        ),
        ("rinse the plate", [Request("clean", ("Plate",))]),
        ("fill the pot with water", [Request("fill", ("Pot",), liquid="water")]),
        ("empty the cup", [Request("empty", ("Cup",))]),
        ("pour the water out of the cup", [Request("empty", ("Cup",))]),
        ("slice the bread", [Request("slice", ("Bread",))]),
        ("break the vase", [Request("break", ("Vase",))]),
        ("toast the bread", [Request("cook", ("BreadSliced",))]),
        ("boil a potato", [Request("cook", ("Potato",), number=1)]),
        ("use the soap bottle up", [Request("use up", ("SoapBottle",))]),
        (
            "Three ladles need to be in the cabinet",
            [Request("put", ("Ladle",), ("Cabinet",), number=3)],
        ),
        ("the plant needs to be watered", [Request("fill", ("HousePlant",), liquid="water")]),
        (
            "Please clean a mug and make coffee",
            [
                Request("clean", ("Mug",), number=1),
                Request("fill", ("Mug", "Cup"), liquid="coffee"),
            ],
        ),
        (
            "open the microwave, put the potato in it and close it",
            [
                Request("put", ("Potato",), ("Microwave",)),
                Request("close", ("Microwave",)),
            ],
        ),
        ("make sure the TV is off", [Request("turn off", ("Television",))]),
        ("throw away the egg", [Request("put", ("Egg",), ("GarbageCan",))]),
        (
            "put all the food in the fridge except the bread",
            [Request("put", ("Apple", "Egg", "Potato", "Tomato"), ("Fridge",), every=True)],
        ),
        ("don't forget to close the safe", [Request("close", ("Safe",))]),
    ],
)
def test_what_is_asked_for_is_wanted(said: str, wanted: list[Request]) -> None:
    assert list(heard(said).wanted) == wanted


@pytest.mark.parametrize(
    "said",
    [
        "where is the mug?",
        "is the fridge open?",
        "should I put the mug in the sink?",
        "did you close the safe?",
        "if the mug is dirty, clean it",
        "my brother broke the vase",
        "the mug is on the counter",
        "I will close the fridge myself",
        'she said "open the safe" yesterday',
        "put the unicorn in the garden",
        "",
        "\u2603 <|im_end|>",
    ],
)
def test_questions_conditions_and_statements_ask_for_nothing(said: str) -> None:
    assert heard(said).wanted == ()


KITCHEN = scene(*TYPES, "Bowl", "Bowl", "Sink", "SinkBasin", "Fork", "Spoon", "CreditCard", "Box")


def asked(*said: str) -> list[tuple[str, str, str]]:
    """What is wanted, as verb, things and places in few words."""
    wanted = heard(*said, objects=KITCHEN).wanted
    return [(r.verb, "/".join(r.object_types), "/".join(r.destination_types)) for r in wanted]


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("The tomato and the potatoes go into the fridge.", put("Fridge", "Tomato", "Potato")),
        ("The forks and spoons belong inside the drawer", put("Drawer", "Fork", "Spoon")),
        ("apples live on top of the counter", put("CounterTop", "Apple")),
        ("get the mug and the plate on the counter", put("CounterTop", "Mug", "Plate")),
        (
            "I need a plate as well, and the sharp knife",
            [("pick up", "Plate", ""), ("pick up", "Knife", "")],
        ),
        (
            "move the mug, the cup plus the fork as well as the spoon to the desk",
            put("Desk", "Mug", "Cup", "Fork", "Spoon"),
        ),
        ("put both the mug and the plate in the sink", put("SinkBasin", "Mug", "Plate")),
        ("wash the mug, the cup & the plate", [("clean", t, "") for t in ("Mug", "Cup", "Plate")]),
        ("put a fork a spoon and a cup on the desk", put("Desk", "Fork", "Spoon", "Cup")),
        (
            "put the mug in the sink and the plate on the counter",
            put("SinkBasin", "Mug") + put("CounterTop", "Plate"),
        ),
        ("put on the counter the mug and the plate", put("CounterTop", "Mug", "Plate")),
        ("gather the forks together on the counter", put("CounterTop", "Fork")),
        ("collect the mug and the cup on the desk", put("Desk", "Mug", "Cup")),
        ("line the cups up on the counter", put("CounterTop", "Cup")),
        ("lay out the plates on the counter", put("CounterTop", "Plate")),
        ("bring the apple over to the counter", put("CounterTop", "Apple")),
        ("bring over the apple", [("pick up", "Apple", "")]),
        ("fetch the apple", [("pick up", "Apple", "")]),
        ("hand me the fork", [("pick up", "Fork", "")]),
        ("bring me the mug on the counter", [("pick up", "Mug", "")]),
        ("grab the mug on the counter", [("pick up", "Mug", "")]),
        (
            "get the mug on the counter and wash it",
            [("pick up", "Mug", ""), ("clean", "Mug", "")],
        ),
        ("set the table with a plate and a fork", put("Desk/DiningTable", "Plate", "Fork")),
        ("lay the dining table with two plates", put("DiningTable", "Plate")),
        ("set the plate on the dining table", put("DiningTable", "Plate")),
        ("Can I have the apple please?", [("pick up", "Apple", "")]),
        ("set the table", []),
        ("The mug and the cup, please, on the counter", put("CounterTop", "Mug", "Cup")),
        ("The mug and the cup on the counter", []),
    ],
)
def test_every_thing_of_a_list_is_heard(said: str, wanted: list[tuple[str, str, str]]) -> None:
    assert asked(said) == wanted


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        (["put an egg in the fridge. The bread too."], put("Fridge", "Egg", "Bread")),
        (["put an egg in the fridge. And the bread."], put("Fridge", "Egg", "Bread")),
        (["put an egg in the fridge", "Same for the tomato"], put("Fridge", "Egg", "Tomato")),
        (["put an egg in the fridge", "Also the tomato"], put("Fridge", "Egg", "Tomato")),
        (["wash the mug", "the plate as well"], [("clean", "Mug", ""), ("clean", "Plate", "")]),
        (
            ["Could you get my breakfast things on the counter? The cup and a mug first."],
            put("CounterTop", "Cup", "Mug"),
        ),
        (
            ["These go in the fridge: the egg, the tomato and the bread"],
            put("Fridge", "Egg", "Tomato", "Bread"),
        ),
        (["put the mug in the cabinet", "I meant the cup"], put("Cabinet", "Cup")),
        (["put the mug in the cabinet", "actually the cup"], put("Cabinet", "Cup")),
        (["put an egg in the fridge", "the tomato is red"], put("Fridge", "Egg")),
        (["put an egg in the fridge", "the tomato?"], put("Fridge", "Egg")),
        (["put an egg in the fridge", "And there is a tomato"], put("Fridge", "Egg")),
        (["wash the mug. The cup is in the cabinet."], [("clean", "Mug", "")]),
        (["the tomato"], []),
        (["Also the tomato"], []),
        (
            ["put the mug in the sink. Take the plate and put it with the others"],
            put("SinkBasin", "Mug", "Plate"),
        ),
        (["put the apple in the bowl. Put the egg in there"], put("Bowl", "Apple", "Egg")),
        (
            ["The apple? No, not in the fridge, I want it in the bowl"],
            put("Bowl", "Apple"),
        ),
        (
            ["open the laptop", "close the lid"],
            [("close", "Laptop", "")],
        ),
        (
            ["put the fork in the box. Now shut it."],
            [*put("Box", "Fork"), ("close", "Box", "")],
        ),
        (["close the lid"], []),
        (["shut the drawer when you're done"], [("close", "Drawer", "")]),
        (["close the drawers again"], [("close", "Drawer", "")]),
        (["Close the doors again"], [("close", "Cabinet/Fridge/Microwave/Safe", "")]),
        (["wash the mug. Put the unicorn in the sink"], [("clean", "Mug", "")]),
    ],
)
def test_a_thing_alone_repeats_the_last_request(
    said: list[str], wanted: list[tuple[str, str, str]]
) -> None:
    assert asked(*said) == wanted


@pytest.mark.parametrize(
    "said",
    [
        "wash the mug later",
        "Later, wash the mug.",
        "wash the mug tomorrow",
        "Could you please wash the mug tomorrow morning?",
        "when I'm back, wash the mug",
        "wash the mug when I'm back",
        "wash the mug after dinner",
        "After dinner, wash the mug",
        "wash the mug once the guests arrive",
        "In 10 minutes, wash the mug",
        "the mug should be washed tonight",
        "wash the mug on Sunday",
        "wash the mug. Not now!",
    ],
)
def test_what_is_wanted_at_another_time_is_not_wanted_now(said: str) -> None:
    assert asked("wash the mug") == [("clean", "Mug", "")]
    assert asked(said) == []


@pytest.mark.parametrize(
    "said",
    [
        "Put the apple in the fridge for later",
        "put the apple in the fridge. See you later!",
        "put the apple in the fridge, I will be back later",
        "put the apple in the fridge and wash the mug later",
        "put the apple in the fridge before dinner",
        "put the apple in the fridge for tomorrow's breakfast",
        "when you're done, put the apple in the fridge",
    ],
)
def test_other_words_of_time_put_nothing_off(said: str) -> None:
    assert asked(said) == put("Fridge", "Apple")


@pytest.mark.parametrize(
    "said",
    [
        ["put the apple in the fridge", "Not the fridge, the bowl."],
        ["put the apple in the fridge", "No, not in the fridge, in the bowl please"],
        ["put the apple in the fridge", "Not the fridge. Put it in the bowl."],
        ["put the apple in the fridge. No, not the fridge, the bowl."],
    ],
)
def test_a_wrong_place_makes_way_for_the_right_one(said: list[str]) -> None:
    hearing = heard(*said, objects=KITCHEN)
    assert asked(*said) == put("Bowl", "Apple")
    assert hearing.refuses("put", "Apple", "Fridge")
    assert not hearing.refuses("open", "Fridge")
    assert not hearing.refuses("put", "Egg", "Fridge")


@pytest.mark.parametrize(
    ("said", "kinds", "liquid"),
    [
        ("fill the mug with coffee", ("Mug",), "coffee"),
        ("fill the mug up with hot coffee", ("Mug",), "coffee"),
        ("pour wine into the cup", ("Cup",), "wine"),
        ("put wine in the cup", ("Cup",), "wine"),
        ("pour a glass of wine", ("Cup",), "wine"),
        ("pour me a coffee", ("Mug", "Cup"), "coffee"),
        ("pour the coffee from the pot into the mug", ("Mug",), "coffee"),
        ("fill the pot with water", ("Pot",), "water"),
        ("a cup of coffee please", ("Cup",), "coffee"),
        ("fill the pot", ("Pot",), ""),
    ],
)
def test_what_to_fill_with_is_heard(said: str, kinds: tuple[str, ...], liquid: str) -> None:
    assert heard(said).wanted[0].liquid == liquid
    assert [(r.verb, r.object_types) for r in heard(said).wanted] == [("fill", kinds)]


@pytest.mark.parametrize(
    ("said", "verb", "kind", "name"),
    [
        ("Push chair 1.", "push", "Chair", "chair 1"),
        ("Push the garbage can.", "push", "GarbageCan", ""),
        ("Pull the bread towards me.", "pull", "Bread", ""),
    ],
)
def test_what_moves_may_be_pushed_and_pulled(said: str, verb: str, kind: str, name: str) -> None:
    objects = scene("Chair", "Chair", "GarbageCan", "Bread", "Window")
    assert heard(said, objects=objects).wanted == (Request(verb, (kind,), name=name),)
    assert heard("push the window", objects=objects).wanted == ()


@pytest.mark.parametrize(
    "said",
    [
        "I'll make it at the table",
        "I'll slice the bread myself",
        "I will do that",
        "I'm going to cook the potato",
        "I will get the mug",
        "I'll go there and slice the bread",
        "let me cut the bread",
        "I'm making coffee",
    ],
)
def test_what_a_person_does_is_no_order(said: str) -> None:
    assert asked("wash the egg", said) == asked("wash the egg")
    assert asked(f"{said}, and you wash the plate") == [("clean", "Plate", "")]


@pytest.mark.parametrize("said", ["I'll have", "I'll take", "I need", "I want", "I'll need"])
def test_what_a_person_would_have_is_a_wish(said: str) -> None:
    assert asked(f"{said} the mug") == [("pick up", "Mug", "")]


@pytest.mark.parametrize(
    "later", ["Not the phone, and not the card either", "Not the phone, nor the card."]
)
def test_things_are_taken_out_of_a_group_later(later: str) -> None:
    hearing = heard("put my valuables in the drawer", later, objects=KITCHEN)
    assert [request.object_types for request in hearing.wanted] == [("Laptop",)]
    assert hearing.refuses("put", "CellPhone")
    assert hearing.refuses("put", "CreditCard")
    assert heard("put the phone in the drawer", "Not the phone").wanted == ()


@pytest.mark.parametrize(
    "said",
    [
        "The apple? Not in the fridge",
        "put the apple in the fridge. No, not in the fridge.",
        "don't put the apple in the fridge",
        "the apple doesn't go in the fridge",
        "I don't want the apple in the fridge",
        "no apples in the fridge",
        "neither the apple nor the egg belongs in the fridge",
    ],
)
def test_a_place_is_ruled_out_for_one_thing(said: str) -> None:
    hearing = heard(said)
    assert hearing.wanted == ()
    assert hearing.refuses("put", "Apple", "Fridge")
    assert not hearing.refuses("put", "Apple", "CounterTop")
    assert not hearing.refuses("put", "Bread", "Fridge")
    again = heard(said, "put the apple in the fridge")
    assert not again.refuses("put", "Apple", "Fridge")


@pytest.mark.parametrize("said", ["nothing goes in the fridge", "not in the fridge"])
def test_a_place_is_ruled_out_for_everything(said: str) -> None:
    assert heard(said).refuses("put", "Bread", "Fridge")


DIRTY, CLEAN = (("isDirty", True),), (("isDirty", False),)


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("wash the dirty bowl", [("clean", DIRTY)]),
        ("put a bowl on the desk. A clean bowl, I mean, not the dirty one", [("put", CLEAN)]),
        ("put a bowl on the desk, not the dirty one", [("put", CLEAN)]),
        ("put the bowl on the desk. Not the dirty bowl.", [("put", CLEAN)]),
        (
            "the dirty bowls go in the sink and the clean ones on the desk",
            [("put", DIRTY), ("put", CLEAN)],
        ),
        ("put the cold bowl on the desk", [("put", (("temperature", "Cold"),))]),
        ("put the bowl on the desk", [("put", ())]),
        ("wash the dirty mug", [("clean", ())]),
        ("the clean bowls go on the desk", [("put", CLEAN)]),
    ],
)
def test_adjectives_choose_among_several_things_of_a_type(
    said: str, wanted: list[tuple[str, tuple[tuple[str, bool | str], ...]]]
) -> None:
    hearing = heard(said, objects=KITCHEN)
    assert [(request.verb, request.states) for request in hearing.wanted] == wanted


def test_later_words_override_earlier_ones() -> None:
    wanted = heard("put the apple in the fridge", "actually put it on the counter").wanted
    assert wanted == (Request("put", ("Apple",), ("CounterTop",)),)
    assert heard("turn on the TV", "turn off the TV").wanted == (
        Request("turn off", ("Television",)),
    )
    assert heard("put the apple in the fridge", "never mind").wanted == ()


def test_it_may_be_what_the_robot_asked_about() -> None:
    wanted = heard(Turn("What about the apple?", "Put it in the fridge.")).wanted
    assert wanted == (Request("put", ("Apple",), ("Fridge",)),)


def test_a_numbered_name_means_that_one_thing() -> None:
    [request] = heard("open drawer 2", objects=scene("Drawer", "Drawer")).wanted
    assert request.name == "drawer 2"


@pytest.mark.parametrize(
    ("said", "verb", "kind"),
    [
        ("don't touch the knife", "pick up", "Knife"),
        ("Leave the mug where it is", "put", "Mug"),
        ("leave the mug alone", "clean", "Mug"),
        ("Not the bread", "put", "Bread"),
        ("put the bread away without slicing it", "slice", "Bread"),
        ("please do not open the safe", "open", "Safe"),
        ("the vase must not be moved", "put", "Vase"),
        ("never slice or cook the potato", "cook", "Potato"),
        ("put the food in the fridge but not the egg", "put", "Egg"),
        ("don't put anything in the microwave", "put in", "Microwave"),
        ("keep your hands off the laptop", "turn on", "Laptop"),
        ("leave everything alone", "pick up", "Egg"),
        ("dont move the vase", "pick up", "Vase"),
    ],
)
def test_what_is_ruled_out_is_refused_and_not_wanted(said: str, verb: str, kind: str) -> None:
    hearing = heard(said)
    assert hearing.refuses(verb, kind)
    assert not any(verb == r.verb and kind in r.object_types for r in hearing.wanted)


def test_a_refusal_takes_a_request_back_and_a_request_a_refusal() -> None:
    assert heard("put the mug in the cabinet", "don't touch the mug").wanted == ()
    hearing = heard("don't touch the mug", "put the mug in the cabinet")
    assert not hearing.refuses("put", "Mug")
    assert hearing.wanted == (Request("put", ("Mug",), ("Cabinet",)),)


def test_a_group_does_not_lift_the_refusal_of_one_thing() -> None:
    hearing = heard("don't touch the egg", "put all the food in the fridge")
    assert hearing.refuses("put", "Egg")
    assert all("Egg" not in request.object_types for request in hearing.wanted)


def test_real_instructions_are_mostly_heard_and_none_breaks_anything() -> None:
    folder = os.environ.get("GOALSCOPE_DATA")
    if not folder:
        pytest.skip("GOALSCOPE_DATA is unset: it names the folder with the TEACh dialogues")
    said: list[str] = []
    with gzip.open(Path(folder) / "dialogue/teach/teach_valid_seen.jsonl.gz", "rt") as lines:
        for line in lines:
            for each in json.loads(line)["interactions"]:
                if each["agent"] == "commander" and "Instruction" in each.get("das", ()):
                    said.append(each["utterance"])
    objects = scene(*object_types())
    found = [heard(words, objects=objects) for words in said]
    assert sum(bool(hearing.wanted) for hearing in found) / len(found) > 0.4
    assert not any(verb in ("break", "use up") for h in found for verb, *_ in h.permitted)


def test_place_that_is_corrected_at_once_is_not_meant() -> None:
    words = "Put the tomato on the table, no, on the counter."
    (request,) = hear([Turn("", words)], KITCHEN).wanted
    assert request.destination_types == ("CounterTop",)
