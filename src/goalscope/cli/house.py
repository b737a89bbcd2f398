"""`goalscope house`: the home robot's rooms, and maps of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from goalscope.base.text import terminal_safe
from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Json
from goalscope.cli.terminal import console

house = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="The home robot's rooms.")


@house.command()
def scenes(as_json: Json = False) -> None:
    """List the rooms for `--scene`, and why some cannot be used."""
    from goalscope.envs.house.simulator.scenes import known_scenes

    rows: list[dict[str, Any]] = []
    for name, read in known_scenes().items():
        try:
            rows.append({"name": name, "objects": len(read().objects)})
        except InvalidInputError as error:
            rows.append({"name": name, "error": str(error)})
    if as_json:
        print(json.dumps(rows))
        return
    for row in rows:
        broken = f"cannot be used: {row.get('error')}"
        text = pluralize(row["objects"], "object") if "objects" in row else broken
        console().print(terminal_safe(f"{row['name']}  {text}"))


@house.command()
def show(
    scene: Annotated[str, typer.Argument(help="Name or file of a room.")],
    svg: Annotated[Path | None, typer.Option(help="Draw a map to this SVG file instead.")] = None,
) -> None:
    """Print the contents of a room, or draw a map of it."""
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
            f"Cannot write the map to {svg}: {error.strerror}. Name another file."
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
    from goalscope.envs.house.simulator.scenes import import_scene

    title, scene = import_scene(file, name, force=force)
    told = (
        f"{title}: {pluralize(len(scene.objects), 'object')}. Try: goalscope chat house "
        f"--scene {title}"
    )
    for line in (*scene.notes, told):
        console().print(terminal_safe(line))
