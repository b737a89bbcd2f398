"""`goalscope house`: the home robot's rooms, and maps of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Json
from goalscope.cli.terminal import say

house = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="The home robot's rooms.")


@house.command()
def scenes(as_json: Json = False) -> None:
    """List the rooms for `--scene`: built-in ones, and the files in $GOALSCOPE_SCENES.

    A file holds AI2-THOR's `event.metadata` (.json, .json.gz) or a room in goalscope's own format
    (.toml). If it cannot be used, the list says why.
    """
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
        say(f"{row['name']}  {text}")


@house.command()
def show(
    scene: Annotated[str, typer.Argument(help="Name or file of a room.")],
    svg: Annotated[Path | None, typer.Option(help="Draw a map to this SVG file instead.")] = None,
) -> None:
    """Print the contents of a room, or draw a map of it."""
    from goalscope.envs.house.room_map import RoomMap
    from goalscope.envs.house.simulator.world import HouseController

    room = RoomMap(HouseController(scene).last_event.metadata)
    if svg is None:
        say(room.text())
    else:
        svg.write_text(room.svg(), encoding="utf-8")
