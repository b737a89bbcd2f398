"""What happens by itself in the house, and what holds of it after any actions at all."""

from __future__ import annotations

import gzip
import json
import math
import os
import warnings
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from goalscope.envs.house.controller import Event, HouseController
from goalscope.envs.house.rooms import read_room
from goalscope.envs.house.scenes import load_scene
from goalscope.envs.house.world import ACTIONS, House
from goalscope.types import InvalidInputError
from houses import ABOUT_THE_ACTION, act, do, facts, house, named, run, thing

BY_ITSELF = """
OpenObject Fridge; PickupObject Apple; PutObject Fridge -> Apple temperature="Cold"
PickupObject Apple; PutObject Pan -> Apple isCooked=false temperature="RoomTemp"
ToggleObjectOn StoveKnob -> Pan temperature="Hot"
ToggleObjectOn StoveKnob:1 -> Pan temperature="RoomTemp"
ToggleObjectOn StoveKnob; PickupObject Potato; PutObject Pan -> Potato isCooked=true
ToggleObjectOn StoveKnob; PickupObject Potato; PutObject Pan -> Potato temperature="Hot"
PickupObject Potato; PutObject Pan; ToggleObjectOn StoveKnob -> Potato isCooked=true
ToggleObjectOn StoveKnob; PickupObject Apple; PutObject Pan -> Apple isCooked=false
PickupObject Potato; PutObject Pan; PickupObject Pan; ToggleObjectOn StoveKnob -> Potato \
isCooked=false
SliceObject Bread; PickupObject BreadSliced; PutObject Toaster -> BreadSliced isCooked=false
SliceObject Bread; PickupObject BreadSliced; PutObject Toaster; ToggleObjectOn Toaster -> \
BreadSliced isCooked=true temperature="Hot"
OpenObject Microwave; PickupObject Potato; PutObject Microwave -> Potato isCooked=false
OpenObject Microwave; PickupObject Potato; PutObject Microwave; CloseObject Microwave; \
ToggleObjectOn Microwave -> Potato isCooked=true temperature="Hot"
PickupObject Mug; PutObject CoffeeMachine -> Mug isFilledWithLiquid=false
PickupObject Mug; PutObject CoffeeMachine; ToggleObjectOn CoffeeMachine -> Mug \
isFilledWithLiquid=true fillLiquid="coffee" temperature="Hot"
PickupObject Mug; PutObject CoffeeMachine; FillObjectWithLiquid Mug fillLiquid="wine"; \
ToggleObjectOn CoffeeMachine -> Mug fillLiquid="wine" temperature="RoomTemp"
PickupObject Mug:1; PutObject SinkBasin -> Mug:1 isDirty=true isFilledWithLiquid=false
PickupObject Mug:1; PutObject SinkBasin; ToggleObjectOn Faucet -> Mug:1 isDirty=false \
isFilledWithLiquid=true fillLiquid="water"
ToggleObjectOn Faucet; PickupObject Mug:1; PutObject SinkBasin; ToggleObjectOff Faucet; \
EmptyLiquidFromObject Mug:1 -> Mug:1 isFilledWithLiquid=false
DirtyObject Plate; ToggleObjectOn Faucet -> Plate isDirty=true
PickupObject Mug:1; PutObject CounterTop; ToggleObjectOn Faucet -> Mug:1 isDirty=true
BreakObject Mug:1 -> Mug:1 isBroken=true isDirty=true
"""
"""Steps in Kitchen1, and what then is so."""


@pytest.mark.parametrize("row", BY_ITSELF.strip().splitlines())
def test_heat_cold_water_and_coffee_do_their_work_at_once(row: str) -> None:
    steps, _, states = row.partition(" -> ")
    words, *pairs = states.split()
    found = thing(do(house(), steps), words)
    wanted = {key: json.loads(value) for key, value in (pair.split("=") for pair in pairs)}
    assert {key: found[key] for key in wanted} == wanted


def test_coffee_is_emptied_and_brewed_anew() -> None:
    home = do(house(), "PickupObject Mug; PutObject CoffeeMachine; ToggleObjectOn CoffeeMachine")
    do(home, "EmptyLiquidFromObject Mug; Pass")
    assert thing(home, "Mug")["fillLiquid"] == "coffee"


def test_a_tap_fills_nothing_that_is_closed_and_only_its_own_basin() -> None:
    home = house("Bathroom1")
    do(
        home,
        "DirtyObject Cloth; PickupObject Cloth; PutObject BathtubBasin; ToggleObjectOn Faucet:1",
    )
    assert thing(home, "Cloth")["isDirty"]
    do(home, "ToggleObjectOn Faucet")
    assert not thing(home, "Cloth")["isDirty"]


def test_a_tap_rinses_no_counter_around_its_basin() -> None:
    home = house()
    basin = thing(home, "SinkBasin")
    old, new = basin["objectId"], "SinkBasin|+01.40|+00.80|+03.66"
    home.state.objects = {
        (new if own == old else own): {**each, "objectId": new} if own == old else each
        for own, each in home.state.objects.items()
    }
    home.state.attach(home.state.objects[new], [named(home, "CounterTop")])
    do(home, "PickupObject Mug:1; PutObject CounterTop; ToggleObjectOn Faucet")
    assert thing(home, "Mug:1")["isDirty"]


@pytest.mark.parametrize(
    ("steps", "words", "temperature"),
    [
        ("PickupObject Egg", "Egg", "Cold"),
        ("ToggleObjectOn StoveKnob; PickupObject Pan", "Pan", "Hot"),
        ('FillObjectWithLiquid Cup fillLiquid="coffee"', "Cup", "Hot"),
    ],
)
def test_what_is_hot_or_cold_has_the_rooms_temperature_after_ten_seconds(
    steps: str, words: str, temperature: str
) -> None:
    home = do(house(), steps)
    home.advance(9.9)
    assert thing(home, words)["temperature"] == temperature
    home.advance(0.2)
    assert thing(home, words)["temperature"] == "RoomTemp"


@pytest.mark.parametrize(
    ("steps", "words", "temperature"),
    [
        ("Pass", "Egg", "Cold"),
        ("OpenObject Fridge", "Egg", "Cold"),
        ("ToggleObjectOn StoveKnob", "Pan", "Hot"),
        ("ToggleObjectOn StoveKnob; ToggleObjectOff StoveKnob", "Pan", "Hot"),
    ],
)
def test_what_stays_at_heat_or_cold_keeps_it(steps: str, words: str, temperature: str) -> None:
    home = do(house(), steps)
    for _ in range(10):
        home.advance(5)
    assert thing(home, words)["temperature"] == temperature


def test_the_clock_runs_with_every_action_that_succeeds() -> None:
    home = house()
    for _ in range(5):
        run(home, "OpenObject Fridge")
    assert home.metadata()["currentTime"] == pytest.approx(0.02)
    home.advance(3)
    assert home.metadata()["currentTime"] == pytest.approx(3.02)


def test_slices_of_what_is_cooked_and_cold_are_so_too() -> None:
    home = do(house(), "CookObject Potato; SliceObject Potato; SliceObject Lettuce")
    assert thing(home, "PotatoSliced")["isCooked"]
    assert thing(home, "LettuceSliced")["temperature"] == "Cold"
    assert thing(home, "LettuceSliced")["parentReceptacles"] == [named(home, "Fridge")]


def test_what_lies_in_a_carried_thing_goes_with_it_at_any_depth() -> None:
    home = do(house(), "OpenObject Microwave; PickupObject SaltShaker; PutObject Mug")
    do(home, "PickupObject Mug; PutObject Bowl")
    do(home, "PickupObject Bowl; PutObject Plate; PickupObject Plate; PutObject Microwave")
    plate, bowl, mug = (named(home, kind) for kind in ("Plate", "Bowl", "Mug"))
    oven, counter = thing(home, "Microwave"), named(home, "CounterTop:1")
    assert oven["parentReceptacles"] == [counter]
    assert thing(home, "SaltShaker")["parentReceptacles"] == sorted(
        [plate, bowl, mug, oven["objectId"]]
    )
    assert math.dist(*(thing(home, kind)["position"].values() for kind in ("Mug", "Plate"))) < 0.3


def test_a_scenes_one_sided_list_carries_at_any_depth() -> None:
    home = do(house(), "PickupObject SaltShaker; PutObject Mug:1; PickupObject Mug:1")
    do(home, "PutObject Plate")
    plate, salt = thing(home, "Plate"), thing(home, "SaltShaker")
    plate["receptacleObjectIds"] = [named(home, "Mug:1")]
    do(home, "PickupObject Plate; Teleport x=1 rotation=90")
    assert abs(salt["position"]["x"] - plate["position"]["x"]) < 0.3


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
    return read_room(path, label="small.toml")


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


@pytest.mark.parametrize("step", ["Pass", "Teleport x=1 rotation=90", "PickupObject Egg"])
def test_hand_and_camera_are_before_and_above_the_agent(step: str) -> None:
    metadata = do(house(), step).metadata()
    at, turn = metadata["agent"]["position"], metadata["agent"]["rotation"]["y"]
    held = metadata["heldObjectPose"]
    ahead = {"x": 0.38 * (turn == 90), "y": 0.515, "z": 0.38 * (turn == 0)}
    assert {a: held["position"][a] - at[a] for a in "xyz"} == pytest.approx(ahead)
    assert held["rotation"]["y"] == turn
    assert held["localPosition"] == pytest.approx({"x": 0, "y": -0.16, "z": 0.38})
    assert metadata["cameraPosition"] == pytest.approx({**at, "y": at["y"] + 0.675})


def test_the_camera_of_a_crouching_agent_is_lower() -> None:
    agent = do(house(), "Crouch").metadata()
    assert agent["cameraPosition"] == agent["agent"]["position"]


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
    cold = thing(home, "Egg")["temperature"]
    for _ in range(600):
        assert run(home, step)["lastActionSuccess"]
    assert facts(home) == before
    assert thing(home, "Egg")["temperature"] == cold == "Cold"
    do(home, "Pass")
    assert home.state.clock > before["currentTime"]


ENGINE = {"speed": 1, "returnToStart": True, "disableRendering": True, "renderImage": False}
OF_AN_OBJECT = {"x": 0.5, "y": 0.5, "placeStationary": False, "manualInteract": True,
                "putNearXY": True, "randomizeOpen": True, "continuous": False}  # fmt: skip


def test_arguments_for_the_engine_change_nothing() -> None:
    steps = [
        "MoveAhead",
        "RotateLeft",
        "PickupObject Egg",
        "PutObject CounterTop",
        "OpenObject Fridge",
    ]
    plain, full = do(house(), *steps), house()
    for step in steps:
        name, *words = step.split()
        given = ENGINE | (OF_AN_OBJECT if words else {})
        assert act(full, name, *words, **given)["lastActionSuccess"]
    assert facts(full) == facts(plain)


NEUTRAL = [
    "MoveHeldObject ahead=0.1 right=0.1 up=0.1 forceVisible=false",
    *(f"MoveHeldObject{way} moveMagnitude=0.1" for way in ("Ahead", "Back", "Left", "Right")),
    "MoveHeldObjectUp moveMagnitude=0.1",
    "MoveHeldObjectDown moveMagnitude=0.1",
    "RotateHeldObject pitch=90",
    'RotateHeldObject rotation={"x":0,"y":90,"z":0}',
    "AdvancePhysicsStep timeStep=0.01 simSeconds=1.0 allowAutoSimulation=true",
    "PausePhysicsAutoSim",
    "UnpausePhysicsAutoSim",
    "SetHandSphereRadius radius=0.1",
]


@pytest.mark.parametrize("step", NEUTRAL)
def test_what_only_physics_feels_succeeds_and_does_nothing(step: str) -> None:
    home, waiting = (do(house(), "PickupObject Mug") for _ in range(2))
    assert facts(do(home, step)) == facts(do(waiting, "Pass"))


@pytest.mark.parametrize("step", [each for each in NEUTRAL if "HeldObject" in each])
def test_an_empty_hand_holds_nothing_to_move(step: str) -> None:
    assert "empty" in run(house(), step)["errorMessage"]


@pytest.mark.parametrize(
    "step",
    [
        'MoveHeldObject ahead="far"',
        "MoveHeldObjectUp moveMagnitude=[]",
        'RotateHeldObject rotation={"pitch":null}',
        "RotateHeldObject rotation=90",
        "SetHandSphereRadius radius=5",
        'ThrowObject moveMagnitude="far"',
    ],
)
def test_an_odd_move_of_the_hand_is_refused(step: str) -> None:
    assert run(do(house(), "PickupObject Mug"), step)["errorCode"] == "InvalidArgument"


def test_to_throw_is_to_drop() -> None:
    thrown, dropped = (do(house(), "PickupObject Mug; Teleport x=1") for _ in range(2))
    assert not run(house(), "ThrowObject moveMagnitude=50")["lastActionSuccess"]
    do(thrown, "ThrowObject moveMagnitude=50")
    assert facts(thrown) == facts(do(dropped, "DropHandObject"))
    assert thrown.state.held is None


class TestHouseController:
    def test_an_event_is_true_where_its_action_succeeded(self) -> None:
        controller = HouseController("Kitchen1")
        fridge = controller.last_event.objects_by_type("Fridge")[0]["objectId"]
        event = controller.step("OpenObject", objectId=fridge, forceAction=True)
        assert event
        assert event is controller.last_event
        assert event.get_object(fridge)["isOpen"]  # type: ignore[index]
        again = controller.step({"action": "OpenObject", "objectId": fridge}, forceAction=True)
        assert not again
        assert again.metadata["errorMessage"] == "Object already open"
        assert "Object already open" in repr(again)
        assert event.get_object("Nothing") is None

    def test_an_event_has_the_names_of_ai2_thor_and_no_images(self) -> None:
        with HouseController("Kitchen1") as controller:
            event = controller.step("Teleport", x=3.25, z=2.5, rotation=270, horizon=30)
        for name in ("frame", "cv2img", "depth_frame", "normals_frame", "flow_frame",
                     "instance_segmentation_frame", "semantic_segmentation_frame",
                     "instance_detections2D"):  # fmt: skip
            assert getattr(event, name) is None
        assert (event.instance_masks, event.class_masks, event.color_to_object_id) == ({}, {}, {})
        assert (event.third_party_camera_frames, event.events) == ([], [event])
        assert (event.screen_width, event.screen_height) == (300, 300)
        assert event.pose == (3250, 2500, 270_000, 30_000)
        assert event.pose_discrete == (13, 10, 3, 30)

    def test_an_event_lacks_no_name_of_ai2_thor(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            server = pytest.importorskip("ai2thor.server", reason="needs the package ai2thor")
        controller = HouseController("Kitchen1")
        theirs = server.Event(controller.last_event.metadata)
        ours = controller.last_event
        assert {each for each in vars(theirs) if each[0] != "_"} <= {*dir(ours)}
        assert (ours.pose, ours.pose_discrete) == (theirs.pose, theirs.pose_discrete)

    def test_the_scene_is_told_by_its_name_and_can_be_reset_to(self, tmp_path: Path) -> None:
        file = tmp_path / "other.json"
        file.write_text(json.dumps(HouseController("Bathroom1").last_event.metadata))
        for scene in ("Kitchen1", load_scene("Kitchen1"), str(file)):
            controller = HouseController(scene)
            name = controller.last_event.metadata["sceneName"]
            first = json.dumps(controller.last_event.metadata)
            assert controller.scene == name
            controller.step("Crouch")
            assert json.dumps(controller.reset(controller.scene).metadata) == first
            assert controller.scene == name
        with pytest.raises(InvalidInputError, match="There is no scene ''"):
            HouseController("")

    def test_a_reset_that_fails_leaves_all_as_it_was(self) -> None:
        controller = HouseController("Kitchen1")
        with pytest.raises(InvalidInputError, match="gridSize"):
            controller.reset("Bathroom1", gridSize=-1)
        assert controller.scene == "Kitchen1"
        assert controller.reset().metadata["sceneName"] == "Kitchen1"

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"action": "Dance"}, "Dance is not an action"),
            ({"action": None}, "None is not an action"),
            ({"action": "OpenObject"}, "needs the argument 'objectId'"),
            ({"action": "OpenObject", "objectId": 5}, "Object ID appears to be invalid"),
            ({"action": "Teleport", "x": "far"}, "position.x must be a number"),
        ],
    )
    def test_bad_actions_raise_value_error(self, arguments: Any, message: str) -> None:
        controller = HouseController("Kitchen1")
        with pytest.raises(ValueError, match=message):
            controller.step(**arguments)
        assert not controller.last_event

    def test_a_failure_raises_only_when_asked_to(self) -> None:
        controller = HouseController("Kitchen1")
        assert not controller.step("DropHandObject")
        with pytest.raises(RuntimeError, match="Nothing in hand to drop!"):
            controller.step("DropHandObject", raise_for_failure=True)
        assert controller.step("Pass", raise_for_failure=True)

    def test_a_reset_house_is_a_new_one(self) -> None:
        controller = HouseController("Kitchen1")
        first = json.dumps(controller.last_event.metadata)
        things = [each["objectId"] for each in controller.last_event.metadata["objects"]]
        for own in things:
            for name in ("OpenObject", "ToggleObjectOn", "SliceObject", "PickupObject"):
                controller.step(name, objectId=own, forceAction=True)
        controller.step("Teleport", x=1.0, rotation=90, forceAction=True)
        assert json.dumps(controller.last_event.metadata) != first
        assert json.dumps(controller.reset().metadata) == first

    def test_reset_goes_to_another_scene(self) -> None:
        controller = HouseController(load_scene("Kitchen1"))
        assert controller.reset("Bathroom1").metadata["sceneName"] == "Bathroom1"
        assert controller.reset().metadata["sceneName"] == "Bathroom1"
        assert controller.reset(load_scene("Bedroom1")).metadata["sceneName"] == "Bedroom1"
        with pytest.raises(InvalidInputError, match="There is no scene 'Nowhere'"):
            controller.reset("Nowhere")
        controller.stop()

    def test_grid_and_reach_are_those_asked_for(self) -> None:
        fine = HouseController("Kitchen1", visibilityDistance=3.0)
        coarse = HouseController("Kitchen1", gridSize=0.5, width=300, renderDepthImage=True)
        places = [
            len(each.step("GetReachablePositions").metadata["actionReturn"])
            for each in (fine, coarse)
        ]
        assert places[0] > 2 * places[1]
        seen = [
            sum(thing["visible"] for thing in each.last_event.metadata["objects"])
            for each in (fine, coarse)
        ]
        assert seen[0] > seen[1]
        coarse.reset(gridSize=0.25)
        assert len(coarse.step("GetReachablePositions").metadata["actionReturn"]) == places[0]
        assert isinstance(coarse.last_event, Event)

    @pytest.mark.parametrize("name", ["gridSize", "visibilityDistance"])
    @pytest.mark.parametrize("bad", [0, -1, 1e-9, 1e9, math.nan, "small", None, True])
    def test_a_grid_or_reach_that_cannot_be_is_refused(self, name: str, bad: Any) -> None:
        with pytest.raises(InvalidInputError, match=f"{name} must be a number between"):
            HouseController("Kitchen1", **{name: bad})
