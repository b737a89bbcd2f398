"""The house behind the face of AI2-THOR's Controller."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path
from typing import Any

import pytest

from goalscope.envs.house.simulator.controller import Event, HouseController
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.types import InvalidInputError


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
