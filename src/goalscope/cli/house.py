"""`goalscope house`: the home robot's rooms, and maps of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Json
from goalscope.cli.terminal import console

house = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="The home robot's rooms.",
)


@house.command()
def scenes(as_json: Json = False) -> None:
    """List the rooms for `--scene`, and why some cannot be used."""
    from goalscope.base.text import terminal_safe
    from goalscope.envs.house.simulator.scenes import known_scenes

    rows: list[dict[str, Any]] = []
    for name, read in known_scenes().items():
        try:
            count = len(read().objects)
        except InvalidInputError as error:
            row, text = {"name": name, "error": str(error)}, f"cannot be used: {error}"
        else:
            row, text = {"name": name, "objects": count}, pluralize(count, "object")
        rows.append(row)
        if not as_json:
            console().print(terminal_safe(f"{name}  {text}"))
    if as_json:
        print(json.dumps(rows))


@house.command()
def show(
    scene: Annotated[str, typer.Argument(help="Name or file of a room.")],
    svg: Annotated[
        Path | None, typer.Option(help="Draw a map of the room to this SVG file instead.")
    ] = None,
) -> None:
    """Print the contents of a room, or draw a map of it."""
    from goalscope.base.text import terminal_safe
    from goalscope.envs.house.room_map import RoomMap
    from goalscope.envs.house.simulator.controller import HouseController

    room = RoomMap(HouseController(scene).last_event.metadata)
    if svg is None:
        console().print(terminal_safe(room.text()))
        return
    try:
        svg.write_text(room.svg(), encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(
            f"Cannot write the picture to {svg}: {error.strerror}. Name another file."
        ) from None


@house.command(name="import")
def import_file(
    file: Annotated[Path, typer.Argument(help="AI2-THOR's `event.metadata` as JSON, or a room.")],
    name: Annotated[
        str | None, typer.Option(help="Name of the scene.  [default: the file's name]")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace an existing scene of this name.")
    ] = False,
) -> None:
    """Import a scene from AI2-THOR for `--scene`.

    The file holds `event.metadata`, or {objectId: object metadata}, or a room in goalscope's own
    format (.toml); .json.gz works, too. A broken scene is refused, and nothing is saved.
    """
    from goalscope.base.text import terminal_safe
    from goalscope.envs.house.simulator.scenes import import_scene

    title, scene = import_scene(file, name, force=force)
    for note in scene.notes:
        console().print(terminal_safe(note))
    console().print(terminal_safe(f"{title}: {pluralize(len(scene.objects), 'object')}. Try: "
                          f"goalscope chat house --scene {title}"))  # fmt: skip
