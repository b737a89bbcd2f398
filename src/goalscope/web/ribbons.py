"""The history of a belief as a drawing without a script; in the page, ribbons.js draws it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from goalscope.web.views import BeliefView

__all__ = ["HEIGHT", "WIDTH", "Ribbon", "ribbons"]

WIDTH, HEIGHT = 100, 100
"""Of a column; the page stretches them."""
LEVEL = 0.36
"""Share of a column in which a ribbon is level."""
COLOURS = 9
"""How many style.css has, `.c0` and so on."""


@dataclass(frozen=True, slots=True)
class Ribbon:
    """A goal over the rounds.

    Attributes:
        goal: Its text.
        colour: Its class in style.css.
        path: Its outline, as the `d` of an SVG path.
    """

    goal: str
    colour: str
    path: str


def ribbons(beliefs: Sequence[BeliefView]) -> list[Ribbon]:
    """A ribbon for each goal that ever was, from the top; the one without words comes last."""
    values: dict[str, list[float]] = {}
    without: set[str] = set()
    for place, belief in enumerate(beliefs):
        for goal in belief.goals:
            row = values.setdefault(goal.text, [0.0] * len(beliefs))
            row[place] = goal.probability
            if goal.unspecified:
                without.add(goal.text)
    drawn: list[Ribbon] = []
    tops = [0.0] * len(beliefs)
    for text in sorted(values, key=lambda text: text in without):
        bottoms = [top + value for top, value in zip(tops, values[text], strict=True)]
        colour = "unspecified" if text in without else f"c{len(drawn) % COLOURS}"
        path = _outline(tops, bottoms)
        drawn.append(Ribbon(text, colour, path))
        tops = bottoms
    return drawn


def _outline(tops: Sequence[float], bottoms: Sequence[float]) -> str:
    """Level in the middle of each column, and straight to the next; back below."""
    places = [place + 0.5 + side for place in range(len(tops)) for side in (-LEVEL / 2, LEVEL / 2)]
    places[0], places[-1] = 0.0, float(len(tops))
    there = zip(places, [y for y in tops for _ in range(2)], strict=True)
    back = zip(places, [y for y in bottoms for _ in range(2)], strict=True)
    points = [*there, *reversed([*back])]
    return f"M{' L'.join(f'{x * WIDTH:.1f} {y * HEIGHT:.2f}' for x, y in points)} Z"
