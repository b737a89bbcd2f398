"""The part of a report on one file of results: provenance, tables and figures."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from goalscope.base.types import GoalscopeError, InvalidInputError, pluralize
from goalscope.experiment.episodes import DEFAULTS
from goalscope.experiment.results import Cell, Results
from goalscope.experiment.summary import Row, Table, slug
from goalscope.experiment.tables import tables_of, warnings_of
from goalscope.models.opening import model_label
from goalscope.report.figures import Figure, figures_of
from goalscope.study.store import StudyStore
from goalscope.study.summary import study_tables

SHOWN = 5
"""Maximum number of different errors to list."""


@dataclass(frozen=True, slots=True)
class Section:
    """The part of a report on one file.

    `tables` begin with the number of cells. `facts` (what it was made with) and `warnings` are one
    sentence each, `codes` hashes of the code that measured its cells; `done` of the `planned` cells
    have results. The tables of a summary leave out what stands `aside`.
    """

    name: str
    title: str
    provenance: str
    tables: Sequence[Table]
    figures: Sequence[Figure] = ()
    commands: Sequence[str] = ()
    facts: Sequence[str] = ()
    warnings: Sequence[str] = ()
    codes: Sequence[str] = ()
    done: int = 0
    planned: int = 0
    aside: bool = False


def sections_of(source: Path, *, draw: bool = True) -> tuple[list[Section], list[str]]:
    """Read a file of results or of studies, or all files in a folder.

    Files are read from a snapshot in memory, so another process may write meanwhile.

    Args:
        source: The file or folder.
        draw: Whether to draw figures.

    Returns:
        The sections, and why other files of the folder are left out.

    Raises:
        InvalidInputError: There is no such file, or it has no results.
        GoalscopeError: The file cannot be read.
    """
    if not source.exists():
        raise InvalidInputError(
            f"There is no {source}. Name a folder of results, or one of its files."
        )
    sections: list[Section] = []
    skipped: list[str] = []
    taken = {"summary"}
    for file in sorted(source.glob("*.db")) if source.is_dir() else [source]:
        try:
            with Results.in_memory(file) as results:
                section = _section(results, file.stem, taken, draw)
        except GoalscopeError as error:
            if not source.is_dir():
                raise
            skipped.append(str(error))
        except (AttributeError, LookupError, TypeError, ValueError) as error:
            skipped.append(f"{file} has cells of an unknown form: {error!r}.")
        else:
            sections += [section] if section else []
    if not sections:
        why = f" {skipped[0]}" if skipped else ""
        raise InvalidInputError(
            f"{source} has no results.{why} Make some with `goalscope experiment run` or "
            "`goalscope bench`."
        )
    return sections, skipped


def _section(results: Results, stem: str, taken: set[str], draw: bool) -> Section | None:
    about, cells = results.about, results.asked_for()
    name = str(about.get("name") or stem)
    studies = [
        table for study in StudyStore(results).all() for table in study_tables(results, study)
    ]
    if not cells:
        return Section(unique(slug(name), taken), stem, "", studies) if studies else None
    source = about.get("source")
    done = [cell for cell in cells if cell.result is not None]
    failed = Counter(cell.error for cell in cells if cell.result is None and cell.error)
    errors = failed.most_common(SHOWN)
    codes = dict.fromkeys((cell.identity or {}).get("code", "") for cell in done)
    return Section(
        unique(slug(name), taken),
        str(about.get("title") or name),
        str(about.get("provenance") or ""),
        [_progress(cells), *tables_of(cells), *studies],
        tuple(figures_of(cells)) if draw else (),
        results.commands(cells),
        [*([f"source in the paper: {source}"] if source else []), *_facts(done)],
        [*warnings_of(cells), *(f"{n} of them: {error}" for error, n in errors)],
        [*filter(None, codes)],
        len(done),
        len(cells),
        about.get("aside") is True,
    )


def _progress(cells: Sequence[Cell]) -> Table:
    """The number of cells of each kind, and their outcomes."""
    rows: list[Row] = []
    for kind in dict.fromkeys(str(cell.spec["kind"]) for cell in cells):
        own = [cell for cell in cells if cell.spec["kind"] == kind]
        done = sum(cell.result is not None for cell in own)
        failed = sum(cell.result is None and cell.error is not None for cell in own)
        rows.append({
            "kind": kind, "planned": len(own), "done": done, "failed": failed,
            "missing": len(own) - done - failed, "retried": sum(c.attempts > 1 for c in own),
        })  # fmt: skip
    return Table("cells", "What was measured", rows)


def _facts(done: Sequence[Cell]) -> Iterator[str]:
    """Models, seeds, layouts and other settings, and the hashes of what they were measured with."""
    models = dict.fromkeys(model_label(cell.spec["model"]) for cell in done)
    if models:
        yield f"models: {'; '.join(models)}"
    settings = [
        {**cell.spec, **(DEFAULTS if own else {}), **own}
        for cell in done
        for own in (cell.spec.get("settings", {}),)
    ]
    for key in ("domain", "human", "likelihood", "layout", "calibration", "propose",
                "k", "prompted", "rounds", "turns", "seed", "trials"):  # fmt: skip
        values = dict.fromkeys(_text(each[key]) for each in settings if key in each)
        if values.keys() - {"null"}:
            joint = "; " if key == "prompted" else ", "
            yield f"{key.replace('_', ' ')}: {joint.join(values)}"
    identities = Counter(json.dumps(cell.identity, sort_keys=True) for cell in done)
    for identity, n in identities.items():
        found: dict[str, str] = json.loads(identity) or {}
        order = sorted(found, key=lambda key: (key not in ("version", "code", "prompts"), key))
        with_ = ", ".join(f"{key} {found[key]}" for key in order)
        yield f"measured with ({pluralize(n, 'cell')}): {with_}"


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_text, cast("Sequence[object]", value))) or "none"
    return value if isinstance(value, str) else json.dumps(value)


def unique(name: str, taken: set[str]) -> str:
    """`name`, with a number if it is taken."""
    n, found = 1, name
    while found.lower() in taken:  # some disks do not tell capitals apart
        n, found = n + 1, f"{name}-{n + 1}"
    taken.add(found.lower())
    return found
