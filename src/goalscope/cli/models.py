"""`goalscope models` and `goalscope doctor`: list, test and fetch models."""

from __future__ import annotations

import json
from typing import Annotated, Any, cast

import typer

from goalscope.base.optional_packages import EXTRAS, remedy
from goalscope.base.text import command_line, model_shown
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.cli.options import Adapter, Json, Model, Scorer, StoreFile, Tokenizer, Writer
from goalscope.cli.terminal import model_names, opened_model, say

PACKAGES = (
    *("goalscope", "numpy", "wordllama"),
    *("openai", "tokenizers", "huggingface-hub", "torch", "transformers"),
)
models = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="List, test and fetch models.",
)


@models.command("list")
def list_models(as_json: Json = False) -> None:
    """List the model files that goalscope finds on this machine."""
    from goalscope.models.hub import pulled_files
    from goalscope.models.llama.model import embedded_path

    paths = [embedded_path(), *pulled_files()]
    known = {path.resolve(): path for path in reversed(paths) if path.is_file()}
    rows = [
        {"path": str(path), "megabytes": path.stat().st_size / 1e6}
        for path in reversed(known.values())
    ]
    if as_json:
        print(json.dumps(rows))
        return
    for row in rows:
        say(f"{row['megabytes']:7,.0f} MB  {row['path']}")


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
    say(f"Use it with: {command_line('chat', '--model', path)}", "dim", stderr=True)


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

    from goalscope.belief.calibration import known_calibration
    from goalscope.belief.likelihood import DEFAULT_LAYOUT
    from goalscope.models.adapters import lost_adapters
    from goalscope.models.check import check as check_model
    from goalscope.models.llama.engine import engine as llama_cpp
    from goalscope.models.llama.engine import processor
    from goalscope.models.llama.model import LlamaCpp
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
            made, origin = known_calibration(engine.speaker, DEFAULT_LAYOUT)
            prior_unspecified = (
                "like any goal" if made.prior_unspecified is None else f"{made.prior_unspecified:g}"
            )
            report["calibration"] = (
                f"similarity {made.similarity:g}, temperature {made.temperature:g}, reference "
                f"{made.reference:g}, switching {made.switching:g}, prior_unspecified "
                f"{prior_unspecified}; {origin}"
            )
            if isinstance(engine.speaker, LlamaCpp):
                report["engine"] = llama_cpp().name
                report["prompt speed (tokens/s)"] = round(512 / engine.speaker.prompt_seconds())
    except GoalscopeError as error:
        problems.append(str(error))
    try:
        with Store.open(store) as opened:
            report["store"] = opened.place
            report["episodes"] = len(opened.episodes())
    except GoalscopeError as error:
        problems.append(str(error))
    _report({**report, "problems": problems}, as_json)


def _report(report: dict[str, Any], as_json: bool) -> None:
    """Print the findings; exit with code 1 if there are problems."""
    if as_json:
        print(model_shown(json.dumps(report)))
    else:
        for key, value in report.items():
            if isinstance(value, list):
                lines = [str(each) for each in cast("list[object]", value)] or ["none"]
            else:
                lines = [f"{value:.3g}" if isinstance(value, float) else str(value)]
            for line in lines:
                say(f"{key:36}{model_shown(line)}")
                key = ""
    if report["problems"]:
        raise typer.Exit(1)
