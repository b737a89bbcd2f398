"""Distribute cells over worker processes with Dask, on this machine or an existing cluster."""

from __future__ import annotations

import asyncio
import importlib
import logging
import os
import pickle
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from queue import Empty, SimpleQueue
from typing import Any

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError, InvalidInputError

Perform = Callable[[Mapping[str, Any]], dict[str, Any]]

_GLANCE = 0.5  # seconds between two looks at which workers live
_PATIENCE = 60.0  # seconds without any worker
_one_cell = threading.Lock()  # a model serves one thread; an existing worker may have several


def on_cluster(
    cells: Sequence[tuple[str, Mapping[str, Any]]],
    perform: Perform,
    *,
    address: str | None = None,
    workers: int = 2,
) -> Generator[tuple[str, dict[str, Any] | Exception, int]]:
    """Yield each cell's key, its result or error, and its number of attempts, as cells finish.

    A worker is a process that runs one cell at a time. When one dies, another repeats its cell, up
    to three times in all; an error raised by `perform` is the outcome of the cell. Closing the
    generator stops the running cells.

    Args:
        cells: Unique keys, and what each cell asks for.
        perform: A function that workers can import by name.
        address: Scheduler of an existing Dask cluster, such as "tcp://host:8786", which keeps
            running. None for processes of this machine, which nobody else can reach.
        workers: Number of processes; ignored for the cluster at `address`.

    Raises:
        InvalidInputError: Nothing answers at `address`.
        GoalscopeError: Dask is missing, or the cluster is lost or has no worker for a minute.
    """
    for module in ("distributed", "cryptography"):
        package(module, "A cluster needs", GoalscopeError)
    waiting, flying = deque(cells), dict[str, str]()
    landed: SimpleQueue[Any] = SimpleQueue()
    with _connected(address, workers) as client:
        last_alive = time.monotonic()
        while waiting or flying:
            if alive := len(client.nthreads()):
                last_alive = time.monotonic()
            elif time.monotonic() - last_alive > _PATIENCE:
                raise GoalscopeError(
                    f"The cluster has had no worker for {_PATIENCE:.0f} seconds. Check why "
                    "they end, or start new ones, and run this again."
                )
            while waiting and len(flying) < alive:  # no cell waits at a worker that may die
                key, spec = waiting.popleft()
                future = client.submit(
                    _perform_alone,
                    perform,
                    pickle.dumps(dict(spec)),  # Dask looks for tasks inside of a dict
                    key=f"goalscope-{uuid.uuid4().hex}",
                    pure=False,
                )
                flying[future.key] = key
                future.add_done_callback(landed.put)
            try:
                future = landed.get(timeout=_GLANCE)
            except Empty:
                continue
            yield flying.pop(future.key), *_outcome(client, future)
            future.release()


def _perform_alone(perform: Perform, spec: bytes) -> bytes:
    with _one_cell:
        return pickle.dumps(perform(pickle.loads(spec)))


def _outcome(client: Any, future: Any) -> tuple[dict[str, Any] | Exception, int]:
    """The result of a cell or its error, and the number of attempts."""
    key, error = future.key, future.exception()
    if (allowed := getattr(error, "allowed_failures", None)) is not None:  # a KilledWorker
        cause = f"All {allowed + 1} workers that ran this cell died. Is there enough memory?"
        return GoalscopeError(cause), allowed + 1

    def deaths(dask_scheduler: Any) -> int:  # nested, so the scheduler need not have goalscope
        return dask_scheduler.tasks[key].suspicious

    outcome = pickle.loads(future.result()) if error is None else error
    return outcome, client.run_on_scheduler(deaths) + 1


@contextmanager
def _connected(address: str | None, workers: int) -> Generator[Any]:
    distributed: Any = importlib.import_module("distributed")
    with ExitStack() as stack:
        stack.enter_context(distributed.utils.silence_logging_cmgr(logging.CRITICAL))
        try:
            if address is not None:  # a client that cannot read it would linger
                distributed.comm.get_address_host_port(address)
            where = address or stack.enter_context(_local_cluster(distributed, workers))
            client = distributed.Client(where, set_as_default=False, timeout=10)
        except (OSError, ValueError) as error:
            raise InvalidInputError(
                f'No Dask scheduler answers at "{address}" ({error}). Use the address that '
                "`dask scheduler` printed."
            ) from error
        try:
            yield stack.enter_context(client)
        except (OSError, asyncio.CancelledError, distributed.client.FutureCancelledError) as error:
            raise GoalscopeError(
                f"Lost the cluster's scheduler ({error}). Start it and run this again."
            ) from error


@contextmanager
def _local_cluster(distributed: Any, workers: int) -> Generator[Any]:
    """Processes on the loopback interface, with keys that only this process has."""
    threads = str(max(1, (os.cpu_count() or 1) // workers))
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    no_pages: dict[str, list[str]] = {  # that tell about the cluster to whoever asks
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
    }
    with importlib.import_module("dask.config").set(no_pages):
        try:
            cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                security=distributed.Security.temporary(),
                dashboard_address=None,
                scheduler_kwargs={
                    "allowed_failures": 2,
                    "dashboard": False,
                    "dashboard_address": "127.0.0.1:0",
                },
                memory_limit=0,  # else a worker with a large model is paused or ended
                env={name: os.environ.get(name, threads) for name in names},
                silence_logs=logging.CRITICAL,
            )
        except (OSError, RuntimeError) as error:
            raise GoalscopeError(
                f"The worker processes did not start: {error} A script must run its work "
                'under `if __name__ == "__main__":`.'
            ) from error
        try:
            yield cluster
        finally:
            cluster.sync(_end_workers, list(cluster.workers.values()))
            cluster.close()


async def _end_workers(nannies: list[Any]) -> None:
    """End processes in the middle of a cell; Dask alone would wait for them."""
    ends = (nanny.close(timeout=0.5, reason="no more cells") for nanny in nannies)
    await asyncio.gather(*ends, return_exceptions=True)
