"""Summarise records of measurements in tables: as text, Markdown, CSV or JSON."""

from __future__ import annotations

import csv
import hashlib
import html
import io
import json
import math
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast

from goalscope.base.stats import Interval, bootstrap_mean, holm, paired_difference
from goalscope.base.text import terminal_safe
from goalscope.models.opening import model_label

Measured = tuple[Mapping[str, Any], Mapping[str, Any]]
"""A spec and its result."""

Record = Mapping[str, Any]
"""One measurement: its settings and results by name.

`group` names the people (or anything else) that it shares with other measurements: a bootstrap
resamples whole groups.
"""

Form = Literal["percent", "number"]
"""How a figure is formatted."""

NO_INTERVAL = "There is no interval where all values are equal."
"""A note for tables with bootstrapped intervals."""
FEW = 10
"""Number of people, or other groups of cases, below which an interval is not reliable."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure with its interval.

    Attributes:
        value: The figure; a fraction where `form` is "percent".
        interval: In the same unit; None if there is none.
        form: Whether it is shown as a percentage.
        groups: Number of people, or other groups of cases, behind the interval, if known.

    Raises:
        ValueError: A number is not finite.
    """

    value: float
    interval: Interval | None = None
    form: Form = "number"
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


Entry = str | float | int | Estimate | None
"""The entry of a row in one column; None without data."""

Row = Mapping[str, Entry]
"""Entries by column heading."""

Columns = Callable[[Sequence[Record]], Row]
"""Computes some columns of a row from its records."""


@dataclass(frozen=True, slots=True)
class Sample:
    """All records of one kind measured with the same settings.

    Attributes:
        name: For files.
        title: The measurement and its model.
        records: One per measurement.
        notes: What readers need to know about these records.
    """

    name: str
    title: str
    records: Sequence[Record]
    notes: tuple[str, ...] = ()

    def where(self, **values: object) -> list[Record]:
        """The records that have these values."""
        wanted = values.items()
        return [each for each in self.records if all(each.get(k) == v for k, v in wanted)]


@dataclass(frozen=True, slots=True)
class Table:
    """Figures with the notes needed to read them.

    Attributes:
        name: For files: letters, digits, `.`, `_` and `-`.
        title: Its content, in one line.
        rows: Entries by column; a missing entry has no data.
        notes: What readers need to know, one sentence each.
    """

    name: str
    title: str
    rows: Sequence[Row]
    notes: tuple[str, ...] = ()

    @property
    def columns(self) -> list[str]:
        """The headings, in the order of the rows' entries."""
        return [*dict.fromkeys(name for row in self.rows for name in row)]

    @property
    def worded(self) -> list[bool]:
        """For each column, whether it has words rather than only figures."""
        return [any(isinstance(row.get(name), str) for row in self.rows) for name in self.columns]

    def texts(self) -> list[list[str]]:
        """The headings, then each row formatted for reading, such as "72.0 % [65.1, 78.2]"."""
        columns = self.columns
        return [columns, *([_shown(row.get(name)) for name in columns] for row in self.rows)]

    def flat(self) -> list[dict[str, str | float | None]]:
        """The rows in full precision: percentages as fractions, interval ends as separate entries.

        The ends of `score` are called `score, low` and `score, high`.
        """
        spread = {
            name
            for row in self.rows
            for name, entry in row.items()
            if isinstance(entry, Estimate) and entry.interval
        }
        found: list[dict[str, str | float | None]] = []
        for row in self.rows:
            line: dict[str, str | float | None] = {}
            for name in self.columns:
                entry = row.get(name)
                value, ends = (
                    (entry.value, entry.interval) if isinstance(entry, Estimate) else (entry, None)
                )
                line[name] = value
                if name in spread:
                    line[f"{name}, low"] = ends and ends.low
                    line[f"{name}, high"] = ends and ends.high
            found.append(line)
        return found

    def to_dict(self) -> dict[str, Any]:
        """The table for JSON, with the rows of `flat`."""
        return {
            "name": self.name, "title": self.title, "rows": self.flat(), "notes": [*self.notes]
        }  # fmt: skip

    def to_csv(self) -> str:
        """The rows of `flat`; text that a spreadsheet would run gets an apostrophe before it."""
        rows = self.flat()
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        for line in (*rows[:1], *(row.values() for row in rows)):
            writer.writerow(
                [inert(_line(each)) if isinstance(each, str) else each for each in line]
            )
        return file.getvalue()

    def to_markdown(self) -> str:
        """A heading, the table in GitHub's Markdown, and the notes."""
        words = self.worded
        heads, *rows = self.texts()
        lines = [[*map(markdown_text, heads)], ["---" if each else "---:" for each in words]]
        for row in rows:
            shown = zip(row, words, strict=True)
            lines.append([markdown_text(t) if w else t.replace("<", "&lt;") for t, w in shown])
        parts = [f"## {markdown_text(self.title)}"]
        parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines))
        parts += ["\n".join(f"* {markdown_text(note)}" for note in self.notes)] * bool(self.notes)
        return "\n\n".join(parts) + "\n"


def rows_of(
    groups: Iterable[tuple[Row, Sequence[Record]]], columns: Sequence[Columns]
) -> list[Row]:
    """A row for each group of records.

    Args:
        groups: The entries that name the row, and its records.
        columns: The functions that compute the other columns.
    """
    rows: list[Row] = []
    for head, records in groups:
        row = dict(head)
        for each in columns:
            row |= each(records)
        rows.append(row)
    return rows


def count(name: str = "n") -> Columns:
    """A column with the number of records."""
    return lambda records: {name: len(records)}


def average(name: str, key: str, form: Form = "number") -> Columns:
    """A column of `mean_of`; a row has no entry if all its records lack the key."""
    return lambda records: (
        {name: mean_of(records, key, form)} if any(key in each for each in records) else {}
    )


def mean_of(records: Iterable[Record], key: str, form: Form = "number") -> Estimate | None:
    """The mean of the records' values of a key, with its interval; None if none has the key."""
    found = [each for each in records if key in each]
    return averaged([each[key] for each in found], [each["group"] for each in found], form)


def short_names(names: Iterable[str]) -> dict[str, str]:
    """FILE.py:NAME without its folder by the full name, as long as no two share it."""
    short = {name: Path(name).name for name in names}
    taken = Counter(short.values())
    return {name: each if taken[each] == 1 else name for name, each in short.items()}


def difference_rows(
    pairs: Iterable[tuple[Row, Sequence[float], Sequence[float], Form]],
) -> list[Row]:
    """A row for each comparison: the mean difference with its interval, p, and p by Holm.

    Args:
        pairs: The entries that name a row, the paired values of the one and the other, by person
            or group, and how their difference is shown. Without pairs it has no entry.
    """
    rows: list[Row] = []
    for head, one, other, form in pairs:
        found = paired_difference(one, other) if one else None
        estimate = found and Estimate(found.difference, found.interval, form, len(one))
        rows.append({**head, "pairs": len(one), "difference": estimate, "p": found and found.p})
    tests = [row["p"] for row in rows if isinstance(row["p"], float)]
    corrected = iter(holm(tests))
    return [{**row, "p (Holm)": None if row["p"] is None else next(corrected)} for row in rows]


def difference_note(rows: Sequence[Row]) -> str:
    """The note below a table of `difference_rows`."""
    number = sum(row["p"] is not None for row in rows)
    return (
        f"95 % paired bootstrap intervals over pairs. {NO_INTERVAL} p is two-sided, from a "
        "sign-flip permutation test; p (Holm) is corrected for the comparisons of this table, "
        f"{number}."
    )


class Labels:
    """Short labels for settings: the model's name, and what else distinguishes them.

    What is None or empty is not in a label, and a path is its last part, as long as no two settings
    share a label.

    Args:
        settings: All that occur; equal ones share a label.
        usual: Values that are told only where they distinguish settings of one model; any other
            value of these fields is told in any case.
    """

    def __init__(
        self, settings: Iterable[Mapping[str, Any]], usual: Mapping[str, Any] | None = None
    ) -> None:
        known = {_key(each): each for each in settings}
        names = {key: model_label(each["model"]) for key, each in known.items()}
        told: dict[str, dict[str, Any]] = {}
        for key, each in known.items():
            same = [known[k] for k in known if names[k] == names[key]]
            differ = [f for f in each if len({_key(other.get(f)) for other in same}) > 1]
            differ += [f for f, value in (usual or {}).items() if _key(each.get(f)) != _key(value)]
            kept = {f: each.get(f) for f in dict.fromkeys(differ)}
            told[key] = {f: value for f, value in kept.items() if value not in (None, (), [])}
        self._labels = {key: _label(names[key], told[key]) for key in known}
        taken = Counter(self._labels.values())
        for key, label in self._labels.items():
            if taken[label] > 1:
                self._labels[key] = _label(names[key], told[key], whole=True)

    def __getitem__(self, settings: Mapping[str, Any]) -> str:
        """The label of some of the given settings."""
        return self._labels[_key(settings)]


def _label(name: str, told: Mapping[str, Any], *, whole: bool = False) -> str:
    parts = (
        f"{'' if field == 'model' else f'{field} '}{_value(value, whole=whole)}"
        for field, value in told.items()
    )
    return ", ".join([name, *parts])


def without_shared(titles: Sequence[str]) -> list[str]:
    """Titles without what all of them say after their first word, such as the same model."""
    told = [re.split(r", | \+ ", title) for title in titles]
    shared = set(told[0]).intersection(*told) if len(told) > 1 else set[str]()
    short = [
        ", ".join([first, *(each for each in rest if each not in shared)]) for first, *rest in told
    ]
    return short if len({*short}) == len({*titles}) else [*titles]


def few_notes(table: Table) -> tuple[str, ...]:
    """The note below a table with intervals from fewer than `FEW` people or other groups."""
    entries = [each for row in table.rows for each in row.values() if isinstance(each, Estimate)]
    if any(each.interval and each.groups and each.groups < FEW for each in entries):
        return (f"With fewer than {FEW} people or groups, an interval says little about others.",)
    return ()


def averaged(
    values: Sequence[float],
    groups: Sequence[str] | None = None,
    form: Form = "number",
) -> Estimate | None:
    """The mean, with a bootstrap interval over groups or else values; None without values."""
    if not values:
        return None
    interval = bootstrap_mean(values, groups)
    number = len(values if groups is None else {*groups})
    return Estimate(math.fsum(values) / len(values), interval, form, number)


def chosen(cells: Iterable[Measured], kind: str) -> list[Measured]:
    """The cells of one kind, in their order."""
    return [cell for cell in cells if cell[0].get("kind") == kind]


def mean(values: Sequence[float]) -> float | None:
    """The mean; None without values."""
    return math.fsum(values) / len(values) if values else None


def percent(value: float | None) -> Estimate | None:
    """A share (0 to 1) shown as a percentage, without an interval; None for None."""
    return None if value is None else Estimate(value, None, "percent")


def slug(text: str) -> str:
    """`text` for use in file names and references; long ones end in a digest."""
    short = re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-.") or "table"
    if len(short) <= 60:
        return short
    return f"{short[:50]}-{hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()[:8]}"


def inert(text: str) -> str:
    """The text, prefixed with an apostrophe if a spreadsheet would read it as a formula."""
    first = unicodedata.normalize("NFKC", text[:1])  # some take wide signs, too
    return f"'{text}" if first and first in "=+-@\t\r\n" else text


def markdown_text(text: str) -> str:
    """`text` on one line, escaped so that Markdown shows it literally."""
    return re.sub(r"([\\`*_\[\]|#!~$])", r"\\\1", html.escape(_line(text), quote=False))


def _key(value: object) -> str:
    return json.dumps(value, sort_keys=True, default=str)


def _value(value: object, *, whole: bool) -> str:
    """A setting in words; of a path the last part, unless it is to be `whole`."""
    if isinstance(value, list | tuple):
        return " > ".join(_value(each, whole=whole) for each in cast("Sequence[object]", value))
    if isinstance(value, str):
        return Path(value).name if os.path.isabs(value) and not whole else value
    return _key(value)


def _hundredths(fraction: float) -> str:
    return f"{100 * fraction:z.1f}"


def _number(value: float) -> str:
    return "<0.001" if 0 < value < 0.0005 else f"{value:z.3f}"


def _line(text: str) -> str:
    return " ".join(terminal_safe(text).plain.split())


def _shown(entry: Entry) -> str:
    if entry is None:
        return "-"
    if isinstance(entry, float):
        return _number(entry)
    return _line(entry) if isinstance(entry, str) else str(entry)
