"""The queue of the model, which serves one person at a time."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import RLock
from typing import Any, TypeVar

__all__ = ["ModelQueue"]

T = TypeVar("T")
OnMove = Callable[[int], None]

log = logging.getLogger(__name__)


class ModelQueue:
    """A queue with one worker thread: first come, first served."""

    def __init__(self) -> None:
        self._worker = ThreadPoolExecutor(1, "model")
        self._waiting: dict[Future[Any], OnMove] = {}
        self._lock = RLock()

    def submit(self, work: Callable[[], T], on_move: OnMove = lambda place: None) -> Future[T]:
        """Run work in the worker thread when its turn comes.

        Args:
            work: What to run.
            on_move: Called with the number of tasks ahead whenever it changes, and with 0 at the
                start. It must return at once.

        Raises:
            RuntimeError: The queue is closed.
        """
        with self._lock:
            future = self._worker.submit(work)
            self._waiting[future] = on_move
            _notify(on_move, len(self._waiting) - 1)
        future.add_done_callback(self._remove)
        return future

    def close(self) -> None:
        """Finish the running task, and cancel those that wait."""
        with self._lock:
            self._worker.shutdown(wait=False, cancel_futures=True)
        self._worker.shutdown()

    def _remove(self, future: Future[Any]) -> None:
        with self._lock:
            place = [*self._waiting].index(future)
            del self._waiting[future]
            for number, on_move in enumerate([*self._waiting.values()][place:], place):
                _notify(on_move, number)


def _notify(on_move: OnMove, place: int) -> None:
    try:
        on_move(place)
    except Exception:
        log.exception("a place in the queue could not be announced")
