"""Run the missing cells of an experiment, in one or more processes, and store each result."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError
from goalscope.envs.registry import OWN
from goalscope.experiment.measure import identity_of, measure, perform
from goalscope.experiment.plan import Experiment, judging
from goalscope.experiment.results import Cell, Results, cell_key
from goalscope.models.trace import tracing
from goalscope.storage.store import dumps

_FAILURES = 5
"""Number of failures in a row after which the run stops."""


@dataclass(frozen=True, slots=True)
class Done:
    """The progress of an experiment after one more cell; `cell` is None before the first.

    `error` says why the cell failed. `total` counts the evaluator's cells to come, too.
    """

    cell: Cell | None
    error: str | None
    done: int
    total: int


def check_packages() -> None:
    """Check that all packages that experiments need are installed.

    Raises:
        GoalscopeError: A package is missing; the message says what to install.
    """
    for module in ("bm25s", "scipy.stats", "sklearn.feature_extraction.text"):
        package(module, "Experiments need", GoalscopeError)


def run(
    experiment: Experiment,
    specs: Sequence[Mapping[str, Any]],
    results: Results,
    *,
    workers: int = 1,
    anyway: bool = False,
    command: str = "",
    trace: Path | None = None,
) -> Iterator[Done]:
    """Run the cells without a result, and store each result as it comes.

    The next call tries failed cells again; five failures in a row end this one.

    Args:
        experiment: What to measure.
        specs: The specs of its cells, from `specs_of`; the evaluator's are added later.
        results: Where results are stored.
        workers: Number of processes; 1 is this one.
        anyway: Continue even if code, prompts or a model have changed since the first results.
        command: The command line, stored with the results.
        trace: File to which each call of a model is added; see `goalscope.models.trace`.

    Yields:
        The progress, once before any cell and then after each.

    Raises:
        InvalidInputError: Code, prompts or a model have changed since the first results.
        GoalscopeError: Too many cells failed in a row, a worker process died, or a package is
            missing.
    """
    check_packages()
    for evaluating in (False, True):
        judged = judging(experiment, results.planned(specs))
        models = {
            json.dumps(spec["model"]): spec["model"] for spec in (judged if evaluating else specs)
        }
        for model in models.values():
            identity = identity_of(model)
            if not anyway:
                results.check(identity)
        wanted = {cell_key(spec): spec for spec in (*specs, *judged)}
        planned = results.plan(wanted.values())
        results.ask_for(planned, command)
        done = sum(cell.result is not None for cell in planned)
        unfinished = sum(c.spec["kind"] == "episode" and c.result is None for c in planned)
        to_come = unfinished if experiment.judge and not evaluating else 0
        total = len(planned) + to_come
        if not evaluating:
            yield Done(None, None, done, total)
        missing = [
            replace(cell, spec=wanted[cell.key])  # never what else a file says
            for cell in planned
            if cell.result is None and (cell.spec["kind"] == "judge") == evaluating
        ]
        missing.sort(key=lambda cell: cell.error is not None)  # what failed before comes last
        failures = 0
        with closing(_outcomes(missing, workers, trace)) as outcomes:
            for cell, outcome in outcomes:
                error = _keep(results, cell, outcome)
                done += error is None
                failures = failures + 1 if error and error != cell.error else 0
                yield Done(cell, error, done, total)
                if failures == _FAILURES:
                    raise GoalscopeError(
                        f"{_FAILURES} cells failed in a row. The last error: {error} Results "
                        "so far are saved; run the same command again to continue."
                    )


Outcome = dict[str, Any] | GoalscopeError


def _outcomes(
    cells: Sequence[Cell], workers: int, trace: Path | None
) -> Generator[tuple[Cell, Outcome]]:
    """The result or error of each cell, as they finish."""
    if workers == 1:
        with tracing(trace):
            yield from ((cell, _attempt(measure, cell.spec)) for cell in cells)
        return
    threads = max(1, (os.cpu_count() or 1) // workers)
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _begin, (threads, trace))
    futures = {
        pool.submit(
            _attempt, perform, {"spec": cell.spec, "identity": identity_of(cell.spec["model"])}
        ): cell
        for cell in cells
    }
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool:
        raise GoalscopeError(
            "A worker process died. Is there enough memory for --workers models? Results so "
            "far are saved; run the same command again to continue."
        ) from None
    finally:
        pool.shutdown(cancel_futures=True)


_UNTIL_THE_END = ExitStack()


def _begin(threads: int, trace: Path | None) -> None:
    """Set up a process of its own, which ends when the run does, however that ends."""
    os.environ.setdefault("OMP_NUM_THREADS", str(threads))
    Thread(target=_end_with_parent, daemon=True).start()
    _UNTIL_THE_END.enter_context(tracing(trace))


def _end_with_parent() -> None:
    if parent := parent_process():
        parent.join()
        os._exit(1)


def _attempt(work: Callable[[Any], dict[str, Any]], task: object) -> Outcome:
    """The result of the work; whatever its error is, the other cells go on."""
    try:
        return work(task)
    except GoalscopeError as error:
        return GoalscopeError(str(error))
    except Exception as error:
        return GoalscopeError(OWN.failure_in(error) or f"{type(error).__name__}: {error}")


def _keep(results: Results, cell: Cell, outcome: Outcome) -> str | None:
    """Store a result, or the error in its place, and return the error."""
    try:
        if isinstance(outcome, GoalscopeError):
            raise outcome
        dumps(outcome)
    except GoalscopeError as error:
        results.fail(cell.key, str(error))
        return str(error)
    results.keep(cell.key, outcome, identity_of(cell.spec["model"]))
    return None
