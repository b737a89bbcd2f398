"""The `goalscope` command. Heavy imports wait until a command needs them."""

from __future__ import annotations

import io
import logging
import os
import sys
from difflib import get_close_matches
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from goalscope.cli.calibrate import calibrate
from goalscope.cli.data import data
from goalscope.cli.episodes import chat, episodes, replay, run
from goalscope.cli.experiments import bench, experiment
from goalscope.cli.fit import fit
from goalscope.cli.house import house
from goalscope.cli.infer import infer
from goalscope.cli.mcp import mcp
from goalscope.cli.models import doctor, models
from goalscope.cli.reading import bench_reading, fit_writer
from goalscope.cli.report import report
from goalscope.cli.serve import serve
from goalscope.cli.study import study
from goalscope.cli.why import why
from goalscope.types import GoalscopeError, InvalidInputError


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
            from goalscope.safe_text import terminal_safe

            typer.echo(terminal_safe("Error: " + " ".join(str(error).split())).plain, err=True)
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


app.command()(infer)
app.command()(fit)
app.command()(fit_writer)
bench.command(name="reading")(bench_reading)
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
        from goalscope.safe_text import terminal_safe

        return terminal_safe(super().format(record)).plain.replace("\n", "\n    ")


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
