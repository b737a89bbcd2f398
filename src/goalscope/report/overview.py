"""The summary on top of a report: of the tables of its parts the rows that tell most."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from goalscope.experiment.predictors import GOALSCOPE
from goalscope.experiment.summary import Entry, Table
from goalscope.experiment.summary_beliefs import AGENT, PAPERS, TURN
from goalscope.report.sections import Section

__all__ = ["counts", "summary_of"]

AS_IT_COMES = "as it comes"

Row = dict[str, Entry]
"""What a row has in each column."""


@dataclass(frozen=True, slots=True)
class _Kind:
    """One kind of result.

    Attributes:
        name: For references.
        title: What it is about.
        tables: What the names of its tables look like, after that of their part.
        cells: The kind of the cells that they are made of.
        of: Heading of what their titles say after the colon; empty if that is not shown.
        columns: Those of their columns that are shown.
        picked: The rows that are shown.
        notes: As in a table.
    """

    name: str
    title: str
    tables: str
    cells: str
    of: str
    columns: tuple[str, ...]
    picked: Callable[[list[Row]], list[Row]]
    notes: tuple[str, ...]


def _believed(rows: list[Row]) -> list[Row]:
    """The paper's belief and goalscope's, both with each model."""
    return [row for row in rows if row["belief"] in (PAPERS, GOALSCOPE, AGENT)]


def _compared(rows: list[Row]) -> list[Row]:
    """After the last turn, each model but the first, with which it is compared."""
    first, last = rows[0]["model"], rows[-1]["turn"]
    shown = [row for row in rows if row["turn"] == last and row["model"] != first]
    return [{**row, "compared with": first} for row in shown]


_KINDS = (
    _Kind(
        "beliefs",
        "Beliefs about what people wanted",
        "beliefs",
        "dialogue",
        "",
        (
            *("dialogues", "model", "belief", "n", "top-1", "log-loss", "ECE"),
            f"AUROC by turn {TURN}",
            *(f"proposes by turn {TURN} if {kind}" for kind in ("absent", "present")),
        ),
        _believed,
        (
            f"{PAPERS}: the paper's belief. {GOALSCOPE}: its own. {AGENT}: the one of an agent "
            "that proposes its goals itself.",
            "Top-1, log-loss (nats) and expected calibration error after the last turn, among the "
            "goals alone: Unspecified may lead all the same. AUROC: "
            "does it tell that the true goal is not among the goals? It should propose others "
            "then, and only then.",
        ),
    ),
    _Kind(
        "models",
        "Models and adapters compared",
        r"models-.*",
        "dialogue",
        "dialogues",
        (
            *("model", "compared with", "n", "top-1", "top-1, difference", "log-loss"),
            *("log-loss, difference", f"{PAPERS}: log-loss, difference", "open-set AUROC"),
        ),
        _compared,
        (
            "All after the last turn, the AUROC too. Difference: from the model that it is "
            f"compared with. {PAPERS}: without calibration, which each model has its own of.",
        ),
    ),
    _Kind(
        "episodes",
        "Episodes: is what was wanted done in the end?",
        r"episodes-.*-methods(-\d+)?",
        "episode",
        "episodes",
        ("method", "runs", "score", "rounds", "terminated"),
        list,
        (
            "Score: share of the person's conditions that hold in the end, a mean over people. "
            "Terminated: the agent, not the limit of rounds, ended it.",
        ),
    ),
    _Kind(
        "mcq",
        "Questions: which choice did the person take?",
        "mcq",
        "mcq",
        "",
        ("model", "prompt", "n", "accuracy", "log-loss, sum"),
        lambda rows: [row for row in rows if row["Unspecified"] == "without"],
        ("Unspecified is not among the goals. The paper's prompt is the question and choices.",),
    ),
    _Kind(
        "changes",
        "Changes of mind: how soon is the new goal the likeliest?",
        r"changes-.*",
        "change",
        "",
        ("belief", "n", "followed within 1", "followed within 2", "followed within 3"),
        list,
        ("Followed within k rounds: the second goal was the likeliest after one of them.",),
    ),
)


def summary_of(sections: Sequence[Section]) -> tuple[Table, ...]:
    """A table for each kind of result that there is, and one of all parts.

    The first column has the name of the part that a row is from. Where cells of its kind are
    missing, the last says how many there are.
    """
    return (*(table for kind in _KINDS if (table := _table(kind, sections)).rows), _parts(sections))


def _table(kind: _Kind, sections: Sequence[Section]) -> Table:
    rows: list[tuple[Entry, ...]] = []
    for section in sections:
        pattern = re.compile(rf"{re.escape(section.name)}-{kind.tables}")
        done, planned = counts(section, kind.cells)
        so_far = f"{done:,} of {planned:,}" if done < planned else None
        for table in filter(lambda each: pattern.fullmatch(each.name), section.tables):
            if not table.rows or table.name.endswith("-first-attempts"):
                continue
            of = (table.title.partition(": ")[2],) if kind.of else ()
            for row in kind.picked([dict(zip(table.columns, r, strict=True)) for r in table.rows]):
                rows.append((section.name, *of, *map(row.get, kind.columns), so_far))
    columns = ("part", *filter(None, [kind.of]), *kind.columns, "cells so far")
    if not any(row[-1] for row in rows):
        columns, rows = columns[:-1], [row[:-1] for row in rows]
    table = Table(f"summary-{kind.name}", kind.title, columns, tuple(rows), kind.notes)
    return _said_once(table)


def _said_once(table: Table) -> Table:
    """The name that all models share, in a note instead of in each row."""
    if "model" not in table.columns:
        return table
    i = table.columns.index("model")
    names = {str(row[i]).partition(" ")[0] for row in table.rows}
    if len(names) != 1:
        return table
    (name,) = names
    rows = tuple(
        (*row[:i], str(row[i]).removeprefix(name).strip() or AS_IT_COMES, *row[i + 1 :])
        for row in table.rows
    )
    note = f"The model is {name}. The embedded model, {AS_IT_COMES}, has an adapter."
    return replace(table, rows=rows, notes=(*table.notes, note))


def _parts(sections: Sequence[Section]) -> Table:
    rows: list[tuple[Entry, ...]] = []
    for each in sections:
        done, planned = counts(each)
        cells = f"{done:,} of {planned:,}" if planned else None
        rows.append((each.name, each.title, cells, ", ".join(c[:6] for c in each.codes) or None))
    codes = {code for section in sections for code in section.codes}
    versions = f"{len(codes)} versions" if len(codes) != 1 else "one version"
    note = f"Measured with {versions} of the code, named by how their hashes begin."
    columns = ("part", "title", "cells measured", "code")
    return Table("summary-parts", "All parts", columns, tuple(rows), (note,) if codes else ())


def counts(section: Section, kind: str = "") -> tuple[int, int]:
    """How many cells of this kind, or of all, were measured, and how many there are."""
    name = f"{section.name}-cells"
    found = [row for table in section.tables if table.name == name for row in table.rows]
    own = [row for row in found if kind in ("", row[0])]
    planned, done = (sum(n for row in own if isinstance(n := row[i], int)) for i in (1, 2))
    return done, planned
