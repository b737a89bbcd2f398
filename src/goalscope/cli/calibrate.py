"""`goalscope calibrate`: beliefs that can be trusted, from dialogues whose goals are known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from goalscope.cli.options import Json
from goalscope.cli.terminal import console, progress
from goalscope.types import GoalscopeError, InvalidInputError, pluralize

__all__ = ["calibrate"]

PEOPLE = 50
"""From how many on a calibration is kept unasked.

Of fewer dialogues there is no conformal threshold at 0.02, and a set that held what is true in 90 %
of them might hold it in only 79 % of others (95 % interval).
"""

OWN, HELD_OUT = "the model's own", "held out"
"""The row of the calibration that there is so far, and of the one that is fitted."""
ORIGINS = {"yours": "your earlier one", "comes with goalscope": "the one that came with goalscope"}


def calibrate(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RESULTS.db...",
            help="What `bench dialogues` or an experiment with dialogues has left.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write it there only, for --calibration; of one model alone."
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Of several models and layouts this one, as they are shown."
        ),
    ] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help=f"Keep it though it is of fewer than {PEOPLE} people.")
    ] = False,
    reset: Annotated[
        bool, typer.Option("--reset", help="Take your own away again: all, or that of --only.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Fit how evidence becomes probabilities, so that they can be trusted.

    From dialogues whose goals are known it finds what the evidence has to be divided by (the
    temperature), what "Unspecified" is compared with (the reference), and how many goals a set
    must hold to hold the true one. It is kept for the model with its adapter and prompt, and used
    from then on wherever that is, in the place of the one that comes with goalscope.
    """
    from collections import Counter
    from contextlib import suppress
    from dataclasses import asdict

    from goalscope.calibrating import FOLDS, fit_calibration, observed_in, quality
    from goalscope.calibration import DEFAULT, PAPER
    from goalscope.calibrations import calibration_file, keep_calibration, known_calibration
    from goalscope.experiment.identity import opened
    from goalscope.experiment.results import Results
    from goalscope.models.opening import model_label, parts

    if reset:
        if results or out:
            raise InvalidInputError("--reset takes calibrations away: name no results, no --out.")
        _reset(only, as_json=as_json)
        return
    if not results:
        raise InvalidInputError(
            "Name a file of results. `goalscope bench dialogues SET --results DIR` makes one."
        )
    ways: dict[str, list[tuple[Any, Any]]] = {}
    for path in results:
        if not path.is_file():
            raise InvalidInputError(
                f"There is no file {path}. `goalscope bench dialogues SET --results DIR` makes one."
            )
        with Results.open(path) as kept:
            for cell in kept.asked_for():
                spec = cell.spec
                if spec["kind"] == "dialogue" and cell.result:
                    way = [spec["model"], spec["layout"], spec["end_of_turn"]]
                    ways.setdefault(json.dumps(way), []).append((spec, cell.result))
    if not ways:
        raise InvalidInputError("These files hold no dialogues with known goals.")
    names: dict[str, str] = {}
    for way in ways:
        model, layout, end_of_turn = json.loads(way)
        names[way] = _name(model_label(model), layout, end_of_turn=end_of_turn)
    if only:
        known = "; ".join(names.values())
        ways = {way: cells for way, cells in ways.items() if names[way] == only}
        if not ways:
            raise InvalidInputError(f"These files hold no model {only!r}. There are: {known}.")
    if out and len(ways) > 1:
        raise InvalidInputError(
            f"These files hold dialogues scored in {len(ways)} ways: "
            f"{'; '.join(names[way] for way in ways)}. Name one with --only, or leave --out out to "
            "keep each for its own model."
        )
    told: list[dict[str, Any]] = []
    taught = sum(bool(result.get("learned")) for cells in ways.values() for _, result in cells)
    if taught:
        said = f"Left out: {pluralize(taught, 'dialogue')} from which the adapter has learned."
        console(stderr=True).print(said)
    observed = {way: observed_in(cells) for way, cells in ways.items()}
    people = {way: len({each.group for each in found}) for way, found in observed.items()}
    if min(people.values()) < 3:
        raise InvalidInputError(
            "There are too few people: some are to fit on, others to judge by. For each model give "
            "dialogues of at least three people, each dialogue with three goals or more."
        )
    few = [f"{names[way]} (of {n})" for way, n in people.items() if n < PEOPLE]
    if few and not (anyway or out):
        raise InvalidInputError(
            f"Nothing is kept: {'; '.join(few)}: dialogues of {PEOPLE} people are needed for a "
            "calibration that is to count from now on. Say --anyway to keep it all the same, or "
            "--out FILE to try it with --calibration."
        )
    for way, found in observed.items():
        model, layout, end_of_turn = json.loads(way)
        about: dict[str, Any] = {
            "model": model_label(model),
            "layout": layout,
            "end_of_turn": end_of_turn,
            "dialogues": dict(Counter(each.origin for each in found)),
            "quality": {},
        }
        scorer = parts(opened(model))[1]
        file = out or calibration_file(scorer, layout, end_of_turn=end_of_turn)
        replaces: dict[str, Any] = {"origin": "broken", "dialogues": 0}
        ways_of = {"Eq. 1": PAPER, "default": DEFAULT}
        with suppress(InvalidInputError):  # a broken file of one's own
            before, origin = known_calibration(scorer, layout, end_of_turn=end_of_turn)
            replaces = {"origin": origin, "dialogues": before.n}
            if origin in ORIGINS:
                ways_of[OWN] = before
        with progress(f"Fitting {about['model']}") as show:
            done, total = 0, (len(ways_of) + 1) * FOLDS + 1
            for name, known in {**ways_of, HELD_OUT: None}.items():
                for step in quality(found, known):
                    show(done, total)
                    done += step is None
                    about["quality"][name] = step and asdict(step)
            fitted = fit_calibration(found)
            show(total, total)
        keep_calibration(file, fitted, about)
        made = {**about, "file": str(file), "calibration": asdict(fitted)}
        made["replaces"] = None if out else replaces
        made["better"] = _better(about["quality"], replaces["origin"])
        told.append(made)
    if as_json:
        print(json.dumps(told))
    else:
        _show(told)


def _name(model: str, layout: str, *, end_of_turn: bool) -> str:
    return f"{model}, {layout}" + ", end of turn" * end_of_turn


def _reset(only: str | None, *, as_json: bool) -> None:
    from goalscope.calibrations import own_calibrations
    from goalscope.safe_text import terminal_safe

    known: dict[Path, str] = {}
    for file, about in own_calibrations().items():
        model, layout = about.get("model", file.name), about.get("layout", "unreadable")
        known[file] = _name(str(model), str(layout), end_of_turn=about.get("end_of_turn") is True)
    gone = {file: name for file, name in known.items() if only in (None, name)}
    if only and not gone:
        there = f"There are: {'; '.join(known.values())}." if known else "There are none."
        raise InvalidInputError(f"You have no calibration of {only!r}. {there}")
    for file in gone:
        try:
            file.unlink(missing_ok=True)
        except OSError as error:
            raise GoalscopeError(
                f"{file} cannot be taken away: {error.strerror or error}."
            ) from None
    if as_json:
        print(json.dumps({"reset": [*gone.values()]}))
        return
    said = "You have no calibration of your own."
    if gone:
        said = (
            f"Taken away: {'; '.join(gone.values())}. What comes with goalscope counts again, and "
            "the default for models without."
        )
    console().print(terminal_safe(said), soft_wrap=True)


def _better(quality: Mapping[str, Any], origin: str) -> str | None:
    """Which has the least log-loss on people whom what was fitted does not know; None for itself.

    One's own earlier one may know them.
    """
    fair = [name for name in quality if (name, origin) != (OWN, "yours")]
    best = min(fair, key=lambda name: (quality[name]["log_loss"], name != HELD_OUT))
    return None if best == HELD_OUT else best


def _replaced(replaces: Mapping[str, Any]) -> str:
    """What a new calibration takes the place of, and the way back."""
    one = ORIGINS.get(replaces["origin"], "the default")
    if replaces["dialogues"]:
        one = f"{one}, of {pluralize(replaces['dialogues'], 'dialogue')}"
    one = "a broken file" if replaces["origin"] == "broken" else one
    return f"It replaces {one}. `goalscope calibrate --reset` takes your own away again."


def _show(told: list[dict[str, Any]]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table as Grid

    from goalscope.safe_text import terminal_safe

    out = console()
    for each in told:
        dialogues = ", ".join(f"{n} of {name}" for name, n in each["dialogues"].items())
        name = _name(each["model"], each["layout"], end_of_turn=each["end_of_turn"])
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
        made = each["calibration"]
        out.print(
            terminal_safe(
                f"temperature {made['temperature']:g}, reference {made['reference']:g}, switching "
                f"{made['switching']:g}; kept in {each['file']}"
            )
        )
        if best := each["better"]:
            loss, least = (each["quality"][name]["log_loss"] for name in (HELD_OUT, best))
            said = f'By log-loss, "{best}" ({least:.3f}) is better than what was fitted on other '
            said += f"people ({loss:.3f}): more dialogues may change that."
            out.print(terminal_safe(said, "yellow"), soft_wrap=True)
        if each["replaces"]:
            out.print(terminal_safe(_replaced(each["replaces"])), soft_wrap=True)
    out.print(
        terminal_safe(
            "Log-loss of what is true, with the true goal among the goals and without it, where "
            "Unspecified is the truth. Held out: as calibrated on dialogues of other people; "
            f"{OWN} may have been fitted on some of these. The 90 % set holds what is true, with "
            "the true goal present and absent.",
            "dim",
        )
    )
