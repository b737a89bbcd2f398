"""The summary of a report: the most informative rows of its parts' tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from goalscope.experiment.dialogues import AS_IN_PAPER, GOALSCOPE, SIMILARITIES
from goalscope.experiment.episodes import TRIVIAL
from goalscope.experiment.fitted_baselines import FITTED_METHODS
from goalscope.experiment.summary import (
    Entry,
    Estimate,
    Row,
    Table,
    few_notes,
    without_shared,
)
from goalscope.report.sections import Section

BASELINES = (*SIMILARITIES, *FITTED_METHODS)
PROMPTS = ("question", "question and choices", None)


@dataclass(frozen=True, slots=True)
class _Kind:
    """A kind of tables (`pattern` matches their names), and what the summary shows of them.

    The column "of" is what a table's title says after the colon; `rows` chooses or makes the rows
    to show, with all their columns where `columns` is empty. Rows `without_model` are
    shown once, where the tables of several models have them.
    """

    name: str
    title: str
    pattern: str
    columns: tuple[str, ...]
    note: str
    rows: Callable[[Sequence[Row]], Sequence[Row]] = lambda rows: rows
    without_model: bool = False


def _last(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["turn"] == rows[-1]["turn"]]


def _one_belief(rows: Sequence[Row]) -> list[Row]:
    """Goalscope's belief after the last turn, with the log-loss of the paper's."""
    by_predictor = {row["predictor"]: row for row in _last(rows)}
    if GOALSCOPE not in by_predictor:
        return []
    paper = by_predictor[AS_IN_PAPER]["log-loss"]
    return [{**by_predictor[GOALSCOPE], "Eq. 1: log-loss": paper}]


def _baselines(rows: Sequence[Row]) -> list[Row]:
    """One row with the top-1 and the log-loss of each simpler way after the last turn."""
    last = {str(row["predictor"]): row for row in _last(rows)}
    entries = {
        way: f"{_bare(last[way]['top-1'])}, {_bare(last[way]['log-loss'])}"
        for way in BASELINES
        if way in last
    }
    return [{"n": rows[-1]["n"], **entries}] if entries else []


def _bare(entry: Entry) -> Entry:
    """A figure without its interval."""
    return replace(entry, interval=None) if isinstance(entry, Estimate) else entry


def _joined(rows: Sequence[Row]) -> list[Row]:
    """Rows that differ in "of" only as one, whose "of" is what theirs share."""
    found: dict[tuple[str, ...], Row] = {}
    for row in rows:
        key = tuple(f"{name}: {entry}" for name, entry in row.items() if name != "of")
        told = str(row["of"]).split(", ")
        before = str(found.get(key, row)["of"]).split(", ")
        found[key] = {**row, "of": ", ".join(each for each in before if each in told)}
    return [*found.values()]


def _side_by_side(rows: Sequence[Row]) -> list[Row]:
    """One row of a table by method and the table of its differences.

    It has the scores of all methods, the differences between the first and the others, the best
    trivial policy, and the number of unwanted things.
    """
    methods = [row for row in rows if row.get("method") not in (None, *TRIVIAL)]
    trivial = [row for row in rows if row.get("method") in TRIVIAL]
    people = [*dict.fromkeys(row["profiles"] for row in methods)]
    found: dict[str, Entry] = {
        "people": people[0] if len(people) == 1 else " or ".join(map(str, people))
    }
    found |= {f"{row['method']}, score": row["score"] for row in methods}
    first = f"{methods[0]['method']} minus "
    for row in rows:
        if row.get("measure") == "score" and str(row["methods"]).startswith(first):
            found[str(row["methods"])] = row["difference"]
    scores = [(row["score"], row["method"]) for row in trivial]
    known = [(score.value, score, name) for score, name in scores if isinstance(score, Estimate)]
    if known:
        _, best, name = max(known, key=lambda each: each[0])
        found["best trivial policy"] = f"{name}, {_bare(best)}"
    return [found | {f"{row['method']}, unwanted": row.get("unwanted") for row in methods}]


KINDS = (
    _Kind(
        "beliefs",
        "Beliefs about what people wanted",
        "dialogues-.*",
        ("of", "n", "top-1", "log-loss", "Eq. 1: log-loss", "ECE", "AUROC"),
        "After the last turn that was read (the pages of the parts tell a limit). Top-1, log-loss "
        "(nats) and calibration error (ECE) are among the goals alone: Unspecified may lead all "
        "the same. Eq. 1: the paper's belief. AUROC: how well Unspecified signals that the true "
        "goal is not among the goals.",
        _one_belief,
    ),
    _Kind(
        "baselines",
        "Simpler ways to infer goals, on the same dialogues",
        "dialogues-.*",
        ("of", "n", *BASELINES),
        "Top-1 and log-loss after the last turn; the pages of the parts have intervals. The last "
        f"{len(FITTED_METHODS)} are fitted on dialogues that those pages name.",
        _baselines,
        without_model=True,
    ),
    _Kind(
        "episodes",
        "Episodes: is what was wanted done in the end?",
        r"episodes-.*-methods",
        (),
        "Score: m / (n + u + v) for n needs, of which m are met, u unwanted things and v violated "
        "prohibitions, a mean over people; differences are paired by person, and the pages of the "
        f"parts have their p. Trivial policies ({', '.join(TRIVIAL)}) do the same for everybody. "
        "Unwanted: number of things that the person neither asked for nor would welcome.",
        _side_by_side,
    ),
    _Kind(
        "mcq",
        "Questions: which choice did the person take?",
        "mcq",
        ("model", "prompt", "n", "accuracy", "log-loss"),
        "Unspecified is not among the goals. The paper's prompt is the question and choices.",
        lambda rows: [
            row for row in rows if row["Unspecified"] == "without" and row["prompt"] in PROMPTS
        ],
    ),
    _Kind(
        "changes",
        "Changes of mind: how soon is the new goal the likeliest?",
        r"following-.*",
        ("of", "predictor", "changes", "at once", "within 3"),
        "How often the new goal leads at the turn that tells it, or within three turns.",
    ),
)


def summary_of(sections: Sequence[Section]) -> list[Table]:
    """A table for each kind of result.

    The first column names the part of a row. If cells of a part are missing, the last column shows
    how many there are.
    """
    return [table for kind in KINDS if (table := _table(sections, kind)).rows]


def _table(sections: Sequence[Section], kind: _Kind) -> Table:
    rows: list[Row] = []
    for section in sections:
        if section.aside:
            continue
        progress: Row = {}
        if section.done < section.planned:
            progress = {"cells so far": f"{section.done:,} of {section.planned:,}"}
        tables = {table.name: table.rows for table in section.tables}
        for table in section.tables:
            if re.fullmatch(kind.pattern, table.name):
                beside = tables.get(f"{table.name.removesuffix('methods')}differences", ())
                for row in kind.rows([*table.rows, *beside]):
                    known: Row = {"of": table.title.partition(": ")[2], **row}
                    columns = kind.columns or known
                    shown = {name: known[name] for name in columns if name in known}
                    rows.append({"part": section.name, **shown, **progress})
    rows = _joined(rows) if kind.without_model else rows
    if rows and all("of" in row for row in rows):
        labels = without_shared([str(row["of"]) for row in rows])
        rows = [{**row, "of": label} for row, label in zip(rows, labels, strict=True)]
    table = Table(f"summary-{kind.name}", kind.title, rows, (kind.note,))
    return replace(table, notes=(*table.notes, *few_notes(table)))
