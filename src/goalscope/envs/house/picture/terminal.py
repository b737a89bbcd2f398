"""A room from above, drawn in a terminal."""

from __future__ import annotations

import re
import string
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, repeat
from typing import Any

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from goalscope.envs.house.picture.floor_plan import Piece, Plan, floor_plan
from goalscope.envs.house.picture.footprints import Point
from goalscope.types import counted

__all__ = ["TerminalPicture", "numbered", "ranges", "terminal_picture"]

LINES = 45
MAP_LINES = (12, 26)
CELL = 2.0  # a terminal's cell is so many times higher than wide
LETTERS = string.ascii_lowercase + string.ascii_uppercase
DIGITS = string.digits[1:]
CHANGES = 6
CHANGED = "bold black on yellow"
ROBOT = "bold black on cyan"
STYLES = {
    "open": "green", "on": "yellow", "hot": "red", "cold": "blue", "dirty": "magenta",
    "filled": "cyan", "sliced": "cyan", "cooked": "cyan", "broken": "red", "used up": "red",
}  # fmt: skip


@dataclass(frozen=True)
class TerminalPicture:
    """A picture that `rich.console.Console.print` draws.

    Attributes:
        plan: What is where.
        width: In cells, at most; the console's own width limits it too.
    """

    plan: Plan
    width: int = 76

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        width = max(24, min(self.width, options.max_width))

        def wrapped(texts: Iterable[Text]) -> list[Text]:
            return [line for text in texts for line in text.wrap(console, width)]

        heading = wrapped(_heading(self.plan, options.ascii_only))
        least, most = MAP_LINES
        drawn: list[Text] = []
        below: list[Text] = []
        for rows in range(most, least - 1, -2):
            grid = _Grid(self.plan, width, rows, options.ascii_only)
            drawn = grid.lines()
            below = wrapped(_list_of_places(self.plan, grid.keys, options.ascii_only))
            if len(heading) + len(drawn) + len(below) <= LINES:
                break
        left = LINES - len(heading) - len(drawn)
        if len(below) > left:
            below = [
                *below[: left - 1],
                Text(f"and {counted(len(below) - left + 1, 'more line')}", "dim"),
            ]
        for line in (*heading, *drawn, *below):
            line.rstrip()
            yield line


def terminal_picture(
    metadata: Mapping[str, Any],
    previous: Mapping[str, Any] | None = None,
    named: Mapping[str, str] | None = None,
    *,
    width: int = 76,
) -> TerminalPicture:
    """A room from above for a terminal, at most 45 lines high.

    Args:
        metadata: AI2-THOR's.
        previous: The same of the round before: what changed since is highlighted.
        named: What to call the objects, by id; None names them anew.
        width: In cells.
    """
    return TerminalPicture(floor_plan(metadata, previous, named), width)


def _ascii(text: str, only: bool) -> str:
    return text.encode("ascii", "replace").decode() if only else text


def _heading(plan: Plan, ascii_only: bool) -> list[Text]:
    held = ", ".join(piece.described for piece in plan.held)
    lines = [Text().append(_ascii(plan.name or "room", ascii_only), "bold")]
    arrow = _arrow(plan.heading, ascii_only)
    lines[0].append(f"  robot {arrow} ", "bold cyan").append(f"looks {plan.looks}, holds ")
    lines[0].append(_ascii(held or "nothing", ascii_only), "bold" if held else "")
    if plan.changes:
        more = len(plan.changes) - CHANGES
        said = "; ".join(plan.changes[:CHANGES]) + (f"; and {more} more" if more > 0 else "")
        lines.append(Text().append("changed (!): ", "bold yellow").append(_ascii(said, ascii_only)))
    return lines


def _arrow(heading: float, ascii_only: bool) -> str:
    arrows = "^>v<" if ascii_only else "▲◥▶◢▼◣◀◤"
    return arrows[round(heading * len(arrows) / 360) % len(arrows)]


class _Grid:
    """The map's cells: the outlines of furniture first, then names, then letters."""

    def __init__(self, plan: Plan, width: int, rows: int, ascii_only: bool) -> None:
        x0, z0, x1, z1 = plan.room
        self.plan, self.ascii_only = plan, ascii_only
        wide, deep = x1 - x0, z1 - z0
        metre = min((width - 2) / wide, (rows - 2) * CELL / deep)
        self.columns = max(3, round(wide * metre))
        self.rows = max(3, round(deep * metre / CELL))
        self.signs = [[" "] * self.columns for _ in range(self.rows)]
        self.styles = [[""] * self.columns for _ in range(self.rows)]
        self.owner = [[-1] * self.columns for _ in range(self.rows)]
        self.taken: set[tuple[int, int]] = set()
        furniture = [piece for piece in plan.pieces if piece.kind == "furniture"]
        for number, piece in enumerate(furniture):
            for part in piece.parts:
                self._outline(number, piece, part)
        self.keys: dict[str, str] = {}
        unnamed = [piece for number, piece in enumerate(furniture) if not self._name(number, piece)]
        if plan.robot is not None:
            self._put(self._cell(plan.robot), _arrow(plan.heading, ascii_only), ROBOT)
        lettered = sorted(
            (piece for piece in plan.pieces if piece.is_on_map),
            key=lambda piece: (piece.parent, piece.name),
        )
        spare = LETTERS[len(lettered) :]
        for signs, pieces in ((DIGITS + spare, unnamed), (LETTERS, lettered)):
            for piece, sign in zip(pieces, chain(signs, repeat("*")), strict=False):
                if piece.at is not None:
                    self.keys[piece.id] = sign
                    self._put(self._cell(piece.at), sign, _style(piece, "bold"))

    def lines(self) -> list[Text]:
        """The map in its walls."""
        side, along, corners = ("|", "-", "++++") if self.ascii_only else ("┃", "━", "┏┓┗┛")
        lines = [Text(corners[0] + along * self.columns + corners[1], "dim")]
        for signs, styles in zip(self.signs, self.styles, strict=True):
            line = Text().append(side, "dim")
            for sign, style in zip(signs, styles, strict=True):
                line.append(sign, style)
            lines.append(line.append(side, "dim"))
        return [*lines, Text(corners[2] + along * self.columns + corners[3], "dim")]

    def _cell(self, at: Point) -> tuple[int, int]:
        x0, z0, x1, z1 = self.plan.room
        row = int((z1 - at[1]) / (z1 - z0) * self.rows)
        column = int((at[0] - x0) / (x1 - x0) * self.columns)
        return min(max(row, 0), self.rows - 1), min(max(column, 0), self.columns - 1)

    def _outline(self, number: int, piece: Piece, part: Sequence[Point]) -> None:
        xs, zs = [x for x, _ in part], [z for _, z in part]
        top, left = self._cell((min(xs), max(zs) - 1e-6))
        bottom, right = self._cell((max(xs) - 1e-6, min(zs)))
        line, bar, corners = ("-", "|", "++++") if self.ascii_only else ("─", "│", "┌┐└┘")
        style = _style(piece, "dim")
        is_flat = bottom - top < 2 or right - left < 2
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                if is_flat:
                    sign = "#" if self.ascii_only else "░"
                elif row in (top, bottom) and column in (left, right):
                    sign = corners[2 * (row == bottom) + (column == right)]
                elif row in (top, bottom):
                    sign = line
                else:
                    sign = bar if column in (left, right) else " "
                self.signs[row][column], self.styles[row][column] = sign, style
                self.owner[row][column] = number

    def _name(self, number: int, piece: Piece) -> bool:
        """Write its name on what is in sight of it; false where it fits nowhere."""
        name = _ascii(piece.name, self.ascii_only)
        name = "".join(sign if cell_len(sign) == 1 else "?" for sign in name)
        own = {
            (row, column)
            for row in range(self.rows)
            for column in range(self.columns)
            if self.owner[row][column] == number and (row, column) not in self.taken
        }
        if not own:
            return False
        blank = {cell for cell in own if self.signs[cell[0]][cell[1]] == " "}
        middle = [sum(axis) / len(own) for axis in zip(*own, strict=True)]
        for lines, free in (([name], blank), (name.split(), blank), ([name], own)):
            high, wide = len(lines), max(map(len, lines))

            def off(at: tuple[int, int], high: int = high, wide: int = wide) -> float:
                row, column = at[0] + (high - 1) / 2, at[1] + (wide - 1) / 2
                return CELL * abs(row - middle[0]) + abs(column - middle[1])

            fits = [
                (row, column)
                for row, column in free
                if all(
                    (row + down, column + along) in free
                    for down in range(high)
                    for along in range(wide)
                )
            ]
            if not fits:
                continue
            row, column = min(fits, key=lambda at: (off(at), at))
            for down, line in enumerate(lines):
                start = column + (wide - len(line)) // 2
                for along, sign in enumerate(line, start):
                    self._set((row + down, along), sign, _style(piece, ""))
                self.taken |= {(row + down, start - 1), (row + down, start + len(line))}
            return True
        return False

    def _put(self, cell: tuple[int, int], sign: str, style: str) -> None:
        """Write one sign in the nearest free cell."""
        cells = (
            (row, column)
            for row in range(max(0, cell[0] - 4), min(self.rows, cell[0] + 5))
            for column in range(max(0, cell[1] - 8), min(self.columns, cell[1] + 9))
        )
        free = [each for each in cells if each not in self.taken]
        where = min(
            free, default=cell,
            key=lambda each: CELL * abs(each[0] - cell[0]) + abs(each[1] - cell[1]),
        )  # fmt: skip
        self._set(where, sign, style)

    def _set(self, cell: tuple[int, int], sign: str, style: str) -> None:
        self.taken.add(cell)
        self.signs[cell[0]][cell[1]] = sign
        self.styles[cell[0]][cell[1]] = style


def _style(piece: Piece, other: str) -> str:
    if piece.changed:
        return CHANGED
    return next((f"bold {STYLES[mark]}" for mark in piece.marks), other)


def _list_of_places(plan: Plan, keys: Mapping[str, str], ascii_only: bool) -> list[Text]:
    """Every object once: what is where, then what is empty."""
    inside: dict[str, list[Piece]] = {}
    for piece in sorted(plan.pieces, key=lambda piece: numbered(piece.name)):
        inside.setdefault(piece.parent, []).append(piece)
    listed: set[str] = set()

    def item(piece: Piece) -> Text:
        listed.add(piece.id)
        key = keys.get(piece.id)
        text = Text().append(f"{key}=" if key else "", "bold")
        text.append("!" if piece.changed else "").append(
            _ascii(piece.name, ascii_only), CHANGED if piece.changed else ""
        )
        if piece.marks:
            text.append(" (")
            for number, (mark, shown) in enumerate(
                zip(piece.marks, piece.shown_marks, strict=True)
            ):
                text.append(", " if number else "").append(_ascii(shown, ascii_only), STYLES[mark])
            text.append(")")
        return text

    def items(pieces: Iterable[Piece]) -> Text:
        new = [piece for piece in pieces if piece.id not in listed]
        alike = [
            piece for piece in new
            if not (piece.id in keys or piece.marks or piece.changed or piece.id in inside)
        ]  # fmt: skip
        listed.update(piece.id for piece in alike)
        runs = [_ascii(each, ascii_only) for each in ranges(piece.name for piece in alike)]
        shown = [with_contents(piece) for piece in new if piece.id not in listed]
        return Text(", ").join([*shown, *map(Text, runs)])

    def with_contents(piece: Piece) -> Text:
        text = item(piece)
        if carried := [each for each in inside.get(piece.id, []) if each.id not in listed]:
            text.append(" with [").append_text(items(carried)).append("]")
        return text

    def line(title: str, pieces: Iterable[Piece]) -> None:
        if text := items(pieces):
            lines.append(Text().append(f"{title}: ", "dim").append_text(text))

    lines: list[Text] = []
    places = [piece for piece in plan.pieces if piece.receptacle and not piece.pickupable]
    places.sort(key=lambda piece: (-len(inside.get(piece.id, [])), numbered(piece.name)))
    held = {piece.id for piece in plan.held}
    line("in hand", plan.held)
    empty: list[Piece] = []
    for place in places:
        contents = [
            each for each in inside.get(place.id, []) if not _is_place(each) and each.id not in held
        ]
        if not contents:
            empty.append(place)
            continue
        title = item(place)
        title.stylize("bold")
        if place.openable and "open" not in place.marks:
            title.append(" (closed)")
        lines.append(title.append(": ").append_text(items(contents)))
    others = [each for each in plan.pieces if not _is_place(each) and each.parent not in listed]
    line("elsewhere", sorted(others, key=lambda piece: numbered(piece.name)))
    empty.sort(key=lambda piece: numbered(piece.name))
    for title, openable in (("empty", False), ("closed and empty", True)):
        group = [
            each for each in empty
            if (each.openable and "open" not in each.marks) == openable and each.id not in listed
        ]  # fmt: skip
        text = items(group)
        if text:
            lines.append(Text().append(f"{len(group)} {title}: ", "dim").append_text(text))
    line("and", [each for each in plan.pieces if each.id not in listed])
    if plan.left_out:
        lines.append(Text(f"and {counted(plan.left_out, 'object')} too many to show", "dim"))
    return lines


def _is_place(piece: Piece) -> bool:
    return piece.receptacle and not piece.pickupable


def numbered(name: str) -> tuple[str, int]:
    """A name without its number, and that: 0 where it has none."""
    found = re.fullmatch(r"(.*) ([0-9]{1,6})", name)
    return (found[1], int(found[2])) if found else (name, 0)


def ranges(names: Iterable[str]) -> list[str]:
    """Names with runs of numbers in one: "drawer 1-4"."""
    runs: list[tuple[str, int, int]] = []
    for name, number in sorted(map(numbered, names)):
        if runs and number and runs[-1][0] == name and runs[-1][2] == number - 1:
            runs[-1] = (name, runs[-1][1], number)
        else:
            runs.append((name, number, number))
    return [
        name + (f" {first}" if first else "") + (f"-{last}" if last > first else "")
        for name, first, last in runs
    ]
