"""What drives a house: the embedded one's controller, or AI2-THOR's own on a Unity build."""

from __future__ import annotations

import importlib
import os
import shlex
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from goalscope.base.optional_packages import remedy
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.state import Scene
from goalscope.envs.house.simulator.world import House

RAISED = ("InvalidAction", "MissingArguments", "InvalidArgument")
"""Error codes that AI2-THOR's Controller raises a ValueError for."""


PATIENCE = 60.0
"""Seconds that Unity may take for one step."""

PHYSICS_STEP = 0.02
"""Seconds of one step of physics: a fixed one, so that the same actions lead to the same state."""


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


def start_thor(scene: str, unity: str | None = None) -> Controller:
    """Start AI2-THOR.

    Args:
        scene: Name of the scene, as the build knows it.
        unity: Path of a Unity build; None takes AI2-THOR's own, which it fetches at the first
            use. Without a display that one renders unseen.

    Raises:
        InvalidInputError: AI2-THOR is not installed, or there is no such program.
        GoalscopeError: It does not start; the message says why.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            thor: Any = importlib.import_module("ai2thor.controller")
    except ImportError as error:
        raise InvalidInputError(
            f"AI2-THOR is not installed ({error}). Run {remedy('thor')}; or leave out `--simulator "
            "thor` for the embedded house."
        ) from None
    options: dict[str, Any] = {}
    if unity is not None:
        if not os.access(unity, os.X_OK) or Path(unity).is_dir():
            raise InvalidInputError(f"{unity} is not an executable program. Name a Unity build.")
        options = {
            "local_executable_path": shlex.quote(unity),
            "x_display": os.environ.get("DISPLAY", ":0"),
            "headless": True,
        }
    elif "DISPLAY" not in os.environ:
        options = {"platform": importlib.import_module("ai2thor.platform").CloudRendering}
    try:
        return thor.Controller(
            scene=scene,
            server_timeout=PATIENCE,
            fixedDeltaTime=PHYSICS_STEP,
            snapToGrid=False,
            **options,
        )
    except Exception as error:
        reason = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
        raise GoalscopeError(
            f"AI2-THOR does not start ({reason}). Its log is ~/.ai2thor/log/unity.log. "
            "Without a build, `--simulator house` will do."
        ) from error
