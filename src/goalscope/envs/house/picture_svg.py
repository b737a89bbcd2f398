"""A room from above as an SVG that stands alone."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from typing import Any

from goalscope.envs.house.floor_plan import Box, Piece, Plan, Point, floor_plan

__all__ = ["svg_picture"]

WIDTH, HEIGHT = 900.0, 760.0  # of the map, at most
MARGIN, TOP = 26.0, 62.0
FONT = 12.0
GLYPH = 0.56  # mean width of a character, in font sizes
DOT = 4.5
CHANGES = 6
INSIDE = 3
LEGEND = ("open", "on", "hot", "cold", "dirty", "filled", "changed")
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
.label,.name,.robot-name{text-anchor:middle;dominant-baseline:central;paint-order:stroke;
stroke:var(--floor);stroke-width:3px;stroke-linejoin:round}
.name{font-weight:600;stroke:var(--piece)}.label{font-size:11px}
.inside{font-size:10px;font-weight:400;font-style:italic}
.lead{stroke:var(--soft);stroke-width:.7}.soft{fill:var(--soft)}
.title{font-size:18px;font-weight:700}
.robot{fill:var(--robot);stroke:var(--paper);stroke-width:1.5}.view{fill:var(--robot);opacity:.16}
.robot-name{font-weight:700;fill:var(--robot)}
.furniture.open,.fitted.open{stroke:var(--open);stroke-width:2.5}
.furniture.on{stroke:var(--on);stroke-width:2.5}
.thing.open{fill:var(--open)}.thing.on{fill:var(--on)}.thing.hot{fill:var(--hot)}
.thing.cold{fill:var(--cold)}.thing.dirty{fill:var(--dirty)}.thing.filled{fill:var(--filled)}
.thing.other{fill:var(--other)}
.furniture.changed,.fitted.changed,.wall.changed,.thing.changed{stroke:var(--changed);stroke-width:3}
text.changed{fill:var(--changed);font-weight:700}
"""


def svg_picture(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None = None,
    named: Mapping[str, str] | None = None,
) -> str:
    """A room from above as an SVG for light and dark pages, with nothing outside it.

    Args:
        metadata: AI2-THOR's.
        previous: The same of the round before: what changed since is highlighted.
        named: What to call the objects, by id; None names them anew.
    """
    return _Drawing(floor_plan(metadata, previous, named)).text()


def _style() -> str:
    """The style sheet with its colours written out, as not every program knows variables."""

    def coloured(colours: Mapping[str, str]) -> str:
        return re.sub(r"var\(--(\w+)\)", lambda found: colours[found[1]], STYLE)

    return f"{coloured(LIGHT)}@media(prefers-color-scheme:dark){{{coloured(DARK)}}}"


class _Drawing:
    def __init__(self, plan: Plan) -> None:
        x0, z0, x1, z1 = plan.room
        self.plan = plan
        self.metre = min(WIDTH / (x1 - x0), HEIGHT / (z1 - z0))
        self.room_width = self.metre * (x1 - x0)
        self.bottom = TOP + self.metre * (z1 - z0)
        self.width = max(self.room_width, 620.0) + 2 * MARGIN
        self.left = (self.width - self.room_width) / 2
        self.taken: list[Box] = []
        self.inside: dict[str, list[Piece]] = {}
        for piece in plan.pieces:
            self.inside.setdefault(piece.parent, []).append(piece)
        height = self.bottom + 84
        self.root = ET.Element(
            "svg",
            {
                "xmlns": "http://www.w3.org/2000/svg",
                "viewBox": f"0 0 {self.width:.0f} {height:.0f}",
                "role": "img",
                "aria-labelledby": "title desc",
            },
        )
        self._add("title", {"id": "title"}, f"{plan.name or 'A room'} from above")
        self._add("desc", {"id": "desc"}, _told(plan))
        self._add("style", {}, _style())
        self._add("rect", {"class": "paper", "width": "100%", "height": "100%"})
        self._heading()
        self._rect("room", plan.room)
        for piece in sorted(plan.pieces, key=lambda each: _LAYERS.index(each.kind)):
            if piece.kind != "thing":
                self._piece(piece)
        self._robot()
        things = [
            each for each in plan.pieces
            if each.kind == "thing" and each.is_on_map
        ]  # fmt: skip
        for piece in things:
            self._dot(piece)
        for piece in sorted(plan.pieces, key=lambda each: -_span(each)):
            if piece.kind == "furniture" or (
                piece.kind == "fitted"
                and ("open" in piece.marks or piece.id in self.inside)
                and not piece.id.endswith("Basin")
            ):
                self._name(piece)
        walls = [piece for piece in plan.pieces if piece.kind == "wall"]
        for piece in (*sorted(things, key=lambda each: not each.changed), *walls):
            self._label(piece)
        self._legend(height)

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

    def _rect(self, kind: str, box: Box) -> None:
        x0, z0, x1, z1 = box
        corners = ((x0, z0), (x1, z0), (x1, z1), (x0, z1))
        self._add("polygon", {"class": kind, "points": self._points(corners)})

    def _piece(self, piece: Piece) -> None:
        for part in piece.parts:
            shape = {"class": _classes(piece), "points": self._points(part)}
            self._add("polygon", shape, title=self._full(piece))

    def _full(self, piece: Piece) -> str:
        contents = [each.described for each in self.inside.get(piece.id, [])]
        return piece.described + (f": {', '.join(contents)}" if contents else "")

    def _dot(self, piece: Piece) -> None:
        if piece.at is None:
            return
        x, y = self._xy(piece.at)
        shape = {"class": _classes(piece), "cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": f"{DOT}"}
        self._add("circle", shape, title=self._full(piece))
        self.taken.append((x - DOT, y - DOT, x + DOT, y + DOT))

    def _robot(self) -> None:
        if self.plan.robot is None:
            return
        x, y = self._xy(self.plan.robot)
        turn = {"transform": f"translate({x:.1f} {y:.1f}) rotate({self.plan.heading:.1f})"}
        self._add("path", {"class": "view", "d": "M0 0L-42 -58A72 72 0 0 1 42 -58Z", **turn})
        self._add("path", {"class": "robot", "d": "M0 -17L12 13L0 7L-12 13Z", **turn})
        self.taken.append((x - 14, y - 16, x + 14, y + 16))
        below = "holds " + ", ".join(each.name for each in self.plan.held)
        for number, line in enumerate(["robot", below] if self.plan.held else ["robot"]):
            at = (x, y + 25 + 14 * number)
            self._text("robot-name", line, at)
            self.taken.append(_box(at, line, FONT))

    def _name(self, piece: Piece) -> None:
        """Its name, in the part of it where this covers least."""
        hidden = [each.name for each in self.inside.get(piece.id, []) if each.hidden]
        more = len(hidden) - INSIDE
        contents = ", ".join(hidden[:INSIDE]) + (f" +{more}" if more > 0 else "")
        marks = ", ".join(piece.shown_marks)
        extra = [line for line in (marks, contents) if line]
        above = self._above(piece)
        best: tuple[float, list[str], Point, bool] | None = None
        for part in piece.parts:
            (xs, ys) = zip(*map(self._xy, part), strict=True)
            x0, y0, x1, y1 = min(xs), min(ys), max(xs), max(ys)
            for lines in ([piece.name, *extra], [*piece.name.split(), *extra]):
                for upright in (False, True):
                    wide = max(map(len, lines)) * FONT * GLYPH
                    high = len(lines) * (FONT + 2)
                    if upright:
                        wide, high = high, wide
                    over = max(0.0, wide - (x1 - x0)) + max(0.0, high - (y1 - y0))
                    for right, down in _SPOTS:
                        at = (
                            (x0 + x1) / 2 + right * max(0.0, x1 - x0 - wide - 4),
                            (y0 + y1) / 2 + down * max(0.0, y1 - y0 - high - 4),
                        )
                        box = _centred(at, wide, high)
                        covers = 3 * self._covers(box, self.taken) + self._covers(box, above)
                        cost = 30 * over + covers + 200 * upright + 20 * len(lines)
                        cost += 10 * (abs(right) + abs(down))
                        if best is None or cost < best[0]:
                            best = cost, lines, at, upright
        if best is None:
            return
        _, lines, at, upright = best
        wide, high = max(map(len, lines)) * FONT * GLYPH, len(lines) * (FONT + 2)
        self.taken.append(_centred(at, *((high, wide) if upright else (wide, high))))
        for number, line in enumerate(lines):
            off = (number - (len(lines) - 1) / 2) * (FONT + 2)
            is_extra = number >= len(lines) - len(extra)
            turn = f"rotate(-90 {at[0]:.1f} {at[1]:.1f})" if upright else ""
            kind = ("name inside" if is_extra else "name") + (" changed" if piece.changed else "")
            self._text(kind, line, (at[0], at[1] + off), turn)

    def _label(self, piece: Piece) -> None:
        """Its name in the first free place around its dot, with a line to it if it is far."""
        if piece.at is None:
            return
        x, y = self._xy(piece.at)
        text = piece.described
        best: tuple[float, Point, Box] | None = None
        for ring in (9.0, 18.0, 30.0, 44.0):
            for step in range(16):
                angle = math.pi * step / 8
                half = len(text) * 11 * GLYPH / 2
                at = (
                    x + math.cos(angle) * (ring + half * abs(math.cos(angle))),
                    y + math.sin(angle) * (ring + 4),
                )
                box = _box(at, text, 11)
                out = max(0.0, 4 - box[0]) + max(0.0, box[2] - self.width + 4)
                cost = self._covers(box, self.taken) + 40 * out + ring * 3 + (step % 8 != 0) * 4
                if best is None or cost < best[0]:
                    best = cost, at, box
        if best is None:
            return
        _, at, box = best
        self.taken.append(box)
        near = (min(max(x, box[0]), box[2]), min(max(y, box[1] + 2), box[3] - 2))
        if math.dist(near, (x, y)) > 13:
            ends = zip(("x1", "y1", "x2", "y2"), (x, y, *near), strict=True)
            self._add("line", {"class": "lead"} | {key: f"{value:.1f}" for key, value in ends})
        kind = (
            "label changed" if piece.changed else "label soft" if piece.kind == "wall" else "label"
        )
        self._text(kind, text, at)

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
    def _covers(box: Box, taken: Iterable[Box]) -> float:
        return sum(
            max(0.0, min(box[2], each[2]) - max(box[0], each[0]))
            * max(0.0, min(box[3], each[3]) - max(box[1], each[1]))
            for each in taken
        )

    def _text(self, kind: str, text: str, at: Point, turn: str = "") -> None:
        attributes = {"class": kind, "x": f"{at[0]:.1f}", "y": f"{at[1]:.1f}"}
        self._add("text", attributes | ({"transform": turn} if turn else {}), text)

    def _heading(self) -> None:
        plan = self.plan
        self._text("title", plan.name or "room", (MARGIN, 28))
        held = ", ".join(piece.described for piece in plan.held) or "nothing"
        self._text("soft", f"The robot looks {plan.looks} and holds {held}. North is up.",
                   (MARGIN, 48))  # fmt: skip

    def _legend(self, height: float) -> None:
        x, y = MARGIN + 5, self.bottom + 24
        for mark in LEGEND:
            kind = "thing changed" if mark == "changed" else f"thing {mark}"
            self._add("circle", {"class": kind, "cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": f"{DOT}"})
            self._text("soft", mark, (x + 9, y + 4))
            x += 36 + len(mark) * FONT * GLYPH
        note = "Dashed: cabinets, drawers, shelves. Blue: on the wall. Italics: inside."
        self._text("soft", note, (MARGIN, y + 26))
        if self.plan.changes:
            more = len(self.plan.changes) - CHANGES
            said = "; ".join(self.plan.changes[:CHANGES]) + (f"; {more} more" if more > 0 else "")
            fits = int((self.width - 2 * MARGIN) / (FONT * GLYPH))
            self._add(
                "text", {"x": f"{MARGIN}", "y": f"{height - 18:.1f}"},
                "Changed: " + (said if len(said) <= fits else said[: fits - 3] + "..."),
            )  # fmt: skip


_LAYERS = ("wall", "furniture", "fitted", "thing")
_SPOTS = [
    (right, down)
    for right in (0.0, -0.25, 0.25, -0.5, 0.5)
    for down in (0.0, -0.25, 0.25, -0.5, 0.5)
]


def _told(plan: Plan) -> str:
    """The picture in words."""
    furniture = [piece.described for piece in plan.pieces if piece.kind == "furniture"]
    things = [piece.described for piece in plan.pieces if piece.kind == "thing" and not piece.held]
    held = ", ".join(piece.described for piece in plan.held) or "nothing"
    said = [f"The robot looks {plan.looks} and holds {held}."]
    said += [f"Furniture: {', '.join(furniture)}."] if furniture else []
    said += [f"Things: {', '.join(things)}."] if things else []
    said += [f"Changed: {'; '.join(plan.changes)}."] if plan.changes else []
    return " ".join(said)


def _classes(piece: Piece) -> str:
    known = [mark for mark in piece.marks if mark in LEGEND]
    state = known[0] if known else "other" if piece.marks else ""
    return " ".join(filter(None, (piece.kind, state, "changed" if piece.changed else "")))


def _span(piece: Piece) -> float:
    x0, z0, x1, z1 = piece.box
    return (x1 - x0) * (z1 - z0)


def _box(at: Point, text: str, font: float) -> Box:
    return _centred(at, len(text) * font * GLYPH, font + 2)


def _centred(at: Point, wide: float, high: float) -> Box:
    return at[0] - wide / 2, at[1] - high / 2, at[0] + wide / 2, at[1] + high / 2
