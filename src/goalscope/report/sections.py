"""What a report says of each file of results: how it was made, its tables, its figures."""

from __future__ import annotations

import json
import sqlite3
import tempfile
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from goalscope.database.errors import explained
from goalscope.experiment.results import Cell, Results
from goalscope.experiment.summary import Entry, Estimate, Table, slug
from goalscope.experiment.summary_beliefs import belief_table
from goalscope.experiment.summary_changes import read_changes
from goalscope.experiment.summary_dialogues import read_dialogues
from goalscope.experiment.summary_episodes import read_episodes
from goalscope.experiment.tables import first_attempts, tables_of, warnings_of
from goalscope.models.opening import model_label
from goalscope.plain import model_shown
from goalscope.report.figures import (
    Figure,
    accuracy_figure,
    belief_figure,
    calibration_figure,
    change_figure,
    mcq_figure,
    methods_figure,
)
from goalscope.study.book import Book
from goalscope.study.summary import study_tables
from goalscope.types import GoalscopeError, InvalidInputError, counted

__all__ = ["Section", "incomplete", "sections_of"]

SHOWN = 5
"""Different errors that are shown."""


@dataclass(frozen=True, slots=True)
class Section:
    """What a report says of one file.

    Attributes:
        name: For files and references.
        title: Of the experiment.
        source: What of the paper it reproduces; empty if nothing.
        command: What made it, one command a line; empty if that is not known.
        facts: What it was made with, by name.
        warnings: What one must know before one trusts a figure, a sentence each.
        tables: How many cells there are; then what came of them.
        figures: In the order in which they are shown.
        codes: Hashes of the code that its cells were measured with.
    """

    name: str
    title: str
    source: str
    command: str
    facts: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    tables: tuple[Table, ...]
    figures: tuple[Figure, ...]
    codes: tuple[str, ...] = ()


def sections_of(source: Path, *, draw: bool = True) -> tuple[list[Section], list[str]]:
    """Read a file of results or of episodes, or all of a folder.

    Files are copied as they are at one moment, so that another process may write meanwhile.

    Args:
        source: The file or folder.
        draw: Whether figures are made.

    Returns:
        The sections, and why files of a folder are not among them.

    Raises:
        InvalidInputError: There is no such file, or no results are in it.
        GoalscopeError: The file cannot be read.
    """
    if not source.exists():
        raise InvalidInputError(f"There is no {source}. Name a folder of results, or a file of it.")
    alone = not source.is_dir()
    files = [source] if alone else sorted(source.glob("*.db"))
    sections: list[Section] = []
    skipped: list[str] = []
    dialogues: list[Cell] = []
    taken = {"summary"}
    for file in files:
        try:
            with _copied(file) as results:
                name = _unique(slug(str(results.about.get("name") or file.stem)), taken)
                section = _section(results, name, file.stem, draw)
                asked = results.asked_for()
                dialogues += [cell for cell in asked if cell.spec.get("kind") == "dialogue"]
        except GoalscopeError as error:
            if alone:
                raise
            skipped.append(str(error))
            continue
        except (LookupError, TypeError, ValueError) as error:
            skipped.append(f"{file} holds cells of a form that is unknown here: {error!r}.")
            continue
        if section is not None:
            sections.append(section)
    if not sections:
        why = f" {skipped[0]}" if skipped else ""
        raise InvalidInputError(
            f"{source} holds no results.{why} Make some with `goalscope experiment run` or `bench`."
        )
    done = [cell for cell in dialogues if cell.result]
    if (beliefs := belief_table((cell.spec, cell.result or {}) for cell in done)).rows:
        name = _unique("beliefs", taken)
        tables = _named([_progress(dialogues), beliefs], name)
        about = (tuple(_facts(done)), tuple(_warnings(dialogues)), tables, (), _codes(done))
        sections.insert(0, Section(name, "Beliefs before and after", "", "", *about))
    return sections, skipped


@contextmanager
def _copied(file: Path) -> Generator[Results]:
    """A file's results as they are now, in a file of their own.

    It is only read, but opened for writing where that is allowed: else SQLite could not take away
    the journal files that it makes beside it.
    """
    with tempfile.TemporaryDirectory(prefix="goalscope-") as folder:
        copy = Path(folder) / "copy.db"
        with explained(file):
            uri = f"{file.absolute().as_uri()}?mode=rw"
            with (
                closing(sqlite3.connect(uri, uri=True, timeout=10)) as there,
                closing(sqlite3.connect(copy)) as here,
            ):
                there.backup(here)
        try:
            results = Results.open(copy)
        except GoalscopeError as error:
            raise type(error)(str(error).replace(str(copy), str(file))) from None
        with results:
            yield results


def _section(results: Results, name: str, stem: str, draw: bool) -> Section | None:
    cells = results.asked_for()
    if not cells:
        return _episodes_alone(results, name, stem, draw)
    about = results.about
    done = [cell for cell in cells if cell.result is not None]
    tables = [_progress(cells), *tables_of(results), *first_attempts(results), *_studies(results)]
    return Section(
        name,
        str(about.get("title") or about.get("name") or stem),
        str(about.get("source", "")),
        "\n".join(results.commands(cells)),
        tuple(_facts(done)),
        tuple(_warnings(cells)),
        _named(tables, name),
        tuple(_figures(results, name, done, tables)) if draw else (),
        _codes(done),
    )


def _episodes_alone(results: Results, name: str, stem: str, draw: bool) -> Section | None:
    """A section of episodes that belong to no experiment."""
    episodes = results.episodes()
    if not episodes:
        return None
    columns = ("episode", "begun", "domain", "profile", "method", "model", "rounds", "ended")
    rows: list[tuple[Entry, ...]] = []
    figures: list[Figure] = []
    taken: set[str] = set()
    for info in episodes:
        score = None if info.score is None else Estimate(info.score, None, "percent")
        who = info.profile or "a person"
        head = (info.id, info.created, info.domain, who, info.method, model_shown(info.model))
        rows.append((*head, info.rounds, info.ended or "goes on", score))
        if draw:
            label = f"{who}, {info.method} ({info.domain}, episode {info.id})"
            own = _unique(slug(f"{name}-belief-{who}-{info.method}-{info.id}"), taken)
            figure = belief_figure(own, label, results.rounds(info.id), who)
            figures += [figure] if figure else []
    table = Table("episodes", "Episodes", (*columns, "score"), tuple(rows))
    tables = _named([table, *_studies(results)], name)
    return Section(name, stem, "", "", (), (), tables, tuple(figures))


def _studies(results: Results) -> Iterator[Table]:
    """What people said of the episodes."""
    for study in Book(results).all():
        yield from study_tables(results, study)


def _named(tables: Sequence[Table], section: str) -> tuple[Table, ...]:
    """The tables under names that no other section has."""
    taken: set[str] = set()
    return tuple(replace(table, name=_unique(f"{section}-{table.name}", taken)) for table in tables)


def _progress(cells: Sequence[Cell]) -> Table:
    """How many cells of each kind there are, and what became of them."""
    rows: list[tuple[Entry, ...]] = []
    for kind in dict.fromkeys(str(cell.spec["kind"]) for cell in cells):
        own = [cell for cell in cells if cell.spec["kind"] == kind]
        done = sum(cell.result is not None for cell in own)
        failed = sum(cell.result is None and cell.error is not None for cell in own)
        retried = sum(cell.attempts > 1 for cell in own)
        rows.append((kind, len(own), done, failed, len(own) - done - failed, retried))
    columns = ("kind", "planned", "done", "failed", "missing", "retried")
    return Table("cells", "What was measured", columns, tuple(rows))


def _facts(done: Sequence[Cell]) -> Iterator[tuple[str, str]]:
    """Models, seeds, layouts and the like; and the hashes of what they were measured with."""
    models = dict.fromkeys(model_label(cell.spec["model"]) for cell in done)
    if models:
        yield "models", "; ".join(models)
    settings = [{**cell.spec, **cell.spec.get("settings", {})} for cell in done]
    for key in ("domain", "human", "layout", "calibration", "end_of_turn", "rounds",
                "seed", "trials"):  # fmt: skip
        values = dict.fromkeys(_text(each[key]) for each in settings if key in each)
        if values:
            yield key.replace("_", " "), ", ".join(values)
    for identity, n in _identities(done).items():
        what = (
            f"measured with ({counted(n, 'cell')})"
            if len(_identities(done)) > 1
            else "measured with"
        )
        found: dict[str, str] = json.loads(identity)
        first = [key for key in ("version", "code", "prompts") if key in found]
        order = [*first, *(key for key in found if key not in first)]
        yield what, ", ".join(f"{key} {found[key]}" for key in order)


def incomplete(counts: Mapping[str, tuple[int, int]]) -> Iterator[str]:
    """A sentence that says what is complete and what is not; none where all is.

    Args:
        counts: How many cells were planned, and how many measured, by what they measure.
    """
    parts = [
        f"{what} ({done:,} of {planned:,})"
        for what, (planned, done) in counts.items()
        if done < planned
    ]
    if parts:
        yield f"Complete, except for: {'; '.join(parts)}."


def _subject(spec: Mapping[str, Any]) -> str:
    """What a cell measures, in a few words: its kind, where, and the model that acts."""
    runs = [*spec["of"]] if spec["kind"] == "compare" else [spec.get("of", spec)]
    run: Mapping[str, Any] = runs[0]
    where = run.get("set") or run.get("settings", {}).get("domain")
    return ", ".join(filter(None, (str(spec["kind"]), where, model_label(run["model"]))))


def _identities(done: Sequence[Cell]) -> Counter[str]:
    return Counter(json.dumps(cell.identity, sort_keys=True) for cell in done if cell.identity)


def _codes(done: Sequence[Cell]) -> tuple[str, ...]:
    codes = (cell.identity.get("code") for cell in done if cell.identity)
    return tuple(dict.fromkeys(code for code in codes if code))


def _warnings(cells: Sequence[Cell]) -> Iterator[str]:
    counts: dict[str, tuple[int, int]] = {}
    for cell in cells:
        label = _subject(cell.spec)
        planned, done = counts.get(label, (0, 0))
        counts[label] = planned + 1, done + (cell.result is not None)
    yield from incomplete(counts)
    yield from warnings_of(cells)
    failed = [cell for cell in cells if cell.result is None and cell.error]
    for error, n in Counter(cell.error for cell in failed).most_common(SHOWN):
        yield f"{n} of them: {error}"


def _figures(
    results: Results, name: str, done: Sequence[Cell], tables: Sequence[Table]
) -> Iterator[Figure]:
    cells = [(cell.spec, cell.result or {}) for cell in done]
    taken: set[str] = set()

    def unique(what: str) -> str:
        return _unique(slug(f"{name}-{what}"), taken)

    for table in tables:
        if table.name == "mcq":
            yield from _made(mcq_figure(unique("accuracy"), table))
    for dialogues in read_dialogues(cells):
        what = "-".join(p for p in (dialogues.set, dialogues.split, dialogues.goal_set,
                                    dialogues.model) if p)  # fmt: skip
        yield from _made(accuracy_figure(unique(f"turns-{what}"), dialogues))
        yield from _made(calibration_figure(unique(f"calibration-{what}"), dialogues))
    for changes in read_changes(cells):
        what = f"change-{changes.set}-{changes.split}-{changes.model}"
        yield change_figure(unique(what), changes)
    for episodes in read_episodes(cells):
        what = f"methods-{episodes.domain}-{episodes.human}-{episodes.model}"
        yield methods_figure(unique(what), episodes)
    yield from _beliefs(results, done, unique)


def _beliefs(
    results: Results, done: Sequence[Cell], unique: Callable[[str], str]
) -> Iterator[Figure]:
    """The belief of each episode, the episodes of one person together."""
    own = [cell for cell in done if cell.spec["kind"] == "episode"]
    runs = [{**cell.spec["settings"], "model": model_label(cell.spec["model"])} for cell in own]
    differ = [
        key
        for key in dict.fromkeys(key for run in runs for key in run)
        if len({_text(run.get(key)) for run in runs}) > 1 and key != "method"
    ]
    order = sorted(range(len(own)), key=lambda i: str(own[i].spec["profile"]))
    for cell, run in ((own[i], runs[i]) for i in order):
        profile, result = str(cell.spec["profile"]), cell.result or {}
        parts = [profile, str(run["method"]), *(f"{key} {_text(run.get(key))}" for key in differ)]
        label = f"{', '.join(parts)}; score {100 * result['score']:.0f} %"
        rounds = results.rounds(result["episode"])
        yield from _made(belief_figure(unique("belief-" + "-".join(parts)), label, rounds, profile))


def _made(figure: Figure | None) -> list[Figure]:
    return [figure] if figure else []


def _text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _unique(name: str, taken: set[str]) -> str:
    """`name`, with a number if another has it."""
    n, found = 1, name
    while found.lower() in taken:  # some disks do not tell capitals apart
        n, found = n + 1, f"{name}-{n + 1}"
    taken.add(found.lower())
    return found
