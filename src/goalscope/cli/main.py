"""The `goalscope` command. Commands import slow modules only when they run."""

from __future__ import annotations

import errno
import io
import logging
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from goalscope.base.text import terminal_safe
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.base.user_dirs import NOWHERE
from goalscope.cli.calibrate import calibrate
from goalscope.cli.chat import chat, run
from goalscope.cli.data import data
from goalscope.cli.episodes import episodes, replay, why
from goalscope.cli.experiments import bench, experiment
from goalscope.cli.fit import fit
from goalscope.cli.house import house
from goalscope.cli.infer import infer
from goalscope.cli.models import doctor, models
from goalscope.cli.reading import bench_reading
from goalscope.cli.report import report
from goalscope.cli.serve import mcp, serve
from goalscope.cli.study import study
from goalscope.cli.trace import trace


def _interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused the error, perhaps through an error in a library's clean-up."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    return error is not None


def _print_error(text: str) -> None:
    line = " ".join(filter(None, map(str.strip, text.splitlines())))
    with suppress(OSError):  # the exit code still tells
        typer.echo(terminal_safe(f"Error: {line}").plain, err=True)


def _explained(error: OSError) -> str:
    """What the system refused, and what to do about it."""
    cause = error.strerror or str(error) or type(error).__name__
    remedy = "Check the path and who may use it, or name another one."
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        remedy = "Free some space, or name a place on another disk."
    name = f": {os.fsdecode(error.filename)}" if isinstance(error.filename, str | bytes) else ""
    return f"{cause}{name}. {remedy}"


def _lost_output() -> OSError | None:
    """Why standard output takes no more, if so; Python would else complain of it at its end."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return error
    return None


def _print_lost(error: OSError) -> None:
    if not isinstance(error, BrokenPipeError):  # its reader has read enough
        _print_error(
            f"Cannot write to standard output: {error.strerror}. Free some space, or send it "
            "elsewhere."
        )


class _Commands(TyperGroup):
    """Prints errors as one line; the exit code is 2 for invalid input, otherwise 1."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the command line; what the system refuses is an error like any other."""
        try:
            return super().main(*args, **kwargs)
        except OSError as error:
            if lost := _lost_output():
                _print_lost(lost)
            else:
                _print_error(_explained(error))
            sys.exit(1)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except GoalscopeError as error:
            _print_error(str(error))
            raise typer.Exit(2 if isinstance(error, InvalidInputError) else 1) from None
        except (typer.Exit, typer.Abort):
            raise
        except (Exception, KeyboardInterrupt) as error:
            if _interrupted(error):
                raise typer.Exit(130) from None
            from goalscope.envs.registry import OWN

            if told := OWN.failure_in(error):
                _print_error(told)
                raise typer.Exit(1) from None
            raise


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
    """Handle the options of `goalscope` itself."""
    if show_version:
        from importlib.metadata import version

        print(version("goalscope"))
        raise typer.Exit


for command in (
    *(chat, run, serve, mcp, infer, fit),
    *(calibrate, replay, why, episodes, trace, doctor),
):
    app.command()(command)
bench.command(name="reading")(bench_reading)
app.add_typer(bench, name="bench")
app.add_typer(experiment, name="experiment")
app.command()(report)
app.add_typer(data, name="data")
app.add_typer(house, name="house")
app.add_typer(models, name="models")
app.add_typer(study, name="study")


class _Lines(logging.Formatter):
    """Indents all lines of a record but the first, so that none can pass for another record."""

    def format(self, record: logging.LogRecord) -> str:
        return terminal_safe(super().format(record)).plain.replace("\n", "\n    ")


def _open_streams() -> None:
    """Open the standard streams that are closed, lest a database takes their place.

    Raises:
        SystemExit: Standard output is closed.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # becomes the lowest number that is free
    if sys.stderr is None:  # pyright: ignore[reportUnnecessaryComparison] (closed at the start)
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (until the end)
    if sys.stdout is None:  # pyright: ignore[reportUnnecessaryComparison]
        sys.exit("Error: Standard output is closed. Send it to a file, or to /dev/null.")


def _at_home(word: str) -> str:
    """A word of the command line with the home folder for "~".

    A shell has put it there; a program that starts this one, from JSON, say, has not.
    """
    option, sign, path = word.partition("=") if word.startswith("--") else ("", "", word)
    found = os.path.expanduser(path) if path.startswith("~") else path
    return word if found.startswith(str(NOWHERE)) else f"{option}{sign}{found}"


def main() -> None:
    """Run the command line."""
    _open_streams()
    try:
        Path.home()
    except RuntimeError:
        os.environ["HOME"] = str(NOWHERE)  # for libraries that would fail without one
    os.environ.setdefault("TQDM_DISABLE", "1")  # goalscope has progress bars of its own
    os.environ["PYTHONSAFEPATH"] = "1"  # no process begun here imports from this folder, anybody's
    log = logging.StreamHandler()
    log.setFormatter(_Lines(logging.BASIC_FORMAT))
    logging.basicConfig(level=logging.WARNING, handlers=[log])  # before a library sets its own
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # an ASCII terminal shows ? and goes on
    try:
        sys.argv[1:] = map(_at_home, sys.argv[1:])
        app()
        code: object = 0
    except KeyboardInterrupt:
        code = 130
    except SystemExit as ended:
        code = ended.code
    if lost := _lost_output():
        _print_lost(lost)
        code = code or 1
    sys.exit(code)  # pyright: ignore[reportArgumentType] (as it was given)
