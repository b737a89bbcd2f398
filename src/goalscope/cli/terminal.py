"""Consoles, tables, progress bars and model loading for the commands."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from goalscope.base.text import terminal_safe

if TYPE_CHECKING:
    from rich.console import Console
    from rich.status import Status
    from rich.table import Table as Grid

    from goalscope.agent.settings import Settings
    from goalscope.experiment.summary import Table
    from goalscope.models.opening import ModelKey, ModelSet


LINES = 30.0
"""Minimum seconds between two lines of progress without a bar."""


def console(*, stderr: bool = False) -> Console:
    """A console that prints text as it is, without markup, emoji or highlighting."""
    from rich.console import Console

    return Console(stderr=stderr, highlight=False, markup=False, emoji=False)


def say(text: str, style: str = "", *, stderr: bool = False) -> None:
    """Print a text, which may be anybody's, without breaking its lines."""
    console(stderr=stderr).print(terminal_safe(text, style), soft_wrap=True)


def spinner(out: Console, words: str) -> Status:
    """A spinner above which `out` can print; on standard error if `out` is not a terminal.

    Files and pipes never get one, even if FORCE_COLOR makes rich treat them as a terminal.
    """
    return (out if out.file.isatty() else console(stderr=True)).status(words)


@contextmanager
def progress(what: str) -> Generator[Callable[[int, int], None]]:
    """A progress bar; yields a function that takes the number done and the total.

    If standard error is not a terminal, it prints a line now and then.
    """
    from rich import progress as bars

    columns = (
        bars.TextColumn("{task.description}", markup=False),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TimeElapsedColumn(),
        bars.TextColumn("left:"),
        bars.TimeRemainingColumn(),
    )
    out = console(stderr=True)
    hidden = not out.is_terminal
    with bars.Progress(*columns, console=out, speed_estimate_period=600, disable=hidden) as bar:
        task, last = bar.add_task(what, total=None), time.monotonic()

        def show(done: int, total: int) -> None:
            nonlocal last
            bar.update(task, completed=done, total=total)
            if hidden and done and time.monotonic() >= last + LINES:
                last = time.monotonic()
                say(f"{what}: {done:,} of {total:,}", stderr=True)

        yield show


def show_tables(tables: Sequence[Table], as_json: bool) -> None:
    """Print tables, each followed by those of its notes that were not printed before.

    Tables by turn show only the last turn. Tables that are too wide are split into parts, each with
    the columns that name the rows.
    """
    from rich.padding import Padding

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


def loading() -> Status:
    """A spinner on standard error while a model is loaded."""
    return console(stderr=True).status("Loading the model")


@contextmanager
def opened_model(names: Mapping[ModelKey, str | None]) -> Generator[ModelSet]:
    """Open a model by its `model_names`, close it at the end, and print the usage of servers."""
    from goalscope.models.opening import open_model

    with loading():
        engine = open_model(**names)
    try:
        yield engine
    finally:
        engine.close()
        servers = [getattr(part, "server", None) for part in (engine.generator, engine.scorer)]
        for server in dict.fromkeys(filter(None, servers)):
            if server.usage:
                say(f"{server.url}: {server.describe_usage()}", "dim", stderr=True)


def settings_model(settings: Settings) -> AbstractContextManager[ModelSet]:
    """Open the model named by an episode's settings; see `opened_model`."""
    from goalscope.models.opening import MODEL_KEYS

    return opened_model({key: getattr(settings, key) for key in MODEL_KEYS})


def model_names(
    model: str | None = None,
    generator: str | None = None,
    scorer: str | None = None,
    tokenizer: str | None = None,
    adapter: str | None = None,
) -> dict[ModelKey, str | None]:
    """The arguments of `open_model` from the options, valid from any folder.

    Files and folders become full paths; any other tokenizer is a name on the hub.
    """
    from goalscope.models.adapters import NO_ADAPTER

    return {
        "model": _model_path(model),
        "generator": _model_path(generator),
        "scorer": _model_path(scorer),
        "tokenizer": _full_path(tokenizer),
        "adapter": str(Path(adapter).absolute()) if adapter and adapter != NO_ADAPTER else adapter,
    }


def _full_path(name: str | None) -> str | None:
    """The full path of an existing file or folder; anything else unchanged."""
    return str(Path(name).absolute()) if name and Path(name).exists() else name


def _model_path(model: str | None) -> str | None:
    if model is None or model.startswith(("http://", "https://")):
        return model
    if model.startswith("hf:"):
        return f"hf:{_full_path(model.removeprefix('hf:'))}"
    return str(Path(model).absolute())
