"""The face of `ai2thor.controller.Controller`, with the embedded house behind it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.state import GRID, REACH
from goalscope.envs.house.simulator.world import House

__all__ = ["Controller", "Event", "HouseController"]

RAISED = ("InvalidAction", "MissingArguments", "AmbiguousAction", "InvalidArgument")
"""Error codes that AI2-THOR's Controller raises a ValueError for."""


class Event:
    """What a step led to; true if the action succeeded.

    It has the names of `ai2thor.server.Event`. The house makes no images: what AI2-THOR would draw
    is None or empty.

    Attributes:
        metadata: AI2-THOR's metadata after the step.
        screen_width: In pixels.
        screen_height: In pixels.
    """

    frame = cv2img = depth_frame = normals_frame = flow_frame = None
    instance_segmentation_frame = semantic_segmentation_frame = instance_detections2D = None

    def __init__(self, metadata: dict[str, Any]) -> None:
        self.metadata = metadata
        self.screen_width: int = metadata["screenWidth"]
        self.screen_height: int = metadata["screenHeight"]
        self.color_to_object_id: dict[Any, str] = {}
        self.object_id_to_color: dict[str, Any] = {}
        self.instance_masks: dict[str, Any] = {}
        self.class_masks: dict[str, Any] = {}
        self.class_detections2D: dict[str, Any] = {}
        self.third_party_camera_frames: list[Any] = []
        self.third_party_depth_frames: list[Any] = []
        self.third_party_normals_frames: list[Any] = []
        self.third_party_flows_frames: list[Any] = []
        self.third_party_instance_masks: list[Any] = []
        self.third_party_class_masks: list[Any] = []
        self.third_party_instance_segmentation_frames: list[Any] = []
        self.third_party_semantic_segmentation_frames: list[Any] = []

    def __bool__(self) -> bool:
        return bool(self.metadata["lastActionSuccess"])

    def __repr__(self) -> str:
        shown = {
            key: self.metadata[key] for key in ("lastAction", "lastActionSuccess", "errorMessage")
        }
        return f"<Event {shown}>"

    @property
    def events(self) -> list[Event]:
        """The event of each agent: there is one."""
        return [self]

    @property
    def pose(self) -> tuple[int, int, int, int]:
        """The agent's x and z in mm, its rotation and the camera's horizon in 1/1000 degree."""
        x, z, yaw, horizon = self._pose()
        return round(x * 1000), round(z * 1000), round(yaw * 1000), round(horizon * 1000)

    @property
    def pose_discrete(self) -> tuple[int, int, int, int]:
        """The agent's x and z in steps of 0.25 m, its quarter turns, and the horizon in degrees."""
        x, z, yaw, horizon = self._pose()
        return int(x / 0.25), int(z / 0.25), int(yaw / 90), round(horizon)

    def _pose(self) -> tuple[float, float, float, float]:
        agent = self.metadata["agent"]
        at = agent["position"]
        return at["x"], at["z"], agent["rotation"]["y"], agent["cameraHorizon"]

    def get_object(self, object_id: str) -> dict[str, Any] | None:
        """The metadata of one object."""
        found = (each for each in self.metadata["objects"] if each["objectId"] == object_id)
        return next(found, None)

    def objects_by_type(self, object_type: str) -> list[dict[str, Any]]:
        """The metadata of all objects of a type."""
        return [each for each in self.metadata["objects"] if each["objectType"] == object_type]


class Controller(Protocol):
    """What the robot needs of a controller: AI2-THOR's own has it, and `HouseController`."""

    @property
    def last_event(self) -> Any:
        """The event of the last step, with `.metadata`."""
        ...

    def step(self, action: Any = None, **arguments: Any) -> Any:
        """Take one action."""
        ...

    def reset(self, scene: Any = None, **parameters: Any) -> Any:
        """Go back to the start of the scene."""
        ...

    def stop(self) -> Any:
        """Let go of whatever runs behind it."""
        ...


class HouseController:
    """Drives the embedded house as `ai2thor.controller.Controller` drives Unity.

    Examples:
        >>> controller = HouseController("Kitchen1")   # doctest: +SKIP
        >>> controller.step("PickupObject", objectId=egg, forceAction=True)   # doctest: +SKIP

    Args:
        scene: A scene, its name, or its file; see `load_scene`.
        gridSize: Distance between the positions where the agent can stand, in m.
        visibilityDistance: How far the agent sees and reaches, in m.
        **parameters: Anything else that AI2-THOR's Controller takes is for its engine.

    Attributes:
        scene: The scene's name; to `reset` to it does not read it again.
        last_event: What the last step led to.
    """

    def __init__(
        self,
        scene: str | Scene = "Kitchen1",
        *,
        gridSize: float = GRID,
        visibilityDistance: float = REACH,
        **parameters: Any,
    ) -> None:
        self._grid, self._reach = gridSize, visibilityDistance
        self._scene = _read(scene)
        self.scene = self._scene.name
        self.last_event: Event
        self.reset()

    def __enter__(self) -> HouseController:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def reset(self, scene: str | Scene | None = None, **parameters: Any) -> Event:
        """Go back to the start of the scene, or go to another one."""
        begun = self._scene if scene is None or scene == self.scene else _read(scene)
        grid = parameters.get("gridSize", self._grid)
        reach = parameters.get("visibilityDistance", self._reach)
        self._house = House(begun, grid=grid, reach=reach)
        self._scene, self.scene = begun, begun.name
        self._grid, self._reach = grid, reach
        self.last_event = Event(self._house.metadata())
        return self.last_event

    def step(self, action: str | Mapping[str, Any] | None = None, **arguments: Any) -> Event:
        """Take one action, by name and arguments or as {"action": name, ...}.

        Raises:
            ValueError: There is no such action, or its arguments are wrong.
            RuntimeError: It failed, and `raise_for_failure=True` was given.
        """
        strict = arguments.pop("raise_for_failure", False)
        given = dict(action) if isinstance(action, Mapping) else {"action": action}
        given |= arguments
        self.last_event = Event(self._house.step(given))
        metadata = self.last_event.metadata
        if metadata["errorCode"] in RAISED:
            raise ValueError(metadata["errorMessage"])
        if strict and not self.last_event:
            raise RuntimeError(metadata["errorMessage"])
        return self.last_event

    def stop(self) -> None:
        """Nothing runs behind it."""


def _read(scene: str | Scene) -> Scene:
    return scene if isinstance(scene, Scene) else load_scene(scene)
