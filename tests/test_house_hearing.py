"""What the home robot hears: requests, refusals, leave for what cannot be undone, completion."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path

import pytest

from goalscope.envs.house.answers import answered
from goalscope.envs.house.hearing import (
    IRREVERSIBLE,
    Hearing,
    Request,
    ask_permission,
    completes,
    hear,
)
from goalscope.envs.house.object_types import object_types
from goalscope.types import Turn

TYPES = [
    "Bread",
    "Vase",
    "Apple",
    "Tomato",
    "Potato",
    "Egg",
    "Mug",
    "Plate",
    "Cup",
    "Fridge",
    "Knife",
    "ButterKnife",
    "SoapBottle",
    "Pot",
    "CellPhone",
    "Window",
    "Blinds",
    "Microwave",
    "CounterTop",
    "DiningTable",
    "Safe",
    "WineBottle",
    "Television",
    "Laptop",
    "Desk",
    "Drawer",
    "Cabinet",
    "GarbageCan",
    "LightSwitch",
    "DeskLamp",
    "HousePlant",
    "Ladle",
    "Pencil",
]


def scene(*types: str) -> list[dict[str, str]]:
    return [{"objectId": f"{t}|+00.{i:02d}", "objectType": t} for i, t in enumerate(types)]


def heard(*said: str | Turn, objects: list[dict[str, str]] | None = None) -> Hearing:
    turns = [each if isinstance(each, Turn) else Turn("", each) for each in said]
    return hear(turns, scene(*TYPES) if objects is None else objects)


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


def put(place: str, *things: str) -> list[tuple[str, str, str]]:
    return [("put", thing, place) for thing in things]


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


@pytest.mark.parametrize(
    ("said", "verb", "kind"),
    [
        ("Slice the bread.", "slice", "Bread"),
        ("could you please slice the bread?", "slice", "Bread"),
        ("Can you cook the potato for me?", "cook", "Potato"),
        ("ok, break the vase now please", "break", "Vase"),
        ("You may slice the bread", "slice", "Bread"),
        ("Take the vase off the table and break it", "break", "Vase"),
        ("use up the soap bottle", "use up", "SoapBottle"),
        ("cut two slices of tomato", "slice", "Tomato"),
        ("crack the egg", "break", "Egg"),
        ("slice the bread with the knife and put the plate on the counter", "slice", "Bread"),
    ],
)
def test_a_plain_order_permits_that_act_alone(said: str, verb: str, kind: str) -> None:
    hearing = heard(said)
    assert hearing.permits(verb, kind)
    others = {(v, t) for v in IRREVERSIBLE for t in TYPES} - {(verb, kind)}
    assert not any(hearing.permits(*other) for other in others)


NO_LEAVE = [
    "don't slice the bread",
    "do not slice the bread",
    "never break the vase",
    "put it away without slicing the bread",
    "Slice the bread? No",
    "should I slice the bread?",
    "can you slice the bread?",
    "could you break the vase",
    "Did you slice the bread?",
    "what if you slice the bread",
    "if it is fresh, slice the bread",
    "slice the bread if it is fresh",
    "slice the bread when I am back",
    "slice the bread after dinner",
    "slice the bread later",
    "slice the bread tomorrow",
    "unless I say so, slice the bread",
    'he said "slice the bread"',
    "he said slice the bread",
    "my brother wants you to break the vase",
    '"break the vase" was what she said',
    "'break the vase'",
    "Say slice the bread",
    "I would never slice the bread",
    "imagine you slice the bread",
    "pretend to break the vase",
    "suppose I break the vase",
    "maybe slice the bread",
    "perhaps break the vase",
    "I might slice the bread",
    "I want to slice the bread",
    "I will slice the bread myself",
    "let me slice the bread",
    "you can slice the bread, can you?",
    "be careful, you could break the vase",
    "careful not to break the vase",
    "avoid breaking the vase",
    "stop slicing the bread",
    "instead of slicing the bread, toast it",
    "no slicing the bread",
    "you shouldn't slice the bread",
    "there is no need to slice the bread",
    "the bread is sliced",
    "the vase is broken",
    "someone broke the vase",
    "I broke the vase",
    "slice the bread, not",
    "slice the bread... just kidding",
    "slice the bread, haha",
    "slice the vegetables",
    "break everything",
    "break it",
    "slice it",
    "cook something",
    "break the bottle opener",
    "slice the bread or the tomato",
    "slice or break the vase",
    "break in the door",
    "crack the window",
    "break the glass ceiling",
    "how do I slice the bread?",
    "I wonder whether to slice the bread",
    "it would be bad to break the vase",
    "you must not break the vase",
    "please don't cook the potato",
    "cook nothing",
    "nobody should slice the bread",
    "forget about slicing the bread",
    "remember when you had to slice the bread",
    "it's fun to break the vase",
    "the knife can slice the bread",
    "put the bread next to the knife",
    "the recipe says: slice the bread",
    "the recipe says to slice the bread",
    "break the news about the vase",
    "slice the bread on TV shows",
    "use the soap bottle",
    "give the vase a break",
    "take a break",
    "ask her to slice the bread",
    "tell him to break the vase",
    "why not break the vase",
    "why don't you slice the bread",
    "slice the bread <|im_end|>",
    "slice the bread but leave the vase",
    "does cooking the potato take long",
    "slice the bread?",
    "Slice the bread. Just kidding!",
    "Slice the bread. Wait, no.",
    "to slice the bread is wrong",
    "break a leg and the vase of course lol",
    "I'll slice the bread",
    "I'm going to slice the bread",
    "Let me slice the bread please",
    "I'll take the bread and slice it",
    "Slice the bread. The tomato too.",
    "slice the bread the tomato",
    "slice the heart of the bread",
    "break the big metaphorical vase",
    "cook up the potato",
    "slice the bread, not the tomato",
]


@pytest.mark.parametrize("said", NO_LEAVE)
def test_nothing_but_a_plain_order_permits(said: str) -> None:
    hearing = heard(said)
    assert not any(hearing.permits(verb, kind) for verb in IRREVERSIBLE for kind in object_types())


def test_which_of_two_things_is_meant_must_be_clear() -> None:
    two = scene("Vase", "Vase", "Bottle", "WineBottle")
    assert not heard("break the vase", objects=two).permits("break", "Vase", "vase 1")
    assert not heard("break the bottle", objects=two).permitted
    numbered = heard("break vase 2", objects=two)
    assert numbered.permits("break", "Vase", "vase 2")
    assert not numbered.permits("break", "Vase", "vase 1")


MANY = scene("Potato", "Potato", "Potato", "Tomato", "Bread", "Cup", "Cup")


@pytest.mark.parametrize(
    ("said", "most"),
    [
        ("Slice a potato.", 1),
        ("slice one of the potatoes", 1),
        ("Take a potato and slice it.", 1),
        ("slice two potatoes", 2),
        ("slice both potatoes", 2),
        ("slice some potatoes", 2),
    ],
)
def test_leave_is_for_as_many_as_were_asked_for(said: str, most: int) -> None:
    hearing = heard(said, objects=MANY)
    allowed = [hearing.permits("slice", "Potato", "potato 2", done) for done in range(4)]
    assert allowed == [done < most for done in range(4)]


def test_leave_for_the_only_thing_is_for_one() -> None:
    hearing = heard("slice the bread", objects=MANY)
    assert hearing.permitted == (("slice", "Bread", 1),)
    assert not hearing.permits("slice", "Bread", "bread", done=1)


@pytest.mark.parametrize(
    "said", ["slice the potatoes", "slice all the potatoes", "slice every potato"]
)
def test_leave_may_be_for_all(said: str) -> None:
    assert heard(said, objects=MANY).permits("slice", "Potato", "potato 3", done=2)


@pytest.mark.parametrize(
    "said",
    [
        "slice the potato",
        "slice the red potatoes",
        "slice the cold potatoes",
        "slice those potatoes",
        "slice the other potatoes",
        "slice the potatoes on the counter",
        "slice the potatoes next to the tomato",
        "slice half the potatoes",
        "slice one or two potatoes",
        "take the potatoes and slice it",
        "slice the potatoes later",
    ],
)
def test_leave_for_some_of_many_is_asked_for(said: str) -> None:
    assert not heard(said, objects=MANY).permits("slice", "Potato", "potato 1")


@pytest.mark.parametrize(
    "later", ["Just one potato.", "Only one, please", "two are enough", "not the cold potato"]
)
def test_leave_for_all_ends_where_fewer_are_asked_for(later: str) -> None:
    assert not heard("slice the potatoes", later, objects=MANY).permits("slice", "Potato")


def test_leave_shrinks_to_the_last_number() -> None:
    hearing = heard("slice the potatoes", "Actually, slice one potato.", objects=MANY)
    assert hearing.permits("slice", "Potato")
    assert not hearing.permits("slice", "Potato", done=1)


def test_names_given_are_used_instead_of_new_ones() -> None:
    two = scene("Vase", "Vase")
    named = {each["objectId"]: name for each, name in zip(two, ("vase", "vase 1"), strict=True)}
    turns = [Turn(ask_permission("break", "vase"), "Yes")]
    assert hear(turns, two, named).permits("break", "Vase", "vase")
    assert not hear(turns, two, named).permits("break", "Vase", "vase 1")
    assert not hear(turns, two).permitted


@pytest.mark.parametrize(
    "later",
    [
        "I'd rather keep the tomato whole",
        "I'd prefer it whole",
        "I'd rather keep the tomato.",
        "Leave it whole, please.",
        "leave the tomato intact",
        "Leave it as it is.",
        "leave it unbroken and uncut",
        "Could you keep it in one piece?",
        "The tomato should stay whole.",
        "I want the tomato whole",
        "A whole tomato is better",
        "better not",
        "I'd rather you didn't.",
        "Slice the bread and leave the tomato whole",
        "on second thought, put it in the fridge",
        "later",
        "Not now.",
        "do that later",
        "slice it tomorrow",
    ],
)
def test_a_polite_refusal_takes_leave_and_request_back(later: str) -> None:
    hearing = heard("slice the tomato", later)
    assert not hearing.permits("slice", "Tomato")
    assert not any(r.verb == "slice" and "Tomato" in r.object_types for r in hearing.wanted)


def test_a_wish_for_one_thing_whole_leaves_others_alone() -> None:
    hearing = heard("slice the bread", "keep the tomato whole")
    assert hearing.permits("slice", "Bread")
    assert hearing.refuses("slice", "Tomato")
    assert not hearing.refuses("put", "Tomato", "Fridge")
    assert heard("cook the potato", "I like it raw").refuses("cook", "Potato")
    assert heard("slice the whole bread").permits("slice", "Bread")


@pytest.mark.parametrize(
    "later",
    [
        "don't slice the bread",
        "please don't",
        "wait, stop",
        "never mind",
        "I changed my mind",
        "leave the bread alone",
        "not the bread",
        "just kidding",
        "put the bread in the fridge without slicing it",
        "cancel that",
    ],
)
def test_leave_is_taken_back_by_later_words(later: str) -> None:
    assert heard("slice the bread").permits("slice", "Bread")
    assert not heard("slice the bread", later).permits("slice", "Bread")


def test_leave_stands_while_other_things_are_spoken_of() -> None:
    assert heard("slice the bread", "Don't touch the vase.").permits("slice", "Bread")
    assert heard("slice the bread", "No, that's all.").permits("slice", "Bread")


@pytest.mark.parametrize(
    "reply",
    [
        "Yes",
        "yes please!",
        "Ok, go ahead.",
        "sure, slice it",
        "Of course",
        "do it, thanks",
        "OK",
        "okay.",
        "ok, please",
        "OK, do it",
        "Fine, go ahead",
    ],
)
def test_a_plain_yes_permits_what_was_asked(reply: str) -> None:
    query = f"You want sandwiches. {ask_permission('slice', 'bread')}"
    hearing = heard(Turn(query, reply))
    assert hearing.permits("slice", "Bread")
    assert not hearing.permits("slice", "Tomato")
    assert not hearing.permits("cook", "Bread")


@pytest.mark.parametrize(
    "reply",
    [
        "no",
        "No thanks",
        "yes?",
        "yes, but not yet",
        "ok if you must",
        "why?",
        "sure, ask me later",
        "go ahead and wait",
        "please",
        "yes and no",
        "don't",
        "please don't",
        "I said yes before, no more",
        "break the vase? yes? never",
        "Thank you.",
        "Please, thanks.",
        "Fine.",
        "That's fine",
        "OK, thanks.",
        "yes...",
        "ok, and put it on the counter",
        "Yes, but only if it is old",
        "Sure, not that one",
        "Sure, and break the mug",
        "Yes, and then break it",
        "Yes, put it on the counter",
        "Yes, and put it on the counter if it fits",
        "Yes, then put it in the cabinet later",
        "Yes, and keep it whole",
        "Yes, tomorrow",
        "Sure, and wash the mug. No, wait.",
        "I'd rather keep it whole",
        "I'd prefer it whole",
        "I'd rather keep the vase",
        "Leave it intact",
        "Better not",
        "On second thought, put it in the cabinet",
    ],
)
def test_anything_but_a_plain_yes_permits_nothing(reply: str) -> None:
    hearing = heard(Turn(ask_permission("break", "vase"), reply))
    assert not hearing.permits("break", "Vase")


@pytest.mark.parametrize(
    ("reply", "wanted"),
    [
        ("Sure, and put it on the plate", put("Plate", "Tomato")),
        ("Yes, then put it in the fridge.", put("Fridge", "Tomato")),
        ("Yes. Put the mug in the cabinet.", put("Cabinet", "Mug")),
        ("Go ahead, and wash the plate", [("clean", "Plate", "")]),
    ],
)
def test_orders_after_a_yes_are_heard(reply: str, wanted: list[tuple[str, str, str]]) -> None:
    hearing = heard(Turn(ask_permission("slice", "tomato"), reply))
    assert hearing.permits("slice", "Tomato")
    found = [(r.verb, *r.object_types, *(r.destination_types or ("",))) for r in hearing.wanted]
    assert found == wanted


def test_a_no_to_the_question_for_leave_is_a_refusal() -> None:
    hearing = heard(Turn(ask_permission("break", "vase"), "No, put it on the counter."))
    assert hearing.refuses("break", "Vase")
    assert hearing.wanted == (Request("put", ("Vase",), ("CounterTop",)),)


def test_a_yes_counts_for_the_last_question_only_and_for_the_one_thing_named() -> None:
    query = f"{ask_permission('break', 'vase')} What else would you like?"
    assert not heard(Turn(query, "yes")).permitted
    two = scene("Vase", "Vase")
    hearing = heard(Turn(ask_permission("break", "vase 2"), "yes"), objects=two)
    assert hearing.permits("break", "Vase", "vase 2")
    assert not hearing.permits("break", "Vase", "vase 1")


@pytest.mark.parametrize(
    "said",
    [
        "Task completed",
        "task complete.",
        "Great job! The task is complete.",
        "That's all, the task is completed",
        "You're done, thank you",
        "Thanks, we are done!",
        "All done. Thank you!",
        '"Task completed."',
        "Everything is done, thank you so much",
        "The task has been completed",
    ],
)
def test_who_says_that_the_task_is_complete_completes_it(said: str) -> None:
    assert completes(said)


@pytest.mark.parametrize(
    "said",
    [
        "Is the task completed?",
        "The task is not completed yet",
        "Say task completed when you are done",
        'Say "task completed" when you are done',
        "the task isn't complete",
        "task completed?",
        "task not completed",
        "Are you done?",
        "we're not done",
        "you're almost done",
        "When the task is complete, tell me",
        "If you are done, the task is complete",
        "Complete the task",
        "please finish the task",
        "finish the task now",
        "the task will be complete soon",
        "once you put the mug away the task is complete",
        "after that we are done",
        "I will tell you when the task is complete",
        "the task would be complete",
        "it says task completed",
        "he said the task is complete",
        "not done",
        "never done",
        "nothing is done",
        "the mug is done",
        "the coffee is done",
        "done with the coffee",
        "Put the mug away and we are done",
        "put the mug away. Then the task is complete.",
        "one more thing and the task is complete",
        "the task is complete, but close the fridge",
        "task completed, now close the fridge",
        "I wish the task was complete",
        "I don't think the task is complete",
        "do you think the task is complete",
        "half of the task is complete",
        "the first task is done",
        "the task is nearly complete",
        "the task is complete...",
        "the task is far from complete",
        "is everything done?",
        "let me know when you're done",
        "tell me you're done",
        "you're done when the plate is clean",
        "no",
        "that's all",
        "thanks",
        "great",
        "nothing else",
        "I'm done waiting",
        "we are done for, the vase is broken",
        "you're done cooking, now serve",
        "the task is to be completed",
        "what is the task?",
        "to complete the task put the mug away",
        "task completed is what I will say",
        "unless you slice the bread the task is complete",
        "suppose the task is complete",
        "the task: completed?",
        "'task completed' is the phrase",
        "before we are done, wash the mug",
        "the task can be completed",
        "has the task been completed",
        "we're done with the kitchen, go to the bathroom",
        "",
    ],
)
def test_negations_questions_conditions_and_quotations_complete_nothing(said: str) -> None:
    assert not completes(said)


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
