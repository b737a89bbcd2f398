"""The summary of a report: the most informative rows of its parts' tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from goalscope.experiment.beliefs import AGENT, EQ1, TURN
from goalscope.experiment.predictors import GOALSCOPE
from goalscope.experiment.summary import Entry, Row, Table
from goalscope.report.sections import Section

__all__ = ["summary_of"]

_Kind = tuple[str, str, str, tuple[str, ...], Callable[[Row], bool], str]

_KINDS: tuple[_Kind, ...] = (
    # name, title, names of its tables, columns, rows that are shown, note
    (
        "beliefs",
        "Beliefs about what people wanted",
        "beliefs",
        (
            *("dialogues", "model", "belief", "n", "top-1", "log-loss", "ECE"),
            f"AUROC by turn {TURN}",
            *(f"proposes by turn {TURN} if {kind}" for kind in ("absent", "present")),
        ),
        lambda row: row["belief"] in (EQ1, GOALSCOPE, AGENT),
        f"{EQ1}: the paper's belief. {GOALSCOPE}: its own. {AGENT}: that of an agent that proposes "
        "its goals itself. Top-1, log-loss (nats) and calibration error after the last turn, among "
        "the goals alone: Unspecified may lead all the same. AUROC: does it tell that the true "
        "goal is not among the goals? It should propose others then, and only then.",
    ),
    (
        "models",
        "Models and adapters compared",
        r"models-.*",
        (
            *("of", "model", "n", "top-1", "top-1, difference", "log-loss"),
            *("log-loss, difference", "Eq. 1: log-loss, difference", "open-set AUROC"),
        ),
        lambda row: row["turn"] == "last" and row["top-1, difference"] is not None,
        "All after the last turn. Difference: from the first model, usually without adapter; "
        f"{EQ1}: without calibration, which each model has its own of.",
    ),
    (
        "episodes",
        "Episodes: is what was wanted done in the end?",
        r"episodes-.*-methods",
        ("of", "method", "runs", "score", "rounds", "terminated"),
        lambda row: True,
        "Score: share of the person's conditions that hold in the end, a mean over people. "
        "Terminated: the agent, not the limit of rounds, ended it.",
    ),
    (
        "mcq",
        "Questions: which choice did the person take?",
        "mcq",
        ("model", "prompt", "n", "accuracy", "log-loss"),
        lambda row: row["Unspecified"] == "without",
        "Unspecified is not among the goals. The paper's prompt is the question and choices.",
    ),
    (
        "changes",
        "Changes of mind: how soon is the new goal the likeliest?",
        r"changes-.*",
        ("belief", "n", "followed within 1", "followed within 2", "followed within 3"),
        lambda row: True,
        "Followed within k rounds: the second goal was the likeliest after one of them.",
    ),
)


def summary_of(sections: Sequence[Section]) -> list[Table]:
    """A table for each kind of result, and one of all parts.

    The first column names the part of a row. If cells of a part are missing, the last column shows
    how many there are.
    """
    tables = [_table(sections, *kind) for kind in _KINDS]
    codes = {code for section in sections for code in section.codes}
    versions = f"{len(codes)} versions" if len(codes) != 1 else "one version"
    note = f"Measured with {versions} of the code, named by how their hashes begin."
    rows: list[Row] = [
        {
            "part": each.name,
            "title": each.title,
            "cells measured": f"{each.done:,} of {each.planned:,}" if each.planned else None,
            "code": ", ".join(code[:6] for code in each.codes) or None,
        }
        for each in sections
    ]
    parts = Table("summary-parts", "All parts", rows, (note,) if codes else ())
    return [*(table for table in tables if table.rows), parts]


def _table(
    sections: Sequence[Section],
    name: str,
    title: str,
    pattern: str,
    columns: tuple[str, ...],
    shown: Callable[[Row], bool],
    note: str,
) -> Table:
    rows: list[Row] = []
    for section in sections:
        for table in section.tables:
            if re.fullmatch(pattern, table.name) and not table.name.endswith("-first-attempts"):
                of: Row = {"of": table.title.partition(": ")[2]}
                for row in filter(shown, table.rows):
                    found = {**of, **row}
                    line: dict[str, Entry] = {"part": section.name}
                    line |= {column: found.get(column) for column in columns}
                    if section.done < section.planned:
                        line["cells so far"] = f"{section.done:,} of {section.planned:,}"
                    rows.append(line)
    return Table(f"summary-{name}", title, rows, (note,))
