"""The `goalscope` command. Heavy imports wait until a command needs them."""

from __future__ import annotations

import io
import json
import logging
import os
import sys
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from goalscope.cli_calibrate import calibrate
from goalscope.cli_data import data
from goalscope.cli_episodes import chat, episodes, replay, run
from goalscope.cli_experiments import bench, experiment
from goalscope.cli_fit import fit
from goalscope.cli_house import house
from goalscope.cli_mcp import mcp
from goalscope.cli_models import doctor, models
from goalscope.cli_options import (
    Adapter,
    CalibrationName,
    Calls,
    EndOfTurn,
    Layout,
    Model,
    Tokenizer,
)
from goalscope.cli_report import report
from goalscope.cli_serve import serve
from goalscope.cli_study import study
from goalscope.cli_why import why
from goalscope.terminal import console, model_names, opened_model, progress
from goalscope.types import GoalscopeError, InvalidInputError, counted


def _interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind it: what a library does of it may fail in turn."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    return error is not None


class _Commands(TyperGroup):
    """Says errors in one line: exit code 2 for what a person gave, 1 for all else."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except GoalscopeError as error:
            from goalscope.plain import plain

            typer.echo(plain("Error: " + " ".join(str(error).split())).plain, err=True)
            raise typer.Exit(2 if isinstance(error, InvalidInputError) else 1) from None
        except (typer.Exit, typer.Abort):
            raise
        except (Exception, KeyboardInterrupt) as error:
            if _interrupted(error):
                raise typer.Exit(130) from None
            raise

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command; of those that there are, only near names are suggested."""
        if self.get_command(ctx, args[0]) is None:
            near = get_close_matches(args[0], self.commands, cutoff=0.65)
            meant = f" Did you mean {' or '.join(near)}?" if near else ""
            ctx.fail(f"No such command {args[0]!r}.{meant}")
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich takes longer to import than all the rest
    help="Agents that infer a person's goals from dialogue, and show what they believe.",
)


@app.callback(invoke_without_command=True)
def options(
    show_version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    """Hold the options of `goalscope` itself."""
    if show_version:
        from importlib.metadata import version

        print(version("goalscope"))
        raise typer.Exit


app.command()(chat)
app.command()(run)
app.command()(serve)
app.command()(mcp)


@app.command()
def infer(
    file: Annotated[Path, typer.Argument(help="Dialogues with their possible goals, JSON Lines.")],
    out: Annotated[Path, typer.Option(help="Beliefs turn by turn, JSON Lines; continued.")],
    model: Model = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    calls: Calls = None,
    layout: Layout = None,
    end_of_turn: EndOfTurn = False,
    calibration: CalibrationName = None,
) -> None:
    """Infer goals in a file of dialogues.

    A row is {"id", "task", "turns": [{"query", "utterance"}, ...], "goals": [...]}; goals that
    differ only in case, spaces or the mark at the end count as one. For each turn a line is
    written: id, turn (from 1), words (a hash of what was read), goals, log_likelihood (this
    turn's), log_posterior, probability, unspecified_log_likelihood, unspecified_probability, set_90
    (the goals that hold the true one in 90 % of dialogues, or null), settings. Run again, it
    continues where it stopped; a file of other words, goals or settings is refused.
    """
    from dataclasses import asdict
    from hashlib import sha256

    from goalscope.calibrations import calibration_named
    from goalscope.experiment.identity import own_identity
    from goalscope.infer import infer as infer_dialogues
    from goalscope.infer import read_dialogues, trim_output
    from goalscope.likelihood import DEFAULT_LAYOUT, RolePlay
    from goalscope.models.opening import parts
    from goalscope.plain import model_shown, plain

    if not out.absolute().parent.is_dir():
        raise InvalidInputError(f"There is no folder {out.parent}. Make it, or name another file.")
    given = calibration_named(calibration) if calibration else None
    dialogues = read_dialogues(file)
    cut: list[str | int] = []
    names = model_names(model, tokenizer=tokenizer, adapter=adapter)
    with opened_model(names, calls) as engine:
        likelihood = RolePlay(engine, layout=layout or DEFAULT_LAYOUT, end_of_turn=end_of_turn)
        scorer: Any = parts(engine)[1]
        settings = {
            "model": model_shown(engine.name),
            "adapter": getattr(scorer, "adapter_metadata", {}).get("general.name"),
            "weights": sha256(scorer.fingerprint.encode()).hexdigest()[:12],
            **own_identity(),
            "layout": likelihood.layout,
            "end_of_turn": end_of_turn,
            "calibration": json.loads(json.dumps(asdict(given or likelihood.calibration))),
        }
        left = trim_output(out, dialogues, settings)
        done = len(dialogues) - len(left)
        with progress("Dialogues") as show:
            show(done, len(dialogues))
            for dialogue in infer_dialogues(left, out, likelihood, settings, given):
                done += 1
                show(done, len(dialogues))
                if likelihood.window(dialogue.task, dialogue.turns):
                    cut.append(dialogue.id)
    if cut:
        console(stderr=True).print(
            plain(f"Too long for the model, so that the oldest turns were left out: {cut}")
        )
    turns = sum(len(dialogue.turns) for dialogue in dialogues)
    held = f"{counted(len(dialogues), 'dialogue')}, {counted(turns, 'turn')}"
    console(stderr=True).print(plain(f"{out}: {held}"), soft_wrap=True)


app.command()(fit)
app.command()(calibrate)
app.command()(replay)
app.command()(why)
app.command()(episodes)
app.command()(doctor)
app.add_typer(bench, name="bench")
app.add_typer(experiment, name="experiment")
app.command()(report)
app.add_typer(data, name="data")
app.add_typer(house, name="house")
app.add_typer(models, name="models")
app.add_typer(study, name="study")


class _Lines(logging.Formatter):
    """Records whose further lines are indented: no text in them passes for another record."""

    def format(self, record: logging.LogRecord) -> str:
        from goalscope.plain import plain

        return plain(super().format(record)).plain.replace("\n", "\n    ")


def main() -> None:
    """Run the command line."""
    os.environ.setdefault("TQDM_DISABLE", "1")  # goalscope has progress bars of its own
    log = logging.StreamHandler()
    log.setFormatter(_Lines(logging.BASIC_FORMAT))
    logging.basicConfig(level=logging.WARNING, handlers=[log])  # before a library sets its own
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # an ASCII terminal shows ? and goes on
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(130)
