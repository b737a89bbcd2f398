"""The numbered map of a room, and the same in words."""

import copy
import math
import xml.etree.ElementTree as ET
from typing import Any

import pytest

from goalscope.envs.house.room_map import MOST, RADIUS, RoomMap
from goalscope.envs.house.simulator.object_types import new_object, object_type, object_types
from houses import do, house

SVG = "{http://www.w3.org/2000/svg}"


def thing(kind: str, x: float, z: float, size: float = 0.1, **more: Any) -> Any:
    """AI2-THOR's metadata of a box that is 1 m high."""
    return new_object(object_type(kind), (x, 0.0, z), (size, 1.0, size), 0.0) | more


def room() -> dict[str, Any]:
    table = thing("DiningTable", 1.0, 1.0, 1.0)
    fridge = thing("Fridge", -1.5, 1.5, 0.8)
    cabinets = [thing("Cabinet", 0.5 * number, -1.8, 0.4) for number in range(3)]
    mug = thing("Mug", 1.2, 1.0, parentReceptacles=[table["objectId"]])
    egg = thing("Egg", -1.5, 1.5, parentReceptacles=[fridge["objectId"]])
    return {
        "sceneName": "FloorPlan1_physics",
        "objects": [thing("Floor", 0.0, 0.0, 4.0), table, fridge, mug, egg, *cabinets],
        "agent": {"position": {"x": 0.0, "y": 0.9, "z": 0.0}, "rotation": {"y": 90.0}},
        "inventoryObjects": [],
    }


def find(metadata: dict[str, Any], kind: str) -> dict[str, Any]:
    return next(each for each in metadata["objects"] if each["objectType"] == kind)


def numbers_on(svg: str) -> list[tuple[str, float, float]]:
    """Text, x and y of each number, those on the map before those of the legend."""
    numbers: list[tuple[str, float, float]] = []
    for group in ET.fromstring(svg).iter(f"{SVG}g"):
        (circle,) = group.iter(f"{SVG}circle")
        at = float(circle.get("cx", 0)), float(circle.get("cy", 0))
        numbers.append((group.findtext(f"{SVG}text", ""), *at))
    return numbers


def test_furniture_is_numbered_row_by_row_with_its_contents() -> None:
    assert RoomMap(room()).text().splitlines() == [
        "Floor Plan 1",
        "The robot (arrow) looks east and holds nothing. North is up.",
        "1. fridge: egg",
        "2. dining table: mug",
        "3. cabinet 1",
        "4. cabinet 2",
        "5. cabinet 3",
    ]


def test_a_rectangle_stands_where_its_box_is() -> None:
    shapes = [each.attrib for each in ET.fromstring(RoomMap(room()).svg()).iter(f"{SVG}rect")]
    (floor,) = (each for each in shapes if each.get("class") == "floor")
    table = next(each for each in shapes if each.get("class") == "place")
    metre = float(floor["width"]) / 4
    assert float(table["width"]) == pytest.approx(metre, abs=0.2)
    assert float(table["x"]) - float(floor["x"]) == pytest.approx(2.5 * metre, abs=0.2)
    assert float(table["y"]) - float(floor["y"]) == pytest.approx(0.5 * metre, abs=0.2)


def test_states_are_shown_and_changes_told_and_marked() -> None:
    before, after = room(), room()
    find(after, "Fridge")["isOpen"] = True
    for each in (before, after):
        find(each, "Mug").update(isDirty=True, fillLiquid="water", isFilledWithLiquid=True)
    egg = find(after, "Egg")
    egg.update(parentReceptacles=None, isPickedUp=True)
    after["inventoryObjects"] = [{"objectId": egg["objectId"], "objectType": "Egg"}]
    drawn = RoomMap(after, before)
    assert "mug (dirty, filled with water)" in drawn.text()
    assert [entry.text for entry in drawn.entries if entry.changed] == ["fridge (open)"]
    assert "holds egg" in drawn.notes[0]
    assert drawn.notes[1] == "Changed: fridge: open; egg: now in the robot's hand."
    marked = [
        each.get("class") for each in ET.fromstring(drawn.svg()).iter()
        if "changed" in each.get("class", "").split()
    ]  # fmt: skip
    assert marked[:3] == ["place changed", "number changed", "number changed"]


HOSTILE = "</text><script>alert(1)</script>[red]\x1b[31m\u202e\x00\ufffe\ud800" + "X" * 10_000_000


def test_hostile_text_is_harmless() -> None:
    metadata = room()
    mug = find(metadata, "Mug")
    metadata["sceneName"] = HOSTILE
    mug.update(objectType=HOSTILE, isFilledWithLiquid=True, fillLiquid=HOSTILE)
    after = copy.deepcopy(metadata)
    find(after, "Fridge")["isOpen"] = True
    svg = RoomMap(after, metadata).svg()
    assert not list(ET.fromstring(svg).iter(f"{SVG}script"))
    assert len(svg) < 100_000
    for sign in ("\x1b", "\u202e", "\x00", "\ufffe"):
        assert sign not in svg


def test_objects_that_hold_each_other_are_drawn() -> None:
    metadata = room()
    bowls = [thing("Bowl", x, 1.0, 0.2) for x in (0.8, 1.2)]
    bowls[0]["parentReceptacles"] = [bowls[1]["objectId"]]
    bowls[1]["parentReceptacles"] = [bowls[0]["objectId"]]
    metadata["objects"] += bowls
    assert "bowl 1 [bowl 2]" in RoomMap(metadata).text()


def test_of_thousands_of_objects_those_that_are_too_many_are_counted() -> None:
    metadata = room()
    metadata["objects"] += [thing("Apple", number / 100 - 2, 0.5) for number in range(5000)]
    drawn = RoomMap(metadata)
    assert len(drawn.entries) == MOST
    assert f"Too many to show: {5005 - MOST:,} more objects." in drawn.notes
    assert "Too many to show" in drawn.svg()


def test_svg_stands_alone_and_speaks() -> None:
    drawn = RoomMap(room())
    root = ET.fromstring(drawn.svg())
    assert root.findtext(f"{SVG}title") == "Floor Plan 1 from above"
    assert root.findtext(f"{SVG}desc") == drawn.text()
    assert "prefers-color-scheme" in root.findtext(f"{SVG}style", "")
    assert not {"script", "image", "use", "a", "foreignObject"} & {
        each.tag.removeprefix(SVG) for each in root.iter()
    }
    attributes = {name for each in root.iter() for name in each.attrib}
    assert not [name for name in attributes if name.startswith("on") or "href" in name]


def assert_numbers_apart(metadata: dict[str, Any], width: int) -> None:
    """No number covers another, all are in the picture, and the legend has each of the map."""
    svg = RoomMap(metadata).svg(width)
    _, _, wide, high = map(float, ET.fromstring(svg).get("viewBox", "").split())
    numbers = numbers_on(svg)
    count = len(numbers) // 2
    assert [text for text, *_ in numbers] == 2 * [str(number + 1) for number in range(count)]
    for place, (_, x, y) in enumerate(numbers):
        assert RADIUS <= x <= wide - RADIUS
        assert RADIUS <= y <= high - RADIUS
        assert all(math.dist((x, y), other[1:]) > 2 * RADIUS for other in numbers[:place])


@pytest.mark.parametrize("width", [240, 340, 560, 1200])
@pytest.mark.parametrize("scene", ["Kitchen1", "LivingRoom1", "Bathroom1", "Bedroom1"])
def test_no_number_covers_another(scene: str, width: int) -> None:
    home = house(scene)
    if scene == "Kitchen1":
        do(home, "SliceObject Bread; SliceObject Tomato; OpenObject Cabinet")
    assert_numbers_apart(home.metadata(), width)


def test_no_number_covers_another_in_a_crowd() -> None:
    metadata = room()
    kinds = [kind for kind in object_types() if kind not in ("Floor", "StoveKnob")][:60]
    metadata["objects"] += [thing(kind, 0.0, 0.0, 0.05) for kind in kinds]
    assert_numbers_apart(metadata, 340)
