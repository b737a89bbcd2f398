"""What is read as a scene, what is refused with its cause, and where scenes are found."""

from __future__ import annotations

import gzip
import json
import math
import os
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import InvalidInputError
from goalscope.envs.house.simulator import scenes
from goalscope.envs.house.simulator.scenes import (
    known_scenes,
    load_scene,
    read_scene,
    scene_from_metadata,
)
from goalscope.envs.house.simulator.state import Scene, State
from goalscope.envs.house.simulator.world import House

LAMP, TABLE, BOOK = "FloorLamp|+01|+00|+01", "DiningTable|+02|+00|+02", "Book|+02|+00.7|+02"
OWN = ["Bathroom1", "Bedroom1", "Kitchen1", "LivingRoom1"]


def placed(own: str, x: float, y: float, size: float, **facts: Any) -> dict[str, Any]:
    """An object's metadata; it is a cube."""
    center = {"x": x, "y": y + size / 2, "z": x}
    box = {"center": center, "size": dict.fromkeys("xyz", size)}
    kind = own.partition("|")[0]
    position = {"x": x, "y": y, "z": x}
    rest = {"position": position, "axisAlignedBoundingBox": box}
    return {"objectId": own, "objectType": kind, **rest, **facts}


def metadata(**book: Any) -> dict[str, Any]:
    """What AI2-THOR prints of a small room; `book` alters one of its objects."""
    floor = placed("Floor|+02|+00|+02", 2, -4, 4, receptacle=True)
    lamp = placed(LAMP, 1, 0, 0.4, toggleable=True)
    table = placed(TABLE, 2, 0, 0.7, receptacle=True, receptacleObjectIds=[BOOK])
    given = placed(BOOK, 2, 0.7, 0.1, pickupable=True, parentReceptacles=[TABLE]) | book
    turn = {"x": 0, "y": 90, "z": 0}
    agent = {"position": {"x": 3, "y": 0.9, "z": 3}, "rotation": turn, "cameraHorizon": 30}
    return {"objects": [floor, lamp, table, given], "agent": agent, "sceneName": "Room_physics"}


def read(data: Any) -> Scene:
    return scene_from_metadata(data, label="room")


def save(path: Path, data: Any) -> Path:
    text = json.dumps(data).encode()
    path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where scenes are kept; not there yet."""
    monkeypatch.setenv("GOALSCOPE_SCENES", str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_metadata_becomes_a_scene() -> None:
    scene = read(
        metadata(
            mass=0.5,
            temperature="Cold",
            assetId="Book\x1b",
            salientMaterials=["Paper", "a\nb", 5, "<|x"],
            evil="<b>",
        )
    )
    book = scene.objects[3]
    assert "evil" not in book
    assert (scene.name, len(scene.objects)) == ("Room_physics", 4)
    assert (book["mass"], book["temperature"], book["assetId"]) == (0.5, "Cold", "")
    assert (book["salientMaterials"], book["parentReceptacles"]) == (["Paper"], [TABLE])
    assert (book["openable"], book["isOpen"], book["openness"]) == (False, False, 0.0)
    assert scene.objects[0]["receptacleObjectIds"] == []
    assert book["receptacleObjectIds"] is None
    home = House(scene)
    assert home.metadata()["agent"]["rotation"]["y"] == 90
    assert home.step({"action": "ToggleObjectOn", "objectId": LAMP, "forceAction": True})[
        "lastActionSuccess"
    ]


def test_what_the_house_prints_is_a_scene_with_the_same_facts() -> None:
    before = House(read(metadata())).metadata()
    after = House(read(json.loads(json.dumps(before)))).metadata()
    assert after == before


NESTED: Any = 0
for _ in range(600):
    NESTED = [NESTED]

BAD_TEXTS = {
    "control": "Book\x1b[2J",
    "bidi": "Book\u202egpj",
    "template": "<|im_start|>system",
    "empty": "",
    "10 MB": "B" * 10**7,
    "number": 5,
}


@pytest.mark.parametrize("text", BAD_TEXTS.values(), ids=BAD_TEXTS.keys())
@pytest.mark.parametrize("key", ["objectId", "objectType", "name"])
def test_names_that_a_screen_or_a_model_would_obey_are_refused(key: str, text: Any) -> None:
    with pytest.raises(InvalidInputError) as error:
        read(metadata(**{key: text}))
    assert "room, object 4" in str(error.value)
    assert len(str(error.value)) < 300


BAD_VALUES: dict[str, list[Any]] = {
    "position": [None, [1, 2, 3], {"x": 1}, {"x": 1, "y": math.nan, "z": 1}, NESTED,
                 {"x": 1e9, "y": 1, "z": 1}, {"x": "1", "y": 1, "z": 1}],
    "isOpen": [1, None],
    "openness": [1.1, "half"],
    "mass": [None, -math.inf, 10**5000],
    "temperature": ["Warm"],
    "fillLiquid": [5, "w" * 21, "water\x1b[0m", "<|im_end|>"],
    "parentReceptacles": ["DiningTable", [5], ["a\nb"], ["x" * 201]],
    "axisAlignedBoundingBox": [{"size": {"x": -1, "y": 1, "z": 1}},
                               {"size": {"x": 1e5, "y": 1, "z": 1}}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("key", "value"), [(key, value) for key, values in BAD_VALUES.items() for value in values],
    ids=[f"{key} {n}" for key, values in BAD_VALUES.items() for n in range(len(values))],
)  # fmt: skip
def test_a_bad_value_is_refused_with_its_object(key: str, value: Any) -> None:
    with pytest.raises(InvalidInputError, match="room, object 4 'Book") as error:
        read(metadata(**{key: value}))
    assert len(str(error.value)) < 300


BAD_METADATA: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "list": (lambda data: [data], "expected a JSON object with AI2-THOR's metadata, not list"),
    "empty": (lambda data: {}, "no objects in it"),
    "object no object": (lambda data: data | {"objects": [5]}, "object 1: expected a JSON object"),
    "twice": (lambda data: data | {"objects": data["objects"] * 2}, "two objects have the id"),
    "too many": (lambda data: data | {"objects": [{}] * 2001}, "2,001 objects; a scene may have"),
    "scene's name": (lambda data: data | {"sceneName": "a\nb"}, "room, sceneName: it has"),
    "nowhere": (lambda data: data | {"agent": {}}, "room, agent: the key 'position' is missing"),
    "two hands": (
        lambda data: data | {"objects": [each | {"isPickedUp": True} for each in data["objects"]]},
        "are both picked up; a hand holds one thing",
    ),
}


@pytest.mark.parametrize(("alter", "message"), BAD_METADATA.values(), ids=BAD_METADATA.keys())
def test_metadata_of_another_form_is_refused(alter: Any, message: str) -> None:
    with pytest.raises(InvalidInputError) as error:
        read(alter(metadata()))
    assert message in str(error.value)


def test_lists_that_go_round_in_a_circle_end() -> None:
    data = metadata(receptacle=True, receptacleObjectIds=[TABLE, BOOK])
    data["objects"][2] |= {"parentReceptacles": [BOOK], "pickupable": True}
    home = House(read(data))
    for action in ("PickupObject", "DropHandObject", "PickupObject"):
        own = {"objectId": BOOK} if action == "PickupObject" else {}
        assert home.step({"action": action, "forceAction": True, **own})["lastActionSuccess"]


def test_a_room_too_large_to_walk_through_is_refused() -> None:
    data = metadata(position={"x": 9e5, "y": 0, "z": 0})
    data["objects"] = data["objects"][1:]
    data["objects"][2].pop("axisAlignedBoundingBox")
    with pytest.raises(InvalidInputError, match="a scene may have 100 m"):
        State(read(data))


def test_a_room_without_free_floor_is_refused() -> None:
    data = metadata()
    del data["agent"]
    data["objects"][0] = placed("Floor|+02|+00|+02", 2, -0.3, 0.3)
    with pytest.raises(InvalidInputError, match="no free floor to stand on"):
        State(read(data))


def test_a_file_in_the_folder_is_found_by_its_name_after_our_own_scenes(folder: Path) -> None:
    assert list(known_scenes()) == OWN
    folder.mkdir()
    for name in ("FloorPlan7_physics.json.gz", "Mine.json", "Kitchen1.json", ".hidden.json"):
        save(folder / name, metadata(mass=7.0))
    assert sorted(known_scenes()) == sorted([*OWN, "FloorPlan7_physics", "Mine"])
    for name in ("FloorPlan7_physics", "FloorPlan7", "mine"):
        assert load_scene(name).objects[3]["mass"] == 7
    assert load_scene("Kitchen1").name == "Kitchen1"


@pytest.mark.parametrize(("liquid", "known"), [("wine", "wine"), (None, None), ("milk", None)])
def test_a_liquid_that_the_house_does_not_know_is_left_out_and_told(
    liquid: str | None, known: str | None
) -> None:
    scene = read(metadata(fillLiquid=liquid, isFilledWithLiquid=True))
    assert (scene.objects[3]["fillLiquid"], scene.objects[3]["isFilledWithLiquid"]) == (known, True)
    told = "The house knows no milk: what holds it counts as filled."
    assert scene.notes == ((told,) if liquid != known else ())


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Nowhere", "There is no scene 'Nowhere'. Choose one of Bathroom1, Bedroom1, Kitchen1"),
        ("nowhere.json", "Cannot read the scene nowhere.json: No such file"),
        ("a\0b.json", "is not valid JSON: embedded null byte"),
    ],
)
def test_a_scene_that_is_not_there_is_told(name: str, message: str, folder: Path) -> None:
    with pytest.raises(InvalidInputError) as error:
        load_scene(name)
    assert message in str(error.value)


GOOD_GZ = gzip.compress(json.dumps(metadata()).encode())
BAD_FILES = {
    "a.json": b"{",
    "f.json.gz": b"no gzip",
    "g.json.gz": GOOD_GZ[:50],
    "i.json.gz": GOOD_GZ[:-8] + bytes(8),
}


@pytest.mark.parametrize(("name", "data"), BAD_FILES.items(), ids=BAD_FILES)
def test_a_broken_file_is_refused_by_its_name(name: str, data: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InvalidInputError, match=rf"[Tt]he scene {name}(:| is not valid)"):
        read_scene(tmp_path / name)


def test_a_packed_file_that_swells_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    chunk = b" " * 2**20
    bomb = b"".join(packer.compress(chunk) for _ in range(65)) + packer.flush()
    (tmp_path / "bomb.json.gz").write_bytes(bomb)
    assert len(bomb) < 100_000
    with pytest.raises(InvalidInputError, match=r"bomb\.json\.gz: larger than 64 MiB"):
        read_scene(tmp_path / "bomb.json.gz")
    monkeypatch.setattr(scenes, "MOST_BYTES", 100)
    with pytest.raises(InvalidInputError, match="larger than"):
        read_scene(save(tmp_path / "plain.json", metadata()))


def test_every_real_scene_loads() -> None:
    data = os.environ.get("GOALSCOPE_DATA")
    if not data:
        pytest.skip("GOALSCOPE_DATA is unset: it names the folder with AI2-THOR's scenes")
    paths = sorted((Path(data) / "thor" / "scenes").glob("*.json.gz"))
    assert len(paths) == 120
    for path in paths:
        home = House(read_scene(path))
        assert home.step({"action": "Pass"})["lastActionSuccess"]
        assert len(home.state.reachable()) > 20, path.name
