"""`goalscope house`: scenes, their pictures, and how far the embedded house is like AI2-THOR."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from goalscope.cli.options import Json
from goalscope.cli.terminal import console, progress
from goalscope.types import InvalidInputError, counted

if TYPE_CHECKING:
    from goalscope.envs.house.simulator.conformance import Agreement

__all__ = ["house"]

house = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="The home robot's rooms, and the embedded house beside AI2-THOR.",
)


@house.command()
def scenes(as_json: Json = False) -> None:
    """List the rooms that `--scene` knows, and what is wrong with those that cannot be used."""
    from goalscope.envs.house.simulator.scenes import known_scenes
    from goalscope.plain import plain

    rows: list[dict[str, Any]] = []
    for name, read in known_scenes().items():
        try:
            count = len(read().objects)
        except InvalidInputError as error:
            row, text = {"name": name, "error": str(error)}, f"cannot be used: {error}"
        else:
            row, text = {"name": name, "objects": count}, counted(count, "object")
        rows.append(row)
        if not as_json:
            console().print(plain(f"{name}  {text}"))
    if as_json:
        print(json.dumps(rows))


@house.command()
def show(
    scene: Annotated[str, typer.Argument(help="Name of a room, or its file.")],
    svg: Annotated[Path | None, typer.Option(help="Draw it into this file instead.")] = None,
) -> None:
    """Tell what is in a room, or draw it from above."""
    from goalscope.envs.house.picture.floor_plan import floor_plan
    from goalscope.envs.house.picture.svg import svg_picture, told
    from goalscope.envs.house.simulator.controller import HouseController

    metadata = HouseController(scene).last_event.metadata
    if svg is None:
        console().print(told(floor_plan(metadata)))
        return
    try:
        svg.write_text(svg_picture(metadata), encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(
            f"The picture cannot be written to {svg}: {error.strerror}. Give another file."
        ) from None


@house.command(name="import")
def import_file(
    file: Annotated[Path, typer.Argument(help="AI2-THOR's `event.metadata` as JSON, or a room.")],
    name: Annotated[str | None, typer.Option(help="What to call it, if not as the file.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace one of this name.")] = False,
) -> None:
    """Keep a scene that AI2-THOR printed, for `--scene`.

    The file holds `event.metadata`, or {objectId: object metadata}, or a room in goalscope's own
    form (.toml); .json.gz is read, too. A scene that is broken is refused, and nothing is kept.
    """
    from goalscope.envs.house.simulator.scenes import import_scene
    from goalscope.plain import plain

    title, scene = import_scene(file, name, force=force)
    for note in scene.notes:
        console().print(plain(note))
    console().print(plain(f"{title}: {counted(len(scene.objects), 'object')}. Try: "
                          f"goalscope chat house --scene {title}"))  # fmt: skip


@house.command()
def conformance(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(help="Recordings of AI2-THOR 5, or folders of them (.jsonl, .jsonl.gz)."),
    ] = None,
    teach: Annotated[Path | None, typer.Option(help="File of TEACh games to replay.")] = None,
    scenes: Annotated[
        Path | None,
        typer.Option(
            help="AI2-THOR's scenes.  [default: $GOALSCOPE_DATA/thor/scenes, imported ones]"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure how far the embedded house does what AI2-THOR did.

    A recording has one step a line: {"action": {...}, "metadata": what AI2-THOR said after it}.
    The house is set to each real state, given the next action, and compared with the next state.
    TEACh's games are replayed from their start by what people did with success: "success_agreement"
    is then the share that the house accepts, and F1 is that of the final object states. With both,
    the figures of TEACh stand under "teach".
    """
    from goalscope.envs.house.simulator.conformance import Agreement, compare_episode, recordings

    if not paths and teach is None:
        raise InvalidInputError("Name recordings, or a file of TEACh games with --teach.")
    agreement = Agreement()
    files = recordings(paths or [])
    with progress("Recordings") as show:
        for number, file in enumerate(files, 1):
            compare_episode(file, agreement)
            show(number, len(files))
    results = {"recordings": agreement} if files else {}
    if teach is not None:
        results["teach"] = _replayed(teach, scenes)
    if as_json:
        first, *others = results.items()
        told = {name: each.as_json() for name, each in others}
        print(json.dumps(first[1].as_json() | told))
        return
    for name, each in results.items():
        _show(name, each)


def _replayed(file: Path, scenes: Path | None) -> Agreement:
    import os
    from itertools import count

    from goalscope.envs.house.simulator.conformance import Agreement, rows
    from goalscope.envs.house.simulator.teach import replay_games

    data = os.environ.get("GOALSCOPE_DATA")
    folder = scenes or (Path(data) / "thor" / "scenes" if data else None)
    agreement = Agreement()
    total, numbers = sum(1 for _ in rows(file)), count(1)
    with progress("Games") as show:
        replay_games(file, folder, agreement, lambda: show(next(numbers), total))
    return agreement


def _show(name: str, agreement: Agreement) -> None:
    from rich.table import Table

    from goalscope.plain import plain

    out = console()
    out.print(plain(
        f"{name}: {counted(agreement.steps, 'action')}, success agrees in "
        f"{agreement.success_agreement:.1%}; changed states: precision {agreement.precision:.3f}, "
        f"recall {agreement.recall:.3f}, F1 {agreement.f1:.3f}", "bold",
    ))  # fmt: skip
    table = Table("difference", "action", "predicate", "count")
    for kind, counts in (("missed", agreement.missed), ("extra", agreement.extra)):
        for (action, predicate), count in counts.most_common(12):
            table.add_row(kind, plain(action), plain(predicate), str(count))
    for (action, message), count in agreement.refused.most_common(12):
        table.add_row("success", plain(action), plain(message), str(count))
    if table.row_count:
        out.print(table)
