"""No room, no home, no reader: one line each with the cause and what to do, and never a trace."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from commands import ROW, fails, rows_file, run
from goalscope.base import user_dirs as places
from goalscope.base.types import GoalscopeError
from goalscope.cli.main import _at_home
from goalscope.storage.opening import opened

SOURCE = str(Path(__file__).parents[1] / "src")
needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="/dev/full is Linux's")


MAIN = [sys.executable, "-c", "from goalscope.cli.main import main; main()"]


def ran(
    tmp_path: Path,
    *words: str,
    stdout: Any = subprocess.PIPE,
    code: str = MAIN[-1],
    unbuffered: str = "",
) -> subprocess.CompletedProcess[str]:
    home = {"HOME": str(tmp_path), "GOALSCOPE_STORE": str(tmp_path / "e.db")}
    environment = {**os.environ, "PYTHONPATH": SOURCE, **home}
    environment["PYTHONUNBUFFERED"] = unbuffered
    return subprocess.run(
        [*MAIN[:-1], code, *words], stdout=stdout, stderr=subprocess.PIPE, text=True,
        env=environment, check=False,
    )  # fmt: skip


@needs_linux
@pytest.mark.parametrize("words", [["data", "list"], ["chat", "--help"]], ids=" ".join)
def test_a_full_disk_behind_standard_output_is_said_in_one_line(
    tmp_path: Path, words: list[str]
) -> None:
    with Path("/dev/full").open("w") as full:
        result = ran(tmp_path, *words, stdout=full)
    assert result.stderr == (
        "Error: Cannot write to standard output: No space left on device. Free some space, or "
        "send it elsewhere.\n"
    )
    assert result.returncode == 1


@needs_linux
def test_without_a_buffer_a_full_disk_is_one_line_too(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        result = ran(tmp_path, "data", "list", stdout=full, unbuffered="1")
    assert result.stderr.startswith("Error: No space left on device. Free some space")
    assert (result.returncode, result.stderr.count("\n")) == (1, 1)


def test_a_reader_who_has_enough_is_told_nothing(tmp_path: Path) -> None:
    reads, writes = os.pipe()
    os.close(reads)
    result = ran(tmp_path, "data", "list", stdout=writes)
    os.close(writes)
    assert (result.returncode, result.stderr) == (1, "")


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_closed_streams_are_said_and_nothing_takes_their_place(tmp_path: Path) -> None:
    def shell(closing: str) -> subprocess.CompletedProcess[str]:
        words = ["sh", "-c", f'exec "$@" {closing}', "sh", *MAIN, "episodes"]
        place = {"GOALSCOPE_STORE": str(tmp_path / "e.db"), "PYTHONPATH": SOURCE}
        environment = {**os.environ, **place}
        return subprocess.run(words, capture_output=True, text=True, env=environment, check=False)

    opened(tmp_path / "e.db")[1].dispose()
    result = shell(">&-")
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == (
        "Error: Standard output is closed. Send it to a file, or to /dev/null.\n"
    )
    result = shell("<&- 2>&-")
    assert (result.returncode, result.stderr) == (0, "")
    assert "episode" in result.stdout


LONG = "x" * 300
PATHS = [
    ("episodes", "--store", "@"),
    ("mcp", "--store", "@"),
    ("chat", "--store", "@"),
    ("replay", "1", "--store", "@"),
    ("study", "list", "--store", "@"),
    ("study", "new", "@"),
    ("chat", "--catalogue", "@"),
    ("chat", "@"),
    ("chat", "house", "--scene", "@"),
    ("run", "--profiles", "@"),
    ("infer", "@", "--out", "o.jsonl"),
    ("infer", "ROWS", "--out", "@", "--model", "http://localhost:1/v1#m"),
    ("infer", "ROWS", "--out", "o.jsonl", "--calibration", "@"),
    ("infer", "ROWS", "--out", "o.jsonl", "--model", "@"),
    ("infer", "ROWS", "--out", "o.jsonl", "--adapter", "@"),
    ("calibrate", "@"),
    ("report", "@"),
    ("experiment", "run", "@"),
    ("bench", "dialogues", "teach", "--data", "@"),
    ("bench", "dialogues", "--jsonl", "@"),
    ("bench", "reading", "@"),
    ("data", "list", "--data", "@"),
    ("data", "export", "teach", "--data", "@", "--out", "o"),
    ("house", "show", "@"),
    ("house", "show", "Kitchen1", "--svg", "@"),
    ("models", "check", "@"),
]


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        *(("long", words) for words in PATHS),
        *((kind, words) for kind in ("deep", "beneath a file") for words in PATHS[::5]),
    ],
)
def test_a_path_that_cannot_be_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, words: tuple[str, ...]
) -> None:
    pytest.importorskip("mcp")
    monkeypatch.chdir(tmp_path)
    rows = rows_file(tmp_path, ROW)
    path = {"long": LONG, "deep": "a/" * 2500 + "b", "beneath a file": f"{rows}/x"}[kind]
    given = [{"@": path, "ROWS": str(rows)}.get(each, each) for each in words]
    result = run(*given)
    assert result.exit_code in (1, 2), result.output
    (line,) = [each for each in result.stderr.splitlines() if each]
    assert line.startswith("Error: ")


@needs_linux
def test_beliefs_on_a_full_disk_are_one_line(tmp_path: Path, words: object) -> None:
    rows = rows_file(tmp_path, ROW)
    line = fails(1, "infer", rows, "--out", "/dev/full")
    assert "Cannot write /dev/full: No space left on device" in line


@pytest.mark.skipif(os.name != "posix", reason="elsewhere every user has a home")
def test_an_unknown_user_without_a_home_is_told_what_to_name(tmp_path: Path) -> None:
    unknown = f"""\
import os, pwd
def getpwuid(_): raise KeyError
pwd.getpwuid = getpwuid
for name in ("HOME", "GOALSCOPE_STORE", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
    os.environ.pop(name, None)
{MAIN[-1]}"""
    result = ran(tmp_path, "episodes", code=unknown)
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == (
        "Error: There is no home folder to keep the episodes in: HOME is not set. Set it, or name "
        "a file with --store.\n"
    )
    result = ran(tmp_path, "models", "list", code=unknown)
    assert (result.returncode, result.stderr) == (0, "")


def test_who_has_no_home_keeps_nothing_and_runs_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def homeless(*_: object) -> Path:
        raise RuntimeError("could not determine the home directory")

    monkeypatch.setattr("platformdirs.user_data_path", homeless)
    assert places.user_data() == places.NOWHERE
    with pytest.raises(GoalscopeError, match="HOME is not set"):
        opened(places.user_data() / "episodes.db")


@pytest.mark.parametrize("given", ["~/rows.jsonl", "--out=~/rows.jsonl"])
def test_the_home_folder_is_found_without_a_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert _at_home(given) == given.replace("~", str(tmp_path))


def test_no_process_that_a_command_starts_runs_code_of_the_current_folder(tmp_path: Path) -> None:
    """Anybody may have written that folder; Python's own helpers import from it by default."""
    here = tmp_path / "strange"
    here.mkdir()
    for name in ("gguf", "multiprocessing", "pickle", "runpy", "signal", "sitecustomize"):
        (here / f"{name}.py").write_text(f"open({str(tmp_path / 'run')!r}, 'a').write('{name} ')")
    entry = tmp_path / "goalscope"  # as pip makes it: the first of sys.path is its own folder
    entry.write_text(
        "from concurrent.futures import ProcessPoolExecutor\n"
        "from multiprocessing import Lock, get_context\n"
        "import goalscope.cli.main as cli\n"
        "def app():\n"
        "    Lock()  # as a progress bar of transformers makes it\n"
        "    with ProcessPoolExecutor(1, get_context('spawn')) as pool:\n"
        "        assert pool.submit(abs, -1).result(60) == 1\n"
        "cli.app = app\n"
        "if __name__ == '__main__':\n"
        "    cli.main()\n"
    )
    environment = {**os.environ, "PYTHONPATH": SOURCE, "HOME": str(tmp_path)}
    environment.pop("PYTHONSAFEPATH", None)
    done = subprocess.run(
        [sys.executable, entry], cwd=here, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert not (tmp_path / "run").exists(), (tmp_path / "run").read_text()
    assert (done.returncode, done.stderr) == (0, "")
