"""Print tables on the terminal or as JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from goalscope.cli.terminal import console

if TYPE_CHECKING:
    from rich.table import Table as Grid

    from goalscope.experiment.summary import Table


def show_tables(tables: Sequence[Table], as_json: bool) -> None:
    """Print tables, each followed by those of its notes that were not printed before.

    Tables by turn show only the last turn. Tables that are too wide are split into parts, each with
    the columns that name the rows.
    """
    from rich.padding import Padding

    from goalscope.base.text import terminal_safe

    if as_json:
        print(json.dumps([table.to_dict() for table in tables], allow_nan=False))
        return
    out, said = console(), set[str]()
    for full in tables:
        last = [row for row in full.rows if row.get("turn") == "last"]
        table = replace(full, rows=last or full.rows)
        title = terminal_safe(table.title)
        for grid in _grids(table, out.width):
            grid.title, title = title, None
            out.print(grid)
        for note in dict.fromkeys(table.notes):
            if note not in said:
                out.print(Padding.indent(terminal_safe(note, "dim"), 2))
        said.update(table.notes)
        out.print()


def _grids(table: Table, room: int) -> Iterator[Grid]:
    """Split the columns over grids so that no figure is broken."""
    from rich.box import SIMPLE_HEAD
    from rich.cells import cell_len
    from rich.table import Table as Grid

    from goalscope.base.text import terminal_safe

    columns = [*zip(*table.texts(), strict=True)]
    words = table.worded
    names = max(words.index(False), 1) if False in words else 1
    needs = [
        max(
            cell_len(text)
            if re.match(r"[-<\d]", text)
            else min(24, max(map(cell_len, text.split()), default=0))
            for text in column
        )
        for column in columns
    ]
    parts = [[*range(names)]]
    for number in range(names, len(columns)):
        if len(parts[-1]) > names and sum(needs[i] + 2 for i in (*parts[-1], number)) > room:
            parts.append([*range(names)])
        parts[-1].append(number)
    for part in parts:
        spare = max(0, room - sum(needs[i] + 2 for i in part))
        grid = Grid(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False, title_justify="left")
        for number in part:
            more = min(max(map(cell_len, columns[number])) - needs[number], spare)
            spare -= more
            heading = terminal_safe(columns[number][0])
            grid.add_column(heading, width=needs[number] + more, overflow="fold")
        for line in zip(*(columns[number][1:] for number in part), strict=True):
            grid.add_row(*map(terminal_safe, line))
        yield grid
