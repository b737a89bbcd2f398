"""`goalscope models` and `goalscope doctor`: list, test, tune and fetch models."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.cli.options import Adapter, Json, Model, Scorer, StoreFile, Tokenizer, Writer
from goalscope.cli.terminal import console, measuring, model_names, opened_model

if TYPE_CHECKING:
    from goalscope.models.llama.engine import Engine
    from goalscope.models.llama.model import LlamaCpp
    from goalscope.models.llama.tune import Tuning

PACKAGES = (
    *("goalscope", "numpy", "wordllama"),
    *("httpx2", "tokenizers", "huggingface-hub", "torch", "transformers"),
)
_COMPILERS = ("c++", "g++", "clang++", "cl")
models = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="List, test, tune and fetch models.",
)


@models.command("list")
def list_models(as_json: Json = False) -> None:
    """List the model files that goalscope finds on this machine."""
    from goalscope.models.hub import pulled_files
    from goalscope.models.llama.model import embedded_path
    from goalscope.models.llama.tune import kept_tunings

    tunings = {each.source: each for each in kept_tunings()}
    paths = [embedded_path(), *pulled_files(), *tunings]
    known = {path.resolve(): path for path in reversed(paths) if path.is_file()}
    rows = [_row(path, tunings.get(source)) for source, path in reversed(known.items())]
    if as_json:
        print(json.dumps(rows))
        return
    for row in rows:
        speed = f"tuned: {row['speed']:,.0f} tokens/s as {row['weights']}" if row["speed"] else ""
        _say(f"{row['megabytes']:7,.0f} MB  {row['path']}  {speed}".rstrip())


@models.command()
def check(
    model: Annotated[str | None, typer.Argument(metavar="[MODEL]", help="As for --model.")] = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    as_json: Json = False,
) -> None:
    """Test whether a model writes and scores correctly.

    The exit code is 1 if it does not.
    """
    from goalscope.models.check import check as check_model

    with opened_model(model_names(model, generator, scorer, tokenizer, adapter)) as engine:
        found, problems = check_model(engine)
    _report({**found, "problems": problems}, as_json)


@models.command()
def tune(
    model: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE]", help="GGUF file.  [default: the embedded model]"),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find the fastest settings for a model file on this machine.

    The result is cached, with a faster copy of the file where there is one. Small files are tuned
    at first use; GOALSCOPE_TUNE=0 turns off tuning and the use of earlier results.
    """
    from goalscope.models.llama.model import embedded_path, processors
    from goalscope.models.llama.tune import tune as tune_file

    source = model.absolute() if model else embedded_path()
    try:
        with measuring("Measuring") as report:
            tuning = tune_file(source, processors(), report)
    except OSError as error:
        raise GoalscopeError(f"Tuning failed, or its result could not be saved: {error}") from error
    if as_json:
        print(json.dumps(asdict(tuning), default=str))
        return
    for line in _trials(tuning):
        _say(line)
    how = tuning.running
    _say(f"{how.threads} threads, batches of {how.batch}; {tuning.path}")


@models.command()
def pull(
    repository: Annotated[str, typer.Argument(help="Repository on the hub, as owner/name.")],
    file: Annotated[str | None, typer.Argument(help="GGUF file in the repository.")] = None,
) -> None:
    """Fetch a GGUF file from the Hugging Face hub.

    The environment variable HF_ENDPOINT can name another hub.
    """
    from goalscope.models.hub import pull as pull_file

    if repository.count("/") != 1:
        raise InvalidInputError(f"{repository} is not a repository of the form OWNER/NAME.")
    path = pull_file(repository, file)
    print(path)
    console(stderr=True).print(f"Use it with: goalscope chat --model {path}", style="dim")


def doctor(
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Check the installation: versions, the model, its speed and its log-probabilities."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    from goalscope.base.optional_packages import EXTRAS, remedy
    from goalscope.base.user_dirs import user_cache
    from goalscope.belief.calibration import known_calibration
    from goalscope.belief.likelihood import DEFAULT_LAYOUT
    from goalscope.models.adapters import lost_adapters
    from goalscope.models.check import check as check_model
    from goalscope.models.llama.tune import processor
    from goalscope.models.opening import parts
    from goalscope.storage.store import Store

    report: dict[str, Any] = {"python": platform.python_version(), "processor": processor()}
    for package in PACKAGES:
        try:
            report[package] = version(package)
        except PackageNotFoundError:
            extra = EXTRAS.get(package)
            wanted = remedy(extra) if extra else f"`pip install {package}`"
            report[package] = f"missing ({'optional: ' if extra else ''}{wanted})"
    problems = [
        f"{path} is missing; the embedded model is less accurate without it. Reinstall goalscope."
        for path in lost_adapters()
    ]
    try:
        with opened_model(model_names(model, generator, scorer, tokenizer, adapter)) as engine:
            found, wrong = check_model(engine)
            problems += wrong
            report |= found
            made, origin = known_calibration(parts(engine)[1], DEFAULT_LAYOUT)
            prior_unspecified = (
                "like any goal" if made.prior_unspecified is None else f"{made.prior_unspecified:g}"
            )
            report["calibration"] = (
                f"temperature {made.temperature:g}, reference {made.reference:g}, switching "
                f"{made.switching:g}, prior_unspecified {prior_unspecified}; {origin}"
            )
            for part in dict.fromkeys(parts(engine)):
                if prompt_seconds := getattr(part, "prompt_seconds", None):
                    report["prompt speed (tokens/s)"] = round(512 / prompt_seconds(512))
                if runs := getattr(part, "engine", None):
                    report["engine"] = _engine(cast("LlamaCpp", part), runs)
                tuning: Tuning | None = getattr(part, "tuning", None)
                report["tuning"] = _trials(tuning) if tuning and tuning.trials else "none"
    except GoalscopeError as error:
        problems.append(str(error))
    report["cache folder"] = str(user_cache())
    try:
        with Store.open(store) as opened:
            report["store"] = opened.place
            report["episodes"] = len(opened.episodes())
    except GoalscopeError as error:
        problems.append(str(error))
    _report({**report, "problems": problems}, as_json)


def _report(report: dict[str, Any], as_json: bool) -> None:
    """Print the findings; exit with code 1 if there are problems."""
    from goalscope.base.text import model_shown

    if as_json:
        print(model_shown(json.dumps(report)))
    else:
        for key, value in report.items():
            if isinstance(value, list):
                lines = [str(each) for each in cast("list[object]", value)] or ["none"]
            else:
                lines = [f"{value:.3g}" if isinstance(value, float) else str(value)]
            for line in lines:
                _say(f"{key:36}{model_shown(line)}")
                key = ""
    if report["problems"]:
        raise typer.Exit(1)


def _engine(model: LlamaCpp, runs: Engine) -> str:
    """The engine that runs a model, and how it compares with the other one on this machine."""
    from goalscope.base.optional_packages import remedy
    from goalscope.models.llama.engine import NATIVE, READY

    if runs.package != NATIVE:
        found = any(map(shutil.which, filter(None, (os.environ.get("CXX"), *_COMPILERS))))
        first = "" if found else "install a C++ compiler (Debian's package g++) first, then "
        return (
            f"{runs.name}, prebuilt; one compiled for this processor can be faster: "
            f"{first}{remedy('native')}"
        )
    told = f"{runs.name}, compiled for this processor"
    if not READY.library:
        return told
    ratio = model.prompt_seconds(by=READY.load()) / model.prompt_seconds(by=runs)
    return f"{told}; it reads {ratio:.1f} times as fast as the prebuilt one"


def _trials(tuning: Tuning) -> list[str]:
    return [
        f"{trial.weights:6} {trial.speed:7,.0f} tokens/s, {trial.error:.4f} nats a token from exact"
        for trial in tuning.trials
    ]


def _row(path: Path, tuning: Tuning | None) -> dict[str, Any]:
    used = tuning.path if tuning else path
    best = tuning.chosen if tuning else None
    return {
        "path": str(path),
        "megabytes": path.stat().st_size / 1e6,
        "used": str(used),
        "weights": best.weights if best else None,
        "speed": best.speed if best else None,
    }


def _say(line: str) -> None:
    from goalscope.base.text import terminal_safe

    console().print(terminal_safe(line), soft_wrap=True)
