"""A report as a page that stands by itself, and as one document of tables."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from goalscope.experiment.summary import Estimate, Table, markdown_text
from goalscope.report.drawing import clean
from goalscope.report.figures import Figure
from goalscope.report.sections import Section

__all__ = ["markdown", "page"]

OPEN = 4
"""So many grouped figures of a section are shown at once; more are folded away by group."""


def page(sections: Sequence[Section], skipped: Sequence[str]) -> str:
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
    return _template().render(sections=rows, skipped=skipped)


def markdown(sections: Sequence[Section], skipped: Sequence[str]) -> str:
    """All tables, with a table of contents."""
    parts = ["# Results", INTRODUCTION]
    parts.append("\n".join(
        f"* [{markdown_text(section.title)}](#{section.name})" + "".join(
            f"\n    * [{markdown_text(table.title)}](#{table.name})" for table in section.tables
        )
        for section in sections
    ))  # fmt: skip
    parts += [f"Left out: {markdown_text(why)}" for why in skipped]
    for section in sections:
        parts.append(f'<a id="{section.name}"></a>\n\n## {markdown_text(section.title)}')
        facts = [("source in the paper", section.source), *section.facts]
        parts.append("\n".join(
            f"* {markdown_text(name)}: {markdown_text(value)}" for name, value in facts if value
        ))  # fmt: skip
        parts += [f"**{markdown_text(warning)}**" for warning in section.warnings]
        for command in section.command.splitlines():
            fenced = Table("", "", (), (), (), command).to_markdown()
            parts.append(fenced[fenced.index("Made by") :].strip())
        for table in section.tables:
            text = replace(table, command="").to_markdown().strip()
            parts.append(f'<a id="{table.name}"></a>\n\n{text}')
    return "\n\n".join(part for part in parts if part) + "\n"


INTRODUCTION = (
    "Made by `goalscope report` from files of results; every figure in it is computed from cells "
    "that were each measured once. Each part names the command that makes its results again, and "
    "hashes of the code, the prompts and the model weights that they were measured with. Brackets "
    "hold 95 % intervals, unless a note says what else."
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
