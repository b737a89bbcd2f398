"""Whoever waits for an answer never waits for the measuring of a first use."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from goalscope.agent.settings import Settings
from goalscope.base.types import GoalscopeError
from goalscope.cli import terminal
from goalscope.cli.terminal import measured_meanwhile
from goalscope.models.llama.model import embedded_path, processors
from goalscope.models.llama.native import Running
from goalscope.models.llama.tune import Tuning, waits
from goalscope.models.opening import open_model, unmeasured
from goalscope.storage.tracking import Trackers
from test_cli import fails, invoke


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The home of a user who never used goalscope, with tuning on."""
    monkeypatch.setattr("platformdirs.user_cache_path", lambda _: tmp_path / "cache")
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    monkeypatch.delenv("GOALSCOPE_TUNE", raising=False)
    return tmp_path


def never(*_: object, **__: object) -> None:
    raise AssertionError("it measured")


class Recorded:
    """In place of a process that measures."""

    def __init__(self, events: list[str]) -> None:
        self.events = events

    def __call__(self, words: list[str], **_: Any) -> Recorded:
        self.events.append(f"begun: {words[-1]}")
        return self

    def __enter__(self) -> Recorded:
        return self

    def __exit__(self, *_: object) -> None:
        self.events.append("waited for")

    def terminate(self) -> None:
        self.events.append("ended")


def test_the_first_call_of_an_assistant_measures_nothing(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mcp")
    events: list[str] = []

    class Server:
        def __init__(self, trackers: Trackers, _: object) -> None:
            self.trackers = trackers

        def run(self) -> None:
            session = self.trackers.open("Help in the kitchen.", ["bake a cake", "cook soup"])
            told = self.trackers.observe(session.id, 1, "", "I need flour and sugar.")
            events.append(f"{len(told.turns)} turn")

    monkeypatch.setattr("goalscope.models.llama.tune.tune", never)
    monkeypatch.setattr("goalscope.web.mcp.create_server", Server)
    monkeypatch.setattr(terminal.subprocess, "Popen", Recorded(events))
    result = invoke("mcp", "--store", fresh / "episodes.db")
    assert result.exit_code == 0, result.output
    assert [each.partition(":")[0] for each in events] == [
        "begun", "1 turn", "ended", "waited for",
    ]  # fmt: skip


@pytest.mark.parametrize("command", [["chat"], ["serve", "--port", "0"], ["mcp", "--adapter", "x"]])
def test_who_waits_for_an_answer_does_not_wait_for_the_measuring(
    fresh: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    def opened(*_: object, measure: bool = True, **__: object) -> None:
        raise GoalscopeError(f"measures: {measure}")

    monkeypatch.setattr("goalscope.models.opening.open_model", opened)
    monkeypatch.setattr(terminal.subprocess, "Popen", Recorded([]))
    assert "measures: False" in fails(1, *command)


def test_a_file_that_was_not_measured_runs_as_it_is(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("goalscope.models.llama.tune.tune", never)
    model = open_model(measure=False)
    assert str(embedded_path()) in model.describe()
    model.close()
    assert not (fresh / "cache").exists()


def test_what_was_measured_is_used_without_measuring(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = embedded_path()
    kept = Tuning(file, file, 3, Running(3))
    assert waits(file, processors())
    monkeypatch.setattr("goalscope.models.llama.tune._kept", lambda *_: kept)
    assert not waits(file, processors())
    model = open_model(adapter="none", measure=False)
    assert "3 threads" in model.describe()
    model.close()


def test_only_small_files_that_goalscope_runs_itself_are_measured(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert unmeasured({})
    assert unmeasured({"generator": "http://localhost:1/v1"})  # the embedded model scores
    assert not unmeasured({"model": "http://localhost:1/v1#m.gguf"})
    assert not unmeasured({"model": "hf:owner/name", "scorer": str(fresh)})
    monkeypatch.setattr("goalscope.models.llama.tune._LARGEST", 1)
    assert not unmeasured({})
    monkeypatch.undo()
    monkeypatch.setenv("GOALSCOPE_TUNE", "0")
    assert not unmeasured({})


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_the_measuring_ends_with_the_program(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, ended = fresh / "begun", fresh / "ended"
    monkeypatch.setattr(
        terminal,
        "_MEASURE",
        f"""\
import pathlib, signal, sys, time
signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
try:
    pathlib.Path({str(begun)!r}).touch()
    time.sleep(600)
finally:
    pathlib.Path({str(ended)!r}).touch()
""",
    )
    with measured_meanwhile(Settings()):
        until(begun.exists)
    assert ended.exists() or sys.platform == "win32"
