"""`goalscope calibrate`: fit a calibration to dialogues with known goals."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from goalscope.base.types import GoalscopeError, InvalidInputError, pluralize
from goalscope.cli.options import Json
from goalscope.cli.terminal import console, progress

if TYPE_CHECKING:
    from goalscope.experiment.fit_calibration import Observed

__all__ = ["calibrate"]

PEOPLE = 50
"""Number of people from which a calibration is saved without --anyway.

With fewer dialogues there is no conformal threshold at 0.02, and a set that covers 90 % of them
might cover only 79 % of others (95 % interval).
"""

OWN, HELD_OUT = "the model's own", "held out"
"""The table rows of the calibration in use so far, and of the one being fitted."""


class Way(NamedTuple):
    """How dialogues were scored: the model (JSON) and the prompt."""

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
        typer.Option(
            metavar="FILE",
            help="Write the calibration to this file only, for use with --calibration. Needs "
            "results of a single model.",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Use only this model and layout, by the name shown."),
    ] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help=f"Save it even with fewer than {PEOPLE} people.")
    ] = False,
    reset: Annotated[
        bool,
        typer.Option(
            "--reset", help="Delete your own calibrations, or only the one named by --only."
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Fit how evidence becomes probabilities, so that beliefs are calibrated.

    From dialogues with known goals, it fits the divisor of the evidence (the temperature), what
    "Unspecified" is compared with (the reference), and the thresholds of the conformal sets. The
    calibration is saved for the model with its adapter and prompt, and replaces the one that ships
    with goalscope wherever that model is used.
    """
    if reset:
        if results or out:
            raise InvalidInputError(
                "--reset deletes calibrations. Leave out the results and --out."
            )
        _reset(only, as_json=as_json)
        return
    ways = _read(results or [], only)
    if out and len(ways) > 1:
        raise InvalidInputError(
            f"These files hold dialogues scored in {len(ways)} different ways: "
            f"{'; '.join(way.name for way in ways)}. Choose one with --only, or leave out "
            "--out to save each for its own model."
        )
    observed = _observed(ways, keeps=not (anyway or out))
    made = [_fit(way, found, out) for way, found in observed.items()]
    if as_json:
        print(json.dumps(made))
    else:
        _show(made, kept=out is None)


def _read(results: Sequence[Path], only: str | None) -> dict[Way, Cells]:
    """The dialogues in files of results, grouped by how they were scored.

    Raises:
        InvalidInputError: There are none.
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
    if not chosen:
        known = "; ".join(way.name for way in ways)
        raise InvalidInputError(f"These files have no results of {only!r}. They have: {known}.")
    return chosen


def _observed(ways: Mapping[Way, Cells], *, keeps: bool) -> dict[Way, list[Observed]]:
    """The dialogues that a calibration can be fitted to.

    Raises:
        InvalidInputError: They come from too few people; a saved calibration needs more.
    """
    from goalscope.experiment.fit_calibration import observed_in

    learned = sum(bool(result.get("learned")) for cells in ways.values() for _, result in cells)
    if learned:
        console(stderr=True).print(
            f"Left out: {pluralize(learned, 'dialogue')} that the adapter was trained on."
        )
    observed = {way: observed_in(cells) for way, cells in ways.items()}
    people = {way: len({each.group for each in found}) for way, found in observed.items()}
    if min(people.values()) < 3:
        raise InvalidInputError(
            "Too few people: some are needed for fitting, others for validation. Each model "
            "needs dialogues of at least three people, with at least three goals each."
        )
    few = [f"{way.name} (of {n})" for way, n in people.items() if n < PEOPLE]
    if few and keeps:
        raise InvalidInputError(
            f"Nothing was saved: {'; '.join(few)}. A calibration that becomes the default "
            f"needs dialogues of {PEOPLE} people. Use --anyway to save it all the same, or "
            "--out FILE to try it with --calibration."
        )
    return observed


def _fit(way: Way, found: Sequence[Observed], out: Path | None) -> dict[str, Any]:
    """Fit a calibration, save it, and compare it with others."""
    from collections import Counter
    from contextlib import suppress
    from dataclasses import asdict

    from goalscope.belief import calibration as calibrations
    from goalscope.belief.calibration import DEFAULT, PAPER, Calibration
    from goalscope.experiment.fit_calibration import fit_calibration, quality
    from goalscope.experiment.identity import opened
    from goalscope.models.opening import model_label

    model = json.loads(way.model)
    scorer, origin = opened(model).speaker, ""
    beside: dict[str, Calibration | None] = {"Eq. 1": PAPER, "default": DEFAULT}
    with suppress(InvalidInputError):  # a broken file of one's own
        known, origin = calibrations.known_calibration(scorer, way.layout)
        if origin in (calibrations.YOURS, calibrations.SHIPPED):
            beside[OWN] = known
    beside[HELD_OUT] = None
    rows: dict[str, Any] = {}
    with progress(f"Fitting {model_label(model)}") as show:
        for name, each in beside.items():
            show(len(rows), len(beside) + 1)
            rows[name] = asdict(quality(found, each))
        show(len(rows), len(beside) + 1)
        fitted = fit_calibration(found)
    about: dict[str, Any] = {
        "model": model_label(model),
        "layout": way.layout,
        "dialogues": dict(Counter(each.origin for each in found)),
        "quality": rows,
    }
    file = out or calibrations.calibration_file(scorer, way.layout)
    calibrations.keep_calibration(file, fitted, about)
    # The user's earlier one may have been fitted on these very people.
    fair = [name for name in rows if name != OWN or origin == calibrations.SHIPPED]
    best = min(fair, key=lambda name: (rows[name]["log_loss"], name != HELD_OUT))
    better = None if best == HELD_OUT else best
    return {**about, "file": str(file), "calibration": asdict(fitted), "better": better}


def _reset(only: str | None, *, as_json: bool) -> None:
    from goalscope.base.text import terminal_safe
    from goalscope.belief.calibration import own_calibrations

    known: dict[Path, str] = {}
    for file, about in own_calibrations().items():
        model, layout = about.get("model", file.name), about.get("layout", "unreadable")
        known[file] = f"{model}, {layout}"
    gone = {file: name for file, name in known.items() if only in (None, name)}
    if only and not gone:
        there = f"There are: {'; '.join(known.values())}." if known else "There are none."
        raise InvalidInputError(f"You have no calibration for {only!r}. {there}")
    for file in gone:
        try:
            file.unlink(missing_ok=True)
        except OSError as error:
            raise GoalscopeError(f"Cannot delete {file}: {error.strerror or error}.") from None
    if as_json:
        print(json.dumps({"reset": [*gone.values()]}))
        return
    said = "You have no calibration of your own."
    if gone:
        said = (
            f"Deleted: {'; '.join(gone.values())}. goalscope uses its own calibrations again, "
            "and the default for models without one."
        )
    console().print(terminal_safe(said), soft_wrap=True)


def _show(made: Sequence[Mapping[str, Any]], *, kept: bool) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table as Grid

    from goalscope.base.text import terminal_safe

    out = console()
    for each in made:
        dialogues = ", ".join(f"{n} of {name}" for name, n in each["dialogues"].items())
        name = f"{each['model']}, {each['layout']}"
        grid = Grid(
            title=terminal_safe(f"{name}: {dialogues}"),
            title_justify="left",
            box=SIMPLE_HEAD,
        )
        for heading in ("belief", "log-loss", "AUROC", "90 % set: present", "absent", "size"):
            grid.add_column(heading)
        for name, row in each["quality"].items():
            shares = [f"{100 * share:.1f} %" for share in row["coverage"] or ()] or ["", ""]
            size = "" if row["size"] is None else f"{row['size']:.1f}"
            grid.add_row(name, f"{row['log_loss']:.3f}", f"{row['auroc']:.3f}", *shares, size)
        out.print(grid)
        fitted = each["calibration"]
        out.print(
            terminal_safe(
                f"temperature {fitted['temperature']:g}, reference {fitted['reference']:g}, "
                f"switching {fitted['switching']:g}; saved in {each['file']}"
            )
        )
        if best := each["better"]:
            loss, least = (each["quality"][name]["log_loss"] for name in (HELD_OUT, best))
            said = f'By log-loss, "{best}" ({least:.3f}) is better than the calibration fitted on '
            said += f"other people ({loss:.3f}). More dialogues may change that."
            out.print(terminal_safe(said, "yellow"), soft_wrap=True)
    out.print(
        terminal_safe(
            "Log-loss is averaged over cases with the true goal among the goals and cases "
            "without it, where Unspecified is true. Held out: calibrated on dialogues of "
            f"other people; {OWN} may have been fitted on some of these. 90 % set: how often "
            "the conformal set holds the truth, with the true goal present and absent.",
            "dim",
        )
    )
    if kept:
        out.print("`goalscope calibrate --reset` deletes your own calibrations.")
