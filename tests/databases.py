"""The databases that a store may be in, and a real PostgreSQL server for them."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from goalscope.storage.store import Store, new_episode

PASSWORD = "secret-7f3a"
_names = count()


def begin(store: Store, **values: Any) -> str:
    """Store an episode with these arguments of `new_episode`, and return its id."""
    episode = new_episode(**values)
    store.add(episode)
    return episode["id"]


@dataclass(frozen=True)
class Server:
    """A running PostgreSQL server."""

    port: int

    def address(self, database: str, password: str = PASSWORD) -> str:
        return f"postgresql://someone:{password}@127.0.0.1:{self.port}/{database}"

    def run(self, statement: str, database: str = "postgres") -> list[tuple[object, ...]]:
        import psycopg

        with psycopg.connect(self.address(database), autocommit=True) as connection:
            cursor = connection.execute(statement.encode())
            return cursor.fetchall() if cursor.description else []

    def new(self) -> str:
        """The address of a new database."""
        name = f"d{next(_names)}"
        self.run(f"CREATE DATABASE {name}")
        return self.address(name)


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    """A PostgreSQL server of Debian's package."""
    pytest.importorskip("psycopg")
    folders = [Path(each).parent for each in [shutil.which("postgres")] if each]
    folders += sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    programs = next((each for each in folders if (each / "initdb").exists()), None)
    if programs is None:
        pytest.skip("PostgreSQL is missing: `make servers`, or `apt-get install postgresql`")
    with tempfile.TemporaryDirectory(prefix="goalscope-postgres-", ignore_cleanup_errors=True) as t:
        folder, port = Path(t), _free_port()
        (folder / "password").write_text(PASSWORD)
        who = {}
        if os.getuid() == 0:  # PostgreSQL refuses to run as root
            shutil.chown(folder, "postgres", "postgres")
            shutil.chown(folder / "password", "postgres", "postgres")
            who = {"user": "postgres", "group": "postgres", "extra_groups": []}
        make = [programs / "initdb", "-D", folder / "data", "-U", "someone", "-A", "scram-sha-256"]
        make += [f"--pwfile={folder / 'password'}", "-E", "UTF8", "--locale=C", "--no-sync"]
        subprocess.run(make, check=True, cwd=folder, stdout=subprocess.DEVNULL, **who)
        start = [programs / "postgres", "-D", folder / "data", "-p", str(port)]
        start += ["-h", "127.0.0.1", "-k", "", "-c", "fsync=off"]
        with (folder / "log").open("wb") as log:
            process = subprocess.Popen(start, cwd=folder, stdout=log, stderr=log, **who)
        try:
            end = time.monotonic() + 60
            while not _answers(port):
                if process.poll() is not None or time.monotonic() > end:
                    raise RuntimeError((folder / "log").read_text(errors="replace"))
                time.sleep(0.05)
            yield Server(port)
        finally:
            process.send_signal(signal.SIGINT)  # ends all connections
            process.wait(30)


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Where a new store may be opened: each test runs over both databases."""
    if request.param == "sqlite":
        return str(tmp_path / "s.db")
    return request.getfixturevalue("server").new()


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def _answers(port: int) -> bool:
    import psycopg

    try:
        Server(port).run("SELECT 1")
    except psycopg.OperationalError:
        return False
    return True
