"""One model and many people: what they want of it is done one thing at a time, in turn."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import RLock
from typing import Any, TypeVar

__all__ = ["ModelQueue"]

T = TypeVar("T")
Moved = Callable[[int], None]

log = logging.getLogger(__name__)


class ModelQueue:
    """A queue before one worker: first come, first served."""

    def __init__(self) -> None:
        self._worker = ThreadPoolExecutor(1, "model")
        self._line: dict[Future[Any], Moved] = {}
        self._lock = RLock()

    def submit(self, work: Callable[[], T], moved: Moved = lambda place: None) -> Future[T]:
        """Have something done when it is its turn.

        Args:
            work: What is done, in the worker's thread.
            moved: Is told how many pieces of work are before it, whenever that changes; 0 when it
                begins. It must return at once.

        Raises:
            RuntimeError: The desk is closed.
        """
        with self._lock:
            future = self._worker.submit(work)
            self._line[future] = moved
            _tell(moved, len(self._line) - 1)
        future.add_done_callback(self._left)
        return future

    def close(self) -> None:
        """Finish what is being done, and cancel what waits."""
        with self._lock:
            self._worker.shutdown(wait=False, cancel_futures=True)
        self._worker.shutdown()

    def _left(self, future: Future[Any]) -> None:
        with self._lock:
            place = [*self._line].index(future)
            del self._line[future]
            for number, moved in enumerate([*self._line.values()][place:], place):
                _tell(moved, number)


def _tell(moved: Moved, place: int) -> None:
    try:
        moved(place)
    except Exception:
        log.exception("somebody could not be told their place")
