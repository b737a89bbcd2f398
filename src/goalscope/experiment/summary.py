"""Tables of figures: what a cell of one can be, and how it reads in each format."""

from __future__ import annotations

import csv
import hashlib
import html
import io
import json
import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from goalscope.models.opening import model_label
from goalscope.plain import plain
from goalscope.stats import Interval

__all__ = [
    "NO_INTERVAL",
    "Entry",
    "Estimate",
    "Labels",
    "Measured",
    "Table",
    "chosen",
    "few_notes",
    "inert",
    "markdown_text",
    "mean",
    "percent",
    "slug",
]

Measured = tuple[Mapping[str, Any], Mapping[str, Any]]
"""What was measured, and what came of it: a spec and its result."""

MISSING = "-"
NO_INTERVAL = "There is no interval where all values are equal."
"""For the notes of tables whose intervals are bootstrapped."""
FEW = 10
"""Of fewer people, or other groups of cases, an interval says little."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure with the interval that it may lie in.

    Attributes:
        value: The figure; a fraction where `form` is "percent".
        interval: In the same unit; None where there is none to give.
        form: Whether it is shown as a percentage.
        groups: How many groups the interval comes from, where that is not the number of cases.

    Raises:
        ValueError: A number is not finite.
    """

    value: float
    interval: Interval | None = None
    form: Literal["percent", "number"] = "number"
    groups: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        ends = (self.interval.low, self.interval.high) if self.interval else ()
        if not all(map(math.isfinite, (self.value, *ends))):
            raise ValueError(f"an estimate must be finite, not {self.value} {ends}")

    def __str__(self) -> str:
        shown, unit = (_hundredths, " %") if self.form == "percent" else (_number, "")
        text = f"{shown(self.value)}{unit}"
        if self.interval is None:
            return text
        return f"{text} [{shown(self.interval.low)}, {shown(self.interval.high)}]"


Entry = str | float | int | Estimate | Interval | None
"""One cell of a table; None where there are no data. An interval alone is a span of its own."""


@dataclass(frozen=True, slots=True)
class Table:
    """Figures with what one needs to read them, and to make them again.

    Attributes:
        name: For files and references: letters, digits, `.`, `_` and `-`.
        title: What it shows, in one line.
        columns: Headings.
        rows: As many entries each as there are columns.
        notes: What one must know to read it, a sentence each.
        command: What makes it again.

    Raises:
        ValueError: A row has another number of entries, or a number is not finite.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Entry, ...], ...]
    notes: tuple[str, ...] = ()
    command: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"{len(self.columns)} columns need as many entries: {row}")
            if not all(math.isfinite(each) for each in row if isinstance(each, float)):
                raise ValueError(f"numbers must be finite: {row}")

    def text_rows(self) -> tuple[tuple[str, ...], ...]:
        """The rows as people read them, such as "72.0 % [65.1, 78.2]"; "-" without data."""
        return tuple(tuple(_shown(each) for each in row) for row in self.rows)

    def to_dict(self) -> dict[str, Any]:
        """For JSON: numbers as numbers.

        An interval has `low` and `high`, and an estimate also `value` and `form`.
        """
        return {
            "name": self.name,
            "title": self.title,
            "columns": list(self.columns),
            "rows": [[_json(each) for each in row] for row in self.rows],
            "notes": list(self.notes),
            "command": self.command,
        }

    def to_csv(self) -> str:
        """With full precision; percentages are fractions, and their ends have columns of their own.

        Text that a spreadsheet would take for a formula gets an apostrophe before it.
        """
        parts = [_parts([row[i] for row in self.rows]) for i in range(len(self.columns))]
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        heads: list[str] = []
        for heading, part in zip(self.columns, parts, strict=True):
            names = (heading, f"{heading}, low", f"{heading}, high")
            heads += [inert(_line(name)) for name in names[part]]
        writer.writerow(heads)
        for row in self.rows:
            line: list[str | float] = []
            for entry, part in zip(row, parts, strict=True):
                line += _spread(entry)[part]
            writer.writerow(line)
        return file.getvalue()

    def to_markdown(self) -> str:
        """A heading, the table as GitHub reads it, the notes, and the command."""
        rule = ["---" if self._is_text(i) else "---:" for i in range(len(self.columns))]
        body = [
            [markdown_text(_shown(each)) if isinstance(each, str) else _shown(each) for each in row]
            for row in self.rows
        ]
        grid = [[markdown_text(each) for each in self.columns], rule, *body]
        parts = [
            f"### {markdown_text(self.title)}",
            "\n".join(f"| {' | '.join(r)} |" for r in grid),
        ]
        if self.notes:
            parts.append("\n".join(f"* {markdown_text(note)}" for note in self.notes))
        if self.command:
            fence = "`" * (1 + max((len(run) for run in re.findall("`+", self.command)), default=0))
            parts.append(f"Made by {fence} {_line(self.command)} {fence}")
        return "\n\n".join(parts) + "\n"

    def to_latex(self) -> str:
        r"""A `table` for the package booktabs, with `\label{tab:NAME}`; all text is escaped."""
        align = "".join("l" if self._is_text(i) else "r" for i in range(len(self.columns)))
        lines = [r"\begin{table}", r"\centering", rf"\caption{{{_latex(self.title)}}}"]
        if self.command:
            lines.insert(0, f"% {_line(self.command)}")
        lines += [rf"\label{{tab:{slug(self.name)}}}", rf"\begin{{tabular}}{{{align}}}"]
        lines += [r"\toprule", " & ".join(map(_latex, self.columns)) + r" \\", r"\midrule"]
        lines += [" & ".join(map(_latex, row)) + r" \\" for row in self.text_rows()]
        lines += [r"\bottomrule", r"\end{tabular}"]
        lines += [rf"\par\footnotesize {_latex(note)}" for note in self.notes]
        return "\n".join([*lines, r"\end{table}", ""])

    def _is_text(self, column: int) -> bool:
        return any(isinstance(row[column], str) for row in self.rows)


class Labels:
    """Short names for settings: the model's name, and what else tells them apart.

    Args:
        settings: All that occur; those that are equal have one label.
    """

    def __init__(self, settings: Iterable[Mapping[str, Any]]) -> None:
        known = {_key(each): each for each in settings}
        fields = dict.fromkeys(key for each in known.values() for key in each)
        differ = [f for f in fields if len({_key(each.get(f)) for each in known.values()}) > 1]
        names = {key: model_label(each["model"]) for key, each in known.items()}
        self._labels: dict[str, str] = {}
        for key, each in known.items():
            label = names[key]
            if list(names.values()).count(label) > 1:
                parts = [f"{f} {_value(each.get(f))}" for f in differ if f != "model"]
                same = [k for k in known if names[k] == label]
                if len({_key(known[k].get("model")) for k in same}) > 1:
                    parts.append(_value(each.get("model")))
                label = ", ".join([label, *parts])
            self._labels[key] = label

    def __getitem__(self, settings: Mapping[str, Any]) -> str:
        """The label of settings that were given at the start."""
        return self._labels[_key(settings)]


def few_notes(table: Table) -> tuple[str, ...]:
    """What to say below a table with intervals of fewer than `FEW` people, groups or cases."""
    counts = [name for name in ("profiles", "n") if name in table.columns][:1]
    found = [
        row[table.columns.index(name)] if each.groups is None else each.groups
        for name in counts
        for row in table.rows
        for each in row
        if isinstance(each, Estimate) and each.interval
    ]
    least = min((n for n in found if isinstance(n, int)), default=FEW)
    if least >= FEW:
        return ()
    what = ("profile" if "profiles" in counts else "group") + "s" * (least != 1)
    return (f"Of {least} {what} an interval says little: so few hardly tell how others differ.",)


def chosen(cells: Iterable[Measured], kind: str) -> list[Measured]:
    """The cells of one kind, in their order."""
    return [cell for cell in cells if cell[0].get("kind") == kind]


def mean(values: Sequence[float]) -> float | None:
    """The mean; None of nothing."""
    return math.fsum(values) / len(values) if values else None


def percent(value: float | None) -> Estimate | None:
    """A share (0 to 1) to be shown as a percentage, without an interval; None of None."""
    return None if value is None else Estimate(value, None, "percent")


def slug(text: str) -> str:
    """`text` as a part of file names and references; long ones end in a digest."""
    short = re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-.") or "table"
    if len(short) <= 60:
        return short
    return f"{short[:50]}-{hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()[:8]}"


def _key(value: object) -> str:
    return json.dumps(value, sort_keys=True, default=str)


def _value(value: object) -> str:
    return value if isinstance(value, str) else _key(value)


def _hundredths(fraction: float) -> str:
    return f"{100 * fraction:z.1f}"


def _number(value: float) -> str:
    return "<0.001" if 0 < value < 0.0005 else f"{value:z.3f}"


def _line(text: str) -> str:
    return " ".join(plain(text).plain.split())


def _shown(entry: Entry) -> str:
    if entry is None:
        return MISSING
    if isinstance(entry, float):
        return _number(entry)
    if isinstance(entry, Interval):
        return f"{_number(entry.low)} to {_number(entry.high)}"
    return _line(entry) if isinstance(entry, str) else str(entry)


def _json(entry: Entry) -> Any:
    if isinstance(entry, Interval):
        return {"low": entry.low, "high": entry.high}
    if not isinstance(entry, Estimate):
        return entry
    low, high = (entry.interval.low, entry.interval.high) if entry.interval else (None, None)
    return {"value": entry.value, "low": low, "high": high, "form": entry.form}


def _parts(entries: Sequence[Entry]) -> slice:
    """Which of the parts of `_spread` a column has: the value, the ends of its interval, or all."""
    if any(isinstance(each, Estimate) for each in entries):
        return slice(None)
    return slice(1, None) if any(isinstance(each, Interval) for each in entries) else slice(1)


def _spread(entry: Entry) -> list[str | float]:
    """The value and, of an estimate, its ends; "" for what there is not."""
    if isinstance(entry, Interval):
        return ["", entry.low, entry.high]
    if isinstance(entry, Estimate):
        ends = (entry.interval.low, entry.interval.high) if entry.interval else ("", "")
        return [entry.value, *ends]
    if isinstance(entry, str):
        return [inert(_line(entry)), "", ""]
    return ["" if entry is None else entry, "", ""]


def inert(text: str) -> str:
    """The text, after an apostrophe if a spreadsheet would take it for a formula."""
    first = unicodedata.normalize("NFKC", text[:1])  # some take wide signs, too
    return f"'{text}" if first and first in "=+-@\t\r\n" else text


def markdown_text(text: str) -> str:
    """`text` in one line, as Markdown that shows it as it is."""
    return re.sub(r"([\\`*_\[\]|#!~$])", r"\\\1", html.escape(_line(text), quote=False))


_LATEX = {
    **{each: "\\" + each for each in "{}$&#_%"},
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "[": "{[}",  # after the end of a row, LaTeX would read it as the row's distance
    "]": "{]}",
    "*": "{*}",
}


def _latex(text: str) -> str:
    return "".join(_LATEX.get(each, each) for each in _line(text))
