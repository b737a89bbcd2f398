"""Where scenes come from: those that come with goalscope, a folder of the user's, or a file."""

from __future__ import annotations

import gzip
import json
import os
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

from goalscope.envs.house.rooms import read_room
from goalscope.envs.house.scene import Scene
from goalscope.types import InvalidInputError

__all__ = ["known_scenes", "load_scene", "read_scene"]

MOST_BYTES = 64 * 2**20


def read_scene(path: str | Path) -> Scene:
    """Read a file: AI2-THOR's metadata (.json, .json.gz), or a room in our own form (.toml).

    Raises:
        InvalidInputError: It cannot be read, or is of neither form.
    """
    path = Path(path)
    if path.suffix == ".toml":
        return read_room(path, label=path.name)
    return Scene.from_metadata(_json(path), label=path.name, name=path.name.partition(".")[0])


def known_scenes() -> dict[str, Callable[[], Scene]]:
    """Readers of the scenes that come with goalscope, and of those in $GOALSCOPE_SCENES, by name.

    A file's scene goes by the file's name without its endings.
    """
    found: dict[str, Callable[[], Scene]] = {}
    for entry in (files("goalscope.envs.house") / "data" / "scenes").iterdir():
        if entry.name.endswith(".toml"):
            stem = entry.name.removesuffix(".toml")
            found[stem] = lambda entry=entry: read_room(entry, label=entry.name)
    if folder := os.environ.get("GOALSCOPE_SCENES"):
        for path in sorted(Path(folder).iterdir()):
            if path.name.endswith((".json", ".json.gz", ".toml")):
                found[path.name.partition(".")[0]] = lambda path=path: read_scene(path)
    return dict(sorted(found.items()))


def load_scene(name: str) -> Scene:
    """The scene of this name ("Kitchen1"), or in this file ("scenes/FloorPlan1_physics.json.gz").

    Raises:
        InvalidInputError: There is no such scene, or its file cannot be used.
    """
    scenes = known_scenes()
    for known in (name, f"{name}_physics"):
        if known in scenes:
            return scenes[known]()
    if "." in name or "/" in name:
        return read_scene(name)
    raise InvalidInputError(
        f"There is no scene {name!r}. There are: {', '.join(scenes)}; or give a file, "
        "or name a folder of them in GOALSCOPE_SCENES."
    )


def _json(path: Path) -> Any:
    opener = gzip.open if path.suffix == ".gz" else open
    try:
        with opener(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise InvalidInputError(f"{path.name}: larger than {MOST_BYTES >> 20} MiB.")
        return json.loads(data)
    except (OSError, EOFError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInputError(
            f"The scene {path.name} cannot be read: {reason}. Give the path of a JSON file."
        ) from None
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"The scene {path.name} is not valid JSON: {error}.") from None
