"""The embedded house as the robot drives it: like AI2-THOR's Controller."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator.controller import HouseController
from goalscope.envs.house.simulator.scenes import load_scene


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


def test_a_scene_is_a_name_a_scene_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "other.json"
    file.write_text(json.dumps(HouseController("Bathroom1").last_event.metadata))
    named = {"Kitchen1": "Kitchen1", load_scene("Bedroom1"): "Bedroom1", str(file): "Bathroom1"}
    for scene, name in named.items():
        assert HouseController(scene).last_event.metadata["sceneName"] == name
    with pytest.raises(InvalidInputError, match="There is no scene ''"):
        HouseController("")


def test_bad_actions_raise_value_error() -> None:
    controller = HouseController("Kitchen1")
    with pytest.raises(ValueError, match=r"position\.x must be a number"):
        controller.step("Teleport", x="far")
    assert not controller.last_event


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
