"""Rooms written by hand become scenes with AI2-THOR's metadata, or are refused with the remedy."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator.object_types import object_types
from goalscope.envs.house.simulator.scenes import load_scene, read_room
from goalscope.envs.house.simulator.state import GRID, REACH, Box, Scene, State, box_of

ROOMS = ["Bathroom1", "Bedroom1", "Kitchen1", "LivingRoom1"]

HEAD = """name = "Test"
size = [4, 3]
agent = {position = [2, 1.5]}
"""
TABLE = '[[object]]\ntype = "DiningTable"\nat = [0.7, 0.6]\n'
APPLE = '[[object]]\ntype = "Apple"\n'
FRIDGE = '[[object]]\ntype = "Fridge"\nat = [3.4, 2.5]\n'
GOOD = HEAD + TABLE + APPLE + 'on = "DiningTable"\n'


def room(folder: Path, text: str) -> Scene:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return read_room(path)


def by_type(scene: Scene) -> dict[str, dict[str, Any]]:
    return {thing["objectType"]: dict(thing) for thing in scene.objects}


def inside(inner: Box, outer: Box, slack: float = 0.001) -> bool:
    return all(
        outer.low(axis) - slack <= inner.low(axis) and inner.high(axis) <= outer.high(axis) + slack
        for axis in range(3)
    )


def connected(state: State) -> set[tuple[int, int]]:
    """The grid's points to which the agent can walk, in steps from its start."""
    x, _, z = state.pose.position
    free = {(round((p[0] - x) / GRID), round((p[2] - z) / GRID)) for p in state.reachable()}
    seen, waiting = set[tuple[int, int]](), [(0, 0)]
    while waiting:
        i, k = waiting.pop()
        if (i, k) in free - seen:
            seen.add((i, k))
            waiting += [(i + 1, k), (i - 1, k), (i, k + 1), (i, k - 1)]
    return seen


def test_an_object_has_the_metadata_of_its_type(tmp_path: Path) -> None:
    things = by_type(room(tmp_path, GOOD))
    apple, table, floor = things["Apple"], things["DiningTable"], things["Floor"]
    kind = object_types()["Apple"]
    assert (apple["pickupable"], apple["sliceable"], apple["openable"]) == (True, True, False)
    assert (apple["mass"], apple["salientMaterials"]) == (kind.mass, ["Food"])
    assert table["objectId"] == "DiningTable|+00.70|+00.00|+00.60"
    assert table["receptacleObjectIds"] == [apple["objectId"]]
    assert apple["parentReceptacles"] == [table["objectId"]]
    assert table["parentReceptacles"] == [floor["objectId"]]
    assert floor["axisAlignedBoundingBox"]["size"]["x"] == 4
    assert apple["receptacleObjectIds"] is None
    assert box_of(apple).low(1) == pytest.approx(box_of(table).high(1))
    assert apple["temperature"] == "RoomTemp"


def test_a_turned_object_has_turned_boxes(tmp_path: Path) -> None:
    sofa = '[[object]]\ntype = "Sofa"\nat = [0.6, 1.5]\nsize = [2, 1, 1]\nrotation = '
    turned = by_type(room(tmp_path, HEAD + sofa + "90\n"))["Sofa"]
    assert box_of(turned).size == pytest.approx((1, 1, 2))
    askew = by_type(room(tmp_path, (HEAD + sofa + "45\n").replace("0.6, 1.5", "1.1, 1.5")
                         .replace("[2, 1.5]", "[3.5, 1]")))["Sofa"]  # fmt: skip
    assert box_of(askew).size == pytest.approx((math.sqrt(4.5), 1, math.sqrt(4.5)))


def test_food_in_the_fridge_is_cold_and_inside_it(tmp_path: Path) -> None:
    things = by_type(room(tmp_path, HEAD + FRIDGE + APPLE + 'in = "Fridge"\n'))
    assert things["Apple"]["temperature"] == "Cold"
    assert inside(box_of(things["Apple"]), box_of(things["Fridge"]))
    warm = by_type(room(tmp_path, HEAD + FRIDGE + APPLE + 'in = "Fridge"\ntemperature = "Hot"\n'))
    assert warm["Apple"]["temperature"] == "Hot"


def test_what_stands_on_a_plate_on_a_table_is_on_both(tmp_path: Path) -> None:
    plate = '[[object]]\ntype = "Plate"\non = "DiningTable"\n'
    things = by_type(room(tmp_path, HEAD + TABLE + plate + APPLE + 'on = "Plate"\n'))
    both = sorted(things[kind]["objectId"] for kind in ("Plate", "DiningTable"))
    assert things["Apple"]["parentReceptacles"] == both
    assert things["Apple"]["objectId"] in things["DiningTable"]["receptacleObjectIds"]


def test_states_are_those_that_were_written(tmp_path: Path) -> None:
    mug = '[[object]]\ntype = "Mug"\non = "DiningTable"\nisDirty = true\nfillLiquid = "coffee"\n'
    switch = '[[object]]\ntype = "LightSwitch"\nat = [0.1, 1.2, 0.1]\n'
    things = by_type(room(tmp_path, HEAD + TABLE + mug + switch + FRIDGE + "isOpen = true\n"))
    assert (things["Mug"]["isDirty"], things["Mug"]["fillLiquid"]) == (True, "coffee")
    assert things["Mug"]["isFilledWithLiquid"]
    assert (things["Fridge"]["isOpen"], things["Fridge"]["openness"]) == (True, 1.0)
    assert things["LightSwitch"]["isToggled"]
    assert not things["DiningTable"]["isOpen"]


def test_a_basin_belongs_to_its_sink_and_a_knob_to_its_burner() -> None:
    things = {thing["objectId"]: thing for thing in load_scene("Kitchen1").objects}
    (sink,) = (thing for thing in things.values() if thing["objectType"] == "Sink")
    assert things[f"{sink['objectId']}|SinkBasin"]["objectType"] == "SinkBasin"
    knobs = [thing for thing in things.values() if thing["objectType"] == "StoveKnob"]
    burners = [burner for knob in knobs for burner in knob["controlledObjects"]]
    assert len(set(burners)) == len(knobs) == 4
    assert {things[burner]["objectType"] for burner in burners} == {"StoveBurner"}
    assert not any(things[burner]["toggleable"] for burner in burners)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (GOOD.replace("[2, 1.5]", "[0.7, 0.6]"), "agent: there is no place to stand"),
        (GOOD.replace("Apple", "Appel"), "object 2: .*'Appel' .* did you mean 'Apple'"),
        (GOOD.replace("Apple", "Floor"), "floor already"),
        (GOOD.replace('on = "DiningTable"', 'on = "DinningTable"'), "did you mean 'DiningTable'"),
        (GOOD + "at = [1, 1]\n", "exactly one of the keys"),
        (GOOD + "isDirty = true\n", "Apple, which is not dirtyable"),
        (GOOD + "size = [3, 0.1, 0.1]\n", "no room for it in or on the DiningTable"),
        (GOOD + 'label = "a\\u001bb"\n', "'label' has invisible characters"),
        (GOOD + 'label = "Fridge"\n', "'Fridge': this label is taken"),
        (GOOD + 'controls = "DiningTable"\n', "'controls' is for a StoveKnob"),
        (GOOD + APPLE + 'on = "Apple"\n', "Apple is not a receptacle"),
        (GOOD + TABLE, "another one is at the same place"),
        (GOOD + TABLE.replace("0.7", "1.9") + APPLE + 'on = "DiningTable"', "are 2 of it"),
        (GOOD + TABLE.replace("0.7", "9"), "DiningTable: it reaches outside the room"),
        (GOOD + '[[object]]\ntype = "SinkBasin"\nat = [1, 1]\n', "must be in a Sink"),
        (GOOD + '[[object]]\ntype = "StoveKnob"\nat = [1, 1, 1]\n', "label of a StoveBurner"),
        (
            GOOD + '[[object]]\ntype = "Toaster"\non = "DiningTable"\n' + APPLE + 'in = "Toaster"',
            "a Toaster holds one BreadSliced",
        ),
    ],
)
def test_a_wrong_room_is_refused_with_place_and_remedy(
    tmp_path: Path, text: str, told: str
) -> None:
    with pytest.raises(InvalidInputError, match=told) as refusal:
        room(tmp_path, text)
    assert "mine.toml" in str(refusal.value)


@pytest.mark.parametrize("name", ROOMS)
def test_our_rooms_are_consistent(name: str) -> None:
    scene = load_scene(name)
    things = {thing["objectId"]: thing for thing in scene.objects}
    assert scene.name == name
    assert 30 <= len(things) <= 60
    assert len(things) == len(scene.objects) == len({thing["name"] for thing in scene.objects})
    for own, thing in things.items():
        for each in thing["receptacleObjectIds"] or ():
            assert own in things[each]["parentReceptacles"]
        for parent in thing["parentReceptacles"] or ():
            assert own in things[parent]["receptacleObjectIds"]
            if things[parent]["objectType"] in ("Fridge", "Cabinet", "Drawer", "LaundryHamper"):
                assert inside(box_of(thing), box_of(things[parent]))


@pytest.mark.parametrize("name", ROOMS)
def test_the_agent_can_walk_to_within_reach_of_everything(name: str) -> None:
    state = State(load_scene(name))
    x, _, z = state.pose.position
    places = [(x + i * GRID, z + k * GRID) for i, k in connected(state)]
    assert len(places) > 0.85 * len(state.reachable())
    assert len(places) * GRID * GRID > 3
    for thing in state.objects.values():
        away = min(box_of(thing).distance(*place) for place in places)
        assert away < REACH - 0.3, thing["objectId"]
