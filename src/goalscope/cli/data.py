"""`goalscope data`: the public datasets, and which of them are available."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from goalscope.base.text import terminal_safe
from goalscope.base.types import pluralize
from goalscope.cli.options import Data, Goals, Json, Limit
from goalscope.cli.terminal import console, say

data = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Public datasets of real dialogues, read from your own folder.",
)


@data.command(name="list")
def list_datasets(folder: Data = None, as_json: Json = False) -> None:
    """List the datasets: contents, sources, and the files found."""
    from rich.table import Table

    from goalscope.datasets import DATASETS, named_folder

    folder = named_folder(folder)

    def there(path: str) -> bool:
        return folder is not None and (folder / path).is_file()

    if as_json:
        rows = [asdict(dataset) for dataset in DATASETS.values()]
        for row in rows:
            files = row["files"].items()
            row["files"] = {key: {"path": path, "there": there(path)} for key, path in files}
        print(json.dumps(rows))
        return
    for dataset in DATASETS.values():
        say(f"{dataset.name}: {dataset.title}", "bold")
        say(f"  {dataset.what}; licence: {dataset.licence}\n  from {dataset.source}")
        if dataset.goal_sets:
            say(f"  goal sets: {', '.join(dataset.goal_sets)}")
        table = Table.grid(padding=(0, 2))
        for split, path in dataset.files.items():
            name = f"{split} (default)" if split == dataset.split else split
            table.add_row("", name, "there" if there(path) else "missing", terminal_safe(path))
        console().print(table)
    where = f"in {folder}" if folder else "in the folder that --data or GOALSCOPE_DATA names"
    say(f"The files belong {where}. goalscope does not download them.")


@data.command()
def export(
    name: Annotated[
        str, typer.Argument(metavar="SET[:SPLIT]", help="Name of the dataset, see `data list`.")
    ],
    out: Annotated[
        Path, typer.Option(metavar="FILE.jsonl", help="File to write; it must not exist.")
    ],
    goal_set: Annotated[
        str | None, typer.Option(help="How wrong goals are drawn.  [default: the set's first]")
    ] = None,
    goals: Goals = 20,
    limit: Limit = None,
    seed: Annotated[int, typer.Option(help="Seed for drawing wrong goals.")] = 1,
    folder: Data = None,
) -> None:
    """Write a dataset's dialogues and goals as JSON Lines, with the true goal under "true".

    `infer`, `bench dialogues --jsonl` and `fit` read such files.
    """
    from goalscope.datasets import data_folder, load
    from goalscope.datasets.case import write_cases

    set, _, split = name.partition(":")
    found = load(
        set,
        data_folder(folder),
        split=split or None,
        goal_set=goal_set,
        goals=goals,
        seed=seed,
        limit=limit,
    )
    write_cases(found, out)
    say(f"{out}: {pluralize(len(found), 'dialogue')}", stderr=True)
