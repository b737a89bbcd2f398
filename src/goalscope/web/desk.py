"""One model and many people: what they want of it is done one thing at a time, in turn."""

from __future__ import annotations

import logging
from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from threading import Condition, Thread
from typing import Any

from goalscope.web.limits import WAITING, too_much

__all__ = ["Desk"]

log = logging.getLogger(__name__)

Moved = Callable[[int], None]


@dataclass(eq=False, slots=True)
class _Job:
    work: Callable[[], Any]
    moved: Moved
    future: Future[Any]
    place: int = 0


class Desk:
    """A fair queue before one worker: each person has a line of their own, served in rotation.

    Whoever asks for much waits for themselves, not the others for them.
    """

    def __init__(self) -> None:
        self._lines: OrderedDict[str, deque[_Job]] = OrderedDict()
        self._busy = False
        self._open = True
        self._changed = Condition()
        self._worker = Thread(target=self._serve, name="model", daemon=True)
        self._worker.start()

    def admit(self, who: str) -> None:
        """Raise the HTTPException 429 where as much of theirs waits as may."""
        with self._changed:
            if len(self._lines.get(who, ())) >= WAITING:
                raise too_much("Too much of yours waits for the model.", 5)

    def submit(self, who: str, work: Callable[[], Any], moved: Moved) -> Future[Any]:
        """Have something done when it is `who`'s turn.

        Args:
            who: Whose line it joins.
            work: What is done, in the worker's thread.
            moved: Is told how many pieces of work are before it, whenever that changes; 0 when it
                begins. It must return at once.

        Raises:
            RuntimeError: The desk is closed.
        """
        job = _Job(work, moved, Future())
        with self._changed:
            if not self._open:
                raise RuntimeError("the desk is closed")
            self._lines.setdefault(who, deque()).append(job)
            self._tell_all()
            self._changed.notify()
        return job.future

    def close(self) -> None:
        """Finish what is being done, and cancel what waits."""
        with self._changed:
            self._open = False
            waiting = [job for line in self._lines.values() for job in line]
            self._lines.clear()
            self._changed.notify()
        for job in waiting:
            job.future.cancel()
        self._worker.join()

    def _serve(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                while self._open and not self._lines:
                    self._changed.wait()
                if not self._open:
                    return
                who, line = self._lines.popitem(last=False)
                job = line.popleft()
                if line:
                    self._lines[who] = line
                self._busy = True
                self._tell_all()
            if job.future.set_running_or_notify_cancel():
                _tell(job, 0)
                try:
                    job.future.set_result(job.work())
                except BaseException as error:
                    job.future.set_exception(error)

    def _tell_all(self) -> None:
        """Tell everybody who waits how many are before them, where that has changed."""
        place = int(self._busy)
        depth = max(map(len, self._lines.values()), default=0)
        for row in range(depth):
            for line in self._lines.values():
                if row < len(line):
                    if place not in (0, line[row].place):
                        _tell(line[row], place)
                    place += 1


def _tell(job: _Job, place: int) -> None:
    job.place = place
    try:
        job.moved(place)
    except Exception:
        log.exception("somebody could not be told their place")
