"""Stand where AI2-THOR's Unity build stands: a program that AI2-THOR's own `Controller` starts.

    Controller(local_executable_path=shutil.which("goalscope-unity"), scene=..., x_display=":0")

It speaks both of the Controller's languages, FIFO and WSGI (HTTP). It makes no images, so that
`event.frame` is None. `Initialize` begins the scene anew.
"""

from __future__ import annotations

import argparse
import errno
import http.client
import json
import os
import re
import select
import struct
import sys
import time
import traceback
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, cast

from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.scenes import known_scenes
from goalscope.envs.house.simulator.world import House
from goalscope.extras import remedy
from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["Scenes", "main", "serve"]

_USAGE = (
    "AI2-THOR's Controller starts this program: "
    'Controller(local_executable_path=shutil.which("goalscope-unity"), x_display=":0").'
)
_PATIENCE = 60.0  # seconds for the Controller to open its end of a pipe
_LARGEST = 1 << 28  # bytes of one action
_HEADER = struct.Struct("!BI")  # of a field in a pipe: its type, and the length of its body
_METADATA, _ACTION, _END = 1, 2, 255
_CAMERA = {"cameraNearPlane": 0.01, "cameraFarPlane": 20.0}  # metres, AI2-THOR's defaults
_ONLY = {"agentCount": 1, "agentMode": "default", "fieldOfView": 90, "rotateStepDegrees": 90}
_MEASURES = {"gridSize": "grid", "visibilityDistance": "reach"}
_OF_THE_WIRE = ("sequenceId", "render")  # how the names begin of what no house needs to know
_BLANK: dict[str, Any] = {
    "objects": [],
    "inventoryObjects": [],
    "sceneName": "",
    "agentId": 0,
    "thirdPartyCameras": [],
    "lastAction": "",
    "lastActionSuccess": True,
    "errorMessage": "",
    "errorCode": None,
    "actionReturn": None,
}


Scenes = Mapping[str, Callable[[], Scene]]
"""How to load each scene, by the name that the Controller gives to `reset`."""


def main() -> None:
    """Serve the known scenes to the Controller that started this program."""
    try:
        serve(os.environ, sys.argv[1:], _scenes)
    except GoalscopeError as error:
        print(f"goalscope-unity: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)


def serve(
    environment: Mapping[str, str], arguments: Sequence[str], scenes: Callable[[], Scenes]
) -> None:
    """Take the Controller's actions until it stops.

    Args:
        environment: Holds the variables AI2THOR_... that the Controller sets.
        arguments: Of Unity's command line; all but the screen's size are ignored.
        scenes: Called when the Controller listens, so that it learns of an error at once.

    Raises:
        InvalidInputError: No Controller is there, or it says what cannot be understood.
    """
    screen = _screen(arguments)
    with _link(environment) as link:
        stage = _Stage(scenes(), *screen)
        message = _message(stage.metadata, 0)
        while action := link.exchange(message):
            message = _message(stage.answer(action), action.get("sequenceId", 0))


class _Stage:
    """What is not of one house: the scenes, the screen, and errors."""

    def __init__(self, scenes: Scenes, width: int, height: int) -> None:
        self._scenes = scenes
        self._scene: Scene | None = None
        self._house: House | None = None
        self._missing = "No scene is loaded. Send Reset with a sceneName first."
        self._screen = {"screenWidth": width, "screenHeight": height}
        self.metadata = _BLANK | self._screen

    def answer(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """The metadata after an action; an error becomes the failure of the action."""
        try:
            news = self._news(action)
        except Exception as error:
            traceback.print_exc()
            news = _failure(f"{type(error).__name__}: {error}")
        self.metadata |= {"lastAction": str(action.get("action"))} | news | self._screen
        return self.metadata

    def _news(self, action: Mapping[str, Any]) -> dict[str, Any]:
        match action.get("action"):
            case "GetScenesInBuild":
                return _success(sorted(self._scenes))
            case "ChangeResolution":
                return self._resize(action.get("x"), action.get("y"))
            case "Reset":
                return self._reset(action.get("sceneName"))
            case "Initialize" if self._scene:
                return self._initialize(self._scene, action)
            case _ if self._house is None:
                return _failure(self._missing)
            case _:
                return self._house.step(
                    {k: v for k, v in action.items() if not k.startswith(_OF_THE_WIRE)}
                )

    def _reset(self, name: object) -> dict[str, Any]:
        self._scene = self._house = None
        if name not in self._scenes:
            known = ", ".join(sorted(self._scenes)) or "none"
            self._missing = f"There is no scene {name!r:.60}. The scenes: {known}."
            return _failure(self._missing)
        try:
            self._scene = self._scenes[str(name)]()
        except Exception as error:
            self._missing = f"The scene {name!r} cannot be loaded: {error}"
            raise
        self._missing = "The house is not built. Send Initialize first."
        return _BLANK | {"sceneName": self._scene.name}

    def _initialize(self, scene: Scene, action: Mapping[str, Any]) -> dict[str, Any]:
        for name, only in _ONLY.items():
            if action.get(name, only) != only:
                return _failure(f"This house has no {name} but {only!r}.", "InvalidArgument")
        given = {
            key: action[name] for name, key in _MEASURES.items() if action.get(name) is not None
        }
        try:
            self._house = House(scene, **given)
        except InvalidInputError as error:
            return _failure(str(error), "InvalidArgument")
        return self._house.metadata("Initialize", returned=_CAMERA)

    def _resize(self, width: object, height: object) -> dict[str, Any]:
        if not (isinstance(width, int) and isinstance(height, int) and min(width, height) > 0):
            return _failure("ChangeResolution needs x and y, pixels above 0.", "InvalidArgument")
        self._screen = {"screenWidth": width, "screenHeight": height}
        return _success()


def _success(result: Any = None) -> dict[str, Any]:
    return {
        "lastActionSuccess": True,
        "errorMessage": "",
        "errorCode": None,
        "actionReturn": result,
    }


def _failure(message: str, code: str | None = None) -> dict[str, Any]:
    return {
        "lastActionSuccess": False,
        "errorMessage": message,
        "errorCode": code,
        "actionReturn": None,
    }


def _message(metadata: dict[str, Any], sequence: Any) -> dict[str, Any]:
    return {
        "agents": [metadata],
        "thirdPartyCameras": [],
        "activeAgentId": 0,
        "sequenceId": sequence,
    }


class _Pipes:
    """FIFO: fields in two named pipes, metadata as MessagePack and actions as JSON.

    The Controller waits long where this program ends without a word: at an error, it gets a
    message without metadata, which it refuses at once.
    """

    def __init__(self, outward: str, inward: str) -> None:
        self._inward = _opened(inward, os.O_RDONLY)
        self._outward = _opened(outward, os.O_WRONLY)
        os.set_blocking(self._outward, True)
        self._doors = select.poll()
        self._doors.register(self._inward, select.POLLIN)
        self._doors.register(self._outward, 0)  # tells when the Controller closes its end

    def __enter__(self) -> _Pipes:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind:
            with suppress(OSError):
                self._write(_HEADER.pack(_END, 0))
        os.close(self._outward)
        os.close(self._inward)

    def exchange(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send metadata, and return the next action; an empty one when the Controller is gone."""
        try:
            body = _packed(message)
            self._write(_HEADER.pack(_METADATA, len(body)) + body + _HEADER.pack(_END, 0))
            action = b""
            while (field := _HEADER.unpack(self._read(_HEADER.size)))[0] != _END:
                kind, length = field
                if kind != _ACTION or length > _LARGEST:
                    raise InvalidInputError(
                        f"Expected an action from the Controller, not a field of type {kind} with "
                        f"{length:,} bytes. Use the Controller of ai2thor 5."
                    )
                action = self._read(length)
        except (EOFError, ConnectionError):
            return {}
        return _parsed(action)

    def _write(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._outward, rest) :]

    def _read(self, length: int) -> bytes:
        data = bytearray()
        while len(data) < length:
            ready = [door for door, _ in self._doors.poll()]
            part = b""
            if self._inward in ready:
                part = os.read(self._inward, min(length - len(data), 1 << 16))
            if not part:
                raise EOFError
            data += part
        return bytes(data)


class _Web:
    """WSGI: the metadata is posted as a form, and the answer is the next action."""

    def __init__(self, host: str, port: int, token: str) -> None:
        self._connection = http.client.HTTPConnection(host, port)
        self._token = token
        try:
            self._connection.connect()
        except OSError as error:
            raise InvalidInputError(
                f"No Controller listens at {host}:{port} ({error.strerror}). {_USAGE}"
            ) from None

    def __enter__(self) -> _Web:
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()

    def exchange(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send metadata, and return the next action; an empty one when the Controller is gone."""
        boundary = uuid.uuid4().hex
        parts = [
            f"--{boundary}\r\n"
            "Content-Type: text/plain; charset=utf-8\r\n"  # the Controller minds the case
            f'Content-disposition: form-data; name="{name}"\r\n\r\n{value}\r\n'
            for name, value in (("metadata", json.dumps(message)), ("token", self._token))
        ]
        body = "".join(parts) + f"--{boundary}--\r\n"
        kind = {"Content-Type": f"multipart/form-data; boundary={boundary}"}
        try:
            self._connection.request("POST", "/train", body.encode(), kind)
            response = self._connection.getresponse()
            answer = response.read(_LARGEST)
        except (OSError, http.client.HTTPException):
            return {}
        if response.status != http.client.OK:
            raise InvalidInputError(
                f"The Controller refused the metadata (HTTP {response.status}). "
                "Start a new Controller; its own error says more."
            )
        return _parsed(answer)


def _link(environment: Mapping[str, str]) -> _Pipes | _Web:
    def variable(name: str) -> str:
        if value := environment.get(f"AI2THOR_{name}"):
            return value
        raise InvalidInputError(f"The environment variable AI2THOR_{name} is not set. {_USAGE}")

    match variable("SERVER_TYPE"):
        case "FIFO":
            return _Pipes(variable("FIFO_SERVER_PIPE_PATH"), variable("FIFO_CLIENT_PIPE_PATH"))
        case "WSGI":
            port = variable("PORT")
            if not (port.isascii() and port.isdigit()):
                raise InvalidInputError(f"AI2THOR_PORT is {port!r}, which is no number. {_USAGE}")
            return _Web(variable("HOST"), int(port), variable("CLIENT_TOKEN"))
        case other:
            raise InvalidInputError(
                f"AI2THOR_SERVER_TYPE is {other!r}. Give the Controller server_class=FifoServer "
                "or server_class=WsgiServer."
            )


def _screen(arguments: Sequence[str]) -> tuple[int, int]:
    parser = argparse.ArgumentParser("goalscope-unity", description=_USAGE, allow_abbrev=False)
    parser.add_argument("-screen-width", type=int, default=300, metavar="PIXELS")
    parser.add_argument("-screen-height", type=int, default=300, metavar="PIXELS")
    known, _ = parser.parse_known_args(arguments)
    return known.screen_width, known.screen_height


def _opened(pipe: str, direction: int) -> int:
    """A pipe, once the Controller is there; a plain open would wait for ever for a dead one."""
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            return os.open(pipe, direction | os.O_NONBLOCK)
        except OSError as error:
            if error.errno != errno.ENXIO or time.monotonic() > end:
                raise InvalidInputError(
                    f"No Controller is at the pipe {pipe} ({error.strerror}). {_USAGE}"
                ) from None
            time.sleep(0.01)


def _packed(message: Mapping[str, Any]) -> bytes:
    try:
        msgpack: Any = import_module("msgpack")
    except ImportError as error:
        raise InvalidInputError(
            f"FIFO needs one more package ({error}). Run {remedy('thor')}; or give the Controller "
            "server_class=WsgiServer."
        ) from None
    return msgpack.packb(message, unicode_errors="replace")


def _parsed(action: bytes) -> dict[str, Any]:
    try:
        value = json.loads(action)
    except ValueError:
        value = None
    if not isinstance(value, dict):
        raise InvalidInputError(
            f"Expected a JSON object from the Controller, not {action[:60]!r}. "
            "Use the Controller of ai2thor 5."
        )
    return cast(dict[str, Any], value)


def _scenes() -> Scenes:
    return {  # the Controller asks for FloorPlan1_physics when it is told FloorPlan1
        re.sub(r"^(FloorPlan[0-9]+)$", r"\1_physics", name): scene
        for name, scene in known_scenes().items()
    }
