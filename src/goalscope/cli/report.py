"""`goalscope report`: what was measured, as a page, figures and tables."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from goalscope.cli.options import Json
from goalscope.types import counted

__all__ = ["report"]


def report(
    source: Annotated[
        Path, typer.Argument(help="Folder of results, one file of it, or a file of episodes.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder to write into.  [default: report, or FILE-report]"
        ),
    ] = None,
    markdown: Annotated[
        Path | None,
        typer.Option(metavar="FILE.md", help="Also the summary, and all tables in FILE/."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Make a page of results, which stands by itself: report.html, with figures and tables.

    With --json the tables are printed, and a page is only made if --out names its folder.
    """
    from goalscope.plain import plain
    from goalscope.report import read_report, write_markdown, write_report
    from goalscope.report.overview import counts

    folder = out or (None if as_json else _beside(source))
    found = read_report(source, draw=folder is not None)
    for why in found.skipped:
        typer.echo(plain(f"Left out: {' '.join(why.split())}").plain, err=True)
    for section in found.sections:
        done, planned = counts(section)
        if done < planned:
            said = f"{section.name}: {done:,} of {planned:,} cells are measured."
            typer.echo(plain(said).plain, err=True)
    if markdown:
        write_markdown(found, markdown)
    page = write_report(found, folder) if folder else None
    if as_json:
        sections = [
            {
                "name": section.name,
                "title": section.title,
                "source": section.source,
                "command": section.command,
                "warnings": list(section.warnings),
                "tables": [table.to_dict() for table in section.tables],
            }
            for section in found.sections
        ]
        print(json.dumps(sections, allow_nan=False))
        return
    tables = sum(len(section.tables) for section in found.sections)
    figures = sum(len(section.figures) for section in found.sections)
    typer.echo(plain(f"{page}: {counted(tables, 'table')}, {counted(figures, 'figure')}.").plain)
    if markdown:
        typer.echo(
            plain(f"{markdown}: the summary; all tables in {markdown.with_suffix('')}.").plain
        )


def _beside(source: Path) -> Path:
    return source / "report" if source.is_dir() else source.with_name(f"{source.stem}-report")
