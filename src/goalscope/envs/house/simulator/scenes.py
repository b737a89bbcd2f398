"""Where scenes come from: those that come with goalscope, a folder of the user's, or a file."""

from __future__ import annotations

import gzip
import json
import os
import re
import zlib
from collections.abc import Callable
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

import platformdirs

from goalscope.envs.house.simulator.rooms import read_room
from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.state import State
from goalscope.types import InvalidInputError

__all__ = ["import_scene", "known_scenes", "load_scene", "read_scene", "scenes_folder"]

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
    """Readers of all scenes by name: those of goalscope, and those in `scenes_folder()`.

    A file's scene goes by the file's name without its endings; ours go before files of their names.
    """
    found: dict[str, Callable[[], Scene]] = {
        path.name.partition(".")[0]: lambda path=path: read_scene(path) for path in _kept()
    }
    return dict(sorted((found | _own()).items()))


def _own() -> dict[str, Callable[[], Scene]]:
    return {
        entry.name.removesuffix(".toml"): lambda entry=entry: read_room(entry, label=entry.name)
        for entry in (files("goalscope.envs.house") / "data" / "scenes").iterdir()
        if entry.name.endswith(".toml")
    }


def _kept() -> list[Path]:
    """The scene files in the folder; none where there is no folder."""
    folder = scenes_folder()
    return [
        path
        for path in sorted(folder.iterdir() if folder.is_dir() else ())
        if path.name.endswith((".json", ".json.gz", ".toml"))
        and path.name[0] != "."
        and path.is_file()
    ]


def scenes_folder() -> Path:
    """$GOALSCOPE_SCENES, or `scenes` in the user's data folder."""
    given = os.environ.get("GOALSCOPE_SCENES")
    return Path(given) if given else platformdirs.user_data_path("goalscope", False) / "scenes"


def import_scene(path: Path, name: str | None = None, *, force: bool = False) -> tuple[str, Scene]:
    """Check a scene file and keep it in `scenes_folder()`, whole or not at all.

    Args:
        path: See `read_scene`.
        name: What to call it; None takes the file's name without its endings.
        force: Replace a scene of this name that was imported before.

    Returns:
        The name, by which `load_scene` now finds it, and the scene.

    Raises:
        InvalidInputError: The file is no scene, the agent could stand nowhere in it, the name has
            other characters than letters, digits, "_" and "-" or is taken, or the folder cannot be
            written.
    """
    scene = read_scene(path)
    State(scene)
    title = name or path.name.partition(".")[0]
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,80}", title):
        raise InvalidInputError(
            f"{title!r} cannot be a scene's name; use letters, digits, _ and -."
        )
    folder = scenes_folder()
    _check_is_free(title, force)
    kept = {"sceneName": title, "agent": scene.agent, "objects": scene.objects}
    part = folder / f".{title}.{os.getpid()}.part"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part.write_bytes(gzip.compress(json.dumps(kept).encode()))
        part.replace(folder / f"{title}.json.gz")
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise InvalidInputError(
            f"The scene cannot be kept in {folder}: {error.strerror}. Set GOALSCOPE_SCENES to a "
            "folder that can be written."
        ) from None
    return title, scene


def _check_is_free(title: str, force: bool) -> None:
    if title in _own():
        raise InvalidInputError(
            f"{title!r} is the name of one of goalscope's own scenes; give another with --name."
        )
    taken = [path.name for path in _kept() if path.name.partition(".")[0] == title]
    others = [each for each in taken if each != f"{title}.json.gz"]
    if others:
        raise InvalidInputError(
            f"The scene {title!r} is there already, as {others[0]} in {scenes_folder()}. Remove "
            "that file, or give another name with --name."
        )
    if taken and not force:
        raise InvalidInputError(
            f"The scene {title!r} is there already. Replace it with --force, or give another name "
            "with --name."
        )


def load_scene(name: str) -> Scene:
    """The scene of this name ("Kitchen1"), or in this file ("scenes/FloorPlan1_physics.json.gz").

    Upper and lower case are one where only one scene has such a name.

    Raises:
        InvalidInputError: There is no such scene, or its file cannot be used.
    """
    scenes = known_scenes()
    for known in (name, f"{name}_physics"):
        if known in scenes:
            return scenes[known]()
    alike = [each for each in scenes if each.casefold() == name.casefold()]
    if len(alike) == 1:
        return scenes[alike[0]]()
    if "." in name or "/" in name:
        return read_scene(name)
    raise InvalidInputError(
        f"There is no scene {name!r}. There are: {', '.join(scenes)}; or give a file. "
        "`goalscope house import FILE` adds more."
    )


def _json(path: Path) -> Any:
    opener = gzip.open if path.suffix == ".gz" else open
    try:
        with opener(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise InvalidInputError(f"{path.name}: larger than {MOST_BYTES >> 20} MiB.")
        return json.loads(data)
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInputError(
            f"The scene {path.name} cannot be read: {reason}. Give the path of a JSON file."
        ) from None
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"The scene {path.name} is not valid JSON: {error}.") from None
