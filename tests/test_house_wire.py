"""The program in Unity's place, driven by bare pipes and HTTP."""

from __future__ import annotations

import json
import os
import struct
import sys
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from goalscope.envs.house.simulator import unity
from goalscope.envs.house.simulator.scene import Scene
from goalscope.types import InvalidInputError
from unities import broken_scene, scene, scenes


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
