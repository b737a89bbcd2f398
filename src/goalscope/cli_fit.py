"""`goalscope fit`: an adapter from dialogues whose goals are known."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from goalscope.cli_options import Json, Layout, Seed
from goalscope.terminal import console, measuring, named, progress
from goalscope.types import InvalidInputError

__all__ = ["fit"]


def fit(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="DIALOGUES...",
            help="FILE.jsonl, or SET:SPLIT of the datasets; perhaps with places, such as [200:].",
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the adapter.")],
    model: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="GGUF file; folder or hf:NAME.  [default: SmolLM2-135M-Instruct]",
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ADAPTER",
            help="Adapter to begin with, or none.  [default: the one that comes with goalscope, "
            "for its own model]",
        ),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="Folder of the datasets.  [default: $GOALSCOPE_DATA]")
    ] = None,
    objective: Annotated[
        Literal["words", "goals", "both"],
        typer.Option(help="The likelihood of the words, the posterior of the goals, or both."),
    ] = "both",
    steps: Annotated[int, typer.Option(min=1, help="Most steps, of 4 dialogues each.")] = 400,
    every: Annotated[int, typer.Option(min=1, help="Steps from one validation to the next.")] = 50,
    validation: Annotated[int, typer.Option(min=1, help="Most dialogues that validate.")] = 60,
    learning_rate: Annotated[
        float, typer.Option(help="At its highest; less for larger models.")
    ] = 1e-3,
    rank: Annotated[int | None, typer.Option(min=1, help="Of the adapter.  [default: 8]")] = None,
    layers: Annotated[
        float | None,
        typer.Option(help="Share of the layers, the last ones, to adapt.  [default: 0.5]"),
    ] = None,
    layout: Layout = None,
    seed: Seed = 1,
    device: Annotated[
        str | None, typer.Option(help="Such as cpu or cuda:1.  [default: a GPU if there is one]")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fit the model that scores to what people really say under a goal.

    A row of a file is as for `infer`, with the true goal under "true". At most a third of the
    dialogues validate; fitting ends when they have not become better for a while. Run again, it
    goes on where it stopped. The folder then holds the adapter, for --adapter, and a model card.
    """
    from goalscope.fitting.fit import Settings
    from goalscope.fitting.run import fit_adapter
    from goalscope.fitting.sources import read_source
    from goalscope.likelihood import DEFAULT_LAYOUT
    from goalscope.models.adapters import NO_ADAPTER, adapter_file, shipped
    from goalscope.models.extras import package
    from goalscope.models.llamacpp import EMBEDDED, embedded_path
    from goalscope.models.torch_network import multiplies_bfloat16
    from goalscope.models.transformers import Transformers
    from goalscope.plain import plain

    if model and model.startswith(("http://", "https://")):
        raise InvalidInputError("A server's model cannot be fitted. Name its folder or file.")
    if not 0 < learning_rate < 1:
        raise InvalidInputError(f"--learning-rate must be between 0 and 1, not {learning_rate}.")
    if layers is not None and not 0 < layers <= 1:
        raise InvalidInputError(f"--layers must be above 0 and at most 1, not {layers}.")
    begin = None if start == NO_ADAPTER else adapter_file(start) if start else None
    if start is None and model is None:
        begin = shipped()
    if begin is not None and (rank is not None or layers is not None):
        raise InvalidInputError(
            "The adapter to begin with has a rank and layers of its own. Leave out --rank and "
            "--layers, or begin with --start none."
        )
    usual = Settings()
    settings = Settings(
        objective=objective,
        rank=rank or usual.rank,
        layers=layers or usual.layers,
        learning_rate=learning_rate,
        steps=steps,
        validate_every=every,
        validation=validation,
        seed=seed,
    )
    read = [read_source(name, data) for name in sources]
    err = console(stderr=True)
    with measuring("Loading the model"):
        name = (named(model) or "").removeprefix("hf:") or embedded_path()
        on_processor = device in (None, "cpu") and not package("torch").cuda.is_available()
        dtype = "bfloat16" if on_processor and multiplies_bfloat16() else None
        engine = Transformers(name, context_size=2048, device=device, dtype=dtype)
    own = model is not None and Path(model).exists()
    base = engine.name if own else (model or EMBEDDED).removeprefix("hf:")
    command = shlex.join(["goalscope", *sys.argv[1:]])
    try:
        with progress("Steps") as show:
            show(0, steps)
            for each in fit_adapter(
                engine,
                read,
                out.resolve(),
                settings,
                start=begin,
                layout=layout or DEFAULT_LAYOUT,
                base=base,
                command=command,
            ):
                show(each.step, steps)
                if (found := each.validation) and not as_json:
                    err.print(
                        f"step {found.step:4}  log-loss {found.log_loss:.3f}  "
                        f"top-1 {found.top1:4.0%}  AUROC {found.auroc:.3f}"
                    )
    finally:
        engine.close()
    facts = json.loads((out / "fit.json").read_text(encoding="utf-8"))
    if as_json:
        print(json.dumps(facts))
        return
    best, number = facts["best"], facts["validated"]
    console().print(
        plain(
            f"{out}: best at step {best['step']}, log-loss {best['log_loss']:.3f}, "
            f"top-1 {best['top1']:.0%}, AUROC {best['auroc']:.3f} on {number} "
            f"dialogue{'s' if number != 1 else ''}"
        ),
        soft_wrap=True,
    )
    use = f"Use it with: goalscope infer FILE --out OUT --adapter {out}"
    err.print(plain(use), style="dim", soft_wrap=True)
