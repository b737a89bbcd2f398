"""A report as a page that stands by itself, and as documents of tables."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from goalscope.experiment.summary import Estimate, Table, markdown_text
from goalscope.report.drawing import clean
from goalscope.report.figures import Figure
from goalscope.report.sections import Section

__all__ = ["markdown", "page", "part_markdown"]

OPEN = 4
"""So many grouped figures of a section are shown at once; more are folded away by group."""


def page(sections: Sequence[Section], summary: Sequence[Table], skipped: Sequence[str]) -> str:
    """HTML with its style and its pictures inside; it asks for nothing else."""
    rows = [
        {
            "section": section,
            "tables": [_grid(table) for table in section.tables],
            "figures": [_shown(each) for each in section.figures if not each.group],
            "groups": _groups(section),
        }
        for section in sections
    ]
    head = [_grid(table) for table in summary]
    return _template().render(sections=rows, summary=head, skipped=skipped)


def markdown(summary: Sequence[Table], skipped: Sequence[str], folder: str) -> str:
    """The summary; the first column of each table leads to a part's page in the folder."""
    parts = ["# Results", INTRODUCTION]
    parts += [f"Left out: {markdown_text(why)}" for why in skipped]
    for table in summary:
        lines = _markdown(table).splitlines()
        for i, (name, *_) in enumerate(table.rows, 4):  # after the title and the headings
            first = f"| {markdown_text(str(name))} |"
            link = f"| [{first[2:-2]}]({quote(folder)}/{quote(str(name))}.md) |"
            lines[i] = lines[i].replace(first, link, 1)
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def part_markdown(section: Section, back: str) -> str:
    """All tables of a part, with a link back to the summary."""
    parts = [f"# {markdown_text(section.title)}", f"[All results](../{quote(back)})"]
    parts.append("\n".join(f"> * {markdown_text(warning)}" for warning in section.warnings))
    facts = [("source in the paper", section.source), *section.facts]
    parts.append("\n".join(
        f"* {markdown_text(name)}: {markdown_text(value)}" for name, value in facts if value
    ))  # fmt: skip
    for command in section.command.splitlines():
        fenced = Table("", "", (), (), (), command).to_markdown()
        parts.append(fenced[fenced.index("Made by") :].strip())
    for table in section.tables:
        parts.append(f'<a id="{table.name}"></a>\n\n{_markdown(replace(table, command=""))}')
    return "\n\n".join(part for part in parts if part) + "\n"


def _markdown(table: Table) -> str:
    """A table below the title of a page."""
    return table.to_markdown().strip().removeprefix("#")


INTRODUCTION = (
    "What agents that infer people's goals believed, did and achieved. Made by `goalscope report`: "
    "every figure is computed from cells that were each measured once. Brackets hold 95 % "
    "intervals. Each part has a page with all of its tables, the "
    "command that makes them again, and hashes of the code, the prompts and the model weights."
)


@cache
def _template() -> Template:
    # Not called *.jinja: those are the prompts, whose hash is a part of what results are of.
    text = files("goalscope.report").joinpath("page.html").read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_harmless,
    )
    return environment.from_string(text)


def _harmless(value: Any) -> Any:
    """What a template prints, without characters that reorder or break the page."""
    return clean(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _grid(table: Table) -> dict[str, Any]:
    words = [any(isinstance(row[i], str) for row in table.rows) for i in range(len(table.columns))]
    rows: list[list[tuple[str, str]]] = []
    for row, texts in zip(table.rows, table.text_rows(), strict=True):
        line: list[tuple[str, str]] = []
        for entry, text in zip(row, texts, strict=True):
            value, _, interval = (
                text.partition(" [") if isinstance(entry, Estimate) else (text, "", "")
            )
            line.append((value, f"[{interval}" if interval else ""))
        rows.append(line)
    return {"table": table, "columns": list(zip(table.columns, words, strict=True)),
            "rows": rows, "words": words}  # fmt: skip


def _groups(section: Section) -> list[dict[str, Any]]:
    """Grouped figures, and whether each group is open at first."""
    grouped = [figure for figure in section.figures if figure.group]
    shown = len(grouped) <= OPEN
    return [
        {"name": name, "open": shown, "figures": [_shown(figure) for figure in members]}
        for name, members in itertools.groupby(grouped, key=lambda figure: figure.group)
    ]


def _shown(figure: Figure) -> dict[str, Any]:
    # The picture is ours: made by Matplotlib, which escapes text, and written anew by minidom.
    return {"figure": figure, "svg": Markup(figure.drawing.svg)}
