"""All tables of an experiment, from what it has measured so far."""

from __future__ import annotations

from goalscope.experiment.results import Results
from goalscope.experiment.summary import Table
from goalscope.experiment.summary_dialogues import read_dialogues
from goalscope.experiment.summary_episodes import read_episodes
from goalscope.experiment.summary_mcq import mcq_tables

__all__ = ["tables_of"]


def tables_of(results: Results) -> list[Table]:
    """The tables of the newest plan for each model, of those cells that have results."""
    done = [cell for cell in results.asked_for() if cell.result is not None]
    cells = [(cell.spec, cell.result or {}) for cell in done]
    command = results.about.get("command", "")
    tables = list(mcq_tables(cells, command=command))
    for dialogues in read_dialogues(cells):
        tables.append(dialogues.table(command=command))
    for episodes in read_episodes(cells, attempts=[cell.attempts for cell in done]):
        tables += episodes.tables(command=command)
    return tables
