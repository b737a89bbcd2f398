"""Keeps two processes from writing to one file."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from goalscope.base.types import InvalidInputError

__all__ = ["sole"]


@contextmanager
def sole(file: Path) -> Generator[None]:
    """Lock a file of results or beliefs against other writers.

    Raises:
        InvalidInputError: Another process holds the lock.
    """
    lock = FileLock(f"{os.path.realpath(file)}.lock")  # by whatever name each process calls it
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InvalidInputError(
            f"Another process is writing to {file}. Wait for it to finish, or stop it."
        ) from None
    except OSError as error:
        raise InvalidInputError(
            f"Cannot write {file}: {error.strerror or error}. Name another place."
        ) from None
    try:
        yield
    finally:
        lock.release()
