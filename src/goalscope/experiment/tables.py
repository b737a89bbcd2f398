"""All tables of an experiment, from its results so far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from goalscope.experiment.changes import change_table, read_changes
from goalscope.experiment.dialogues import dialogue_table, model_tables, read_dialogues
from goalscope.experiment.episodes import episode_tables, read_episodes
from goalscope.experiment.questions import question_tables
from goalscope.experiment.results import Cell
from goalscope.experiment.summary import Table, few_notes

__all__ = ["first_attempts", "tables_of", "warnings_of"]


def tables_of(cells: Sequence[Cell]) -> list[Table]:
    """The tables of the cells with results."""
    done = [cell for cell in cells if cell.result is not None]
    measured = [(cell.spec, cell.result or {}) for cell in done]
    dialogues = read_dialogues(measured)
    tables = [
        *question_tables(measured),
        *model_tables(dialogues),
        *map(dialogue_table, dialogues),
        *map(change_table, read_changes(measured)),
        *(table for sample in read_episodes(done) for table in episode_tables(sample)),
    ]
    notes = tuple(warnings_of(cells))
    return [
        replace(table, notes=(*notes, *few_notes(table), *table.notes))
        for table in tables
        if table.rows
    ]


def first_attempts(cells: Sequence[Cell]) -> list[Table]:
    """The tables without cells that took more than one attempt; none if there are no such cells.

    The cause of a first failure may be related to what the cell measures.
    """
    retried = {cell.key for cell in cells if cell.attempts > 1}
    kept = [
        cell for cell in cells if retried.isdisjoint({cell.key, cell.spec.get("of", {}).get("key")})
    ]
    left_out = len(cells) - len(kept)
    note = f"Without {left_out:,} of {len(cells):,} cells: they, or the runs that they judge, took "
    return [
        replace(
            table,
            name=f"{table.name}-first-attempts",
            title=f"{table.title}, first attempts alone",
            notes=(f"{note}more than one attempt.", *table.notes),
        )
        for table in (tables_of(kept) if left_out else [])
    ]


def warnings_of(cells: Sequence[Cell]) -> Iterator[str]:
    """Warnings about figures computed from these cells, one sentence each."""
    done = [cell for cell in cells if cell.result is not None]
    known: dict[str, set[str]] = {}
    for cell in done:
        for name, value in (cell.identity or {}).items():
            known.setdefault(name, set()).add(value)
    mixed = sorted(name for name, values in known.items() if len(values) > 1)
    if mixed:
        yield f"These figures mix cells measured with different {', '.join(mixed)}."
    failed = [cell for cell in cells if cell.result is None and cell.error]
    missing = len(cells) - len(done) - len(failed)
    if missing:
        yield f"{missing:,} of {len(cells):,} cells are not measured yet, so figures will change."
    if failed:
        yield f"{len(failed):,} of {len(cells):,} cells failed and are not included."
