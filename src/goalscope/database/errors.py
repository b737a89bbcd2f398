"""What a database's errors mean to a person."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["explained"]

SERVER = "Is the server running, and is the address right? It was given with --store."
ADVICE = {
    # SQLite, by the name of the error
    "SQLITE_FULL": "The disk is full: free some space.",
    "SQLITE_IOERR": "The disk is full or broken: free some space, or name another one's file.",
    "SQLITE_BUSY": "Another program is writing to it: close that one and try again.",
    "SQLITE_LOCKED": "Another program is writing to it: close that one and try again.",
    "SQLITE_READONLY": "It may not be written: name another file.",
    "SQLITE_CANTOPEN": "It may not be opened: name another file.",
    "SQLITE_CORRUPT": "It is damaged: move it away, and a new one is begun.",
    # PostgreSQL, by SQLSTATE or its class
    "08": SERVER,
    "22": "The database's encoding should be UTF8.",
    "25006": "It may not be written: name another database with --store.",
    "28": "Check the user and the password in the address.",
    "3D000": "Make the database first: `createdb NAME`.",
    "42501": "Its user lacks the right to: have it granted, or name another user in the address.",
    "53100": "The server's disk is full: free some space.",
    "53300": "The server has too many connections: close some and try again.",
    "55P03": "Another program is writing to it: close that one and try again.",
    "57": "The server is starting, stopping or busy: try again.",
}
STATES = {
    "password": "28",
    "authentication": "28",
    r'role ".*" does not exist': "28",
    "pg_hba.conf": "28",
    r'database ".*" does not exist': "3D000",
    "too many clients|remaining connection slots": "53300",
    "starting up|shutting down|recovery": "57",
}
"""States of errors that come before there is a connection, and so bear none."""


@contextmanager
def explained(place: str | Path) -> Generator[None]:
    """Turn a database's errors into one line that says what to do.

    Args:
        place: The file, or the address without its password.

    Raises:
        GoalscopeError: In the place of such an error.
        InvalidInputError: The file is none of a database.
    """
    try:
        yield
    except (sqlite3.Error, SQLAlchemyError) as error:
        cause = error.orig or error if isinstance(error, DBAPIError) else error
        if getattr(cause, "sqlite_errorname", "") == "SQLITE_NOTADB":
            raise InvalidInputError(
                f"{place} is no database of goalscope: it is no SQLite file. Name another one."
            ) from error
        said = " ".join(str(cause).split())
        raise GoalscopeError(
            f"The database {place} cannot be used: {said.rstrip('.')}. {_advice(cause, said)} "
            "What was stored earlier is kept."
        ) from error


def _advice(cause: BaseException, said: str) -> str:
    if isinstance(cause, sqlite3.Error):
        name = getattr(cause, "sqlite_errorname", "")  # such as SQLITE_READONLY_DIRECTORY
        return ADVICE.get("_".join(name.split("_")[:2]), "Name another file.")
    state = getattr(cause, "sqlstate", None) or next(
        (state for words, state in STATES.items() if re.search(words, said)), "08"
    )
    return ADVICE.get(state) or ADVICE.get(state[:2], "Name another store with --store.")
