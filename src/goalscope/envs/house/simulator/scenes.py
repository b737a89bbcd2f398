"""Scenes: built-in, from the user's folder, or from files, which are validated."""

from __future__ import annotations

import gzip
import json
import math
import os
import re
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, astuple, dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import Field

from goalscope.base.inputs import shown, validated
from goalscope.base.text import without_invisible
from goalscope.base.types import InvalidInputError
from goalscope.base.user_dirs import user_data
from goalscope.envs.house.simulator.geometry import box_metadata
from goalscope.envs.house.simulator.object_types import LIQUIDS
from goalscope.envs.house.simulator.rooms import read_room
from goalscope.envs.house.simulator.state import Scene, State

MOST_BYTES = 64 * 2**20

MOST_OBJECTS = 2000
MOST_TEXT = 200
"""Limits of a scene: 2,000 objects, names of 200 characters."""

MOST_SIZE = 100.0
"""Longest side of an object, in m."""

_FLAGS = (
    "receptacle", "toggleable", "isToggled", "breakable", "isBroken", "canFillWithLiquid",
    "isFilledWithLiquid", "dirtyable", "isDirty", "canBeUsedUp", "isUsedUp", "cookable",
    "isCooked", "isHeatSource", "isColdSource", "sliceable", "isSliced", "openable", "isOpen",
    "pickupable", "isPickedUp", "moveable",
)  # fmt: skip


_Number = Annotated[float, Field(gt=-1e6, lt=1e6)]
_Side = Annotated[float, Field(ge=0, le=MOST_SIZE)]


@dataclass(frozen=True, slots=True)
class _Vector:
    x: _Number
    y: _Number
    z: _Number


@dataclass(frozen=True, slots=True)
class _Size:
    x: _Side
    y: _Side
    z: _Side


@dataclass(frozen=True, slots=True)
class _Box:
    center: _Vector | None = None
    size: _Size = _Size(0.1, 0.1, 0.1)
    cornerPoints: Any = None


@dataclass(frozen=True, slots=True)
class _Agent:
    position: _Vector
    rotation: _Vector
    cameraHorizon: _Number = 0.0
    isStanding: bool = True


@dataclass(frozen=True, slots=True)
class _Object:
    """What the house reads of an object's metadata besides its names and flags."""

    position: _Vector
    rotation: _Vector = _Vector(0.0, 0.0, 0.0)
    fillLiquid: Annotated[str, Field(max_length=20)] | None = None
    temperature: Literal["RoomTemp", "Hot", "Cold"] = "RoomTemp"
    openness: Annotated[float, Field(ge=0, le=1)] | None = None
    mass: _Number = 0.0
    parentReceptacles: list[str] | None = None
    receptacleObjectIds: list[str] | None = None
    controlledObjects: list[str] | None = None
    axisAlignedBoundingBox: _Box | None = None


def read_scene(path: str | Path) -> Scene:
    """Read a file: AI2-THOR's metadata (.json, .json.gz), or a room in our own form (.toml).

    Raises:
        InvalidInputError: It cannot be read, or is of neither form.
    """
    path = Path(path)
    if path.suffix == ".toml":
        return read_room(path)
    return scene_from_metadata(_json(path), label=path.name, name=path.name.partition(".")[0])


def known_scenes() -> dict[str, Callable[[], Scene]]:
    """Readers of all scenes by name: built-in ones, and those in `scenes_folder()`.

    A file's scene goes by the file's name without its endings; ours go before files of their names.
    """
    found: dict[str, Callable[[], Scene]] = {
        path.name.partition(".")[0]: lambda path=path: read_scene(path) for path in _kept()
    }
    return dict(sorted((found | _own()).items()))


def _own() -> dict[str, Callable[[], Scene]]:
    return {
        entry.name.removesuffix(".toml"): lambda entry=entry: read_room(entry)
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
    return Path(given) if given else user_data() / "scenes"


def import_scene(path: Path, name: str | None = None, *, force: bool = False) -> tuple[str, Scene]:
    """Check a scene file and save it in `scenes_folder()`, completely or not at all.

    Args:
        path: See `read_scene`.
        name: Name of the scene; by default, the file's name without suffixes.
        force: Replace a scene of this name that was imported before.

    Returns:
        The name, by which `load_scene` now finds it, and the scene.

    Raises:
        InvalidInputError: The file is not a scene, the agent cannot stand anywhere in it, the name
            is taken or has characters other than letters, digits, "_" and "-", or the folder is not
            writable.
    """
    scene = read_scene(path)
    State(scene)
    title = name or path.name.partition(".")[0]
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,80}", title):
        raise InvalidInputError(
            f"{title!r} is not a valid scene name. Use letters, digits, _ and -."
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
            f"Cannot save the scene in {folder}: {error.strerror}. Set GOALSCOPE_SCENES to a "
            "writable folder."
        ) from None
    return title, scene


def _check_is_free(title: str, force: bool) -> None:
    if title in _own():
        raise InvalidInputError(
            f"{title!r} is the name of a built-in scene. Choose another with --name."
        )
    taken = [path.name for path in _kept() if path.name.partition(".")[0] == title]
    others = [each for each in taken if each != f"{title}.json.gz"]
    if others:
        raise InvalidInputError(
            f"The scene {title!r} already exists as {others[0]} in {scenes_folder()}. Remove "
            "that file, or choose another name with --name."
        )
    if taken and not force:
        raise InvalidInputError(
            f"The scene {title!r} already exists. Replace it with --force, or choose another "
            "name with --name."
        )


def load_scene(name: str) -> Scene:
    """The scene of this name ("Kitchen1"), or in this file ("scenes/FloorPlan1_physics.json.gz").

    Case is ignored if the name is unambiguous.

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
        f"There is no scene {name!r}. Choose one of {', '.join(scenes)}, or name a file. "
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
            f"Cannot read the scene {path.name}: {reason}. Name a JSON file."
        ) from None
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"The scene {path.name} is not valid JSON: {error}.") from None


def scene_from_metadata(metadata: Any, *, label: str, name: str | None = None) -> Scene:
    """A scene of what AI2-THOR's `event.metadata` holds, or of {objectId: object metadata}.

    Args:
        metadata: As parsed from JSON; nothing in it is trusted.
        label: What to call it in errors.
        name: Name of the scene, where the metadata gives none.

    Raises:
        InvalidInputError: It is no such metadata; the message names the object and the key.
    """
    if not isinstance(metadata, dict):
        raise InvalidInputError(
            f"{label}: expected a JSON object with AI2-THOR's metadata, "
            f"not {type(metadata).__name__}. Save `event.metadata` with json.dump."
        )
    table = cast("dict[str, Any]", metadata)
    listed: object = table["objects"] if "objects" in table else list(table.values())
    if not isinstance(listed, list) or not listed:
        raise InvalidInputError(f"{label}: there are no objects in it.")
    rows = cast("list[Any]", listed)
    if len(rows) > MOST_OBJECTS:
        raise InvalidInputError(
            f"{label}: {len(rows):,} objects; a scene may have {MOST_OBJECTS:,}."
        )
    objects = tuple(_object(row, f"{label}, object {n}") for n, row in enumerate(rows, 1))
    ids = [each["objectId"] for each in objects]
    for each in ids:
        if ids.count(each) > 1:
            raise InvalidInputError(f"{label}: two objects have the id {each!r}.")
    held = [each["objectId"] for each in objects if each["isPickedUp"]]
    if len(held) > 1:
        raise InvalidInputError(
            f"{label}: {held[0]!r} and {held[1]!r} are both picked up; a hand holds one thing."
        )
    agent = table.get("agent")
    if agent is not None:
        agent = {
            "name": "agent",
            **asdict(validated(_known(agent, _Agent), _Agent, f"{label}, agent")),
            "inHighFrictionArea": False,
        }
    title = table.get("sceneName") or name or "Imported"
    if not _is_text(title, MOST_TEXT):
        raise InvalidInputError(f"{label}: 'sceneName' must be a short text.")
    odd = sorted({str(each["fillLiquid"]) for each in rows if _is_odd_liquid(each)})
    note = f"The house knows no {' or '.join(odd[:5])}: what holds it counts as filled."
    return Scene(str(title), objects, agent, (note,) if odd else ())


def _object(row: Any, label: str) -> dict[str, Any]:
    """The object's metadata with every key that the house needs, checked."""
    if not isinstance(row, dict):
        raise InvalidInputError(f"{label}: expected a JSON object, not {type(row).__name__}.")
    given = cast("dict[str, Any]", row)
    names = {key: given.get(key) for key in ("objectId", "objectType")}
    names["name"] = given.get("name", names["objectId"])
    for key, text in names.items():
        if not text or not _is_text(text, MOST_TEXT):
            raise InvalidInputError(
                f"{label}: {key!r} must be a text of 1 to {MOST_TEXT} characters without control "
                "characters. Is this the metadata of AI2-THOR 5?"
            )
    label = f"{label} {given['objectId']!r}"
    flags = validated({key: given.get(key, False) for key in _FLAGS}, dict[str, bool], label)
    thing = validated(_known(given, _Object), _Object, label)
    ids = (thing.parentReceptacles, thing.receptacleObjectIds, thing.controlledObjects)
    for own in [own for each in ids for own in each or ()]:
        if not _is_text(own, MOST_TEXT):
            raise InvalidInputError(f"{label}: {shown(own)} is no id of an object.")
    if thing.fillLiquid and not _is_text(thing.fillLiquid, 20):
        raise InvalidInputError(f"{label}: 'fillLiquid' must be a short text or null.")
    openness = float(flags["isOpen"]) if thing.openness is None else thing.openness
    box = thing.axisAlignedBoundingBox or _Box()
    materials = given.get("salientMaterials")
    return {
        **names,
        "assetId": given["assetId"] if _is_text(given.get("assetId"), MOST_TEXT) else "",
        "visible": False,
        "isInteractable": False,
        "distance": 0.0,
        **flags,
        **asdict(thing),
        "receptacleObjectIds": thing.receptacleObjectIds or ([] if flags["receptacle"] else None),
        "fillLiquid": thing.fillLiquid if thing.fillLiquid in LIQUIDS else None,
        "openness": openness,
        "salientMaterials": [
            each for each in cast("list[Any]", materials)[:20] if _is_text(each, 40)
        ]
        if isinstance(materials, list)
        else None,
        "isMoving": False,
        "axisAlignedBoundingBox": box_metadata(
            astuple(box.center or thing.position), astuple(box.size)
        ),
        "objectOrientedBoundingBox": _oriented(given.get("objectOrientedBoundingBox")),
    }


def _known(given: Any, kind: type) -> Any:
    """The keys that a dataclass has: AI2-THOR writes many more."""
    if not isinstance(given, dict):
        return given
    table = cast("dict[str, Any]", given)
    return {each.name: table[each.name] for each in fields(kind) if each.name in table}


def _is_odd_liquid(given: Mapping[str, Any]) -> bool:
    return given.get("fillLiquid") not in (None, *LIQUIDS)


def _is_text(value: Any, most: int) -> bool:
    """Whether it is short, and without invisible characters and a model's control tokens."""
    is_short = isinstance(value, str) and len(value) <= most
    return is_short and "<|" not in value and without_invisible(value) == value


def _oriented(value: Any) -> dict[str, Any] | None:
    corners: Any = (
        cast("dict[str, Any]", value).get("cornerPoints") if isinstance(value, dict) else 0
    )
    if not isinstance(corners, Sequence) or len(cast("Sequence[Any]", corners)) != 8:
        return None
    try:
        points = [[float(each) for each in corner] for corner in cast("Any", corners)]
    except (TypeError, ValueError, OverflowError):
        return None
    if any(len(point) != 3 or not all(map(math.isfinite, point)) for point in points):
        return None
    return {"cornerPoints": points}
