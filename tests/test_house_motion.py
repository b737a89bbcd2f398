"""How the agent moves, what goes with it, and from where it sees and reaches what it asks for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from goalscope.envs.house.simulator.world import House
from houses import act, do, house, run, thing


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
        ("LookDown", 3.5, 2.5, 0, 30),
        ("LookUp degrees=10", 3.5, 2.5, 0, -10),
        ("Teleport x=1 rotation=450 horizon=30", 1, 2.5, 90, 30),
        ('Teleport position={"x":1,"z":2.25} rotation={"y":180}', 1, 2.25, 180, 0),
        ("TeleportFull x=1 y=0.9 z=2.5 rotation=90 horizon=30 standing=true", 1, 2.5, 90, 30),
    ],
)
def test_the_agent_goes_where_it_is_told(
    step: str, x: float, z: float, yaw: float, horizon: float
) -> None:
    agent = do(house(), step.replace("; Move", " forceAction=false; Move")).state.agent
    assert (agent["position"]["x"], agent["position"]["z"]) == pytest.approx((x, z))
    assert (agent["rotation"]["y"], agent["cameraHorizon"]) == pytest.approx((yaw, horizon))
    assert (agent["position"]["y"], agent["isStanding"]) == (0.9, True)


@pytest.mark.parametrize("y", [-5.0, 0.0, 0.79, 1.01, 1.575, 40.0])
def test_the_agent_is_set_neither_into_the_air_nor_into_the_floor(y: float) -> None:
    home = house()
    pose = f"x=1 y={y} z=2.5"
    for step in (f"Teleport {pose}", f"TeleportFull {pose} rotation=0 horizon=0 standing=true"):
        metadata = run(home, f"{step} forceAction=false")
        assert "would not stand on the floor" in metadata["errorMessage"]
        assert metadata["agent"]["position"]["x"] == 3.5
    assert do(home, f"Teleport {pose}").state.agent["position"]["y"] == y
    do(home, "Teleport y=0.9 forceAction=false")
    do(home, "Teleport y=0.95 forceAction=false")


def test_crouching_and_standing_undo_each_other() -> None:
    home = do(house(), "Crouch")
    assert home.metadata()["agent"]["isStanding"] is False
    assert do(home, "Stand").metadata()["agent"]["isStanding"] is True
    assert do(home, "Teleport standing=false").metadata()["agent"]["isStanding"] is False


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


def test_reachable_positions_have_the_grid_asked_for() -> None:
    home = do(house(), "Teleport x=1.1 z=2.6")
    usual = run(home, "GetReachablePositions")["actionReturn"]
    coarse = run(home, "GetReachablePositions gridSize=0.5")["actionReturn"]
    fine = run(home, "GetReachablePositions gridSize=0.125")["actionReturn"]
    assert run(home, "GetReachablePositions gridSize=0.25")["actionReturn"] == usual
    assert all(each in usual for each in coarse)
    assert all(each in fine for each in usual)
    assert len(coarse) * 2 < len(usual) < len(fine) / 2
    assert run(home, "GetReachablePositions")["actionReturn"] == usual
    lost = House(replace(home.state.scene, agent=None))
    free = run(lost, "GetReachablePositions")["actionReturn"]
    assert free[0] in run(lost, "GetReachablePositions gridSize=0.5")["actionReturn"]


@pytest.mark.parametrize("grid", ["0", "-1", "1e-9", "99", "true", '"small"', "[]"])
def test_a_grid_that_cannot_be_is_refused(grid: str) -> None:
    metadata = run(house(), f"GetReachablePositions gridSize={grid}")
    assert (metadata["errorCode"], metadata["actionReturn"]) == ("InvalidArgument", None)


@pytest.mark.parametrize("most", ["0", "-1", "0.5"])
def test_fewer_poses_than_one_cannot_be_asked_for(most: str) -> None:
    metadata = run(house(), f"GetInteractablePoses Toaster maxPoses={most}")
    assert metadata["errorCode"] == "InvalidArgument"
    assert metadata["errorMessage"] == "maxPoses must be at least 1"


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
        assert home.step({"action": "TeleportFull", "position": place, **rest})["lastActionSuccess"]
        assert thing(home, "Toaster")["visible"]


def test_interactable_poses_are_among_those_asked_for() -> None:
    home = house()
    asked: dict[str, Any] = {
        "positions": [{"x": 4.0, "y": 0.9, "z": 3.0}, {"x": 0.5, "y": 0.9, "z": 0.5}],
        "rotations": range(0, 360, 45),
        "horizons": (0.0,),
        "standings": [True],
    }
    poses = act(home, "GetInteractablePoses", "Toaster", **asked)["actionReturn"]
    assert {pose["rotation"] for pose in poses} >= {45, 90}
    assert all((pose["x"], pose["horizon"], pose["standing"]) == (4.0, 0, True) for pose in poses)
    assert run(home, "GetInteractablePoses Toaster maxPoses=3")["actionReturn"][2:]
    assert len(run(home, "GetInteractablePoses Toaster maxPoses=3")["actionReturn"]) == 3
    assert run(home, "GetInteractablePoses Toaster positions=[]")["actionReturn"] == []
    do(home, "SliceObject Apple")
    assert run(home, "GetInteractablePoses Apple")["actionReturn"] == []
