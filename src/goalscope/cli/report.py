"""`goalscope report`: write results as Markdown with tables and figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from goalscope.base.types import pluralize
from goalscope.cli.options import Json
from goalscope.cli.terminal import say


def report(
    source: Annotated[
        Path, typer.Argument(help="Folder of results, one of its files, or a store with studies.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md", help="File to write.  [default: report.md, or NAME-report.md]"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a summary of results, and a folder with pages, figures (SVG) and tables (CSV).

    With --json, the tables are printed, and files are written only if --out is given.
    """
    from goalscope.report import read_report, write_report

    file = out
    if not (out or as_json):
        name = f"{source.stem}-report.md"
        file = source / "report.md" if source.is_dir() else source.with_name(name)
    found = read_report(source, draw=file is not None)
    said = [f"Left out: {' '.join(why.split())}" for why in found.skipped]
    said += [
        f"{section.name}: {section.done:,} of {section.planned:,} cells measured."
        for section in found.sections
        if section.done < section.planned
    ]
    for line in said:
        say(line, stderr=True)
    if file:
        write_report(found, file)
    if as_json:
        keys = ("name", "title", "commands", "facts", "warnings")
        sections = [
            {key: getattr(section, key) for key in keys}
            | {"tables": [table.to_dict() for table in section.tables]}
            for section in found.sections
        ]
        print(json.dumps(sections, allow_nan=False))
        return
    tables = sum(len(section.tables) for section in found.sections)
    figures = sum(len(section.figures) for section in found.sections)
    say(f"{file}: {pluralize(tables, 'table')}, {pluralize(figures, 'figure')}.")
