"""The program in Unity's place, driven by AI2-THOR's own Controller."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from unities import LAMP, executable, room

BOTH = pytest.mark.parametrize("server", ["FIFO", "WSGI"])
DRIVEN = [
    BOTH,
    pytest.mark.filterwarnings(  # AI2-THOR never closes its log
        "ignore:unclosed file .*unity.log:ResourceWarning",
    ),
]


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
