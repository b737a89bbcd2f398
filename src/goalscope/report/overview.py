"""The summary of a report: the most informative rows of its parts' tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from goalscope.experiment.beliefs import EQ1, TURN
from goalscope.experiment.episodes import METHODS
from goalscope.experiment.predictors import GOALSCOPE
from goalscope.experiment.summary import Entry, Row, Table, few_notes, without_shared
from goalscope.report.sections import Section

__all__ = ["summary_of"]

_Kind = tuple[str, str, str, tuple[str, ...], Callable[[Sequence[Row]], Sequence[Row]], str]

_LOSS = f"{EQ1}: log-loss"
_MEASURES = ("score", "unwanted")
_PROMPTS = ("question", "question and choices", None)


def _one_belief(rows: Sequence[Row]) -> list[Row]:
    """The rows of goalscope's belief, with the log-loss of the paper's, which comes before it."""
    found: list[Row] = []
    paper: Entry = None
    for row in rows:
        if row["belief"] == EQ1:
            paper = row["log-loss"]
        elif row["belief"] == GOALSCOPE:
            found.append({**row, _LOSS: paper})
    return found


def _side_by_side(rows: Sequence[Row]) -> list[Row]:
    """One row with the scores of all methods, and then what was unwanted."""
    people = [*dict.fromkeys(row["profiles"] for row in rows)]
    entries = {f"{row['method']}, {key}": row.get(key) for key in _MEASURES for row in rows}
    number = people[0] if len(people) == 1 else " or ".join(map(str, people))
    return [{"people": number, **entries}]


_KINDS: tuple[_Kind, ...] = (
    # name, title, names of its tables, columns, rows that are shown, note
    (
        "beliefs",
        "Beliefs about what people wanted",
        "beliefs",
        (
            *("dialogues", "model", "n", "top-1", "log-loss", _LOSS, "ECE"),
            f"AUROC by turn {TURN}",
        ),
        _one_belief,
        "Top-1, log-loss (nats) and calibration error (ECE) after the last turn, among the goals "
        f"alone: Unspecified may lead all the same. {EQ1}: the paper's belief. AUROC: how well "
        "Unspecified signals that the true goal is not among the goals. Where n differs, the page "
        "of a part compares models on the same dialogues.",
    ),
    (
        "episodes",
        "Episodes: is what was wanted done in the end?",
        r"episodes-.*-methods",
        ("of", "people", *(f"{method}, {key}" for key in _MEASURES for method in METHODS)),
        _side_by_side,
        "Score: share of the person's conditions that hold in the end, a mean over people. "
        "Unwanted: number of things that the person neither asked for nor would welcome.",
    ),
    (
        "mcq",
        "Questions: which choice did the person take?",
        "mcq",
        ("model", "prompt", "n", "accuracy", "log-loss"),
        lambda rows: [
            row for row in rows if row["Unspecified"] == "without" and row["prompt"] in _PROMPTS
        ],
        "Unspecified is not among the goals. The paper's prompt is the question and choices.",
    ),
    (
        "changes",
        "Changes of mind: how soon is the new goal the likeliest?",
        r"changes-.*",
        ("belief", "n", "followed within 1", "followed within 2", "followed within 3"),
        lambda rows: rows,
        "Followed within k rounds: the second goal was the likeliest after at least one of them.",
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
            "command": " or ".join(each.commands) or None,
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
    shown: Callable[[Sequence[Row]], Sequence[Row]],
    note: str,
) -> Table:
    rows: list[Row] = []
    for section in sections:
        for table in section.tables:
            if re.fullmatch(pattern, table.name) and not table.name.endswith("-first-attempts"):
                of: Row = {"of": table.title.partition(": ")[2]}
                for row in shown(table.rows):
                    found = {**of, **row}
                    line: dict[str, Entry] = {"part": section.name}
                    line |= {column: found[column] for column in columns if column in found}
                    if section.done < section.planned:
                        line["cells so far"] = f"{section.done:,} of {section.planned:,}"
                    rows.append(line)
    table = Table(f"summary-{name}", title, _shorter(rows), (note,))
    return replace(table, notes=(*table.notes, *few_notes(table)))


def _shorter(rows: Sequence[Row]) -> list[Row]:
    """The rows with what distinguishes their "of"."""
    if not all("of" in row for row in rows):
        return [*rows]
    of = without_shared([str(row["of"]) for row in rows])
    return [{**row, "of": each} for row, each in zip(rows, of, strict=True)]
