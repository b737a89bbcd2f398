"""Processes that may die at any moment: `goalscope` over the small honest model, forked.

A process that has loaded everything waits for orders, and forks for each: hundreds of real
processes can be killed in a minute. What they said is read from a file.
"""

from __future__ import annotations

import importlib
import io
import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from fakes import GOALS, NEEDS, QUESTION

HERE = Path(__file__).parent
CATALOGUE = """name,category,unit,price
Whole Milk,dairy,1 L,1.20
Green Tea,drinks,20 bags,3.00
Plain Flour,baking,1 kg,1.10
Cocoa Powder,baking,250 g,2.40
Free Range Eggs,dairy,6 ct,2.20
"""
PEOPLE = """
[[profile]]
name = "baker"
description = "You want to bake a chocolate cake."
replies = [
    "Please add cocoa powder.", "It is for Sunday.", "2 packs of plain flour, please.",
    "Also eggs.", "Please remove the flour.", "And green tea.", "Add whole milk.",
]
checks = [{must_have = ["cocoa"]}]

[[profile]]
name = "drinker"
description = "You want tea."
replies = ["Please add green tea.", "And milk for it."]
checks = [{must_have = ["tea"]}]
"""
EXPERIMENT = """
[mcq]
file = "questions.jsonl"
[episodes]
domain = "grocery"
people = "people.toml"
catalogue = "shop.csv"
methods = ["good", "no-goals"]
[judge]
trials = 1
"""


REPLIES = {
    GOALS: "bake a cake\ndrink tea with milk",
    NEEDS: "needed: flour, cocoa",
    QUESTION: "What do you like?",
    "reasonable is this": '{"explanation": "It fits.", "score": 2}',
}


@dataclass(frozen=True)
class Life:
    """A process that was started; what it says stands in a file, line by line."""

    pid: int
    file: Path
    ends: Callable[[], int]

    def said(self) -> list[str]:
        """The whole lines so far."""
        return self.file.read_text().split("\n")[:-1] if self.file.exists() else []


class Lives:
    """The process that has loaded everything."""

    def __init__(self) -> None:
        folders = [HERE.parent / "src", HERE, HERE / "reliability"]
        path = os.pathsep.join([*map(str, folders), *sys.path])
        few = {"PYTHONPATH": path, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=pipe, stdout=pipe, text=True, env=os.environ | few
        )
        self._answer("ready")

    def begin(self, life: Callable[..., Any], folder: Path, *given: Any) -> Life:
        """Start a process that calls a function of a module with a folder, and what is given."""
        (folder / "said").unlink(missing_ok=True)
        order = [life.__module__, life.__name__, str(folder), *given]
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(order) + "\n")
        self._process.stdin.flush()
        return Life(self._answer("pid"), folder / "said", lambda: self._answer("end"))

    def live(self, life: Callable[..., Any], folder: Path, *given: Any) -> int:
        """Start such a process, and wait for its exit code."""
        return self.begin(life, folder, *given).ends()

    def close(self) -> None:
        self._process.communicate()

    def _answer(self, to: str) -> int:
        assert self._process.stdout is not None
        said, number = self._process.stdout.readline().split()
        assert said == to
        return int(number)


@pytest.fixture(scope="session")
def lives() -> Iterator[Lives]:
    if not hasattr(os, "fork"):
        pytest.skip("the system cannot fork")
    found = Lives()
    yield found
    found.close()


@pytest.fixture(scope="module")
def whole(lives: Lives, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any, Any, Any]:
    """A folder, and what comes of it where nothing happens: cells, tables, and an episode."""
    folder = furnish(tmp_path_factory.mktemp("whole") / "run")
    for life in (experiment, episode):
        assert lives.live(life, folder) == 0, (folder / "errors").read_text()
    (rounds,) = rounds_of(folder / "s.db")
    return folder, *measured(folder), rounds


def signalled(life: Life, how: int, heard: int, delay: float) -> int:
    """The exit code of a process that got a signal some seconds after so many lines, if it ran."""
    end = time.monotonic() + 60
    while len(life.said()) < heard and time.monotonic() < end and _runs(life.pid):
        time.sleep(0.001)
    time.sleep(delay)
    if _runs(life.pid):
        os.kill(life.pid, how)
    return life.ends()


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)  # the parent has not waited for it yet, or it would be another's
    except ProcessLookupError:
        return False
    return True


def furnish(folder: Path) -> Path:
    """The files of a tiny shop, and of an experiment in it."""
    from test_run import QUESTIONS

    folder.mkdir(parents=True, exist_ok=True)
    (folder / "shop.csv").write_text(CATALOGUE)
    (folder / "people.toml").write_text(PEOPLE)
    (folder / "tiny.toml").write_text(EXPERIMENT.replace("questions", f"{folder}/questions"))
    (folder / "questions.jsonl").write_text("".join(json.dumps(row) + "\n" for row in QUESTIONS))
    return folder


def experiment(folder: str, *more: str) -> None:
    """`goalscope experiment run`, which says each cell that it tells of."""
    from goalscope.experiment import run as runs

    def told(*given: Any, **options: Any) -> Iterator[Any]:
        for step in run(*given, **options):
            if step.cell and not step.error:
                print(step.cell.key, flush=True)
            yield step

    run = runs.run
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "run", told)
        _command("experiment", "run", f"{folder}/tiny.toml", "--results", folder, *more)


def episode(folder: str, *more: str) -> None:
    """`goalscope run`, or what goes on with its episode; says the number of each round shown."""
    from goalscope.base.types import GoalscopeError
    from goalscope.cli import display
    from goalscope.storage.store import Store

    show = display.show_done
    begun, known = list[str](), 0
    with suppress(GoalscopeError), Store.open(f"{folder}/s.db") as store:
        for info in store.episodes():
            begun, known = [info.id], info.rounds
            if info.ended:
                return

    def told(out: Any, round: Any) -> None:
        show(out, round)
        if round.number > known:
            print(round.number, flush=True)

    shop = ["--catalogue", f"{folder}/shop.csv", "--profiles", f"{folder}/people.toml"]
    words = ["chat", "--resume", *begun] if begun else ["run", "--profile", "baker", *shop]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(display, "show_done", told)
        _command(*words, "--store", f"{folder}/s.db", *more)


def rounds_of(place: Path | str) -> list[tuple[str, ...]]:
    """Of each episode in a store its rounds, as they are stored; a file must be whole."""
    from goalscope.storage.store import Store, round_to_json

    with Store.open(place) as store:
        if "://" not in str(place):
            with store.reading() as connection:
                checked = connection.exec_driver_sql("PRAGMA integrity_check").scalar()
            assert checked == "ok"
        return [tuple(map(round_to_json, store.rounds(e.id))) for e in store.episodes()]


def measured(folder: Path) -> tuple[dict[str, Any], list[Any]]:
    """Cells by key, each with its episode in it, and all tables."""
    from goalscope.experiment.results import Results
    from goalscope.experiment.tables import tables_of
    from goalscope.storage.store import round_to_json

    with Results.open(folder / "tiny.db") as results:
        cells = {}
        for cell in results.cells():
            found = dict(cell.result or {})
            if "episode" in found:
                found["episode"] = [
                    round_to_json(each) for each in results.rounds(found["episode"])
                ]
            cells[cell.key] = (cell.spec, {k: v for k, v in found.items() if k != "seconds"})
        asked = results.asked_for()
        tables = [each.to_dict() for each in tables_of(asked)]
    return cells, tables


def anew(folder: Path) -> Path:
    """The folder as it was before anything ran in it."""
    shutil.rmtree(folder)
    return furnish(folder)


def _command(*words: str) -> None:
    """A command line over the small model; what it shows goes nowhere."""
    from rich.console import Console

    from goalscope.cli import chat, experiments, main, terminal
    from goalscope.experiment import measure as measuring
    from goalscope.models import opening
    from test_run import NamedModel

    def small(*_: Any, **__: Any) -> NamedModel:
        return NamedModel(REPLIES)

    quiet = Console(file=open(os.devnull, "w"))  # noqa: SIM115
    measuring.opened = opening.open_model = small
    for module in (chat, experiments, terminal):
        module.console = lambda **_: quiet
    experiments.show_tables = lambda *_: None
    sys.argv = ["goalscope", *words]
    main.main()


def _main() -> None:
    logging.basicConfig(level=logging.WARNING)  # as `goalscope` does before it loads anything
    with TemporaryDirectory() as folder:  # a rehearsal, which loads everything
        for life in (experiment, episode):
            with suppress(SystemExit), redirect_stdout(io.StringIO()):
                life(str(furnish(Path(folder))))
    os.write(1, b"ready 0\n")
    answers = os.dup(1)
    for line in sys.stdin:
        module, name, folder, *given = json.loads(line)
        life = getattr(importlib.import_module(module), name)
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # until the child can stand it
        pid = os.fork()
        if pid == 0:
            _live(partial(life, folder, *given), Path(folder))
        os.write(answers, f"pid {pid}\n".encode())
        _, status = os.waitpid(pid, 0)
        os.write(answers, f"end {os.waitstatus_to_exitcode(status)}\n".encode())


def _live(life: Callable[[], None], folder: Path) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    append = os.O_WRONLY | os.O_CREAT | os.O_APPEND
    os.dup2(os.open(folder / "said", append), 1)
    os.dup2(os.open(folder / "errors", append), 2)
    try:
        code = _lived(life)
    except KeyboardInterrupt:  # it came before the command ran, or as it had ended
        code = 130
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def _lived(life: Callable[[], None]) -> int:
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        life()
        code = 0
    except SystemExit as leaves:
        code = leaves.code if isinstance(leaves.code, int) else 1
    except Exception:
        import traceback

        traceback.print_exc()
        code = 70
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    return code


if __name__ == "__main__":
    _main()
