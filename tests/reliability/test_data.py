"""Data on disk: durable at each commit, whole after a torn write, kept when the disk is full."""

from __future__ import annotations

import json
import logging
import os
import resource
import shutil
import signal
import sqlite3
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from sqlalchemy.engine.default import DefaultDialect

import lives as fork
from databases import begin
from fakes import WordModel
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.belief.calibration import DEFAULT, calibration_named, keep_calibration
from goalscope.belief.likelihood import RolePlay
from goalscope.datasets.case import read_cases
from goalscope.experiment import measure as measuring
from goalscope.experiment.infer import infer, trim_output
from goalscope.experiment.plan import read_experiment, specs_of
from goalscope.experiment.results import Results
from goalscope.experiment.run import run
from goalscope.storage import opening
from goalscope.storage.store import Store
from goalscope.study.store import StudyStore
from lives import Lives, anew, episode, experiment, furnish, measured, rounds_of
from sites import site
from test_run import NamedModel
from test_store import EPISODE, a_round
from test_study import fill
from test_study_web import HOME, WEB, put

lives, whole = fork.lives, fork.whole
STRIDES = [97, pytest.param(1, marks=pytest.mark.slow)]
SETTINGS = {"model": "words"}


# Durable on every connection


def test_every_commit_is_on_disk_before_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, visit: Any, figure: Any
) -> None:
    """Asked of each connection as it commits, whoever uses it."""
    seen, used, commit = Counter[tuple[Any, ...]](), set[Any](), DefaultDialect.do_commit

    def asked(self: Any, connection: Any) -> None:
        cursor, found = connection.cursor(), []
        (_, _, file) = cursor.execute("PRAGMA database_list").fetchone()
        if not file:  # in memory, for one episode of an experiment
            return commit(self, connection)
        for name in ("journal_mode", "synchronous", "foreign_keys"):
            found += cursor.execute(f"PRAGMA {name}").fetchone()
        seen[tuple(found)] += 1
        used.add(connection.dbapi_connection)
        commit(self, connection)

    monkeypatch.setattr(DefaultDialect, "do_commit", asked)
    monkeypatch.setattr(measuring, "opened", lambda model, *_: NamedModel())
    monkeypatch.setattr(measuring, "_fingerprints", {})
    folder = furnish(tmp_path / "run")
    plan = read_experiment(folder / "tiny.toml")
    with Results.open(folder / "tiny.db") as results:
        assert [step.error for step in run(plan, specs_of(plan, None), results)][-1] is None
    with Store.open(tmp_path / "threads.db") as store, ThreadPoolExecutor(8) as pool:
        together = threading.Barrier(8)

        def talk(_: int) -> None:
            together.wait()
            id = begin(store, **EPISODE)
            for number in range(1, 6):
                store.append(id, a_round(number))

        list(pool.map(talk, range(8)))
    with Store.open(tmp_path / "study.db") as store:
        fill(store)
        StudyStore(store).add(WEB)
        with site(tmp_path / "study.db") as address:
            ann = visit(address)
            ann.http.params = {"id": "ann"}
            ann.post(f"{HOME}/consent", agreed=True)
            assert put(ann, 1, 2, 1).status_code == 200
    assert set(seen) == {("wal", 2, 1)}
    assert seen.total() > 60
    assert len(used) > 2
    figure(f"{seen.total()} commits of {len(used)} connections: WAL and FULL at each")


def test_a_file_system_on_which_nothing_is_durable_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SQLite's own way with disks that cannot share memory, as many across a network."""
    connect = sqlite3.connect

    def without_shared_memory(file: Path, *given: Any, **more: Any) -> sqlite3.Connection:
        return connect(f"{file.as_uri()}?vfs=unix-dotfile", *given, uri=True, **more)

    monkeypatch.setattr(sqlite3, "connect", without_shared_memory)
    with pytest.raises(GoalscopeError, match=r"not survive a crash.*a file on a local disk"):
        Store.open(tmp_path / "s.db")


@pytest.mark.parametrize("kind", ["nfs4", "cifs", "fuse.sshfs", "ext4", "tmpfs"])
def test_a_network_file_system_is_warned_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    home = tmp_path / "my home"
    home.mkdir()
    (tmp_path / "link").symlink_to(home)
    place = str(home).replace(" ", r"\040")
    (tmp_path / "mounts").write_text(f"a / ext4 rw 0 0\nhost:/x {place} {kind} rw 0 0\n")
    monkeypatch.setattr(opening, "MOUNTS", tmp_path / "mounts")
    for file in (home / "new" / "s.db", tmp_path / "link" / "s.db", tmp_path / "s.db"):
        with caplog.at_level(logging.WARNING):
            Store.open(file).close()
        warned = kind not in ("ext4", "tmpfs") and file != tmp_path / "s.db"
        assert ("network file system" in caplog.text) is warned
        caplog.clear()


# Torn tails


def test_beliefs_in_a_file_survive_a_tear_at_every_byte(tmp_path: Path, figure: Any) -> None:
    turns = [{"query": "What?", "utterance": "milk"}, {"query": "And?", "utterance": "tea, ünd"}]
    rows = [
        {"id": n, "task": "Sell.", "turns": turns, "goals": ["buy milk", "drink tea ☕"]}
        for n in range(2)
    ]
    file, out = tmp_path / "in.jsonl", tmp_path / "out.jsonl"
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    dialogues = read_cases(file, labelled=False)

    def go_on() -> int:
        left = trim_output(out, dialogues, SETTINGS)
        return sum(1 for _ in infer(left, out, RolePlay(WordModel()), SETTINGS))

    assert go_on() == 2
    whole = out.read_bytes()
    start = whole.index(b'{"id": "1"')  # a dialogue is written at once, two lines
    for size in range(start, len(whole) + 1):
        out.write_bytes(whole[:size])
        assert go_on() == (size < len(whole))
        assert out.read_bytes() == whole
    figure(f"torn at each of {len(whole) - start:,} bytes: only the torn "
                    "dialogue is read again, and the file is the same to the byte")  # fmt: skip


def torn_copies(database: Path, before: int, stride: int) -> Iterator[tuple[int, Path]]:
    """How much there is of its log, from `before` on, and a folder with such a copy."""
    log = Path(f"{database}-wal").read_bytes()
    for size in sorted({*range(before, len(log), stride), len(log) - 1, len(log)}):
        with TemporaryDirectory(dir=database.parent) as folder:
            torn = Path(folder)
            shutil.copy(database, torn)
            (torn / f"{database.name}-wal").write_bytes(log[:size])
            yield size, torn


@pytest.mark.parametrize("stride", STRIDES)
def test_a_store_loses_at_most_the_round_whose_write_was_torn(
    tmp_path: Path, stride: int, figure: Any
) -> None:
    """What is not yet in the database's file stands at the end of its log."""
    with Store.open(tmp_path / "s.db") as store:
        id = begin(store, **EPISODE)
        store.append(id, a_round(1))
        before = (tmp_path / "s.db-wal").stat().st_size
        store.append(id, a_round(2))
        shutil.copytree(tmp_path, tmp_path / "copy")
    length = (tmp_path / "copy" / "s.db-wal").stat().st_size
    kept = Counter[int]()
    for size, torn in torn_copies(tmp_path / "copy" / "s.db", before, stride):
        connection = sqlite3.connect(torn / "s.db")
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        found = [n for (n,) in connection.execute("SELECT number FROM rounds ORDER BY number")]
        connection.close()
        assert found == ([1, 2] if size == length else [1])
        kept[len(found)] += 1
        if size % (10 * stride) == 0 or size == length - 1:
            with Store.open(torn / "s.db") as store:
                store.append(id, a_round(len(found) + 1))
            assert len(rounds_of(torn / "s.db")[0]) == len(found) + 1
    assert set(kept) == {1, 2}
    figure(f"torn at {kept.total():,} of {length - before + 1:,} bytes: "
                    "whole each time, without the torn round alone")  # fmt: skip


def test_a_calibration_is_the_old_or_the_new_whatever_stops_its_writing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, write = tmp_path / "mine.json", Path.write_text
    keep_calibration(file, DEFAULT, {})

    def write_half(self: Path, text: str, **more: Any) -> None:
        write(self, text[: len(text) // 2], **more)
        raise KeyboardInterrupt

    def give_no_name(self: Path, target: Path) -> None:
        raise KeyboardInterrupt

    for name, stopped in (("write_text", write_half), ("replace", give_no_name)):
        with monkeypatch.context() as patch:
            patch.setattr(Path, name, stopped)
            with pytest.raises(KeyboardInterrupt):
                keep_calibration(file, replace(DEFAULT, temperature=7.0), {})
        assert calibration_named(str(file)) == DEFAULT
    whole = file.read_text()
    for size in range(len(whole) - 1):  # by another program
        file.write_text(whole[:size])
        with pytest.raises(InvalidInputError, match="is not a calibration"):
            calibration_named(str(file))


# Full, read-only and locked disks


def limited(folder: str, life: str, size: str) -> None:
    """Live with a disk on which no file may be larger than so many bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(size), int(size)))
    getattr(fork, life)(folder)


def said_clearly(folder: Path) -> None:
    """The last line of the errors is one for people, and no traceback stands above it."""
    said = (folder / "errors").read_text()
    assert "Traceback" not in said
    assert said.splitlines()[-1].startswith("Error: "), said
    (folder / "errors").unlink()


@pytest.mark.parametrize(
    ("life", "step"),
    [
        (experiment, 150_000),
        (episode, 50_000),
        pytest.param(experiment, 15_000, marks=pytest.mark.slow),
        pytest.param(episode, 5_000, marks=pytest.mark.slow),
    ],
)
def test_a_full_disk_stops_a_run_and_with_room_it_goes_on(
    lives: Lives, whole: Any, life: Callable[..., None], step: int, figure: Any
) -> None:
    folder, cells, tables, rounds = whole
    stopped = 0
    for size in range(step, 10**7, step):
        anew(folder)
        first = lives.begin(limited, folder, life.__name__, str(size))
        code, told = first.ends(), first.said()
        if code == 0:
            break
        assert code == 1, (folder / "errors").read_text()
        said_clearly(folder)
        stopped += 1
        if life is experiment:
            if told:
                with Results.open(folder / "tiny.db") as results:
                    assert {*told} <= {cell.key for cell in results.cells() if cell.result}
            assert lives.live(experiment, folder) == 0, (folder / "errors").read_text()
            with Results.open(folder / "tiny.db") as results:
                retried = any(cell.attempts > 1 for cell in results.cells())
            again, same = measured(folder)
            assert again == cells
            assert (same == tables) is not retried  # an episode's own file may have had no room
        else:
            if told:
                assert len(rounds_of(folder / "s.db")[0]) >= len(told)
            assert lives.live(episode, folder) == 0, (folder / "errors").read_text()
            assert rounds_of(folder / "s.db") == [rounds]
    assert stopped > 1
    figure(f"{life.__name__}: full at {stopped} sizes: one line each, "
                    "nothing that was told lost, the same results in the end")  # fmt: skip


def unprivileged(folder: str, life: str) -> None:
    """Live as nobody, for whom files may be read-only."""
    if os.getuid() == 0:
        os.setgid(65534)
        os.setuid(65534)
    getattr(fork, life)(folder)


@pytest.mark.parametrize("life", [experiment, episode])
def test_a_read_only_file_stops_a_run_and_is_as_it_was(
    lives: Lives, life: Callable[..., None], figure: Any
) -> None:
    with fork.TemporaryDirectory() as name:  # where nobody may enter, too
        os.chmod(name, 0o777)
        folder = furnish(Path(name) / "run")
        os.chmod(folder, 0o777)
        assert lives.live(unprivileged, folder, life.__name__) == 0, (folder / "errors").read_text()
        (folder / "errors").unlink(missing_ok=True)
        file = folder / ("tiny.db" if life is experiment else "s.db")
        with sqlite3.connect(file) as connection:  # as before the last of its work
            connection.execute("UPDATE cells SET result = NULL")
            connection.execute("UPDATE episodes SET ended = NULL")
            connection.execute("DELETE FROM rounds WHERE number > 1")
        connection.close()
        before = file.read_bytes()
        os.chmod(file, 0o444)
        os.chmod(folder, 0o555)
        for path in (folder / "said", folder / "errors"):
            path.touch()
            os.chmod(path, 0o666)
        assert lives.live(unprivileged, folder, life.__name__) == 1
        said = (folder / "errors").read_text()
        assert "Traceback" not in said
        assert "not writable" in said.splitlines()[-1] or "opened" in said.splitlines()[-1], said
        assert file.read_bytes() == before
        os.chmod(folder, 0o777)
        os.chmod(file, 0o666)
        assert lives.live(unprivileged, folder, life.__name__) == 0, (folder / "errors").read_text()


def impatient(folder: str, life: str) -> None:
    """Live without waiting long for a lock."""
    opening.WAIT = 0
    getattr(fork, life)(folder)


@pytest.mark.parametrize("life", [experiment, episode])
def test_a_locked_file_stops_a_run_and_once_it_is_free_it_goes_on(
    lives: Lives, whole: Any, life: Callable[..., None]
) -> None:
    folder, cells, tables, rounds = whole
    anew(folder)
    file = folder / ("tiny.db" if life is experiment else "s.db")
    first = lives.begin(life, folder)
    fork.signalled(first, signal.SIGKILL, 2, 0)
    told = first.said()
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    assert lives.live(impatient, folder, life.__name__) == 1
    assert "Another program is writing to it" in (folder / "errors").read_text()
    said_clearly(folder)
    other.execute("ROLLBACK")
    other.close()
    assert lives.live(life, folder) == 0, (folder / "errors").read_text()
    if life is experiment:
        assert measured(folder) == (cells, tables)
        with Results.open(file) as results:
            attempts = {cell.key: cell.attempts for cell in results.cells()}
        assert {attempts[key] for key in told} == {1}
    else:
        assert rounds_of(file) == [rounds]
