"""`goalscope calibrate`: fit a calibration to dialogues with known goals."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from goalscope.base.text import terminal_safe
from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Json
from goalscope.cli.terminal import console, progress, say

if TYPE_CHECKING:
    from goalscope.experiment.fit_calibration import Observed

PEOPLE = 50
"""Number of people from which a calibration may become a model's own.

With fewer dialogues there is no conformal threshold at 0.02, and a set that covers 90 % of them
might cover only 79 % of others (95 % interval).
"""

OWN, HELD_OUT = "the model's own", "held out"
"""The table rows of the calibration in use so far, and of the one being fitted."""


class Way(NamedTuple):
    """How dialogues were scored: the model (JSON) and where its prompt states the goal."""

    model: str
    layout: str

    @property
    def name(self) -> str:
        """The name that `--only` takes."""
        from goalscope.models.opening import model_label

        return f"{model_label(json.loads(self.model))}, {self.layout}"


Cells = list[tuple[Any, Any]]
"""Specs and results of measured dialogues."""


def calibrate(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RESULTS.db...",
            help="Results of `bench dialogues` or of an experiment with dialogues.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write it to this file, for use with --calibration."),
    ] = None,
    save: Annotated[
        bool,
        typer.Option(
            "--save",
            help="Use it from now on wherever this model runs on this machine. Needs dialogues of "
            f"{PEOPLE} people.",
        ),
    ] = False,
    only: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Use only this model and layout, by the name shown."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Fit how evidence becomes probabilities, so that beliefs are calibrated.

    From dialogues with known goals, it fits the divisor of the evidence (the temperature), what
    "Unspecified" is compared with (the reference), and the thresholds of the conformal sets. It
    shows how good they are, and saves them only with --out or --save.
    """
    way, cells = _read(results or [], only)
    found = _observed(way, cells, saves=save)
    made, fitted = _fit(way, found)
    files = _save(way, made, fitted, out, save=save)
    if as_json:
        print(json.dumps({**made, "files": files}))
    else:
        _show(way, made, files)


def _read(results: Sequence[Path], only: str | None) -> tuple[Way, Cells]:
    """The dialogues in files of results, which were all scored in one way.

    Raises:
        InvalidInputError: There are none, or they were scored in several ways.
    """
    from goalscope.experiment.results import Results

    make = "`goalscope bench dialogues SET --results DIR` makes one."
    if not results:
        raise InvalidInputError(f"Expected a file of results. {make}")
    ways: dict[Way, Cells] = {}
    for path in results:
        if not path.is_file():
            raise InvalidInputError(f"There is no file {path}. {make}")
        with Results.open(path) as kept:
            for cell in kept.asked_for():
                spec = cell.spec
                if spec["kind"] == "dialogue" and cell.result:
                    way = Way(json.dumps(spec["model"]), spec["layout"])
                    ways.setdefault(way, []).append((spec, cell.result))
    if not ways:
        raise InvalidInputError("These files hold no dialogues with known goals.")
    chosen = {way: cells for way, cells in ways.items() if only in (None, way.name)}
    known = "; ".join(way.name for way in ways)
    if not chosen:
        raise InvalidInputError(f"These files have no results of {only!r}. They have: {known}.")
    if len(chosen) > 1:
        raise InvalidInputError(
            f"These files hold dialogues scored in {len(chosen)} ways: {known}. Choose one with "
            "--only."
        )
    return next(iter(chosen.items()))


def _observed(way: Way, cells: Cells, *, saves: bool) -> list[Observed]:
    """The dialogues that a calibration can be fitted to.

    Raises:
        InvalidInputError: They come from too few people; a saved calibration needs more.
    """
    from goalscope.experiment.fit_calibration import observed_in

    if learned := sum(bool(result.get("learned")) for _, result in cells):
        left = pluralize(learned, "dialogue")
        say(f"Left out: {left} that the adapter was trained on.", stderr=True)
    found = observed_in(cells)
    people = len({each.group for each in found})
    if people < 3:
        raise InvalidInputError(
            "Too few people: some are needed for fitting, others for validation. Give dialogues "
            "of at least three people, with at least three goals each."
        )
    if saves and people < PEOPLE:
        raise InvalidInputError(
            f"Nothing was saved: {way.name} has dialogues of {people} people, and --save needs "
            f"{PEOPLE}. Use --out FILE to try it with --calibration."
        )
    return found


def _fit(way: Way, found: Sequence[Observed]) -> tuple[dict[str, Any], Any]:
    """Fit a calibration, and compare it with others."""
    from collections import Counter
    from contextlib import suppress
    from dataclasses import asdict

    from goalscope.belief import calibration as calibrations
    from goalscope.belief.calibration import DEFAULT, PAPER, Calibration
    from goalscope.experiment.fit_calibration import fit_calibration, quality
    from goalscope.models.opening import model_label

    origin = ""
    beside: dict[str, Calibration | None] = {"Eq. 1": PAPER, "default": DEFAULT}
    with suppress(InvalidInputError):  # a broken file of one's own
        known, origin = calibrations.known_calibration(_scorer(way), way.layout)
        if origin in (calibrations.YOURS, calibrations.SHIPPED):
            beside[OWN] = known
    beside[HELD_OUT] = None
    rows: dict[str, Any] = {}
    name = model_label(json.loads(way.model))
    with progress(f"Fitting {name}") as show:
        for row, each in beside.items():
            show(len(rows), len(beside) + 1)
            rows[row] = asdict(quality(found, each))
        show(len(rows), len(beside) + 1)
        fitted = fit_calibration(found)
    # The user's earlier one may have been fitted on these very people.
    fair = [row for row in rows if row != OWN or origin == calibrations.SHIPPED]
    best = min(fair, key=lambda row: (rows[row]["log_loss"], row != HELD_OUT))
    made = {
        "model": name,
        "layout": way.layout,
        "dialogues": dict(Counter(each.origin for each in found)),
        "quality": rows,
        "calibration": asdict(fitted),
        "better": None if best == HELD_OUT else best,
    }
    return made, fitted


def _scorer(way: Way) -> Any:
    from goalscope.experiment.measure import opened

    return opened(json.loads(way.model)).speaker


def _save(
    way: Way, made: Mapping[str, Any], fitted: Any, out: Path | None, *, save: bool
) -> list[str]:
    """Write the files that were asked for."""
    from goalscope.belief.calibration import calibration_file, keep_calibration

    files = [out] if out else []
    if save:
        files.append(calibration_file(_scorer(way), way.layout))
    about = {key: made[key] for key in ("model", "layout", "dialogues", "quality")}
    for file in files:
        keep_calibration(file, fitted, about)
    return [*map(str, files)]


def _show(way: Way, made: Mapping[str, Any], files: Sequence[str]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table as Grid

    dialogues = ", ".join(f"{n} of {name}" for name, n in made["dialogues"].items())
    grid = Grid(
        title=terminal_safe(f"{way.name}: {dialogues}"), title_justify="left", box=SIMPLE_HEAD
    )
    for heading in ("belief", "log-loss", "AUROC", "90 % set: present", "absent", "size"):
        grid.add_column(heading)
    for name, row in made["quality"].items():
        shares = [f"{100 * share:.1f} %" for share in row["coverage"] or ()] or ["", ""]
        size = "" if row["size"] is None else f"{row['size']:.1f}"
        grid.add_row(name, f"{row['log_loss']:.3f}", f"{row['auroc']:.3f}", *shares, size)
    console().print(grid)
    fitted = made["calibration"]
    saved = f"saved in {' and '.join(files)}." if files else "not saved."
    say(
        f"temperature {fitted['temperature']:g}, reference {fitted['reference']:g}, "
        f"switching {fitted['switching']:g}; {saved}"
    )
    if best := made["better"]:
        loss, least = (made["quality"][name]["log_loss"] for name in (HELD_OUT, best))
        said = f'By log-loss, "{best}" ({least:.3f}) is better than the calibration fitted on '
        said += f"other people ({loss:.3f}). More dialogues may change that."
        say(said, "yellow")
    note = (
        "Log-loss is averaged over cases with the true goal among the goals and cases without it, "
        "where Unspecified is true. Held out: calibrated on dialogues of other people; "
        f"{OWN} may have been fitted on some of these. 90 % set: how often the conformal set "
        "holds the truth, with the true goal present and absent."
    )
    console().print(terminal_safe(note, "dim"))
    if not files:
        say("--out FILE writes it for --calibration; --save makes it this model's own.")
