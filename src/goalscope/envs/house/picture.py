"""A room from above, as a self-contained SVG and as text."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten, wrap
from typing import Any

from goalscope.envs.house.floor_plan import Box, Piece, Plan, Point, area, floor_plan, middle_of
from goalscope.types import pluralize

__all__ = ["svg_picture", "told"]

WIDTH, HEIGHT = 480.0, 520.0  # of the map, at most
MARGIN, TOP = 16.0, 56.0
FONT = 12.0
GLYPH = 0.6  # mean width of a character, in font sizes
LINE = 17.0
DISC = 8.5
CHANGES = 6
_LAYERS = ("wall", "furniture", "fitted", "thing")
_SPOTS = sorted(
    ((right / 4, down / 4) for right in range(-2, 3) for down in range(-2, 3)),
    key=lambda spot: abs(spot[0]) + abs(spot[1]),
)

LEGEND = ("open", "on", "hot", "cold", "dirty", "filled", "changed")
"""The states whose colours a picture explains."""

LIGHT = {"paper": "#fff", "floor": "#f6f3ee", "wall": "#4a4a4a", "piece": "#e2d9cb",
         "edge": "#a4937a", "ink": "#2b2b2b", "soft": "#6b675f", "glass": "#8fc3e8",
         "robot": "#0b7285", "changed": "#e8590c", "open": "#2b8a3e", "on": "#e0a800",
         "hot": "#d6336c", "cold": "#1c7ed6", "dirty": "#8d5a2b", "filled": "#0c9fb5",
         "other": "#7048e8"}  # fmt: skip
DARK = {"paper": "#1b1b1d", "floor": "#26262a", "wall": "#b9b9b9", "piece": "#3a3731",
        "edge": "#7d7464", "ink": "#ececec", "soft": "#a8a59e", "glass": "#4f87ab",
        "robot": "#3bc9db", "changed": "#ff922b", "open": "#51cf66", "on": "#ffd43b",
        "hot": "#f783ac", "cold": "#4dabf7", "dirty": "#c08a55", "filled": "#66d9e8",
        "other": "#b197fc"}  # fmt: skip
STYLE = """
text{font:12px system-ui,"DejaVu Sans",sans-serif;fill:var(--ink)}
.paper{fill:var(--paper)}.room{fill:var(--floor);stroke:var(--wall);stroke-width:5}
.furniture{fill:var(--piece);stroke:var(--edge);stroke-linejoin:round}
.fitted{fill:none;stroke:var(--edge);stroke-dasharray:3 3;opacity:.7}
.wall{fill:var(--glass);stroke:none;opacity:.75}
.thing{fill:var(--soft);stroke:var(--paper);stroke-width:1}
.name,.number,.robot-name{text-anchor:middle;dominant-baseline:central}
.name{font-weight:600}.number{font-size:10px;font-weight:700;fill:var(--paper)}
.lead{stroke:var(--ink);stroke-width:.8}.spot{fill:var(--ink)}.soft{fill:var(--soft)}
.title{font-size:17px;font-weight:700}
.robot{fill:var(--robot);stroke:var(--paper);stroke-width:1.5}.view{fill:var(--robot);opacity:.16}
.robot-name{font-weight:700;fill:var(--robot)}
.furniture.open,.fitted.open{stroke:var(--open);stroke-width:2.5}
.furniture.on{stroke:var(--on);stroke-width:2.5}
.thing.open{fill:var(--open)}.thing.on{fill:var(--on)}.thing.hot{fill:var(--hot)}
.thing.cold{fill:var(--cold)}.thing.dirty{fill:var(--dirty)}.thing.filled{fill:var(--filled)}
.thing.other{fill:var(--other)}
.furniture.changed,.fitted.changed,.wall.changed,.thing.changed{stroke:var(--changed);stroke-width:2.5}
text.changed{fill:var(--changed);font-weight:700}
"""


def svg_picture(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None = None,
    named: Mapping[str, str] | None = None,
) -> str:
    """A room from above as a self-contained SVG for light and dark pages.

    Args:
        metadata: AI2-THOR's.
        previous: Metadata of the round before; changes since then are highlighted.
        named: What to call the objects, by id; None names them anew.
    """
    return _Drawing(floor_plan(metadata, previous, named)).text()


@dataclass
class _Mark:
    """A number on the map: for one piece, or for several alike side by side.

    `spot` is where they are, `at` where the number stands.
    """

    pieces: list[Piece]
    spot: Point
    at: Point = (0.0, 0.0)

    @property
    def text(self) -> str:
        names = ", ".join(_ranges(piece.name for piece in self.pieces))
        return names + self.pieces[0].described.removeprefix(self.pieces[0].name)


class _Drawing:
    """The map, with names where there is room and numbers elsewhere; below it what they mean."""

    def __init__(self, plan: Plan) -> None:
        x0, z0, x1, z1 = plan.room
        self.plan = plan
        self.metre = min(WIDTH / (x1 - x0), HEIGHT / (z1 - z0))
        self.room_width = self.metre * (x1 - x0)
        self.bottom = TOP + self.metre * (z1 - z0)
        self.width = WIDTH + 2 * MARGIN
        self.left = (self.width - self.room_width) / 2
        self.taken: list[Box] = []
        self.inside: dict[str, list[Piece]] = {}
        for piece in plan.pieces:
            self.inside.setdefault(piece.parent, []).append(piece)
        shown = {"role": "img", "aria-labelledby": "title desc"}
        self.root = ET.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", **shown})
        self._add("title", {"id": "title"}, f"{plan.name or 'A room'} from above")
        self._add("desc", {"id": "desc"}, told(plan))
        self._add("style", {}, _style())
        self._add("rect", {"class": "paper", "width": "100%", "height": "100%"})
        self._heading()
        self._add("polygon", {"class": "room", "points": self._corners()})
        for piece in sorted(plan.pieces, key=lambda each: _LAYERS.index(each.kind)):
            if piece.kind != "thing":
                self._piece(piece)
        self._robot()
        everything = self._marks()
        marks = [mark for mark in everything if self._place(mark)]
        for piece in sorted(plan.pieces, key=lambda each: area(each.box)):
            if piece.kind == "furniture" and not self._name(piece):
                everything.append(_Mark([piece], self._middle(piece)))
                marks += [everything[-1]] if self._place(everything[-1]) else []
        marks.sort(key=lambda mark: (round(mark.at[1] / 40), mark.at[0]))
        for mark in marks:
            self._lead(mark)
        for number, mark in enumerate(marks, 1):
            self._numbered(mark, number, mark.at)
        placed = {id(mark) for mark in marks}
        bottom = self._legend(marks, [mark for mark in everything if id(mark) not in placed])
        self.root.set("viewBox", f"0 0 {self.width:.0f} {bottom:.0f}")

    def text(self) -> str:
        """The SVG."""
        return ET.tostring(self.root, encoding="unicode")

    def _add(
        self, tag: str, attributes: Mapping[str, str], text: str = "", title: str = ""
    ) -> ET.Element:
        element = ET.SubElement(self.root, tag, dict(attributes))
        element.text = text
        if title:
            ET.SubElement(element, "title").text = title
        return element

    def _xy(self, at: Point) -> Point:
        x0, _, _, z1 = self.plan.room
        x = self.left + (at[0] - x0) * self.metre
        y = TOP + (z1 - at[1]) * self.metre
        return min(max(x, 2.0), self.width - 2), min(max(y, TOP - 6), self.bottom + 6)

    def _points(self, part: Iterable[Point]) -> str:
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in map(self._xy, part))

    def _corners(self) -> str:
        x0, z0, x1, z1 = self.plan.room
        return self._points(((x0, z0), (x1, z0), (x1, z1), (x0, z1)))

    def _piece(self, piece: Piece) -> None:
        for part in piece.parts:
            shape = {"class": _classes(piece), "points": self._points(part)}
            self._add("polygon", shape, title=self._full(piece))

    def _full(self, piece: Piece) -> str:
        contents = [each.described for each in self.inside.get(piece.id, [])]
        return piece.described + (f": {', '.join(contents)}" if contents else "")

    def _robot(self) -> None:
        x, y = self._xy(self.plan.robot)
        turn = {"transform": f"translate({x:.1f} {y:.1f}) rotate({self.plan.heading:.1f})"}
        walls = self._add("clipPath", {"id": "walls"})
        ET.SubElement(walls, "polygon", {"points": self._corners()})
        view = {"class": "view", "d": "M0 0L-30 -42A52 52 0 0 1 30 -42Z", **turn}
        ET.SubElement(self._add("g", {"clip-path": "url(#walls)"}), "path", view)
        self._add("path", {"class": "robot", "d": "M0 -13L9 10L0 5L-9 10Z", **turn})
        self.taken.append(_centred((x, y), 24, 26))
        at = (min(max(x, self.left + 20), self.width - self.left - 20), y + 20)
        self._text("robot-name", "robot", at)
        self.taken.append(_centred(at, len("robot") * FONT * GLYPH, FONT + 2))

    def _middle(self, piece: Piece) -> Point:
        return self._xy(middle_of(piece.box))

    def _marks(self) -> list[_Mark]:
        """What gets a number: things in sight, what hangs, and what has things inside."""
        marks: list[_Mark] = []
        for piece in sorted(self.plan.pieces, key=lambda each: not each.changed):
            hides = any(each.hidden for each in self.inside.get(piece.id, []))
            fitted = piece.kind == "fitted" and hides and not piece.id.endswith("Basin")
            if not (piece.is_on_map or fitted or piece.kind == "wall"):
                continue
            spot = self._xy(piece.at)
            for mark in marks:
                if _alike(mark.pieces[0], piece) and math.dist(mark.spot, spot) < 4 * DISC:
                    mark.pieces.append(piece)
                    break
            else:
                marks.append(_Mark([piece], spot))
        return marks

    def _place(self, mark: _Mark) -> bool:
        """Find the free place for a number that is nearest; false where there is none."""
        x, y = mark.spot
        for ring in range(0, 120, 4):
            for step in range(24 if ring else 1):
                angle = math.pi * step / 12
                at = (x + ring * math.cos(angle), y + ring * math.sin(angle))
                box = _centred(at, 2 * DISC + 1, 2 * DISC + 1)
                on_map = box[0] > 0 and box[2] < self.width and box[1] > TOP - 8
                if on_map and box[3] < self.bottom + 10 and not self._covers(box, self.taken):
                    mark.at = at
                    self.taken.append(box)
                    return True
        return False

    def _lead(self, mark: _Mark) -> None:
        """A line from a number that stands apart to its thing."""
        (x, y), (to_x, to_y) = mark.spot, mark.at
        if math.dist(mark.spot, mark.at) > DISC:
            ends = {"x1": x, "y1": y, "x2": to_x, "y2": to_y}
            self._add("line", {"class": "lead"} | {key: f"{at:.1f}" for key, at in ends.items()})
            self._add("circle", {"class": "spot", "cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": "2"})

    def _numbered(self, mark: _Mark, number: int, at: Point) -> None:
        kind = f"thing {_state(mark.pieces[0])}".strip()
        shape = {"class": kind, "cx": f"{at[0]:.1f}", "cy": f"{at[1]:.1f}", "r": f"{DISC}"}
        self._add("circle", shape, title="; ".join(map(self._full, mark.pieces)))
        self._text("number", str(number), at)

    def _name(self, piece: Piece) -> bool:
        """Write its name on a free place of it; false where there is none."""
        marks = [", ".join(piece.shown_marks)] if piece.marks else []
        above = self._above(piece)
        for part in piece.parts:
            (xs, ys) = zip(*map(self._xy, part), strict=True)
            x0, y0, x1, y1 = min(xs), min(ys), max(xs), max(ys)
            for lines in ([piece.name, *marks], [*piece.name.split(), *marks]):
                wide = max(map(len, lines)) * FONT * GLYPH
                high = len(lines) * (FONT + 2)
                right, down = x1 - x0 - wide, y1 - y0 - high
                if min(right, down) < 0:
                    continue
                for across, along in _SPOTS:
                    at = ((x0 + x1) / 2 + across * right, (y0 + y1) / 2 + along * down)
                    box = _centred(at, wide, high)
                    if self._covers(box, [*self.taken, *above]):
                        continue
                    self.taken.append(box)
                    for number, line in enumerate(lines):
                        off = (number - (len(lines) - 1) / 2) * (FONT + 2)
                        kind = "name changed" if piece.changed else "name"
                        self._text(kind, line, (at[0], at[1] + off))
                    return True
        return False

    def _above(self, piece: Piece) -> list[Box]:
        """The boxes of furniture that is drawn over this piece."""
        later = self.plan.pieces[self.plan.pieces.index(piece) + 1 :]
        boxes: list[Box] = []
        for each in later:
            if each.kind == "furniture":
                x0, z0, x1, z1 = each.box
                boxes.append((*self._xy((x0, z1)), *self._xy((x1, z0))))
        return boxes

    @staticmethod
    def _covers(box: Box, taken: Iterable[Box]) -> bool:
        left, top, right, bottom = box
        return any(
            x0 < right and left < x1 and y0 < bottom and top < y1 for x0, y0, x1, y1 in taken
        )

    def _text(self, kind: str, text: str, at: Point) -> None:
        self._add("text", {"class": kind, "x": f"{at[0]:.1f}", "y": f"{at[1]:.1f}"}, text)

    def _heading(self) -> None:
        plan = self.plan
        self._text("title", plan.name or "room", (MARGIN, 24))
        told = f"The robot looks {plan.looks} and holds {plan.held}. North is up."
        self._text("soft", shorten(told, self._fits(self.width), placeholder="..."), (MARGIN, 42))

    def _fits(self, width: float) -> int:
        """How many characters go into a width between the margins."""
        return int((width - 2 * MARGIN) / (FONT * GLYPH))

    def _legend(self, marks: Sequence[_Mark], others: Sequence[_Mark]) -> float:
        """What the numbers and colours mean, what is out of sight, what changed; and its end."""
        y = self.bottom + 26
        longest = max((len(mark.text) for mark in marks), default=1)
        width = 2 * DISC + 14 + longest * FONT * GLYPH
        columns = max(1, min(4, int(WIDTH / width)))
        rows = -(-len(marks) // columns)
        for index, mark in enumerate(marks):
            column, row = divmod(index, rows)
            at = (MARGIN + DISC + column * WIDTH / columns, y + row * (LINE + 2))
            self._numbered(mark, index + 1, at)
            kind = "changed" if any(piece.changed for piece in mark.pieces) else ""
            fits = self._fits(WIDTH / columns + MARGIN - DISC)
            self._text(kind, _cut(mark.text, fits), (at[0] + DISC + 5, at[1] + 4))
        y += rows * (LINE + 2) + 6
        shown = {_classes(piece) for piece in self.plan.pieces if not piece.hidden}
        used = [mark for mark in LEGEND if any(mark in each.split() for each in shown)]
        x = MARGIN + 5
        for mark in used:
            shape = {"class": f"thing {mark}", "cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": "5"}
            self._add("circle", shape)
            self._text("soft", mark, (x + 9, y + 4))
            x += 30 + len(mark) * FONT * GLYPH
        y += LINE if used else 0
        notes = ["Dashed: cabinets, drawers, shelves. Blue: on the wall."]
        for piece in self.plan.pieces:
            if hidden := [each for each in self.inside.get(piece.id, []) if each.hidden]:
                notes.append(f"In {piece.name}: {', '.join(_listed(hidden))}.")
        if others:
            notes.append(f"No room on the map for: {', '.join(mark.text for mark in others)}.")
        if self.plan.left_out:
            notes.append(f"Too many to show: {pluralize(self.plan.left_out, 'more object')}.")
        lines = [line for note in notes for line in wrap(note, self._fits(self.width))[:3]]
        for line in lines:
            self._text("soft", line, (MARGIN, y + 4))
            y += LINE
        if self.plan.changes:
            more = len(self.plan.changes) - CHANGES
            said = "; ".join(self.plan.changes[:CHANGES]) + (f"; {more} more" if more > 0 else "")
            for line in wrap(f"Changed: {said}.", self._fits(self.width))[:6]:
                self._text("", line, (MARGIN, y + 4))
                y += LINE
        return y + 4


def _alike(one: Piece, other: Piece) -> bool:
    """Whether one number may stand for both: two apples on a table, say."""

    def look(piece: Piece) -> tuple[object, ...]:
        name, _ = _name_and_number(piece.name)
        return name, piece.kind, piece.parent, piece.shown_marks, piece.changed

    return look(one) == look(other)


def _listed(pieces: Sequence[Piece]) -> list[str]:
    plain = [piece.name for piece in pieces if not piece.marks]
    return [*_ranges(plain), *(piece.described for piece in pieces if piece.marks)]


def _name_and_number(name: str) -> tuple[str, int]:
    """A name without its number, and that: 0 where it has none."""
    found = re.fullmatch(r"(.*) ([0-9]{1,6})", name)
    return (found[1], int(found[2])) if found else (name, 0)


def _ranges(names: Iterable[str]) -> list[str]:
    """Names with runs of numbers in one: "drawer 1-4"."""
    runs: list[tuple[str, int, int]] = []
    for name, number in sorted(map(_name_and_number, names)):
        if runs and number and runs[-1][0] == name and runs[-1][2] == number - 1:
            runs[-1] = (name, runs[-1][1], number)
        else:
            runs.append((name, number, number))
    return [
        name + (f" {first}" if first else "") + (f"-{last}" if last > first else "")
        for name, first, last in runs
    ]


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: max(most - 3, 0)] + "..."


def told(plan: Plan) -> str:
    """The picture in words."""
    furniture = [piece.described for piece in plan.pieces if piece.kind == "furniture"]
    things = [piece.described for piece in plan.pieces if piece.kind == "thing" and not piece.held]
    said = [f"The robot looks {plan.looks} and holds {plan.held}."]
    said += [f"Furniture: {', '.join(furniture)}."] if furniture else []
    said += [f"Things: {', '.join(things)}."] if things else []
    said += [f"Changed: {'; '.join(plan.changes)}."] if plan.changes else []
    return " ".join(said)


def _classes(piece: Piece) -> str:
    return f"{piece.kind} {_state(piece)}".strip()


def _state(piece: Piece) -> str:
    known = [mark for mark in piece.marks if mark in LEGEND]
    state = known[0] if known else "other" if piece.marks else ""
    return " ".join(filter(None, (state, "changed" if piece.changed else "")))


def _centred(at: Point, wide: float, high: float) -> Box:
    return at[0] - wide / 2, at[1] - high / 2, at[0] + wide / 2, at[1] + high / 2


def _style() -> str:
    """The style sheet with its colours written out, as not every program knows variables."""

    def coloured(colours: Mapping[str, str]) -> str:
        return re.sub(r"var\(--(\w+)\)", lambda found: colours[found[1]], STYLE)

    return f"{coloured(LIGHT)}@media(prefers-color-scheme:dark){{{coloured(DARK)}}}"
