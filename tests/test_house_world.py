"""What holds of the house after any actions at all, and of its metadata."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from goalscope.envs.house.simulator.rooms import read_room
from goalscope.envs.house.simulator.world import ACTIONS, House
from houses import ABOUT_THE_ACTION, act, do, facts, house, run, thing

ROOM = """name = "Small"
size = [3, 3]
agent = {position = [1.5, 1.5]}
"""
THINGS = {
    "DiningTable": "at = [2.0, 2.2]",
    "Fridge": "at = [0.5, 0.5]",
    "Plate": 'on = "DiningTable"',
    "Bowl": 'on = "DiningTable"',
    "Mug": 'on = "DiningTable"',
    "Egg": 'in = "Fridge"',
    "Apple": 'on = "DiningTable"',
    "Knife": 'on = "DiningTable"',
}


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("rooms") / "small.toml"
    things = "".join(f'[[object]]\ntype = "{kind}"\n{place}\n' for kind, place in THINGS.items())
    path.write_text(ROOM + things)
    return read_room(path)


LIKELY = ["PickupObject"] * 4 + ["PutObject"] * 4 + ["SliceObject", "BreakObject", "OpenObject"]
STEPS = st.lists(
    st.tuples(st.sampled_from(LIKELY + sorted(ACTIONS)), st.integers(0, 40), st.booleans()),
    max_size=25,
)


def steps_of(home: House, steps: list[tuple[str, int, bool]]) -> list[dict[str, Any]]:
    """The metadata after each of the steps."""
    found: list[dict[str, Any]] = []
    for name, number, force in steps:
        ids = list(home.state.objects)
        target = {"objectId": ids[number % len(ids)]} if "Object" in name else {}
        target = {} if name == "DropHandObject" else target
        liquid = {"fillLiquid": "water"} if name == "FillObjectWithLiquid" else {}
        forced = {} if name == "Pass" else {"forceAction": force}
        found.append(home.step({"action": name, **target, **liquid, **forced}))
    return found


def check(metadata: dict[str, Any]) -> None:
    """What holds of every house."""
    things = {each["objectId"]: each for each in metadata["objects"]}
    assert len(things) == len(metadata["objects"])
    links = {(own, up) for own, each in things.items() for up in each["parentReceptacles"] or ()}
    mirrored = {
        (own, up) for up, each in things.items() for own in each["receptacleObjectIds"] or ()
    }
    assert links == mirrored
    assert not {(own, up) for own, up in links if own == up or (up, own) in links}
    held = [own for own, each in things.items() if each["isPickedUp"]]
    assert [each["objectId"] for each in metadata["inventoryObjects"]] == held
    assert len(held) <= 1
    assert all(not things[own]["parentReceptacles"] for own in held)
    assert not [own for own, each in things.items() if each["isSliced"] and each["visible"]]
    json.dumps(metadata, allow_nan=False)


@settings(max_examples=60)
@given(steps=STEPS)
def test_any_actions_leave_the_house_in_order_and_failures_leave_it_as_it_was(
    small: Any, steps: list[tuple[str, int, bool]]
) -> None:
    home = House(small)
    before = facts(home)
    for step in steps:
        (metadata,) = steps_of(home, [step])
        check(metadata)
        after = facts(home)
        assert metadata["lastActionSuccess"] == (metadata["errorMessage"] == "")
        if not metadata["lastActionSuccess"]:
            assert after == before
        before = after


@settings(max_examples=25)
@given(steps=STEPS)
def test_the_same_actions_lead_to_the_same_house_and_earlier_metadata_stays(
    small: Any, steps: list[tuple[str, int, bool]]
) -> None:
    home = House(small)
    written = [json.dumps(steps_of(home, [step])) for step in steps]
    metadata = steps_of(House(small), steps)
    assert [json.dumps([each]) for each in metadata] == written
    assert facts(House(small)) == facts(House(small))


def test_metadata_has_the_keys_of_ai2_thor() -> None:
    metadata = house().metadata()
    assert set(ABOUT_THE_ACTION) < set(metadata)
    assert metadata["sceneName"] == "Kitchen1"
    assert metadata["lastAction"] == "Initialize"
    home = do(house(), "PickupObject Egg")
    egg = thing(home, "Egg")
    assert home.metadata()["heldObjectPose"]["position"] == egg["position"]
    assert home.metadata()["inventoryObjects"] == [
        {"objectId": egg["objectId"], "objectType": "Egg"}
    ]


@pytest.mark.parametrize("step", ["Pass", "Teleport x=1 rotation=90", "PickupObject Egg", "Crouch"])
def test_hand_and_camera_are_before_and_above_the_agent(step: str) -> None:
    metadata = do(house(), step).metadata()
    at, turn = metadata["agent"]["position"], metadata["agent"]["rotation"]["y"]
    held = metadata["heldObjectPose"]
    ahead = {"x": 0.38 * (turn == 90), "y": 0.515, "z": 0.38 * (turn == 0)}
    assert {a: held["position"][a] - at[a] for a in "xyz"} == pytest.approx(ahead)
    assert held["rotation"]["y"] == turn
    assert held["localPosition"] == pytest.approx({"x": 0, "y": -0.16, "z": 0.38})
    height = at["y"] if step == "Crouch" else at["y"] + 0.675
    assert metadata["cameraPosition"] == pytest.approx({**at, "y": height})


def test_the_scene_is_bounded_by_what_is_in_it_and_by_a_ceiling() -> None:
    home = house()
    bounds = home.metadata()["sceneBounds"]
    for axis, name in enumerate("xyz"):
        ends = [corner[axis] for corner in bounds["cornerPoints"]]
        half = bounds["size"][name] / 2
        assert [min(ends), max(ends)] == pytest.approx(
            [bounds["center"][name] - half, bounds["center"][name] + half]
        )
        for each in home.state.objects.values():
            corners = [row[axis] for row in each["axisAlignedBoundingBox"]["cornerPoints"]]
            assert min(ends) <= min(corners) + 1e-9 <= max(corners) <= max(ends) + 1e-9
    assert len(bounds["cornerPoints"]) == len({*map(tuple, bounds["cornerPoints"])}) == 8
    assert bounds["size"]["y"] >= 2.6


def test_metadata_has_every_key_of_a_recording_of_ai2_thor() -> None:
    data = os.environ.get("GOALSCOPE_DATA")
    if not data:
        pytest.skip("GOALSCOPE_DATA is unset: it names the folder with AI2-THOR's recordings")
    paths = sorted((Path(data) / "thor" / "traces").glob("*.jsonl.gz"))
    assert paths
    ours = house().metadata()
    for path in paths:
        rows = gzip.decompress(path.read_bytes()).splitlines()
        real = [json.loads(row)["metadata"] for row in rows]
        for each in real:
            assert set(ours) == set(each)
            assert set(ours["objects"][0]) == set(each["objects"][0])
            for key in ("agent", "heldObjectPose", "sceneBounds"):
                assert set(ours[key]) == set(each[key])
        for key in ("arm", "colors", "depthFormat", "fov", "cameraOrthSize", "visibleRange",
                    "flatSurfacesOnGrid", "distances", "normals", "isOpenableGrid",
                    "segmentedObjectIds", "objectIdsInBox", "actionIntReturn", "screenWidth",
                    "actionFloatReturn", "actionStringsReturn", "actionFloatsReturn",
                    "actionVector3sReturn"):  # fmt: skip
            assert ours[key] == real[-1][key], key


def test_the_callers_metadata_is_not_the_next_ones() -> None:
    home = house()
    first = home.metadata()
    for value in first.values():
        if isinstance(value, list):
            value.append("mine")
    first["heldObjectPose"]["position"]["x"] = 99
    assert "mine" not in str(home.metadata())
    assert home.metadata()["heldObjectPose"]["position"]["x"] != 99


@pytest.mark.parametrize("step", ["GetReachablePositions", "GetInteractablePoses Toaster"])
def test_a_question_takes_no_time_and_changes_nothing(step: str) -> None:
    home = do(house(), "PickupObject Egg")
    before = facts(home)
    for _ in range(5):
        assert run(home, step)["lastActionSuccess"]
    assert facts(home) == before
    do(home, "Pass")
    assert home.state.clock > before["currentTime"]


ENGINE = {"speed": 1, "returnToStart": True, "disableRendering": True, "renderImage": False}
OF_AN_OBJECT = {"x": 0.5, "y": 0.5, "placeStationary": False, "manualInteract": True,
                "putNearXY": True, "randomizeOpen": True, "continuous": False}  # fmt: skip


def test_arguments_for_the_engine_change_nothing() -> None:
    steps = ["MoveAhead", "RotateLeft", "PickupObject Egg", "PutObject CounterTop"]
    plain, full = do(house(), *steps), house()
    for step in steps:
        name, *words = step.split()
        given = ENGINE | (OF_AN_OBJECT if words else {})
        assert act(full, name, *words, **given)["lastActionSuccess"]
    assert facts(full) == facts(plain)
