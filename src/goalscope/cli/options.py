"""The options that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

__all__ = [
    "Adapter",
    "CalibrationName",
    "Calls",
    "Catalogue",
    "Columns",
    "Domain",
    "EndOfTurn",
    "Json",
    "Layout",
    "Method",
    "Model",
    "Picture",
    "Prompted",
    "Propose",
    "ReadingAdapter",
    "ReadingForm",
    "Scene",
    "Scorer",
    "Seed",
    "Simulator",
    "StoreFile",
    "Tokenizer",
    "Unity",
    "Writer",
]

Domain = Annotated[
    str,
    typer.Argument(
        metavar="[grocery|house|FILE.py]", help="Where the agent acts: a file is your own domain."
    ),
]
Scene = Annotated[
    str | None,
    typer.Option(metavar="NAME|FILE", help="The house's room; see `house scenes`."),
]
Simulator = Annotated[
    Literal["house", "thor"], typer.Option(help="The embedded house, or AI2-THOR.")
]
Unity = Annotated[
    Path | None, typer.Option(help="Program that AI2-THOR starts, if not its own build.")
]
Picture = Annotated[
    Path | None, typer.Option(metavar="FILE.svg", help="Draw the house's room into it each round.")
]
Method = Annotated[Literal["good", "no-goals", "no-inference"], typer.Option()]
Catalogue = Annotated[Path | None, typer.Option(help="CSV file of your own shop.")]
Columns = Annotated[
    list[str] | None,
    typer.Option("--column", metavar="NAME=TITLE", help="Heading that holds name, price, ..."),
]
Layout = Annotated[
    Literal["goal-first", "goal-last"] | None,
    typer.Option(help="Where the likelihood prompt states the goal."),
]
EndOfTurn = Annotated[bool, typer.Option(help="Score the end of the utterance, too.")]
CalibrationName = Annotated[
    str | None,
    typer.Option(
        "--calibration",
        metavar="paper|default|last-turn|FILE",
        help="How evidence becomes probabilities.  [default: for given goals what `calibrate` "
        "found for the model, the default for an agent]",
    ),
]
Propose = Annotated[
    str | None,
    typer.Option(
        metavar="PROBABILITY|paper",
        help="Propose goals once Unspecified is likelier than this by the words since the newest "
        "goals; paper: once it is the likeliest.  [default: 0.5]",
    ),
]
Prompted = Annotated[
    list[str] | None,
    typer.Option(
        metavar="all|propose|remove|plan|query",
        help="Have the paper's prompts do this, whatever the model was taught; repeatable. A model "
        "that was taught nothing proposes, plans and asks by them in any case.",
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything that is drawn.")]
Model = Annotated[
    str | None,
    typer.Option(
        metavar="MODEL",
        help="GGUF file; folder or hf:NAME (Transformers); http://HOST/v1#NAME (a server).  "
        "[default: SmolLM2-135M-Instruct]",
    ),
]
Writer = Annotated[
    str | None, typer.Option(metavar="MODEL", help="Writes the words, if not --model.")
]
Scorer = Annotated[
    str | None, typer.Option(metavar="MODEL", help="Tells how likely words are, if not --model.")
]
Tokenizer = Annotated[
    str | None,
    typer.Option(help="GGUF file, folder or hub name of the tokenizer of a server's model."),
]
Adapter = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|FOLDER|none",
        help="LoRA adapter for the model that scores.  "
        "[default: the one that comes with goalscope, for its own model]",
    ),
]
Calls = Annotated[
    Path | None, typer.Option(help="File that keeps the model's answers, so none is asked twice.")
]
StoreFile = Annotated[
    str | None,
    typer.Option(
        "--store",
        metavar="FILE|postgresql://USER:PASSWORD@HOST/DATABASE",
        help="Where episodes are kept.  [default: $GOALSCOPE_STORE]",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="JSON on standard output, and nothing else.")]

ReadingAdapter = Annotated[
    str | None,
    typer.Option(
        "--adapter",
        metavar="ADAPTER",
        help="Fitted by `fit-writer`, or none.  [default: the one that comes with goalscope, for "
        "its own model]",
    ),
]

ReadingForm = Annotated[
    Literal["text", "json"], typer.Option("--form", help="How a reading is written.")
]
