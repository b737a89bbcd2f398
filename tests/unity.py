"""What AI2-THOR's own `Controller` starts in tests, in place of its Unity build.

It serves the embedded house over the Controller's two named pipes: metadata go out as MessagePack,
actions come in as JSON. It makes no images.
"""

from __future__ import annotations

import json
import os
import shlex
import struct
import sys
from pathlib import Path
from typing import Any, BinaryIO

from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.world import House

HEADER = struct.Struct("!BI")
"""Of a field in a pipe: its type, and the length of its body."""

METADATA, END = 1, 255

NOTHING = {
    "agentId": 0, "objects": [], "inventoryObjects": [], "thirdPartyCameras": [], "sceneName": "",
    "screenWidth": 300, "screenHeight": 300, "lastAction": "", "lastActionSuccess": True,
    "errorMessage": "", "errorCode": None, "actionReturn": None,
}  # fmt: skip
"""Metadata while there is no house."""

CAMERA = {"cameraNearPlane": 0.01, "cameraFarPlane": 20.0}


def executable(folder: Path) -> Path:
    """A file in the folder that runs this one."""
    path = folder / "unity"
    path.write_text(f'#!/bin/sh\nexec {shlex.join([sys.executable, __file__])} "$@"\n')
    path.chmod(0o755)
    return path


class Stage:
    """The scene that the Controller named, and its house."""

    def __init__(self) -> None:
        self.scene = ""
        self.house: House | None = None

    def answer(self, action: dict[str, Any]) -> dict[str, Any]:
        """The metadata after an action."""
        if action["action"] == "Reset":
            self.scene = action["sceneName"]
            return NOTHING | {"sceneName": self.scene}
        if action["action"] == "Initialize":
            try:
                self.house = House(load_scene(self.scene))
            except InvalidInputError as error:
                return NOTHING | {"lastActionSuccess": False, "errorMessage": str(error)}
            return NOTHING | self.house.metadata("Initialize", returned=CAMERA)
        if self.house is None:  # GetScenesInBuild: none are named, so that any may be asked for
            return NOTHING | {"actionReturn": []}
        return NOTHING | self.house.step(action)


def serve(outward: str, inward: str) -> None:
    """Answer over these pipes until the Controller closes its own; it speaks after the first."""
    stage = Stage()
    with open(outward, "wb") as sink:
        send(sink, NOTHING, 0)
        with open(inward, "rb") as source:
            while action := received(source):
                send(sink, stage.answer(action), action["sequenceId"])


def send(outward: BinaryIO, metadata: dict[str, Any], sequence: int) -> None:
    import msgpack

    message = {
        "agents": [metadata], "thirdPartyCameras": [], "activeAgentId": 0, "sequenceId": sequence,
    }  # fmt: skip
    body: bytes = msgpack.packb(message)
    outward.write(HEADER.pack(METADATA, len(body)) + body + HEADER.pack(END, 0))
    outward.flush()


def received(inward: BinaryIO) -> dict[str, Any]:
    """The next action; an empty one when the Controller is gone."""
    action = b""
    while len(head := inward.read(HEADER.size)) == HEADER.size:
        kind, length = HEADER.unpack(head)
        if kind == END:
            return json.loads(action)
        action = inward.read(length)
    return {}


if __name__ == "__main__":
    serve(*(os.environ[f"AI2THOR_FIFO_{end}_PIPE_PATH"] for end in ("SERVER", "CLIENT")))
