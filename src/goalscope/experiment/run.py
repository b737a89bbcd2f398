"""Run the missing cells of an experiment, here or on a cluster, and store each result."""

from __future__ import annotations

import json
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError
from goalscope.envs.registry import OWN
from goalscope.experiment.measure import identity_of, measure, perform
from goalscope.experiment.plan import Experiment, judging
from goalscope.experiment.results import Cell, Results, cell_key
from goalscope.storage.store import dumps

_FAILURES = 5
"""Number of failures in a row after which the run stops."""


@dataclass(frozen=True, slots=True)
class Done:
    """The progress of an experiment after one more cell.

    Attributes:
        cell: The cell that was run; None before the first.
        error: Why it failed; None if it did not.
        done: Number of cells with results.
        total: Number of all cells, with the evaluator's to come.
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
    on: str | None = None,
    workers: int = 2,
    anyway: bool = False,
    command: str = "",
) -> Iterator[Done]:
    """Run the cells without a result, and store each result as it comes.

    The next call tries failed cells again; five failures in a row end this one.

    Args:
        experiment: What to measure.
        specs: The specs of its cells, from `specs_of`; the evaluator's are added later.
        results: Where results are stored.
        on: None for this process, "dask" for worker processes of this machine, or the address of a
            Dask scheduler, such as "tcp://host:8786".
        workers: Number of processes for "dask".
        anyway: Continue even if code, prompts or a model have changed since the first results.
        command: The command line, stored with the results.

    Yields:
        The progress, once before any cell and then after each.

    Raises:
        InvalidInputError: Code, prompts or a model have changed since the first results.
        GoalscopeError: Too many cells failed in a row, or a package is missing.
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
        with closing(_measured(results, missing, on, workers)) as measured:
            for cell, error in measured:
                done += error is None
                failures = failures + 1 if error and error != cell.error else 0
                yield Done(cell, error, done, total)
                if failures == _FAILURES:
                    raise GoalscopeError(
                        f"{_FAILURES} cells failed in a row. The last error: {error} Results "
                        "so far are saved; run the same command again to continue."
                    )


def _measured(
    results: Results, cells: Sequence[Cell], on: str | None, workers: int
) -> Generator[tuple[Cell, str | None]]:
    """Run cells, and store their results or errors."""
    if on is None:
        for cell in cells:
            try:
                outcome: Any = measure(cell.spec)
            except Exception as error:  # whatever it is, the other cells go on
                outcome = error
            yield cell, _kept(results, cell, outcome)
        return
    from goalscope.experiment.cluster import on_cluster

    by_key = {cell.key: cell for cell in cells}
    tasks = [
        (cell.key, {"spec": cell.spec, "identity": identity_of(cell.spec["model"])})
        for cell in cells
    ]
    address = None if on == "dask" else on
    with closing(on_cluster(tasks, perform, address=address, workers=workers)) as outcomes:
        for key, outcome, attempts in outcomes:
            yield by_key[key], _kept(results, by_key[key], outcome, attempts)


def _kept(results: Results, cell: Cell, outcome: Any, attempts: int = 1) -> str | None:
    """Store a result, or the error in its place, and return the error."""
    if not isinstance(outcome, Exception):
        try:
            dumps(outcome)
        except GoalscopeError as unfit:
            outcome = unfit
        else:
            results.keep(cell.key, outcome, identity_of(cell.spec["model"]), attempts)
            return None
    error = str(outcome)
    if not isinstance(outcome, GoalscopeError):
        error = OWN.failure_in(outcome) or f"{type(outcome).__name__}: {error}"
    results.fail(cell.key, error, attempts)
    return error
