"""The program in Unity's place, driven by AI2-THOR's own Controller and by bare pipes and HTTP."""

from __future__ import annotations

import json
import os
import shlex
import signal
import struct
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from goalscope.envs.house import unity
from goalscope.envs.house.scene import Scene
from goalscope.types import InvalidInputError

LAMP = "FloorLamp|+02.00|+00.00|+02.00"
BOTH = pytest.mark.parametrize("server", ["FIFO", "WSGI"])
DRIVEN = [
    BOTH,
    pytest.mark.filterwarnings(  # AI2-THOR never closes its log
        "ignore:unclosed file .*unity.log:ResourceWarning",
    ),
]


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


@pytest.fixture
def launch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Any]]:
    """Start AI2-THOR's Controller on an `executable`."""
    monkeypatch.setenv("HOME", str(tmp_path))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "invalid escape sequence")
        pytest.importorskip("ai2thor", reason="needs the package ai2thor")
        from ai2thor.controller import Controller
        from ai2thor.fifo_server import FifoServer
        from ai2thor.wsgi_server import WsgiServer
    started: list[Any] = []

    def start(server: str, served: str = "scenes", **options: Any) -> Any:
        started.append(
            Controller(
                local_executable_path=str(executable(tmp_path, served)),
                x_display=":0",
                server_start_timeout=20,
                server_timeout=20,
                server_class={"FIFO": FifoServer, "WSGI": WsgiServer}[server],
                **{"scene": "Kitchen1"} | options,
            )
        )
        return started[-1]

    yield start
    for controller in started:
        controller.stop()


class TestController:
    pytestmark = DRIVEN

    def test_it_starts_in_the_scene(self, launch: Any, server: str) -> None:
        event = launch(server).last_event
        assert event.metadata["sceneName"] == "Kitchen1"
        assert event.metadata["lastAction"] == "Initialize"
        assert event.get_object(LAMP)["isToggled"] is False
        assert event.frame is None

    def test_it_starts_without_a_scene_named(self, launch: Any, server: str) -> None:
        event = launch(server, scene=None, headless=True).last_event
        assert event.metadata["sceneName"] == "FloorPlan1_physics"

    def test_an_action_succeeds_once_and_then_fails(self, launch: Any, server: str) -> None:
        controller = launch(server)
        first = controller.step("ToggleObjectOn", objectId=LAMP, forceAction=True)
        assert first
        assert first.get_object(LAMP)["isToggled"] is True
        second = controller.step("ToggleObjectOn", objectId=LAMP, forceAction=True)
        assert not second
        assert second.metadata["errorMessage"] == "can't toggle object on if it's already on!"

    def test_a_scalar_rotation_arrives(self, launch: Any, server: str) -> None:
        event = launch(server).step("Teleport", x=2, y=0.9, z=1, rotation=90)
        assert event.metadata["agent"]["rotation"]["y"] == 90

    def test_an_unknown_action_raises(self, launch: Any, server: str) -> None:
        controller = launch(server)
        with pytest.raises(ValueError, match="Dance"):
            controller.step("Dance")
        assert controller.step("Pass")

    def test_what_concerns_images_is_no_error(self, launch: Any, server: str) -> None:
        controller = launch(server, headless=True, renderDepthImage=True)
        assert controller.step("Pass", renderSomethingImage=True)

    def test_an_error_in_the_house_is_a_failed_action(self, launch: Any, server: str) -> None:
        controller = launch(server)
        event = controller.step("Explode")
        assert not event
        assert event.metadata["errorMessage"] == "KeyError: 'fuse'"
        assert event.get_object(LAMP)
        assert controller.step("Pass").metadata["errorMessage"] == ""

    def test_broken_characters_arrive(self, launch: Any, server: str) -> None:
        controller = launch(server)
        with pytest.raises(ValueError, match="Dance"):
            controller.step("Dance \ud800")
        assert controller.step("Pass")

    def test_reset_builds_a_house_anew(self, launch: Any, server: str) -> None:
        controller = launch(server)
        controller.step("ToggleObjectOn", objectId=LAMP, forceAction=True)
        assert controller.reset().get_object(LAMP)["isToggled"] is False
        assert controller.reset("FloorPlan1").metadata["sceneName"] == "FloorPlan1_physics"

    def test_reset_to_no_scene_names_the_scenes(self, launch: Any, server: str) -> None:
        controller = launch(server)
        with pytest.raises(RuntimeError, match=r"'Procedural'.*FloorPlan1_physics, Kitchen1"):
            controller.reset({"rooms": []})
        assert controller.reset("Kitchen1")

    def test_reset_to_a_broken_scene_says_what_is_broken(self, launch: Any, server: str) -> None:
        controller = launch(server)
        with pytest.raises(RuntimeError, match="The lamp has no position"):
            controller.reset("Ruin")
        assert not controller.step("Pass")
        assert controller.reset("Kitchen1")

    def test_the_house_has_the_grid_and_the_reach_asked_for(self, launch: Any, server: str) -> None:
        controller = launch(server)
        fine = controller.step("GetReachablePositions").metadata["actionReturn"]
        assert controller.last_event.get_object(LAMP)["visible"] is True
        controller.reset(gridSize=0.5, visibilityDistance=0.2)
        coarse = controller.step("GetReachablePositions").metadata["actionReturn"]
        assert len(coarse) < len(fine)
        assert controller.last_event.get_object(LAMP)["visible"] is False

    def test_options_that_the_house_cannot_honour_are_refused(
        self, launch: Any, server: str
    ) -> None:
        controller = launch(server)
        options = {"agentCount": [2, 1], "gridSize": [0, 0.25], "visibilityDistance": ["far", None]}
        for name, (bad, good) in options.items():
            with pytest.raises(ValueError, match=name):
                controller.reset(**{name: bad})
            assert controller.reset(**{name: good})

    @pytest.mark.parametrize("options", [{}, {"headless": True}])
    def test_the_screen_has_the_size_asked_for(
        self, launch: Any, server: str, options: dict[str, Any]
    ) -> None:
        controller = launch(server, width=200, height=400, **options)
        assert controller.last_event.metadata["screenWidth"] == 200
        assert controller.last_event.metadata["screenHeight"] == 400
        assert controller.reset(width=640).metadata["screenWidth"] == 640
        with pytest.raises(ValueError, match="pixels above 0"):
            controller.step("ChangeResolution", x=0, y=10)

    def test_the_command_serves_a_folder_of_scenes(
        self, launch: Any, server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        folder = tmp_path / "rooms"
        folder.mkdir()
        (folder / "FloorPlan7.json").write_text(json.dumps(room("FloorPlan7_physics")))
        monkeypatch.setenv("GOALSCOPE_SCENES", str(folder))
        controller = launch(server, "main", scene="FloorPlan7")
        assert controller.last_event.metadata["sceneName"] == "FloorPlan7_physics"

    def test_stop_ends_the_program(self, launch: Any, server: str) -> None:
        controller = launch(server)
        program = controller.server.unity_proc
        assert program.poll() is None
        controller.stop()
        assert program.poll() is not None

    def test_the_program_ends_when_the_controller_dies(
        self, launch: Any, server: str, tmp_path: Path
    ) -> None:
        path = executable(tmp_path, "scenes")
        code = (
            "from ai2thor import controller, fifo_server, wsgi_server\n"
            f"kind = dict(FIFO=fifo_server.FifoServer, WSGI=wsgi_server.WsgiServer)[{server!r}]\n"
            f"c = controller.Controller(local_executable_path={str(path)!r},\n"
            "    scene='Kitchen1', x_display=':0', server_class=kind)\n"
            "print(c.unity_pid, flush=True)\n"
            "input()\n"
        )
        holder = subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        with holder:
            assert holder.stdout
            program = int(holder.stdout.readline())
            assert not (tmp_path / "ended").exists()
            holder.kill()
        end = time.monotonic() + 10
        while not (tmp_path / "ended").exists():
            if time.monotonic() > end:
                with suppress(ProcessLookupError):
                    os.kill(program, signal.SIGKILL)
                pytest.fail("the program goes on without its Controller")
            time.sleep(0.02)


@pytest.mark.filterwarnings("ignore:unclosed file .*unity.log:ResourceWarning")
def test_over_fifo_an_error_at_the_start_is_told_at_once(launch: Any, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no metadata"):
        launch("FIFO", "no_scenes")
    end = time.monotonic() + 10
    log = tmp_path / ".ai2thor" / "log" / "unity.log"
    while "The folder of scenes is gone." not in log.read_text():
        assert time.monotonic() < end
        time.sleep(0.02)


class Post(BaseHTTPRequestHandler):
    """Answers each POST with the next of the server's `answers`."""

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.posts.append((self.path, body))  # type: ignore[attr-defined]
        status, answer = self.server.answers.pop(0)  # type: ignore[attr-defined]
        self.send_response(status)
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

    def log_message(self, format: str, *args: Any) -> None:
        pass


def posts(*answers: tuple[int, bytes]) -> list[tuple[str, bytes]]:
    """What is posted to a server that gives these answers."""
    server: Any = HTTPServer(("127.0.0.1", 0), Post)
    server.posts, server.answers = [], list(answers)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    environment = {
        "AI2THOR_SERVER_TYPE": "WSGI",
        "AI2THOR_HOST": "127.0.0.1",
        "AI2THOR_PORT": str(server.server_port),
        "AI2THOR_CLIENT_TOKEN": "secret",
    }
    try:
        unity.serve(environment, [], scenes)
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
    return server.posts


def test_an_empty_action_over_http_ends_the_program() -> None:
    step = json.dumps({"action": "GetScenesInBuild", "sequenceId": 7}).encode()
    first, second = posts((200, step), (200, b"{}"))
    assert first[0] == "/train"
    assert b'"sequenceId": 0' in first[1]
    assert b'name="token"\r\n\r\nsecret\r\n' in first[1]
    assert b'"sequenceId": 7' in second[1]
    assert b'"actionReturn": ["FloorPlan1_physics", "Kitchen1", "Ruin"]' in second[1]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ((200, b"no json"), "Expected a JSON object"),
        ((200, b"[1]"), "Expected a JSON object"),
        ((403, b""), "HTTP 403"),
    ],
)
def test_nonsense_over_http_is_refused(answer: tuple[int, bytes], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        posts(answer)


class Pipes:
    """The Controller's ends of the pipes, and the program at the other ends."""

    def __init__(self, folder: Path) -> None:
        self.outward, self.inward = folder / "server.pipe", folder / "client.pipe"
        os.mkfifo(self.outward)
        os.mkfifo(self.inward)
        self.scenes: Callable[[], dict[str, Callable[[], Scene]]] = scenes
        self.error: BaseException | None = None
        self.program = threading.Thread(target=self._serve, daemon=True)

    def _serve(self) -> None:
        environment = {
            "AI2THOR_SERVER_TYPE": "FIFO",
            "AI2THOR_FIFO_SERVER_PIPE_PATH": str(self.outward),
            "AI2THOR_FIFO_CLIENT_PIPE_PATH": str(self.inward),
        }
        try:
            unity.serve(environment, [], self.scenes)
        except BaseException as error:
            self.error = error

    def read(self, data: bytes) -> bytes:
        """What the program writes after its first message, when it gets these data."""
        self.program.start()
        with self.outward.open("rb") as reader:
            _, length = struct.unpack("!BI", reader.read(5))
            reader.read(length + 5)
            with self.inward.open("wb") as writer:
                writer.write(data)
            time.sleep(0.05)  # let the pipe become full
            return reader.read()

    def ended(self) -> bool:
        self.program.join(10)
        return not self.program.is_alive()


END = struct.pack("!BI", 255, 0)


def field(**action: Any) -> bytes:
    body = json.dumps(action).encode()
    return struct.pack("!BI", 2, len(body)) + body + END


@pytest.fixture
def pipes(tmp_path: Path) -> Pipes:
    pytest.importorskip("msgpack", reason="needs the package msgpack")
    return Pipes(tmp_path)


def test_a_message_longer_than_a_pipe_holds_arrives_whole(pipes: Pipes) -> None:
    pipes.scenes = lambda: {f"Room{n}": broken_scene for n in range(20_000)}
    written = pipes.read(field(action="GetScenesInBuild"))
    _, length = struct.unpack("!BI", written[:5])
    assert length > 2**16
    assert written[5 + length :] == END
    assert pipes.ended()
    assert pipes.error is None


def test_an_answer_that_nobody_reads_ends_the_program(pipes: Pipes) -> None:
    closed = threading.Event()

    def slow_scene() -> Scene:
        assert closed.wait(10)
        return scene("Slow")

    pipes.scenes = lambda: {"Slow": slow_scene}
    pipes.program.start()
    with pipes.outward.open("rb"), pipes.inward.open("wb") as writer:
        writer.write(field(action="Reset", sceneName="Slow"))
    closed.set()
    assert pipes.ended()
    assert pipes.error is None


@pytest.mark.parametrize("part", [b"", b"\x02\0", struct.pack("!BI", 2, 9) + b'{"action'])
def test_pipes_that_close_end_the_program(pipes: Pipes, part: bytes) -> None:
    assert pipes.read(part) == b""
    assert pipes.ended()
    assert pipes.error is None


def test_a_pipe_that_is_not_read_any_more_ends_the_program(pipes: Pipes) -> None:
    pipes.program.start()
    with pipes.outward.open("rb") as reader:
        reader.read(5)
    assert pipes.ended()
    assert pipes.error is None


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (struct.pack("!BI", 9, 3), "type 9"),
        (struct.pack("!BI", 2, 2**32 - 1), "4,294,967,295 bytes"),
        (struct.pack("!BI", 2, 3) + b"[1]" + END, r"not b'\[1\]'"),
        (END, "not b''"),
    ],
)
def test_nonsense_in_a_pipe_is_refused(pipes: Pipes, data: bytes, message: str) -> None:
    assert pipes.read(data) == END
    assert pipes.ended()
    with pytest.raises(InvalidInputError, match=message):
        raise pipes.error or AssertionError


def test_a_missing_package_is_named(pipes: Pipes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "msgpack", None)
    pipes.program.start()
    assert pipes.outward.read_bytes() == END
    assert pipes.ended()
    with pytest.raises(InvalidInputError, match=r"goalscope\[thor\]"):
        raise pipes.error or AssertionError


def test_a_controller_that_never_comes_is_not_awaited_for_ever(
    pipes: Pipes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unity, "_PATIENCE", 0.05)
    pipes.program.start()
    assert pipes.ended()
    with pytest.raises(InvalidInputError, match="No Controller is at the pipe"):
        raise pipes.error or AssertionError


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        ({}, "AI2THOR_SERVER_TYPE is not set"),
        ({"SERVER_TYPE": "PIGEON"}, "PIGEON"),
        ({"SERVER_TYPE": "FIFO"}, "AI2THOR_FIFO_SERVER_PIPE_PATH is not set"),
        (
            {
                "SERVER_TYPE": "FIFO",
                "FIFO_SERVER_PIPE_PATH": "/nowhere/server.pipe",
                "FIFO_CLIENT_PIPE_PATH": "/nowhere/client.pipe",
            },
            "No such file",
        ),
        ({"SERVER_TYPE": "WSGI", "PORT": "x"}, "'x', which is no number"),
        ({"SERVER_TYPE": "WSGI", "PORT": "1"}, "No Controller listens"),
    ],
)
def test_the_program_started_by_hand_says_what_it_wants(
    environment: dict[str, str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = {"HOST": "127.0.0.1", "CLIENT_TOKEN": "secret"} | environment
    for name in (*given, "SERVER_TYPE"):
        monkeypatch.delenv(f"AI2THOR_{name}", raising=False)
    for name, value in given.items():
        monkeypatch.setenv(f"AI2THOR_{name}", value)
    monkeypatch.setattr(sys, "argv", ["goalscope-unity"])
    with pytest.raises(SystemExit) as end:
        unity.main()
    assert end.value.code == 2
    assert message in capsys.readouterr().err


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
