"""A program in Unity's place for tests: it serves rooms with a lamp, and can break."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from goalscope.envs.house.simulator import unity
from goalscope.envs.house.simulator.scene import Scene
from goalscope.types import InvalidInputError

LAMP = "FloorLamp|+02.00|+00.00|+02.00"


def room(name: str) -> dict[str, Any]:
    """AI2-THOR's metadata of a room with a lamp."""

    def thing(kind: str, y: float, size: tuple[float, float, float], **flags: bool) -> Any:
        return {
            "objectId": f"{kind}|+02.00|+00.00|+02.00",
            "objectType": kind,
            "position": {"x": 2.0, "y": y, "z": 2.0},
            "axisAlignedBoundingBox": {
                "center": {"x": 2.0, "y": y + size[1] / 2, "z": 2.0},
                "size": dict(zip("xyz", size, strict=True)),
            },
        } | flags

    objects = [
        thing("Floor", -0.1, (4.0, 0.1, 4.0), receptacle=True),
        thing("FloorLamp", 0.0, (0.3, 1.5, 0.3), toggleable=True),
    ]
    agent = {
        "position": {"x": 2.0, "y": 0.9, "z": 1.0},
        "rotation": {"x": 0.0, "y": 0.0, "z": 0.0},
    }
    return {"objects": objects, "agent": agent, "sceneName": name}


def scene(name: str) -> Scene:
    return Scene.from_metadata(room(name), label="the test's scene")


def broken_scene() -> Scene:
    raise InvalidInputError("The lamp has no position.")


def scenes() -> dict[str, Callable[[], Scene]]:
    names = ("Kitchen1", "FloorPlan1_physics")
    return {name: lambda name=name: scene(name) for name in names} | {"Ruin": broken_scene}


def no_scenes() -> dict[str, Callable[[], Scene]]:
    raise InvalidInputError("The folder of scenes is gone.")


class Fragile(unity.House):
    """A house that breaks at the action Explode."""

    def step(self, action: Mapping[str, Any]) -> dict[str, Any]:
        if action["action"] == "Explode":
            raise KeyError("fuse")
        return super().step(action)


def executable(folder: Path, served: str) -> Path:
    """A file that serves `scenes`, `no_scenes`, or what `unity.main` serves."""
    path = folder / served
    command = shlex.join([sys.executable, __file__, served, str(folder / "ended")])
    path.write_text(f'#!/bin/sh\nexec {command} "$@"\n')
    path.chmod(0o755)
    return path


if __name__ == "__main__":
    unity.House = Fragile
    _, served, ended, *rest = sys.argv
    try:
        if served == "main":
            unity.main()
        else:
            given = {"scenes": scenes, "no_scenes": no_scenes}[served]
            unity.serve(os.environ, rest, given)
    finally:
        Path(ended).touch()
