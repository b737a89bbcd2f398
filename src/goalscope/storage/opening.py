"""Open durable databases with this version's tables; refuse those of other programs."""

from __future__ import annotations

import logging
import os
import sqlite3
import time
from collections.abc import Callable, Generator
from contextlib import closing, contextmanager
from pathlib import Path

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
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, SQLAlchemyError

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.base.user_dirs import NOWHERE, user_data
from goalscope.storage.tables import METADATA, SCHEMA, SCHEMA_VERSION

APPLICATION = 0x474F4144  # "GOAD": marks a file as an episode store
WAIT = 10
"""Seconds to wait for a locked database."""
MOUNTS = Path("/proc/self/mounts")
"""Where Linux lists its mounted file systems."""
NETWORK = (
    "nfs", "nfs4", "cifs", "smb3", "9p", "fuse.sshfs", "fuse.glusterfs", "ceph", "lustre", "beegfs",
    "afs",
)  # fmt: skip
WRITING = {"goalscope_writing": True}
"""Execution options of connections that write."""

ADVICE = {
    # SQLite, by the name of the error
    "SQLITE_FULL": "The disk is full: free some space.",
    "SQLITE_IOERR": "The disk is full or broken: free some space, or name a file on another disk.",
    "SQLITE_BUSY": "Another program is writing to it: close that one and try again.",
    "SQLITE_LOCKED": "Another program is writing to it: close that one and try again.",
    "SQLITE_READONLY": "It is not writable: name another file.",
    "SQLITE_CANTOPEN": "It cannot be opened: name another file.",
    "SQLITE_CORRUPT": "It is damaged: move it away, and a new one is created.",
    # PostgreSQL, by SQLSTATE or its class; errors while connecting have none
    "": "Check that the server is running, that the database exists (`createdb NAME`), and the "
    "user and the password in the address.",
    "25006": "It is not writable: name another database with --store.",
    "42501": "The user lacks a permission: ask for it, or name another user in the address.",
    "53": "The server's disk, memory or connections are used up: free some and try again.",
    "55P03": "Another program is writing to it: close that one and try again.",
    "57": "The server is starting, stopping or busy: try again.",
}

log = logging.getLogger(__name__)


def default_place() -> str:
    """$GOALSCOPE_STORE, or `episodes.db` in the user's data folder."""
    given = os.environ.get("GOALSCOPE_STORE")
    return given or str(user_data() / "episodes.db")


def pasted(place: str | Path) -> str:
    """A database as a command line names it in any folder; PASSWORD stands for a password."""
    if "://" not in str(place):
        return str(Path(place).expanduser().absolute())
    url = make_url(str(place)).difference_update_query(["password"])
    return url.render_as_string().replace(":***@", ":PASSWORD@", 1)


def opened(place: str | Path) -> tuple[str, Engine]:
    """Open a database; returns its name in messages, without password, and its engine.

    Args:
        place: A file, or the address of a PostgreSQL database.

    Raises:
        GoalscopeError: It cannot be used, or another version of goalscope made it.
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
        file = file.expanduser()
        file.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError) as error:
        if isinstance(error, RuntimeError) or file.is_relative_to(NOWHERE):
            raise GoalscopeError(
                "There is no home folder to keep the episodes in: HOME is not set. Set it, or name "
                "a file with --store."
            ) from None
        raise GoalscopeError(
            f"Cannot create the folder of the episode store {file}: {error.strerror}. Name "
            "another file with --store."
        ) from error
    path = file.absolute()
    try:  # a new file is readable by its owner only: it holds what people said
        os.close(os.open(path, os.O_CREAT | os.O_EXCL, 0o600))
    except FileExistsError:
        if path.is_dir():
            raise GoalscopeError(
                f"The episode store {file} is a folder: name another file with --store."
            ) from None
    except OSError as error:
        raise GoalscopeError(
            f"Cannot create the episode store {file}: {error.strerror}. Name another file with "
            "--store."
        ) from error
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
    """The kind of a file's file system; empty if unknown."""
    try:
        lines = MOUNTS.read_text("utf-8", "replace").splitlines()
    except OSError:
        return ""
    mounts = (line.split()[1:3] for line in lines if len(line.split()) > 2)
    kinds = {place.replace(r"\040", " "): kind for place, kind in mounts}
    return next((kinds[each] for each in map(str, file.parents) if each in kinds), "")


def _connected(path: Path, name: Path) -> sqlite3.Connection:
    """Connect, so that every commit is durable; another program's file is left untouched."""
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
    """Switch to the write-ahead log; SQLite does not itself wait for others that do so, too."""
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
        raise InvalidInputError(f"{name} belongs to another program. Name another file.")


def _address(text: str) -> URL:
    """The address of a PostgreSQL database; no message may contain its password."""
    try:
        url = make_url(text)
    except (ArgumentError, ValueError):
        raise InvalidInputError(
            "The address of the episode store is invalid. Expected "
            "postgresql://USER:PASSWORD@HOST:PORT/DATABASE."
        ) from None
    if url.drivername not in ("postgresql", "postgres"):
        raise InvalidInputError(
            "An episode store must be a file or a postgresql:// address, not "
            f"{url.drivername}://..."
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
    """Create the tables of a new database, and refuse one with those of another version."""
    with engine.connect() as connection:
        if _has_tables(connection, name):
            return
    with engine.execution_options(**WRITING).begin() as connection:
        if connection.dialect.name == "postgresql":  # BEGIN IMMEDIATE has SQLite's processes wait
            connection.execute(select(func.pg_advisory_xact_lock(APPLICATION)))
        if _has_tables(connection, name):
            return
        if others := {*METADATA.tables} & {*inspect(connection).get_table_names()}:
            raise GoalscopeError(
                f"The database {name} already has other tables named "
                f"{', '.join(sorted(others))}. Name another one with --store."
            )
        if connection.dialect.name == "sqlite":
            connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION}")
        METADATA.create_all(connection, checkfirst=False)
        connection.execute(SCHEMA.insert().values(version_num=SCHEMA_VERSION))


def _has_tables(connection: Connection, name: str) -> bool:
    # By a query: in an older SQLite, PRAGMA table_info misses what another connection made.
    if SCHEMA.name not in inspect(connection).get_table_names():
        return False
    version = connection.scalar(select(SCHEMA.c.version_num))
    if version != SCHEMA_VERSION:
        raise GoalscopeError(
            f"The episode store {name} has tables of version {version} instead of "
            f"{SCHEMA_VERSION}: open it with the version of goalscope that made it, or name "
            "another store with --store."
        )
    return True


@contextmanager
def explained(place: str | Path) -> Generator[None]:
    """Turn a database's errors into one line that says what to do.

    Args:
        place: The file, or the address without its password.

    Raises:
        GoalscopeError: In place of such an error.
        InvalidInputError: The file is not a SQLite file.
    """
    try:
        yield
    except (sqlite3.Error, SQLAlchemyError) as error:
        cause = error.orig or error if isinstance(error, DBAPIError) else error
        if getattr(cause, "sqlite_errorname", "") == "SQLITE_NOTADB":
            raise InvalidInputError(f"{place} is not a SQLite file. Name another one.") from error
        said = " ".join(str(cause).split())
        raise GoalscopeError(
            f"Cannot use the database {place}: {said.rstrip('.')}. {_advice(cause)}"
        ) from error


def _advice(cause: BaseException) -> str:
    if isinstance(cause, sqlite3.Error):
        name = getattr(cause, "sqlite_errorname", "")  # such as SQLITE_READONLY_DIRECTORY
        return ADVICE.get("_".join(name.split("_")[:2]), "Name another file.")
    state = getattr(cause, "sqlstate", None) or ""
    return ADVICE.get(state) or ADVICE.get(state[:2], "Name another store with --store.")
