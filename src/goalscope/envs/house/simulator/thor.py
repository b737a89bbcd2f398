"""AI2-THOR's own Controller, started on a Unity build."""

from __future__ import annotations

import importlib
import os
import shlex
import warnings
from pathlib import Path
from typing import Any

from goalscope.envs.house.simulator.controller import Controller
from goalscope.extras import remedy
from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["start"]

PATIENCE = 60.0
"""Seconds that Unity may take for one step."""

PHYSICS_STEP = 0.02
"""Seconds of one step of physics: a fixed one, so that the same actions lead to the same state."""


def start(scene: str, unity: str | None = None) -> Controller:
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
            raise InvalidInputError(f"{unity} is no program that can be run; name a Unity build.")
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
