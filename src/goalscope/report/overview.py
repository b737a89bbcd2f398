"""The summary on top of a report: of the tables of its parts the rows that tell most."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from goalscope.experiment.summary import Entry, Table
from goalscope.experiment.summary_beliefs import AGENT, PAPERS, WHOLE
from goalscope.report.sections import Section

__all__ = ["summary_of"]

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
        columns: What is shown of them, each named by how its heading begins.
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
    """The paper's belief with the first model of each set, and goalscope's with the others."""
    models: dict[Entry, list[Entry]] = {}
    for row in rows:
        models.setdefault(row["dialogues"], []).append(row["model"])
    picked: list[Row] = []
    for row in rows:
        others = set(models[row["dialogues"]]) - {models[row["dialogues"]][0]}
        shown = (WHOLE, AGENT) if row["model"] in others or not others else ()
        papers = row["model"] == models[row["dialogues"]][0] and row["belief"] == PAPERS
        picked += [row] if papers or row["belief"] in shown else []
    return picked


def _compared(rows: list[Row]) -> list[Row]:
    """After the last turn, each model but the first."""
    first, last = rows[0]["model"], rows[-1]["turn"]
    return [row for row in rows if row["turn"] == last and row["model"] != first]


_KINDS = (
    _Kind(
        "beliefs",
        "Beliefs about what real people wanted",
        "beliefs",
        "dialogue",
        "",
        (
            *("dialogues", "model", "belief", "n", "top-1", "log-loss", "ECE", "AUROC"),
            *("proposes if absent", "proposes if present"),
        ),
        _believed,
        (
            f"{PAPERS}: the paper's belief, with the first model. {WHOLE}: goalscope's, with each "
            f"other one. {AGENT}: the one of an agent that proposes its goals itself.",
            "Top-1, log-loss (nats) and ECE (in brackets, that of a perfect forecaster) after the "
            "last turn. AUROC: does it tell that the true goal is not among the goals? Then it "
            "should propose others, and only then.",
        ),
    ),
    _Kind(
        "models",
        "What an adapter gives",
        r"models-.*",
        "dialogue",
        "dialogues",
        (
            *("model", "n", "top-1", "top-1, difference"),
            *("log-loss", "log-loss, difference", "open-set AUROC"),
        ),
        _compared,
        ("After the last turn. Difference: from the first model, usually without adapter.",),
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
        ("belief", "n", "followed within 1", "followed within 3", "first goal leads"),
        list,
        ("Followed within so many rounds; the first goal should lead before the change.",),
    ),
)


def summary_of(sections: Sequence[Section]) -> tuple[Table, ...]:
    """A table for each kind of result that there is, and one of all parts.

    The first column has the name of the part that a row is from, the last how many of the part's
    cells of this kind were measured.
    """
    return (*(table for kind in _KINDS if (table := _table(kind, sections)).rows), _parts(sections))


def _table(kind: _Kind, sections: Sequence[Section]) -> Table:
    rows: list[tuple[Entry, ...]] = []
    headings = dict(zip(kind.columns, kind.columns, strict=True))
    for section in sections:
        pattern = re.compile(rf"{re.escape(section.name)}-{kind.tables}")
        for table in filter(lambda each: pattern.fullmatch(each.name), section.tables):
            if not table.rows or table.name.endswith("-first-attempts"):
                continue
            found = {each: _heading(table, each) for each in kind.columns}
            headings |= found
            of = (table.title.partition(": ")[2],) if kind.of else ()
            for row in kind.picked([dict(zip(table.columns, r, strict=True)) for r in table.rows]):
                shown = (row.get(found[each]) for each in kind.columns)
                rows.append((section.name, *of, *shown, _measured(section, kind.cells)))
    columns = ("part", *filter(None, [kind.of]), *headings.values(), "cells")
    return Table(f"summary-{kind.name}", kind.title, columns, tuple(rows), kind.notes)


def _heading(table: Table, start: str) -> str:
    """The first column whose heading is, or else begins like, that; that itself if none does."""
    return min((each for each in table.columns if each.startswith(start)), key=len, default=start)


def _parts(sections: Sequence[Section]) -> Table:
    codes = {code for section in sections for code in section.codes}
    rows = tuple(
        (each.name, each.title, _measured(each), ", ".join(code[:6] for code in each.codes) or None)
        for each in sections
    )
    versions = f"{len(codes)} versions" if len(codes) != 1 else "one version"
    note = f"Measured with {versions} of the code, named by how their hashes begin."
    return Table("summary-parts", "All parts", ("part", "title", "cells", "code"), rows, (note,))


def _measured(section: Section, kind: str = "") -> str | None:
    """How many cells of this kind, or of all, and of how many if that is not all."""
    counts = list(_counts(section, kind))
    planned, done = (sum(count[i] for count in counts) for i in (0, 1))
    if not planned:
        return None
    return f"all {done:,}" if done == planned else f"{done:,} of {planned:,}"


def _counts(section: Section, kind: str) -> Iterator[tuple[int, int]]:
    for table in section.tables:
        for name, planned, done, *_ in table.rows if table.name == f"{section.name}-cells" else ():
            if kind in ("", name) and isinstance(planned, int) and isinstance(done, int):
                yield planned, done
