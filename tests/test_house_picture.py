import copy
import math
import os
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from goalscope.envs.house.floor_plan import Plan, floor_plan
from goalscope.envs.house.picture import svg_picture
from goalscope.envs.house.simulator.object_types import object_type, object_types
from goalscope.envs.house.simulator.objects import new_object
from goalscope.envs.house.simulator.scenes import read_scene
from goalscope.envs.house.simulator.world import House
from houses import do, house

SVG = "{http://www.w3.org/2000/svg}"


def thing(kind: str, x: float, z: float, size: float = 0.1, depth: float = 0.0, **more: Any) -> Any:
    """AI2-THOR's metadata of a box that is 1 m high."""
    return new_object(object_type(kind), (x, 0.0, z), (size, 1.0, depth or size), 0.0) | more


def room() -> dict[str, Any]:
    table = thing("DiningTable", 1.0, 1.0, 1.0, 0.8)
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


def piece(plan: Plan, kind: str) -> Any:
    return next(each for each in plan.pieces if each.id.startswith(kind))


def texts(svg: str) -> list[str]:
    return [each.text or "" for each in ET.fromstring(svg).iter(f"{SVG}text")]


def test_furniture_lies_where_its_box_is() -> None:
    plan = floor_plan(room())
    assert plan.room == (-2.0, -2.0, 2.0, 2.0)
    assert piece(plan, "DiningTable").box == pytest.approx((0.5, 0.6, 1.5, 1.4))
    assert piece(plan, "DiningTable").kind == "furniture"
    assert piece(plan, "Mug").kind == "thing"
    assert piece(plan, "Cabinet").kind == "fitted"
    assert (plan.robot, plan.looks) == ((0.0, 0.0), "east")


def test_turned_furniture_has_turned_corners() -> None:
    metadata = room()
    corners = [[1.0 + x, y, 1.0 + z] for x, z in ((0, 1), (1, 0), (0, -1), (-1, 0)) for y in (0, 1)]
    find(metadata, "DiningTable")["objectOrientedBoundingBox"] = {"cornerPoints": corners}
    (part,) = piece(floor_plan(metadata), "DiningTable").parts
    assert set(part) == {(1.0, 2.0), (2.0, 1.0), (1.0, 0.0), (0.0, 1.0)}


def test_counter_around_a_corner_leaves_the_floor_free() -> None:
    metadata = room()
    metadata["objects"] += [
        thing("CounterTop", 0.0, 0.0, 3.8),
        thing("Sink", -1.6, 0.5, 0.4),
        thing("StoveBurner", 1.0, -1.6, 0.2),
    ]
    boxes = piece(floor_plan(metadata), "CounterTop").parts
    assert len(boxes) == 2
    assert all(min(x for x, _ in box) < -1.8 and min(z for _, z in box) < -1.8 for box in boxes)
    assert not any(max(min(map(abs, corner)) for corner in box) < 0.8 for box in boxes)


def test_smallest_receptacle_holds_what_lies_in_several() -> None:
    metadata = room()
    bowl = thing("Bowl", 1.0, 1.0, 0.2)
    metadata["objects"].append(bowl)
    floor, table = find(metadata, "Floor"), find(metadata, "DiningTable")
    every = [floor["objectId"], table["objectId"], bowl["objectId"]]
    find(metadata, "Mug")["parentReceptacles"] = every
    assert piece(floor_plan(metadata), "Mug").parent == bowl["objectId"]


def test_things_in_something_closed_are_on_the_map_when_it_opens() -> None:
    closed, opened = room(), room()
    find(opened, "Fridge")["isOpen"] = True
    assert not piece(floor_plan(closed), "Egg").is_on_map
    assert piece(floor_plan(opened), "Egg").is_on_map


def test_states_are_shown() -> None:
    metadata = room()
    find(metadata, "Mug").update(
        isDirty=True, isFilledWithLiquid=True, fillLiquid="water", temperature="Hot"
    )
    assert "mug (hot, dirty, filled: water)" in " ".join(texts(svg_picture(metadata)))


def test_changes_are_told_and_marked() -> None:
    before, after = room(), room()
    find(after, "Fridge")["isOpen"] = True
    egg = find(after, "Egg")
    egg["parentReceptacles"] = None
    after["inventoryObjects"] = [{"objectId": egg["objectId"], "objectType": "Egg"}]
    after["objects"].append(thing("Apple", 0.0, 1.0))
    after["objects"].remove(find(after, "Mug"))
    plan = floor_plan(after, before)
    assert set(plan.changes) == {
        "fridge is now open", "egg is in the robot's hand", "apple is new", "mug is gone"
    }  # fmt: skip
    marked = [
        each for each in ET.fromstring(svg_picture(after, before)).iter(f"{SVG}polygon")
        if "changed" in each.get("class", "").split()
    ]  # fmt: skip
    assert len(marked) == 1
    assert floor_plan(before, copy.deepcopy(before)).changes == ()


HOSTILE = "</text><script>alert(1)</script>[red]\x1b[31m\u202e\x00\ufffe\ud800" + "X" * 10_000_000


def test_hostile_text_is_harmless() -> None:
    metadata = room()
    mug = find(metadata, "Mug")
    metadata["sceneName"] = HOSTILE
    mug.update(objectType=HOSTILE, isFilledWithLiquid=True, fillLiquid=HOSTILE)
    after = copy.deepcopy(metadata)
    find(after, "Fridge")["isOpen"] = True
    svg = svg_picture(after, metadata)
    root = ET.fromstring(svg)
    assert not list(root.iter(f"{SVG}script"))
    assert len(svg) < 100_000
    for sign in ("\x1b", "\u202e", "\x00", "\ufffe"):
        assert sign not in svg


def test_objects_that_hold_each_other_are_drawn() -> None:
    metadata = room()
    bowls = [thing("Bowl", x, 1.0, 0.2) for x in (0.8, 1.2)]
    bowls[0]["parentReceptacles"] = [bowls[1]["objectId"]]
    bowls[1]["parentReceptacles"] = [bowls[0]["objectId"]]
    metadata["objects"] += bowls
    assert {"bowl 1", "bowl 2"} <= set(texts(svg_picture(metadata)))


def test_of_thousands_of_objects_those_that_are_too_many_are_told() -> None:
    metadata = room()
    metadata["objects"] += [thing("Apple", number / 100 - 2, 0.5) for number in range(5000)]
    left_out = floor_plan(metadata).left_out
    assert left_out > 0
    assert f"Too many to show: {left_out:,} more objects." in texts(svg_picture(metadata))


def test_svg_stands_alone_and_speaks() -> None:
    root = ET.fromstring(svg_picture(room()))
    assert root.findtext(f"{SVG}title") == "FloorPlan1 from above"
    assert "mug" in (root.findtext(f"{SVG}desc") or "")
    assert "prefers-color-scheme" in (root.findtext(f"{SVG}style") or "")
    assert not {"script", "image", "use", "a", "foreignObject"} & {
        each.tag.removeprefix(SVG) for each in root.iter()
    }
    attributes = {name for each in root.iter() for name in each.attrib}
    assert not [name for name in attributes if name.startswith("on") or "href" in name]


def test_the_robots_view_ends_at_the_walls() -> None:
    root = ET.fromstring(svg_picture(room()))
    (group,) = (each for each in root.iter(f"{SVG}g") if each.get("clip-path") == "url(#walls)")
    assert [each.get("class") for each in group] == ["view"]
    walls = root.find(f".//{SVG}clipPath[@id='walls']/{SVG}polygon")
    drawn_room = root.find(f".//{SVG}polygon[@class='room']")
    assert walls is not None
    assert drawn_room is not None
    assert walls.get("points") == drawn_room.get("points")


def boxes(svg: str) -> list[tuple[str, float, float, float, float]]:
    """What is written on the map or drawn as a number there: (what, x0, y0, x1, y1)."""
    root = ET.fromstring(svg)
    _, _, wide, high = map(float, root.get("viewBox", "").split())
    found: list[tuple[str, float, float, float, float]] = []
    for mark in root.iter(f"{SVG}g"):
        if mark.get("class") == "mark":
            (circle,) = mark.iter(f"{SVG}circle")
            x, y = float(circle.get("cx", 0)), float(circle.get("cy", 0))
            found.append((circle.findtext(f"{SVG}title") or "", x - 8, y - 8, x + 8, y + 8))
    for each in root.iter(f"{SVG}text"):
        kinds = (each.get("class") or "").split()
        if not {"name", "label", "robot-name"} & {*kinds}:
            continue
        text, x, y = each.text or "", float(each.get("x", 0)), float(each.get("y", 0))
        long = len(text) * 6
        left = x if "after" in kinds else x - long if "before" in kinds else x - long / 2
        found.append((text, left, y - 5, left + long, y + 5))
    assert all(x0 >= 0 and x1 <= wide and y0 >= 0 and y1 <= high for _, x0, y0, x1, y1 in found)
    return found


def assert_apart(found: list[tuple[str, float, float, float, float]]) -> None:
    for i, (one, ax0, ay0, ax1, ay1) in enumerate(found):
        for other, bx0, by0, bx1, by1 in found[:i]:
            apart = min(ax1, bx1) <= max(ax0, bx0) or min(ay1, by1) <= max(ay0, by0)
            assert apart, (one, other)


SCENES = ["Kitchen1", "LivingRoom1", "Bathroom1", "Bedroom1"]


@pytest.mark.parametrize("width", [240, 320, 358, 512, 600, 688, 1200])
@pytest.mark.parametrize("scene", SCENES)
def test_nothing_on_the_map_covers_anything_else(scene: str, width: int) -> None:
    home = house(scene)
    if scene == "Kitchen1":
        do(home, "SliceObject Bread; SliceObject Tomato; OpenObject Cabinet")
    svg = svg_picture(home.metadata(), width=width)
    found = boxes(svg)
    assert len(found) > 20
    assert_apart(found)


@pytest.mark.parametrize(("width", "least"), [(320, 0.6), (512, 0.85), (640, 0.9), (900, 0.9)])
@pytest.mark.parametrize("scene", SCENES)
def test_most_things_are_named_where_they_are(scene: str, width: int, least: float) -> None:
    root = ET.fromstring(svg_picture(house(scene).metadata(), width=width))
    numbers = sum(each.get("class") == "mark" for each in root.iter(f"{SVG}g"))
    dots = sum(each.get("r") == "3" and "thing" in each.get("class", "").split()
               for each in root.iter(f"{SVG}circle"))  # fmt: skip
    assert dots / (dots + numbers) >= least


def test_a_name_stands_at_its_thing_and_tells_its_state() -> None:
    metadata = room()
    mug = find(metadata, "Mug")
    mug.update(isDirty=True, isFilledWithLiquid=True, fillLiquid="water", temperature="Hot")
    root = ET.fromstring(svg_picture(metadata))
    dot = next(each for each in root.iter(f"{SVG}circle")
               if (each.findtext(f"{SVG}title") or "").startswith("mug"))  # fmt: skip
    spot = float(dot.get("cx", 0)), float(dot.get("cy", 0))
    lines = [each for each in root.iter(f"{SVG}text") if "label" in each.get("class", "").split()]
    named = [each for each in lines if (each.text or "") in ("mug (hot, dirty,", "filled: water)")]
    assert len(named) == 2
    for each in named:
        assert math.dist(spot, (float(each.get("x", 0)), float(each.get("y", 0)))) < 80


def crowd(count: int) -> dict[str, Any]:
    """A room with so many different things at one place."""
    metadata = room()
    kinds = [kind for kind in object_types() if kind not in ("Floor", "Wall")][:count]
    metadata["objects"] += [thing(kind, 0.0, 0.0, 0.05) for kind in kinds]
    return metadata


@pytest.mark.parametrize("width", [320, 512, 900])
@pytest.mark.parametrize("count", [30, 60])
def test_every_number_on_the_map_is_in_the_list_and_tells_its_name(count: int, width: int) -> None:
    root = ET.fromstring(svg_picture(crowd(count), width=width))
    marks = [each for each in root.iter(f"{SVG}g") if each.get("class") == "mark"]
    tips = [each for each in root.iter(f"{SVG}g") if each.get("class") == "tip"]
    assert len(marks) > 3
    assert len(tips) == len(marks)
    style = root.findtext(f"{SVG}style") or ""
    _, _, wide, _ = map(float, root.get("viewBox", "").split())
    written = [each.text for each in root.iter(f"{SVG}text") if each.get("class") == "number"]
    assert sorted(written) == sorted(2 * [str(number + 1) for number in range(len(marks))])
    for number, (mark, tip) in enumerate(zip(marks, tips, strict=True), 1):
        assert mark.get("tabindex") == "0"
        assert mark.get("aria-label")
        assert f"#m{number}:hover~#t{number},#m{number}:focus~#t{number}" in style
        box = tip.find(f"{SVG}rect")
        assert box is not None
        left, right = float(box.get("x", 0)), float(box.get("x", 0)) + float(box.get("width", 0))
        assert 0 <= left < right <= wide
        assert tip.findtext(f"{SVG}text", "").rstrip(".") in str(mark.get("aria-label")).replace(
            "; ", ", "
        )
    children = [*root]
    assert children.index(tips[0]) > max(map(children.index, marks))


@pytest.mark.parametrize(
    ("width", "beside"), [(320, False), (687, False), (688, True), (900, True)]
)
def test_the_list_stands_beside_the_map_where_there_is_room(width: int, beside: bool) -> None:
    root = ET.fromstring(svg_picture(crowd(60), width=width))
    corners = next(each for each in root.iter(f"{SVG}polygon") if each.get("class") == "room")
    points = [tuple(map(float, each.split(","))) for each in corners.get("points", "").split()]
    right, bottom = max(x for x, _ in points), max(y for _, y in points)
    listed = [each for each in root if each.tag == f"{SVG}circle" and each.get("r") == "8.5"]
    assert listed
    for each in listed:
        x, y = float(each.get("cx", 0)), float(each.get("cy", 0))
        assert x > right if beside else y > bottom


def test_things_alike_side_by_side_share_a_name() -> None:
    metadata = room()
    metadata["objects"] += [thing("Apple", 1.0 + number / 20, 1.0) for number in range(6)]
    assert {"apple 1-6", "mug"} <= set(texts(svg_picture(metadata)))


def test_what_finds_no_room_on_the_map_is_told() -> None:
    metadata = room()
    kinds = [kind for kind in object_types() if kind not in ("Floor", "Wall")]
    metadata["objects"] += [thing(kind, 0.0, 0.0) for kind in kinds]
    svg = svg_picture(metadata)
    assert any(text.startswith("No room on the map for: ") for text in texts(svg))
    assert boxes(svg)


@pytest.mark.parametrize("number", [1, 201, 301, 401])
def test_real_rooms_are_drawn(number: int) -> None:
    data = os.environ.get("GOALSCOPE_DATA")
    if not data:
        pytest.skip("GOALSCOPE_DATA is not set: there are no real scenes to draw")
    path = Path(data) / "thor" / "scenes" / f"FloorPlan{number}_physics.json.gz"
    assert boxes(svg_picture(House(read_scene(path)).metadata()))
