"""Results as a page, figures and tables that stand by themselves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from goalscope.experiment.summary import Table
from goalscope.report.overview import summary_of
from goalscope.report.page import markdown, page, part_markdown
from goalscope.report.sections import Section, sections_of
from goalscope.types import InvalidInputError

__all__ = ["Report", "Section", "read_report", "write_markdown", "write_report"]


@dataclass(frozen=True, slots=True)
class Report:
    """What is reported of files of results.

    Attributes:
        sections: One for each file.
        summary: The rows of their tables that tell most; the first column names the section.
        skipped: Why other files of the folder are not among them.
    """

    sections: tuple[Section, ...]
    summary: tuple[Table, ...]
    skipped: tuple[str, ...]


def read_report(source: Path, *, draw: bool = True) -> Report:
    """What is to be reported of a file of results or of episodes, or of all in a folder.

    Args:
        source: The file or folder; another process may write to it.
        draw: Whether figures are made.

    Raises:
        InvalidInputError: There is no such file, or no results are in it.
        GoalscopeError: The file cannot be read, or packages are missing.
    """
    sections, skipped = sections_of(source, draw=draw)
    return Report(tuple(sections), summary_of(sections), tuple(skipped))


def write_report(report: Report, out: Path) -> Path:
    """Write the page, and beside it `figures/` (SVG, PNG) and `tables/` (CSV, LaTeX).

    The same results give the same bytes.

    Args:
        report: What is reported.
        out: The folder, which may exist.

    Returns:
        The page.

    Raises:
        InvalidInputError: The folder cannot be written.
    """
    target = out / "report.html"
    for section in report.sections:
        for figure in section.figures:
            _write(out / "figures" / f"{figure.name}.svg", figure.drawing.svg)
            _write(out / "figures" / f"{figure.name}.png", figure.drawing.png)
    for table in (*report.summary, *(each for part in report.sections for each in part.tables)):
        _write(out / "tables" / f"{table.name}.csv", table.to_csv())
        _write(out / "tables" / f"{table.name}.tex", table.to_latex())
    _write(target, page(report.sections, report.summary, report.skipped))
    return target


def write_markdown(report: Report, file: Path) -> None:
    """Write the summary, and all tables as a document for each part in a folder of its name.

    Raises:
        InvalidInputError: The file cannot be written.
    """
    folder = file.with_suffix("")
    for section in report.sections:
        _write(folder / f"{section.name}.md", part_markdown(section, file.name))
    _write(file, markdown(report.summary, report.skipped, folder.name))


def _write(file: Path, content: str | bytes) -> None:
    data = content.encode("utf-8", "replace") if isinstance(content, str) else content
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(data)
    except OSError as error:
        raise InvalidInputError(
            f"{file} cannot be written: {error.strerror or error}. Name another place."
        ) from None
