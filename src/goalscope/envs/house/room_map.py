"""A room as a plain numbered map in SVG, with a legend that says what the numbers are."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from string import Template
from textwrap import wrap
from typing import Any

from goalscope.base.text import terminal_safe
from goalscope.base.types import pluralize
from goalscope.envs.house.simulator.state import Box, box_of, innermost, is_whole
from goalscope.envs.house.view import STATES, View

WIDTH = 560
"""Width of a map, in px."""

MOST = 120
"""Most numbers on a map."""

BESIDE = 1.0  # m; furniture reaches at most so far over the edge of the floor
MARGIN, HIGHEST, RADIUS, GAP, LINE = 14.0, 460.0, 8.5, 4.0, 17.0  # px
GLYPH = 6.8  # px; mean width of a character
COLUMN = 230.0  # px; least width of a column of the legend
LONGEST = 60  # characters of a name
COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
LIGHT = {"paper": "#fff", "floor": "#f6f3ee", "edge": "#8d7b62", "piece": "#e2d9cb",
         "ink": "#2b2b2b", "soft": "#6b675f", "robot": "#0b7285", "changed": "#c2410c"}  # fmt: skip
DARK = {"paper": "#1b1b1d", "floor": "#26262a", "edge": "#9a8f7c", "piece": "#45413a",
        "ink": "#ececec", "soft": "#a8a59e", "robot": "#3bc9db", "changed": "#ff922b"}  # fmt: skip
STYLE = Template("""
text{font:12px system-ui,"DejaVu Sans",sans-serif;fill:$ink}
.title{font-size:16px;font-weight:700}
.paper{fill:$paper}.floor{fill:$floor;stroke:$edge;stroke-width:4}
.place{fill:$piece;fill-opacity:.6;stroke:$edge}.wide{fill:none;stroke-dasharray:4 4}
.lead{stroke:$soft}.robot{fill:$robot;stroke:$paper;stroke-width:1.5}
.number circle{fill:$ink}.number.changed circle{fill:$changed}
.number text{font-size:10px;font-weight:700;text-anchor:middle;fill:$paper}
.place.changed{stroke:$changed;stroke-width:2.5}text.changed{fill:$changed;font-weight:600}
""")


@dataclass(frozen=True, slots=True)
class Entry:
    """What has a number: a piece of furniture, or a thing that is in or on none.

    Attributes:
        box: Its bounding box.
        text: Its name and state, and what is in or on it.
        changed: Whether it, or what is in or on it, is not as it was in the previous round.
    """

    box: Box
    text: str
    changed: bool


class RoomMap:
    """A room from above.

    Args:
        metadata: AI2-THOR's.
        previous: Metadata of the round before, to mark what changed since.
        names: Names of the objects by id; None names them anew.

    Attributes:
        title: The scene's name.
        notes: Sentences about the robot, about what is not on the map, and about changes.
        entries: What has a number, row by row from the north; the first is number 1.
    """

    def __init__(
        self,
        metadata: Mapping[str, Any],
        previous: Mapping[str, Any] | None = None,
        names: Mapping[str, str] | None = None,
    ) -> None:
        self._view = view = View(metadata, names)
        self._robot: Mapping[str, Any] = metadata["agent"]
        turn: float = metadata["agent"]["rotation"]["y"]
        self._table = {own: thing for own, thing in view.table.items() if is_whole(thing)}
        self._inside = self._contents()
        changes = dict(view.changes(View(previous).table)) if previous else {}
        entries = [
            Entry(box_of(self._table[own]), self._text(own), bool({*changes} & self._within(own)))
            for own in self._inside[""]
            if own != view.held and view.type_of(view.names[own]) not in ("Floor", "StoveKnob")
        ]
        entries.sort(key=lambda entry: (-round(entry.box.center[2] / 0.6), entry.box.center[0]))
        scene = _clean(metadata["sceneName"]).removesuffix("_physics")
        self.title = re.sub(r"(?<=[a-z])(?=[A-Z0-9])", " ", scene) or "A room"
        self.entries = entries[:MOST]
        held = self._text(view.held) if view.held else "nothing"
        heading = COMPASS[round(turn / 45) % 8]
        self.notes = [f"The robot (arrow) looks {heading} and holds {held}. North is up."]
        if more := len(entries) - len(self.entries):
            self.notes.append(f"Too many to show: {pluralize(more, 'more object')}.")
        if changes:
            self.notes.append(f"Changed: {'; '.join(map(_clean, changes.values()))}.")

    def text(self) -> str:
        """The map in words, one numbered line for each entry."""
        lines = (f"{number}. {entry.text}" for number, entry in enumerate(self.entries, 1))
        return "\n".join([self.title, *self.notes, *lines])

    def svg(self, width: int = WIDTH) -> str:
        """A self-contained SVG for light and dark pages.

        Args:
            width: In px, at which the text is read best.
        """
        root = ET.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "role": "img",
                                  "aria-labelledby": "title desc"})  # fmt: skip
        _add(root, "title", {"id": "title"}, f"{self.title} from above")
        _add(root, "desc", {"id": "desc"}, self.text())
        dark = f"@media(prefers-color-scheme:dark){{{STYLE.substitute(DARK)}}}"
        _add(root, "style", {}, STYLE.substitute(LIGHT) + dark)
        _add(root, "rect", {"class": "paper", "width": "100%", "height": "100%"})
        _add(root, "text", {"class": "title", "x": MARGIN, "y": 24}, self.title)
        bottom = self._legend(root, width, self._draw_map(root, width))
        for note in self.notes:
            for line in wrap(note, int((width - 2 * MARGIN) / GLYPH)):
                kind = "changed" if note.startswith("Changed") else "soft"
                _add(root, "text", {"class": kind, "x": MARGIN, "y": bottom + LINE / 2}, line)
                bottom += LINE
        root.set("viewBox", f"0 0 {width} {bottom + 6:.0f}")
        return ET.tostring(root, encoding="unicode")

    def _legend(self, root: ET.Element, width: int, top: float) -> float:
        """Write what the numbers mean, in columns; where it ends."""
        columns = max(1, int(width / COLUMN))
        column = (width - MARGIN) / columns
        fits = int((column - MARGIN - 2 * RADIUS) / GLYPH)
        blocks = [wrap(entry.text, fits) for entry in self.entries]
        full = sum(len(lines) * LINE + 3 for lines in blocks) / columns
        left, y, bottom = MARGIN, top, top
        for number, (entry, lines) in enumerate(zip(self.entries, blocks, strict=True), 1):
            if y - top >= full:
                left, y = left + column, top
            _number(root, number, (left + RADIUS, y), entry.changed)
            for line in lines:
                kind = "changed" if entry.changed else ""
                _add(root, "text", {"class": kind, "x": left + 3 * RADIUS, "y": y + 4}, line)
                y += LINE
            y += 3
            bottom = max(bottom, y)
        return bottom

    def _draw_map(self, root: ET.Element, width: int) -> float:
        """Draw floor, furniture, robot and numbers; where the legend begins."""
        x0, z0, x1, z1 = self._extent()
        scale = min((width - 2 * MARGIN) / (x1 - x0), HIGHEST / (z1 - z0))
        left, top = (width - scale * (x1 - x0)) / 2, 40.0
        right, bottom = left + scale * (x1 - x0), top + scale * (z1 - z0)

        def px(x: float, z: float) -> tuple[float, float]:
            x, y = left + (x - x0) * scale, top + (z1 - z) * scale
            return min(max(x, left), right), min(max(y, top), bottom)

        def rectangle(box: tuple[float, ...], kind: str) -> None:
            (ax, ay), (bx, by) = px(box[0], box[3]), px(box[2], box[1])
            shape = {"x": ax, "y": ay, "width": bx - ax, "height": by - ay, "rx": 2}
            _add(root, "rect", {"class": kind, **shape})

        rectangle((x0, z0, x1, z1), "floor")
        for entry in sorted(self.entries, key=lambda entry: -_area(entry.box)):
            kinds = ["place"] + ["changed"] * entry.changed
            kinds += ["wide"] * (3 * _area(entry.box) > (x1 - x0) * (z1 - z0))
            rectangle(_around([entry.box]), " ".join(kinds))
        at = px(self._robot["position"]["x"], self._robot["position"]["z"])
        turned = f"translate({at[0]:.1f} {at[1]:.1f}) rotate({self._robot['rotation']['y']:.1f})"
        _add(root, "path", {"class": "robot", "d": "M0 -13L9 10L0 5L-9 10Z", "transform": turned})
        taken = [at]
        places = [px(entry.box.center[0], entry.box.center[2]) for entry in self.entries]
        edges = (left + RADIUS, top + RADIUS, right - RADIUS, bottom - RADIUS)
        for place in places:
            spot = _free(place, taken, edges)
            taken.append(spot)
            if math.dist(spot, place) > RADIUS:
                ends = {"x1": place[0], "y1": place[1], "x2": spot[0], "y2": spot[1]}
                _add(root, "line", {"class": "lead", **ends})
        for number, (entry, spot) in enumerate(zip(self.entries, taken[1:], strict=True), 1):
            _number(root, number, spot, entry.changed)
        return bottom + 2 * LINE

    def _extent(self) -> tuple[float, float, float, float]:
        """The floor with the furniture that reaches over its edge, and the robot: x and z."""
        floors = [box_of(each) for each in self._table.values() if each["objectType"] == "Floor"]
        boxes = [entry.box for entry in self.entries]
        x0, z0, x1, z1 = _around(floors or boxes)
        ax, az, bx, bz = _around([*floors, *boxes])
        x, z = self._robot["position"]["x"], self._robot["position"]["z"]
        x0, z0 = min(x, max(ax, x0 - BESIDE)), min(z, max(az, z0 - BESIDE))
        x1, z1 = max(x, min(bx, x1 + BESIDE)), max(z, min(bz, z1 + BESIDE))
        return x0, z0, max(x1, x0 + 1.0), max(z1, z0 + 1.0)

    def _contents(self) -> Mapping[str, list[str]]:
        """Ids of what is in or on each thing; under "" those that get a number of their own."""
        holders = {own: self._holder(own) for own in self._table}
        for own in holders:
            above = [own]
            while (holder := holders[above[-1]]) and holder not in above:
                above.append(holder)
            if holder:  # they hold each other
                holders[own] = ""
        inside: dict[str, list[str]] = defaultdict(list)
        for own, holder in holders.items():
            inside[holder].append(own)
        return inside

    def _holder(self, own: str) -> str:
        """What a thing is listed under: a basin under its sink, "" for what stands by itself."""
        thing, whole = self._table[own], own.rpartition("|")[0]
        if not thing["pickupable"]:
            return whole if whole in self._table else ""
        holder = "" if own == self._view.held else innermost(thing, self._table)
        return "" if not holder or self._table[holder]["objectType"] == "Floor" else holder

    def _within(self, own: str) -> set[str]:
        return {own}.union(*(self._within(each) for each in self._inside.get(own, ())))

    def _text(self, own: str) -> str:
        """A thing's name and state, and what is in or on it."""
        thing = self._table[own]
        states = [word for key, word in STATES if thing[key]]
        states += [thing["temperature"].lower()] * (thing["temperature"] != "RoomTemp")
        if thing["isFilledWithLiquid"]:
            states.append(f"filled with {_clean(thing['fillLiquid'] or 'a liquid')}")
        text = _clean(self._view.names[own]) + (f" ({', '.join(states)})" if states else "")
        inside = ", ".join(map(self._text, self._inside.get(own, ())))
        if not inside:
            return text
        return f"{text} [{inside}]" if thing["pickupable"] else f"{text}: {inside}"


def _free(
    place: tuple[float, float],
    taken: Sequence[tuple[float, float]],
    edges: tuple[float, float, float, float],
) -> tuple[float, float]:
    """The nearest spot to a place where a number covers no other one; the place if none is left."""
    for step in range(80):
        for turn in range(12 if step else 1):
            x = place[0] + 5 * step * math.cos(turn * math.pi / 6)
            y = place[1] + 5 * step * math.sin(turn * math.pi / 6)
            x, y = min(max(x, edges[0]), edges[2]), min(max(y, edges[1]), edges[3])
            if all(math.dist((x, y), other) > 2 * RADIUS + GAP for other in taken):
                return x, y
    return place


def _number(root: ET.Element, number: int, at: tuple[float, float], changed: bool) -> None:
    group = _add(root, "g", {"class": "number changed" if changed else "number"})
    _add(group, "circle", {"cx": at[0], "cy": at[1], "r": RADIUS})
    _add(group, "text", {"x": at[0], "y": at[1] + 3.5}, str(number))


def _add(parent: ET.Element, tag: str, attributes: Mapping[str, Any], text: str = "") -> ET.Element:
    written = {
        key: f"{value:.1f}" if isinstance(value, float) else str(value)
        for key, value in attributes.items()
    }
    element = ET.SubElement(parent, tag, written)
    element.text = text
    return element


def _around(boxes: Iterable[Box]) -> tuple[float, float, float, float]:
    """The smallest x and z of boxes, and the largest."""
    sides = [(box.low(0), box.low(2), box.high(0), box.high(2)) for box in boxes]
    x0, z0, x1, z1 = zip(*sides, strict=True)
    return min(x0), min(z0), max(x1), max(z1)


def _area(box: Box) -> float:
    return box.size[0] * box.size[2]


def _clean(text: str) -> str:
    """One short line that is safe to show."""
    shown = " ".join(terminal_safe(text[: LONGEST + 1]).plain.split())
    shown = shown.replace("\ufffe", "").replace("\uffff", "")
    return shown if len(shown) <= LONGEST else shown[: LONGEST - 3] + "..."
