"""What holds of the house after any actions, of its metadata, of motion, and of its controller."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator.scenes import load_scene, read_room
from goalscope.envs.house.simulator.world import ACTIONS, House, HouseController
from houses import do, facts, house, run, thing

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


def test_objects_and_agent_have_every_key_of_a_recording_of_ai2_thor() -> None:
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
            assert set(ours) < set(each)
            assert set(ours["objects"][0]) == set(each["objects"][0])
            assert set(ours["agent"]) == set(each["agent"])


@pytest.mark.parametrize("step", ["GetReachablePositions", "GetInteractablePoses Toaster"])
def test_a_question_takes_no_time_and_changes_nothing(step: str) -> None:
    home = do(house(), "PickupObject Egg")
    before = facts(home)
    for _ in range(5):
        assert run(home, step)["lastActionSuccess"]
    assert facts(home) == before
    do(home, "Pass")
    assert home.state.clock > before["currentTime"]


@pytest.mark.parametrize(
    ("step", "x", "z", "yaw", "horizon"),
    [
        ("MoveAhead", 3.5, 2.75, 0, 0),
        ("MoveBack", 3.5, 2.25, 0, 0),
        ("MoveLeft", 3.25, 2.5, 0, 0),
        ("MoveRight", 3.75, 2.5, 0, 0),
        ("MoveRight moveMagnitude=0.5", 4.0, 2.5, 0, 0),
        ("RotateRight; MoveAhead", 3.75, 2.5, 90, 0),
        ("RotateLeft; MoveAhead", 3.25, 2.5, 270, 0),
        ("RotateRight degrees=45", 3.5, 2.5, 45, 0),
        ("Teleport x=1 rotation=450 horizon=30", 1, 2.5, 90, 30),
        ('Teleport position={"x":1,"z":2.25} rotation={"y":180}', 1, 2.25, 180, 0),
    ],
)
def test_the_agent_goes_where_it_is_told(
    step: str, x: float, z: float, yaw: float, horizon: float
) -> None:
    agent = do(house(), step.replace("; Move", " forceAction=false; Move")).state.agent
    assert (agent["position"]["x"], agent["position"]["z"]) == pytest.approx((x, z))
    assert (agent["rotation"]["y"], agent["cameraHorizon"]) == pytest.approx((yaw, horizon))
    assert (agent["position"]["y"], agent["isStanding"]) == (0.9, True)


@pytest.mark.parametrize("y", [0.79, 1.01])
def test_the_agent_is_set_neither_into_the_air_nor_into_the_floor(y: float) -> None:
    home = house()
    pose = f"x=1 y={y} z=2.5"
    metadata = run(home, f"Teleport {pose} forceAction=false")
    assert "would not stand on the floor" in metadata["errorMessage"]
    assert metadata["agent"]["position"]["x"] == 3.5
    assert do(home, f"Teleport {pose}").state.agent["position"]["y"] == y
    do(home, "Teleport y=0.9 forceAction=false")
    do(home, "Teleport y=0.95 forceAction=false")


def test_what_is_held_goes_with_the_hand() -> None:
    home = do(house(), "PickupObject Mug; PutObject Plate; PickupObject Plate")
    apart = [thing(home, "Mug")["position"][a] - thing(home, "Plate")["position"][a] for a in "xyz"]
    do(home, "Teleport x=1 rotation=90")
    plate, mug = thing(home, "Plate")["position"], thing(home, "Mug")["position"]
    assert (plate["x"], plate["z"]) == pytest.approx((1.38, 2.5))
    assert [mug[axis] - plate[axis] for axis in "xyz"] == pytest.approx(apart)
    assert thing(home, "Plate")["visible"]


def test_reachable_positions_are_free_and_stay_so_wherever_the_agent_is() -> None:
    home = house()
    places = run(home, "GetReachablePositions forceAction=false")["actionReturn"]
    assert {"x": 3.5, "y": 0.9, "z": 2.5} in places
    for place in places:
        assert home.step({"action": "Teleport", "position": place})["lastActionSuccess"]
    do(home, "Teleport x=1.1 z=2.6")
    assert run(home, "GetReachablePositions")["actionReturn"] == places
    late = do(house(), "Teleport x=1.1 z=2.6")
    assert run(late, "GetReachablePositions")["actionReturn"] == places


def test_furniture_that_is_pushed_away_leaves_its_place_free() -> None:
    home = do(house(), "Teleport x=1.85 z=2.5 rotation=180")
    place = dict(thing(home, "Chair")["position"])
    blocked = {"x": place["x"], "z": place["z"]}
    assert not home.step({"action": "Teleport", "position": blocked})["lastActionSuccess"]
    do(home, 'PullObject Chair moveMagnitude="200"')
    assert thing(home, "Chair")["position"] != place
    assert home.step({"action": "Teleport", "position": blocked})["lastActionSuccess"]


def test_from_an_interactable_pose_the_object_is_seen() -> None:
    home = house()
    poses = run(home, "GetInteractablePoses Toaster")["actionReturn"]
    assert len(poses) > 20
    assert {pose["standing"] for pose in poses} == {True, False}
    for pose in poses:
        place = {axis: pose[axis] for axis in "xyz"}
        rest = {key: pose[key] for key in ("rotation", "horizon", "standing")}
        assert home.step({"action": "Teleport", "position": place, **rest})["lastActionSuccess"]
        assert thing(home, "Toaster")["visible"]


def things(controller: HouseController) -> dict[str, dict[str, Any]]:
    return {each["objectId"]: each for each in controller.last_event.metadata["objects"]}


def test_an_event_is_true_where_its_action_succeeded() -> None:
    controller = HouseController("Kitchen1")
    fridge = next(own for own in things(controller) if own.startswith("Fridge"))
    event = controller.step("OpenObject", objectId=fridge, forceAction=True)
    assert event
    assert event is controller.last_event
    assert things(controller)[fridge]["isOpen"]
    again = controller.step(action="OpenObject", objectId=fridge, forceAction=True)
    assert not again
    assert again.metadata["errorMessage"] == "Object already open"
    with pytest.raises(ValueError, match=r"position\.x must be a number"):
        controller.step("Teleport", x="far")


def test_a_scene_is_a_name_a_scene_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "other.json"
    file.write_text(json.dumps(HouseController("Bathroom1").last_event.metadata))
    named = {"Kitchen1": "Kitchen1", load_scene("Bedroom1"): "Bedroom1", str(file): "Bathroom1"}
    for scene, name in named.items():
        assert HouseController(scene).last_event.metadata["sceneName"] == name
    with pytest.raises(InvalidInputError, match="There is no scene ''"):
        HouseController("")


def test_a_reset_house_is_a_new_one() -> None:
    controller = HouseController("Kitchen1")
    first = json.dumps(controller.last_event.metadata)
    for own in things(controller):
        for name in ("OpenObject", "ToggleObjectOn", "SliceObject", "PickupObject"):
            controller.step(name, objectId=own, forceAction=True)
    controller.step("Teleport", x=1.0, rotation=90, forceAction=True)
    assert json.dumps(controller.last_event.metadata) != first
    assert json.dumps(controller.reset().metadata) == first
    controller.stop()
