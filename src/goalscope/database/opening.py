"""A database, made ready: durable, ours, and with the tables of this goalscope."""

from __future__ import annotations

import logging
import os
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path

import platformdirs
from sqlalchemy import (
    Connection,
    Engine,
    Pool,
    QueuePool,
    StaticPool,
    create_engine,
    event,
    func,
    inspect,
    select,
)
from sqlalchemy import column as column_named
from sqlalchemy import table as table_named
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from goalscope.database.errors import explained
from goalscope.database.tables import METADATA, REVISION, VERSION_TABLE
from goalscope.extras import package
from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["WRITING", "default_place", "opened", "opened_in_memory"]

APPLICATION = 0x474F4144  # "GOAD": marks a file as an episode store
WAIT = 10
"""Seconds until a locked database is given up."""
MOUNTS = Path("/proc/self/mounts")
"""Where Linux tells which file system is where."""
NETWORK = (
    "nfs", "nfs4", "cifs", "smb3", "9p", "fuse.sshfs", "fuse.glusterfs", "ceph", "lustre", "beegfs",
    "afs",
)  # fmt: skip
WRITING = {"goalscope_writing": True}
"""Execution options of connections that write."""

log = logging.getLogger(__name__)


def default_place() -> str:
    """$GOALSCOPE_STORE, or `episodes.db` in the user's data folder."""
    given = os.environ.get("GOALSCOPE_STORE")
    return given or str(platformdirs.user_data_path("goalscope", False) / "episodes.db")


def opened(place: str | Path) -> tuple[str, Engine]:
    """A database that is ready for use, and what to call it in messages.

    Args:
        place: A file, or the address of a PostgreSQL database.

    Raises:
        GoalscopeError: It cannot be used, or a newer goalscope made it.
    """
    name = str(place)
    if "://" in name:
        url = _address(name)
        name = url.set(query={}).render_as_string().replace("+psycopg", "", 1)
        engine = _server(url)
    else:
        engine = _file(Path(place))
    try:
        with explained(name):
            _prepare(engine, name)
    except BaseException:
        engine.dispose()
        raise
    return name, engine


def opened_in_memory(copied: Path | None = None) -> tuple[str, Engine]:
    """A database of this process alone, which leaves nothing on the disk, and what to call it.

    Args:
        copied: A file that it begins as a copy of. It is only read, but opened for writing where
            that is allowed: else SQLite could not take away the journal files that it makes
            beside it.

    Raises:
        GoalscopeError: The file cannot be used, or a newer goalscope made it.
    """
    name = str(copied or "in memory")
    connection = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
    engine = _sqlite(lambda: connection, StaticPool)
    try:
        with explained(name):
            if copied:
                uri = f"{copied.absolute().as_uri()}?mode=rw"
                with closing(sqlite3.connect(uri, uri=True, timeout=WAIT)) as file:
                    file.backup(connection)
                _refuse_others(connection, copied)
            connection.execute("PRAGMA foreign_keys = ON")
            _prepare(engine, name)
    except BaseException:
        connection.close()
        raise
    return name, engine


def _file(file: Path) -> Engine:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GoalscopeError(
            f"The folder of the episode store {file} cannot be made: {error.strerror}. "
            "Name another file with --store."
        ) from error
    path = file.absolute()
    with suppress(OSError):  # new, and for its owner alone: it holds what people said
        os.close(os.open(path, os.O_CREAT | os.O_EXCL, 0o600))
    if (kind := _file_system(Path(os.path.realpath(path)))) in NETWORK:
        log.warning(
            f"The episode store {file} is on a network file system ({kind}), where programs on "
            "several machines can damage it. Name a file on a local disk, or a PostgreSQL "
            "database, with --store."
        )
    return _sqlite(lambda: _connected(path, file), QueuePool)


def _sqlite(connect: Callable[[], sqlite3.Connection], pool: type[Pool]) -> Engine:
    engine = create_engine("sqlite://", creator=connect, poolclass=pool)

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get(*WRITING)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _file_system(file: Path) -> str:
    """The kind of the file system that a file is on; empty where the system does not tell."""
    try:
        lines = MOUNTS.read_text("utf-8", "replace").splitlines()
    except OSError:
        return ""
    mounts = (line.split()[1:3] for line in lines if len(line.split()) > 2)
    kinds = {place.replace(r"\040", " "): kind for place, kind in mounts}
    return next((kinds[each] for each in map(str, file.parents) if each in kinds), "")


def _connected(path: Path, name: Path) -> sqlite3.Connection:
    """Refuse another program's file as it is; else make every commit durable."""
    connection = sqlite3.connect(path, WAIT, isolation_level=None, check_same_thread=False)
    try:
        _refuse_others(connection, name)
        journal = _journal(connection)
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        (synchronous,) = connection.execute("PRAGMA synchronous").fetchone()
        if (journal, synchronous) != ("wal", 2):
            raise GoalscopeError(
                f"The episode store {name} would not survive a crash (journal {journal}, "
                f"synchronous {synchronous}). Name a file on a local disk with --store."
            )
    except BaseException:
        connection.close()
        raise
    return connection


def _journal(connection: sqlite3.Connection) -> str:
    """Set it; SQLite itself waits for no other process that does so at the same time."""
    end = time.monotonic() + WAIT
    while True:
        try:
            return connection.execute("PRAGMA journal_mode = WAL").fetchone()[0]
        except sqlite3.OperationalError as error:
            if not error.sqlite_errorname.startswith("SQLITE_BUSY") or time.monotonic() > end:
                raise
        time.sleep(0.01)


def _refuse_others(connection: sqlite3.Connection, name: Path) -> None:
    """Refuse another program's file."""
    connection.execute("BEGIN")  # a snapshot
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    connection.execute("COMMIT")
    if tables and application != APPLICATION:
        raise InvalidInputError(f"{name} is another program's file. Name another one.")


def _address(text: str) -> URL:
    """The address of a PostgreSQL database; messages must not show it as it is."""
    try:
        url = make_url(text)
    except (ArgumentError, ValueError):
        raise InvalidInputError(
            "The address of the episode store cannot be read. It should look like "
            "postgresql://USER:PASSWORD@HOST:PORT/DATABASE."
        ) from None
    if url.drivername not in ("postgresql", "postgres"):
        raise InvalidInputError(
            f"Episodes are kept in a file, or in postgresql://..., not in {url.drivername}://..."
        )
    if "@" in (url.host or ""):
        raise InvalidInputError(
            "In the address of the episode store, an @ in the user's name or password must be "
            "written as %40."
        )
    query = {"connect_timeout": str(WAIT), "client_encoding": "utf8", **url.query}
    return url.set(drivername="postgresql+psycopg", query=query)


def _server(url: URL) -> Engine:
    package("psycopg", "An episode store on PostgreSQL needs", GoalscopeError)
    engine = create_engine(url, pool_pre_ping=True)

    @event.listens_for(engine, "connect")
    def connected(connection: sqlite3.Connection, _: object) -> None:
        connection.execute("SET synchronous_commit = on")
        connection.execute(f"SET lock_timeout = '{WAIT}s'")
        connection.commit()

    return engine


def _prepare(engine: Engine, name: str) -> None:
    """Bring the tables up to date."""
    with engine.connect() as connection:
        if _revision(connection, name) == REVISION:
            return
    with engine.execution_options(**WRITING).begin() as connection:
        if connection.dialect.name == "postgresql":  # BEGIN IMMEDIATE has SQLite's processes wait
            connection.execute(select(func.pg_advisory_xact_lock(APPLICATION)))
            _refuse_other_tables(connection, name)
        if _revision(connection, name) != REVISION:
            _migrate(connection)


def _revision(connection: Connection, name: str) -> str:
    """The revision of the tables; empty before the first."""
    if not inspect(connection).has_table(VERSION_TABLE):
        return ""
    version = table_named(VERSION_TABLE, column_named("version_num"))
    revision: str = connection.scalar(select(version.c.version_num)) or ""
    if revision > REVISION:
        raise GoalscopeError(
            f"A newer goalscope made the episode store {name}. Update goalscope, or name another "
            "store with --store."
        )
    return revision


def _refuse_other_tables(connection: Connection, name: str) -> None:
    there = {*inspect(connection).get_table_names()}
    theirs = {*METADATA.tables} & there
    if theirs and VERSION_TABLE not in there:
        raise GoalscopeError(
            f"The database {name} has other tables named {', '.join(sorted(theirs))}. "
            "Name another one with --store."
        )


def _migrate(connection: Connection) -> None:
    from alembic import command  # takes longer to import than all the rest
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", "goalscope.database:migrations")
    config.attributes["connection"] = connection
    if connection.dialect.name == "sqlite":
        connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION}")
    command.upgrade(config, "head")
