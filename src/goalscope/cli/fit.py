"""`goalscope fit`: fit an adapter to dialogues with known goals."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from goalscope.base.optional_packages import package
from goalscope.base.text import command_line
from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Data, Json, Layout, Seed
from goalscope.cli.terminal import loading, model_names, progress, say

if TYPE_CHECKING:
    from goalscope.models.torch.model import Transformers

FEW = 20

FitModel = Annotated[
    str | None,
    typer.Option(
        metavar="MODEL",
        help="GGUF file; folder or hf:NAME.  [default: SmolLM2-135M-Instruct]",
    ),
]
Device = Annotated[
    str | None, typer.Option(help="Such as cpu or cuda:1.  [default: a GPU if there is one]")
]


def fit(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="DIALOGUES...",
            help="FILE.jsonl, or SET:SPLIT of `goalscope data list`; append [200:] to leave out "
            "the first 200 dialogues.",
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the adapter.")],
    model: FitModel = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ADAPTER",
            help="Adapter to start from, or none.  [default: the one that ships with goalscope, "
            "for its own model]",
        ),
    ] = None,
    data: Data = None,
    steps: Annotated[
        int, typer.Option(min=1, help="Maximum number of steps, of 4 dialogues each.")
    ] = 400,
    every: Annotated[int, typer.Option(min=1, help="Steps between validations.")] = 50,
    validation: Annotated[
        int, typer.Option(min=1, help="Maximum number of validation dialogues.")
    ] = 60,
    learning_rate: Annotated[
        float, typer.Option(help="Peak learning rate; larger models need a smaller one.")
    ] = 1e-3,
    rank: Annotated[
        int | None,
        typer.Option(min=1, help="Rank of a new adapter.  [default: 8]"),
    ] = None,
    layout: Layout = None,
    seed: Seed = 1,
    device: Device = None,
    as_json: Json = False,
) -> None:
    """Fit the scoring model to what people really say under a goal.

    Rows of a file are as for `infer`, with the true goal (its text, or its index from 0) under
    "true", and optionally a "group", such as the speaker. At most a third of the groups are held
    out for validation; fitting stops once the validation no longer improves. The same command
    resumes an interrupted fit. The folder then holds the adapter, for --adapter, and a model card.
    """
    from goalscope.belief.likelihood import DEFAULT_LAYOUT
    from goalscope.datasets.sources import read_source
    from goalscope.fitting.fit import Settings
    from goalscope.fitting.plan import Plan
    from goalscope.models.adapters import NO_ADAPTER, adapter_file, shipped

    if model and model.startswith(("http://", "https://")):
        raise InvalidInputError("A model on a server cannot be fitted. Name its folder or file.")
    if not 0 < learning_rate < 1:
        raise InvalidInputError(f"--learning-rate must be between 0 and 1, not {learning_rate}.")
    begin = None if start == NO_ADAPTER else adapter_file(start) if start else None
    if start is None and model is None:
        begin = shipped()
    if begin is not None and rank is not None:
        raise InvalidInputError(
            "The adapter to start from has a fixed rank. Leave out --rank, or use --start none."
        )
    settings = Settings(
        rank=rank or Settings().rank,
        learning_rate=learning_rate,
        steps=steps,
        validate_every=every,
        validation=validation,
        seed=seed,
    )
    named = {name: read_source(name, data) for name in dict.fromkeys(sources)}
    read = [named[name] for name in sources]
    out = out.resolve()
    base, layout = base_of(model), layout or DEFAULT_LAYOUT
    plan = Plan(read, out, settings, start=begin, layout=layout, base=base)
    engine = engine_of(model, device)
    command = command_line(*sys.argv[1:])
    began = False
    try:
        with progress("Steps") as show:
            show(0, steps)
            for each in plan.run(engine, command=command):
                show(each.step, steps)
                if each.validation is None and not began and not as_json:
                    say(f"Resumed after step {each.step}.", stderr=True)
                began = True
                if (found := each.validation) and not as_json:
                    say(
                        f"step {found.step:4}  loss {found.loss:.3f}  "
                        f"log-loss {found.log_loss:.3f}  "
                        f"top-1 {found.top1:4.0%}  AUROC {found.auroc:.3f}",
                        stderr=True,
                    )
    except KeyboardInterrupt:
        if (out / "state.pt").exists():
            again = "Interrupted. The same command resumes, and repeats at most ten steps."
            say(again, stderr=True)
        raise
    finally:
        engine.close()
    facts = json.loads((out / "fit.json").read_text(encoding="utf-8"))
    if as_json:
        print(json.dumps(facts))
    else:
        _show(facts, out)
        base = ("--model", model_names(model)["model"]) if model else ()
        use = command_line("infer", "FILE", "--out", "OUT", "--adapter", out, *base)
        say(f"Use it with: {use}", "dim", stderr=True)


def base_of(model: str | None) -> str:
    """The public name of the model that an adapter is for."""
    from goalscope.models.llama.model import EMBEDDED

    if model and (path := Path(model)).exists():
        return path.stem if path.is_file() else path.name
    return (model or EMBEDDED).removeprefix("hf:")


def engine_of(model: str | None, device: str | None) -> Transformers:
    """The model, opened for training."""
    from goalscope.models.llama.model import embedded_path
    from goalscope.models.torch.model import Transformers
    from goalscope.models.torch.network import multiplies_bfloat16

    with loading():
        name = (model_names(model)["model"] or "").removeprefix("hf:") or embedded_path()
        on_processor = device in (None, "cpu") and not package("torch").cuda.is_available()
        dtype = "bfloat16" if on_processor and multiplies_bfloat16() else None
        return Transformers(name, context_size=2048, device=device, dtype=dtype)


def _show(facts: Mapping[str, Any], out: Path) -> None:
    """Print the figures of a finished fit."""
    best, first, number = facts["best"], facts["history"][0], facts["validated"]
    figures = (("log-loss", "log_loss", ".3f"), ("top-1", "top1", ".0%"), ("AUROC", "auroc", ".3f"))
    told = ", ".join(f"{name} {best[k]:{form}} ({first[k]:{form}})" for name, k, form in figures)
    say(
        f"{out}: lowest loss at step {best['step']}, {best['loss']:.3f} (before "
        f"{first['loss']:.3f}), {told} on {pluralize(number, 'dialogue')}"
    )
    if number < FEW:
        few = f"A validation on fewer than {FEW} dialogues is not reliable. Use more dialogues."
        say(few, stderr=True)
    if not best["step"]:
        none = "No step lowered the loss, so the adapter has the weights that it started from."
        say(none, stderr=True)
