"""How the agent moves, what goes with it, and from where it sees and reaches what it asks for."""

from __future__ import annotations

import pytest

from houses import do, house, run, thing


@pytest.mark.parametrize(
    ("step", "x", "z", "yaw", "horizon"),
    [
        ("Crouch; Stand", 3.5, 2.5, 0, 0),
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


def test_what_is_gone_can_be_seen_from_nowhere() -> None:
    home = do(house(), "SliceObject Apple")
    assert run(home, "GetInteractablePoses Apple")["actionReturn"] == []
