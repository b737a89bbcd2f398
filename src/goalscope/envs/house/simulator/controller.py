"""What drives the house: as the robot sees it, AI2-THOR's own Controller does, too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.world import House

__all__ = ["Controller", "Event", "HouseController"]

RAISED = ("InvalidAction", "MissingArguments", "InvalidArgument")
"""Error codes that AI2-THOR's Controller raises a ValueError for."""


class Controller(Protocol):
    """What the robot needs of a controller: AI2-THOR's own has it, and `HouseController`."""

    @property
    def last_event(self) -> Any:
        """The event of the last step, with `.metadata`."""
        ...

    def step(self, action: str, **arguments: Any) -> Any:
        """Take one action."""
        ...

    def reset(self) -> Any:
        """Go back to the start of the scene."""
        ...

    def stop(self) -> Any:
        """Let go of whatever runs behind it."""
        ...


@dataclass(frozen=True, slots=True)
class Event:
    """What a step led to; true if the action succeeded.

    Attributes:
        metadata: AI2-THOR's metadata after the step.
    """

    metadata: dict[str, Any]

    def __bool__(self) -> bool:
        return bool(self.metadata["lastActionSuccess"])


class HouseController:
    """Drives the embedded house as `ai2thor.controller.Controller` drives Unity.

    Examples:
        >>> controller = HouseController("Kitchen1")   # doctest: +SKIP
        >>> controller.step("PickupObject", objectId=egg, forceAction=True)   # doctest: +SKIP

    Args:
        scene: A scene, its name, or its file; see `load_scene`.

    Attributes:
        last_event: What the last step led to.
    """

    def __init__(self, scene: str | Scene = "Kitchen1") -> None:
        self._scene = scene if isinstance(scene, Scene) else load_scene(scene)
        self.last_event: Event
        self.reset()

    def reset(self) -> Event:
        """Go back to the start of the scene."""
        self._house = House(self._scene)
        self.last_event = Event(self._house.metadata())
        return self.last_event

    def step(self, action: str, **arguments: Any) -> Event:
        """Take one action.

        Raises:
            ValueError: There is no such action, or its arguments are wrong.
        """
        self.last_event = Event(self._house.step({"action": action, **arguments}))
        metadata = self.last_event.metadata
        if metadata["errorCode"] in RAISED:
            raise ValueError(metadata["errorMessage"])
        return self.last_event

    def stop(self) -> None:
        """Nothing runs behind it."""
