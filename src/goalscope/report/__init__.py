"""Reports: results as Markdown pages with figures (SVG), and tables as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from goalscope.base.types import InvalidInputError, pluralize
from goalscope.experiment.summary import Table, markdown_text
from goalscope.report.overview import summary_of
from goalscope.report.sections import Section, sections_of, unique

__all__ = ["Report", "Section", "read_report", "write_report"]

INTRODUCTION = (
    "Beliefs, actions and outcomes of agents that infer people's goals. `goalscope report` "
    "computes every figure from cells that were each measured once. Brackets show 95 % "
    "intervals. It also writes a page for each part, with all tables and figures, and hashes of "
    "the code, the prompts and the model weights. The command of a part gives the same figures "
    "again, on any x86-64 processor and with any number of threads."
)
HEADLINE = "ablation"
"""The figure that the summary shows; its caption is on the page of its part."""


@dataclass(frozen=True, slots=True)
class Report:
    """The report on one or more files of results.

    Attributes:
        sections: One per file.
        summary: The most informative rows of their tables; the first column names the section.
        skipped: Why other files of the folder are left out.
    """

    sections: Sequence[Section]
    summary: Sequence[Table]
    skipped: Sequence[str]


def read_report(source: Path, *, draw: bool = True) -> Report:
    """Read a report from a file of results or of studies, or from all files in a folder.

    Args:
        source: The file or folder; another process may be writing to it.
        draw: Whether to draw figures.

    Raises:
        InvalidInputError: There is no such file, or it has no results.
        GoalscopeError: The file cannot be read, or packages are missing.
    """
    sections, skipped = sections_of(source, draw=draw)
    return Report(sections, summary_of(sections), skipped)


def write_report(report: Report, file: Path) -> None:
    """Write the summary, and a folder of the same name with a page per part, figures and tables.

    The same results give the same bytes.

    Args:
        report: The report.
        file: File of the summary; it must end in `.md`.

    Raises:
        InvalidInputError: It ends otherwise.
        OSError: It cannot be written.
    """
    if file.suffix != ".md":
        raise InvalidInputError(f"The report is Markdown, so {file} must end in .md.")
    folder, taken = file.with_suffix(""), set[str]()
    for table in report.summary:
        _write(folder / "tables" / f"{table.name}.csv", table.to_csv())
    headlines: list[str] = []
    for section in report.sections:
        figures: list[str] = []
        for figure in section.figures:
            name = unique(f"{section.name}-{figure.name}", taken)
            _write(folder / "figures" / f"{name}.svg", figure.svg)
            alt, caption = map(markdown_text, (figure.caption.partition(". ")[0], figure.caption))
            figures.append(f"![{alt}](figures/{quote(name)}.svg)\n\n{caption}")
            if figure.name == HEADLINE and not section.aside:
                where = f"{quote(folder.name)}/figures/{quote(name)}.svg"
                headlines.append(f"## {markdown_text(section.title)}\n\n![{alt}]({where})")
        for table in section.tables:
            name = unique(f"{section.name}-{table.name}", taken)
            _write(folder / "tables" / f"{name}.csv", table.to_csv())
        _write(folder / f"{section.name}.md", _page(section, figures, file.name))
    parts = ["# Results", INTRODUCTION]
    parts += [f"Left out: {markdown_text(why)}" for why in report.skipped]
    parts += [*(table.to_markdown().strip() for table in report.summary), *headlines, "## Parts"]
    parts += ["\n".join(_part(section, quote(folder.name)) for section in report.sections)]
    _write(file, "\n\n".join(parts) + "\n")


def _part(section: Section, folder: str) -> str:
    """A line on a part with a link to its page: who spoke, and how it was measured."""
    told = [f"* [{markdown_text(section.title)}]({folder}/{section.name}.md)"]
    told += [f"(`{section.name}`)."] if section.title != section.name else []
    told += [markdown_text(section.provenance)] if section.provenance else []
    if section.planned:
        facts = [f"{section.done:,} of {pluralize(section.planned, 'cell')} measured"]
        facts += [f"by {markdown_text(' or '.join(section.commands))}"] * bool(section.commands)
        facts += [f"with code {', '.join(code[:6] for code in section.codes)}"] * bool(
            section.codes
        )
        told += [f"{', '.join(facts)}."]
    return " ".join(told)


def _page(section: Section, figures: Sequence[str], back: str) -> str:
    """All tables and figures of a part, with a link back to the summary."""
    parts = [f"# {markdown_text(section.title)}", f"[All results](../{quote(back)})"]
    parts.append(markdown_text(section.provenance))
    parts.append("\n".join(f"> * {markdown_text(warning)}" for warning in section.warnings))
    parts.append("\n".join(f"* {markdown_text(fact)}" for fact in section.facts))
    parts += [f"Made by: {markdown_text(command)}" for command in section.commands]
    parts += [*figures, *(table.to_markdown().strip() for table in section.tables)]
    return "\n\n".join(filter(None, parts)) + "\n"


def _write(file: Path, content: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content.encode("utf-8", "replace"))
