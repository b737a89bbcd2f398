"""Names on a map: which things share one, and where it stands, near and clear of the others."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence

from goalscope.envs.house.floor_plan import Box, Piece, Point

__all__ = ["Space", "alike", "centred", "listed", "nearest_point", "overlap", "ranges"]

_STEP = 4  # px
_ANGLES = [math.pi * each / 8 for each in (0, 8, 4, 12, 2, 6, 10, 14, 1, 7, 9, 15, 3, 5, 11, 13)]


class Space:
    """The free room of a map.

    Args:
        bounds: What nothing may stand beyond.
    """

    def __init__(self, bounds: Box) -> None:
        self.bounds = bounds
        self.taken: list[Box] = []
        self._lines: list[tuple[Point, Point]] = []

    def is_free(self, box: Box) -> bool:
        """Whether a box is within bounds, and nothing stands there."""
        x0, y0, x1, y1 = self.bounds
        within = x0 <= box[0] and y0 <= box[1] and box[2] <= x1 and box[3] <= y1
        return within and not any(overlap(box, each) for each in self.taken)

    def near(
        self, spot: Point, wide: float, high: float, *, least: int, far: int, crosses: bool = False
    ) -> Point | None:
        """Take the nearest free place for something, from which a line leads to its spot.

        Args:
            spot: What it belongs to.
            wide: Its width.
            high: Its height.
            least: Smallest distance of its edge to the spot; negative if it may cover it.
            far: Largest distance of its edge.
            crosses: Whether the line may cross other things, or another line this one.

        Returns:
            Its middle; None if there is no such place.
        """
        for at in _around(spot, wide, high, least, far):
            box = centred(at, wide, high)
            line = (spot, nearest_point(box, spot))
            if not self.is_free(box) or not (crosses or self._is_clear(box, *line)):
                continue
            self.taken.append(box)
            if math.dist(*line) > 1:
                self._lines.append(line)
            return at
        return None

    def _is_clear(self, box: Box, spot: Point, end: Point) -> bool:
        """Whether no line crosses a box, and its own line crosses nothing."""
        others = (each for each in self.taken if not _holds(each, spot))
        crossed = any(_crosses(*line, box) for line in self._lines)
        return not crossed and not any(_crosses(spot, end, each) for each in others)


def centred(at: Point, wide: float, high: float) -> Box:
    """The box around a middle."""
    return at[0] - wide / 2, at[1] - high / 2, at[0] + wide / 2, at[1] + high / 2


def nearest_point(box: Box, to: Point) -> Point:
    """The point of a box that is nearest to another."""
    return min(max(to[0], box[0]), box[2]), min(max(to[1], box[1]), box[3])


def _around(spot: Point, wide: float, high: float, least: int, far: int) -> Iterator[Point]:
    """Middles of boxes around a spot, the near ones first, and of these those beside it."""
    if least < 0:
        yield spot
    for gap in range(max(least, 0), far, _STEP):
        for angle in _ANGLES:
            across, down = math.cos(angle), math.sin(angle)
            yield (
                spot[0] + across * (gap + wide / 2),
                spot[1] + down * (gap + high / 2),
            )


def overlap(one: Box, other: Box) -> bool:
    """Whether two boxes share more than an edge."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _holds(box: Box, point: Point) -> bool:
    return box[0] <= point[0] <= box[2] and box[1] <= point[1] <= box[3]


def _crosses(start: Point, end: Point, box: Box) -> bool:
    """Whether a line enters a box (Liang and Barsky)."""
    enter, leave = 0.0, 1.0
    for axis in (0, 1):
        step = end[axis] - start[axis]
        low, high = box[axis] - start[axis], box[axis + 2] - start[axis]
        if abs(step) < 1e-9:
            if low >= 0 or high <= 0:
                return False
            continue
        first, last = sorted((low / step, high / step))
        enter, leave = max(enter, first), min(leave, last)
    return enter < leave


def alike(one: Piece, other: Piece) -> bool:
    """Whether one name may stand for both: two apples on a table, say."""

    def look(piece: Piece) -> tuple[object, ...]:
        name, _ = _name_and_number(piece.name)
        return name, piece.kind, piece.parent, piece.shown_marks, piece.changed

    return look(one) == look(other)


def listed(pieces: Sequence[Piece]) -> list[str]:
    """The names of pieces, those with marks last and by themselves."""
    plain = [piece.name for piece in pieces if not piece.marks]
    return [*ranges(plain), *(piece.described for piece in pieces if piece.marks)]


def _name_and_number(name: str) -> tuple[str, int]:
    """A name without its number, and that: 0 where it has none."""
    found = re.fullmatch(r"(.*) ([0-9]{1,6})", name)
    return (found[1], int(found[2])) if found else (name, 0)


def ranges(names: Iterable[str]) -> list[str]:
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
