"""The face of `ai2thor.controller.Controller`, with the embedded house behind it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from goalscope.envs.house.scene import Scene
from goalscope.envs.house.scenes import load_scene
from goalscope.envs.house.state import GRID, REACH
from goalscope.envs.house.world import House

__all__ = ["Controller", "Event", "HouseController"]

RAISED = ("InvalidAction", "MissingArguments", "AmbiguousAction", "InvalidArgument")
"""Error codes that AI2-THOR's Controller raises a ValueError for."""


class Event:
    """What a step led to; true if the action succeeded."""

    def __init__(self, metadata: dict[str, Any]) -> None:
        self.metadata = metadata

    def __bool__(self) -> bool:
        return bool(self.metadata["lastActionSuccess"])

    def __repr__(self) -> str:
        shown = {
            key: self.metadata[key] for key in ("lastAction", "lastActionSuccess", "errorMessage")
        }
        return f"<Event {shown}>"

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

    >>> controller = HouseController("Kitchen1")   # doctest: +SKIP
    >>> controller.step("PickupObject", objectId=egg, forceAction=True)   # doctest: +SKIP

    Args:
        scene: A scene, its name, or its file; see `load_scene`.
        gridSize: Distance between the positions where the agent can stand, in m.
        visibilityDistance: How far the agent sees and reaches, in m.
        **parameters: Anything else that AI2-THOR's Controller takes is for its engine.
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
        self.scene = scene if isinstance(scene, Scene) else load_scene(scene)
        self.last_event: Event
        self.reset()

    def reset(self, scene: str | Scene | None = None, **parameters: Any) -> Event:
        """Go back to the start of the scene, or go to another one."""
        if scene is not None:
            self.scene = scene if isinstance(scene, Scene) else load_scene(scene)
        self._grid = parameters.get("gridSize", self._grid)
        self._reach = parameters.get("visibilityDistance", self._reach)
        self._house = House(self.scene, grid=self._grid, reach=self._reach)
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
