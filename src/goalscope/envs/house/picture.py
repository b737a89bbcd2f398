"""A room from above, as a self-contained SVG and as text."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

from goalscope.base.types import pluralize
from goalscope.envs.house.floor_plan import (
    Box,
    Piece,
    Plan,
    Point,
    area,
    floor_plan,
    middle_of,
)
from goalscope.envs.house.labels import (
    Space,
    alike,
    centred,
    listed,
    nearest_point,
    overlap,
    ranges,
)
from goalscope.envs.house.picture_style import LEGEND, pointing, style_sheet

__all__ = ["svg_picture", "told"]

WIDTH = 512
"""Width of a picture, in px."""

WIDE, HIGH = 640.0, 520.0  # of the map, at most
MARGIN = 16.0
BESIDE = 216.0  # width of a list beside the map, where there is room for both
FONT = 12.0
LABEL = 11.0  # font size of the names of things
GLYPH = 0.6  # mean width of a character, in font sizes
LINE = 17.0
DISC = 8.5
DOT = 3.0
FAR = 64  # px from a thing to its name, at most
CHANGES = 6
LEAST = 440.0  # width of a map that has its list beside it
_CHARACTERS = 16  # in a line of a name
_LAYERS = ("wall", "furniture", "fitted", "thing")
_SPOTS = sorted(
    ((right / 4, down / 4) for right in range(-2, 3) for down in range(-2, 3)),
    key=lambda spot: abs(spot[0]) + abs(spot[1]),
)


def svg_picture(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None = None,
    named: Mapping[str, str] | None = None,
    *,
    width: int = WIDTH,
) -> str:
    """A room from above as a self-contained SVG for light and dark pages.

    Names stand at the things. Where it is too crowded there are numbers, which a list explains:
    below the map, or beside it in a wide picture. In a browser, a number that is pointed at or has
    the focus shows its name, too.

    Args:
        metadata: AI2-THOR's.
        previous: Metadata of the round before; changes since then are highlighted.
        named: What to call the objects, by id; None names them anew.
        width: Width in px at which the text is read best.
    """
    return _Drawing(floor_plan(metadata, previous, named), width).text()


@dataclass
class _Mark:
    """A name or number on the map: for one piece, or for several alike side by side.

    `spot` is where they are, `at` the middle of the name or number, `lines` the name if there is
    room for it.
    """

    pieces: list[Piece]
    spot: Point
    at: Point = (0.0, 0.0)
    lines: Sequence[str] = ()

    @property
    def text(self) -> str:
        names = ", ".join(ranges(piece.name for piece in self.pieces))
        return names + self.pieces[0].described.removeprefix(self.pieces[0].name)

    @property
    def changed(self) -> str:
        """Its class where one of the pieces has changed."""
        return "changed" if any(piece.changed for piece in self.pieces) else ""


class _Drawing:
    """The map, and a list of what is not named on it."""

    def __init__(self, plan: Plan, width: int) -> None:
        x0, z0, x1, z1 = plan.room
        self.plan = plan
        self.width = float(width)
        shown = {"role": "img", "aria-labelledby": "title desc"}
        self.root = ET.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", **shown})
        self._add("title", {"id": "title"}, f"{plan.name or 'A room'} from above")
        self._add("desc", {"id": "desc"}, told(plan))
        style = self._add("style", {}, style_sheet())
        self._add("rect", {"class": "paper", "width": "100%", "height": "100%"})
        self.is_beside = width - 2 * MARGIN - BESIDE >= LEAST
        room = width - 2 * MARGIN - (BESIDE + MARGIN if self.is_beside else 0)
        self.metre = min(min(room, WIDE) / (x1 - x0), HIGH / (z1 - z0))
        self.top = self._heading()
        self.bottom = self.top + self.metre * (z1 - z0)
        self.left = MARGIN + max(0.0, room - self.metre * (x1 - x0)) / 2 * (not self.is_beside)
        self.right = self.left + self.metre * (x1 - x0)
        self.space = Space((2.0, self.top - 8, self.right + MARGIN - 2, self.bottom + 10))
        self.inside: dict[str, list[Piece]] = {}
        for piece in plan.pieces:
            self.inside.setdefault(piece.parent, []).append(piece)
        self._add("polygon", {"class": "room", "points": self._corners()})
        for piece in sorted(plan.pieces, key=lambda each: _LAYERS.index(each.kind)):
            if piece.kind != "thing":
                self._piece(piece)
        self._robot()
        numbers, others = self._names()
        bottom = self._legend(numbers, others)
        for number, mark in enumerate(numbers, 1):
            self._tip(mark, number)
        style.text = f"{style.text}{pointing(len(numbers))}"
        self.root.set("viewBox", f"0 0 {self.width:.0f} {bottom:.0f}")

    def text(self) -> str:
        """The SVG."""
        return ET.tostring(self.root, encoding="unicode")

    def _add(
        self,
        tag: str,
        attributes: Mapping[str, str],
        text: str = "",
        title: str = "",
        into: ET.Element | None = None,
    ) -> ET.Element:
        element = ET.SubElement(self.root if into is None else into, tag, dict(attributes))
        element.text = text
        if title:
            ET.SubElement(element, "title").text = title
        return element

    def _xy(self, at: Point) -> Point:
        x0, _, _, z1 = self.plan.room
        x = self.left + (at[0] - x0) * self.metre
        y = self.top + (z1 - at[1]) * self.metre
        return min(max(x, 2.0), self.width - 2), min(max(y, self.top - 6), self.bottom + 6)

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
        at = (min(max(x, self.left + 20), self.right - 20), y + 20)
        self._text("robot-name", "robot", at)
        name = centred(at, len("robot") * FONT * GLYPH, FONT + 2)
        self.space.taken += [centred((x, y), 24, 26), name]

    def _spot(self, piece: Piece) -> Point:
        """A point of a piece of furniture where nothing is written; its middle if there is none."""
        x, z = middle_of(piece.box)
        x0, z0, x1, z1 = piece.box
        spots = [self._xy((x + a * (x1 - x0) * 0.8, z + b * (z1 - z0) * 0.8)) for a, b in _SPOTS]
        return next((spot for spot in spots if self.space.is_free(_dot(spot))), spots[0])

    def _names(self) -> tuple[list[_Mark], list[_Mark]]:
        """Draw the names; which things have a number instead, and which found no room at all."""
        marks = self._marks()
        self.space.taken += [_dot(mark.spot) for mark in marks]
        standing = sorted(self.plan.pieces, key=lambda each: area(each.box))
        for piece in standing:
            if piece.kind == "furniture" and not self._name(piece):
                marks.append(_Mark([piece], self._spot(piece)))
                self.space.taken.append(_dot(marks[-1].spot))
        named = [mark for mark in marks if self._label(mark)]
        rest = [mark for mark in marks if not mark.lines]
        numbers = [mark for mark in rest if self._place(mark)]
        numbers.sort(key=lambda mark: (round(mark.at[1] / 40), mark.at[0]))
        for mark in (*named, *numbers):
            self._lead(mark)
        for mark in named:
            self._labelled(mark)
        for number, mark in enumerate(numbers, 1):
            known = {"class": "mark", "id": f"m{number}", "tabindex": "0", "role": "img"}
            about = "; ".join(map(self._full, mark.pieces))
            group = self._add("g", known | {"aria-label": about})
            self._numbered(mark, number, mark.at, group)
        placed = {id(mark) for mark in numbers}
        return numbers, [mark for mark in rest if id(mark) not in placed]

    def _marks(self) -> list[_Mark]:
        """What gets a mark: things in sight, what hangs, and what has things inside."""
        marks: list[_Mark] = []
        for piece in sorted(self.plan.pieces, key=lambda each: not each.changed):
            hides = any(each.hidden for each in self.inside.get(piece.id, []))
            fitted = piece.kind == "fitted" and hides and not piece.id.endswith("Basin")
            if not (piece.is_on_map or fitted or piece.kind == "wall"):
                continue
            spot = self._xy(piece.at)
            for mark in marks:
                if alike(mark.pieces[0], piece) and math.dist(mark.spot, spot) < 4 * DISC:
                    mark.pieces.append(piece)
                    break
            else:
                marks.append(_Mark([piece], spot))
        return marks

    def _label(self, mark: _Mark) -> bool:
        """Find a free place for the name near its thing; false where there is none."""
        lines = wrap(_cut(mark.text, 3 * _CHARACTERS), _CHARACTERS)
        wide = max(map(len, lines)) * LABEL * GLYPH
        at = self.space.near(mark.spot, wide, len(lines) * (LABEL + 2), least=5, far=FAR)
        if at is not None:
            mark.at, mark.lines = at, lines
        return at is not None

    def _place(self, mark: _Mark) -> bool:
        """Find the free place for a number that is nearest; false where there is none."""
        size = 2 * DISC + 1
        if (dot := _dot(mark.spot)) in self.space.taken:  # on which the number may stand
            self.space.taken.remove(dot)
        at = self.space.near(mark.spot, size, size, least=-1, far=120, crosses=True)
        mark.at = at or mark.at
        self.space.taken.append(dot)
        return at is not None

    def _lead(self, mark: _Mark) -> None:
        """A dot, and a line to it from a name or number that stands apart."""
        x, y = mark.spot
        high = len(mark.lines) * (LABEL + 2) or 2 * DISC
        wide = max(map(len, mark.lines), default=0) * LABEL * GLYPH or 2 * DISC
        to_x, to_y = nearest_point(centred(mark.at, wide, high), mark.spot)
        if math.dist((x, y), (to_x, to_y)) > 2 * DOT:
            ends = {"x1": x, "y1": y, "x2": to_x, "y2": to_y}
            self._add("line", {"class": "lead"} | {key: f"{at:.1f}" for key, at in ends.items()})
        if math.dist(mark.spot, mark.at) > DISC:
            kind = f"thing {_state(mark.pieces[0])}" if mark.lines else "spot"
            shape = {"class": kind.strip(), "cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": f"{DOT:.0f}"}
            self._add("circle", shape, title="; ".join(map(self._full, mark.pieces)))

    def _labelled(self, mark: _Mark) -> None:
        half = max(map(len, mark.lines)) * LABEL * GLYPH / 2
        side = mark.at[0] - mark.spot[0]
        anchor = "" if abs(side) < half else "after" if side > 0 else "before"
        x = mark.at[0] - half * {"": 0, "after": 1, "before": -1}[anchor]
        kind = " ".join(filter(None, ("label", anchor, mark.changed)))
        for number, line in enumerate(mark.lines):
            off = (number - (len(mark.lines) - 1) / 2) * (LABEL + 2)
            self._text(kind, line, (x, mark.at[1] + off))

    def _numbered(
        self, mark: _Mark, number: int, at: Point, into: ET.Element | None = None
    ) -> None:
        kind = f"thing {_state(mark.pieces[0])}".strip()
        shape = {"class": kind, "cx": f"{at[0]:.1f}", "cy": f"{at[1]:.1f}", "r": f"{DISC}"}
        self._add("circle", shape, title="; ".join(map(self._full, mark.pieces)), into=into)
        self._text("number", str(number), at, into)

    def _tip(self, mark: _Mark, number: int) -> None:
        """The name that a number shows while it is pointed at or has the focus; over all else."""
        text = _cut(mark.text, self._fits(self.right))
        wide = len(text) * FONT * GLYPH + 12
        x = min(max(mark.at[0], 4 + wide / 2), self.right + MARGIN - 4 - wide / 2)
        y = mark.at[1] - 2 * DISC - 4
        tip = self._add("g", {"class": "tip", "id": f"t{number}", "aria-hidden": "true"})
        x0, y0, *_ = centred((x, y), wide, 20)
        shape = {"x": x0, "y": y0, "width": wide, "height": 20.0}
        self._add("rect", {key: f"{at:.1f}" for key, at in shape.items()} | {"rx": "5"}, into=tip)
        self._text("", text, (x, y), tip)

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
                    box = centred(at, wide, high)
                    if not self.space.is_free(box) or any(overlap(box, each) for each in above):
                        continue
                    self.space.taken.append(box)
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

    def _text(self, kind: str, text: str, at: Point, into: ET.Element | None = None) -> None:
        shape = {"class": kind, "x": f"{at[0]:.1f}", "y": f"{at[1]:.1f}"}
        self._add("text", shape, text, into=into)

    def _heading(self) -> float:
        """The room's name and what the robot does; where the map begins."""
        plan, y = self.plan, 24.0
        self._text("title", plan.name or "room", (MARGIN, y))
        told = f"The robot looks {plan.looks} and holds {plan.held}. North is up."
        for line in wrap(told, self._fits(self.width))[:2]:
            y += LINE + 1
            self._text("soft", line, (MARGIN, y))
        return y + 14

    def _fits(self, width: float) -> int:
        """How many characters go into a width between the margins."""
        return int((width - 2 * MARGIN) / (FONT * GLYPH))

    def _legend(self, marks: Sequence[_Mark], others: Sequence[_Mark]) -> float:
        """What the numbers and colours mean, what is out of sight, what changed; and its end."""
        left, y, width = MARGIN, self.bottom + 26, self.width - 2 * MARGIN
        if self.is_beside:
            left, y, width = self.right + 2 * MARGIN, self.top + DISC, self.width - self.right
            width -= 3 * MARGIN
        longest = max((len(mark.text) for mark in marks), default=1)
        columns = max(1, min(4, int(width / (2 * DISC + 14 + longest * FONT * GLYPH))))
        rows = -(-len(marks) // columns)
        for index, mark in enumerate(marks):
            column, row = divmod(index, rows)
            at = (left + DISC + column * width / columns, y + row * (LINE + 2))
            self._numbered(mark, index + 1, at)
            fits = self._fits(width / columns + MARGIN - DISC)
            self._text(mark.changed, _cut(mark.text, fits), (at[0] + DISC + 5, at[1] + 4))
        y += rows * (LINE + 2) + (6 if rows else 0)
        shown = {_classes(piece) for piece in self.plan.pieces if not piece.hidden}
        used = [mark for mark in LEGEND if any(mark in each.split() for each in shown)]
        x = left + 5
        for mark in used:
            if x + 9 + len(mark) * FONT * GLYPH > left + width:
                x, y = left + 5, y + LINE
            shape = {"class": f"thing {mark}", "cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": "5"}
            self._add("circle", shape)
            self._text("soft", mark, (x + 9, y + 4))
            x += 30 + len(mark) * FONT * GLYPH
        y += LINE if used else 0
        notes = ["Dashed: cabinets, drawers, shelves. Blue: on the wall."]
        for piece in self.plan.pieces:
            if hidden := [each for each in self.inside.get(piece.id, []) if each.hidden]:
                notes.append(f"In {piece.name}: {', '.join(listed(hidden))}.")
        if others:
            notes.append(f"No room on the map for: {', '.join(mark.text for mark in others)}.")
        if self.plan.left_out:
            notes.append(f"Too many to show: {pluralize(self.plan.left_out, 'more object')}.")
        told = [("soft", note, 3) for note in notes]
        if self.plan.changes:
            more = len(self.plan.changes) - CHANGES
            said = "; ".join(self.plan.changes[:CHANGES]) + (f"; {more} more" if more > 0 else "")
            told.append(("", f"Changed: {said}.", 6))
        for kind, text, most in told:
            for line in wrap(text, self._fits(width + 2 * MARGIN))[:most]:
                self._text(kind, line, (left, y + 4))
                y += LINE
        return max(y + 4, self.bottom + 12)


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


def _dot(spot: Point) -> Box:
    return centred(spot, 2 * DOT, 2 * DOT)
