"""Draw with Matplotlib: one style, literal text, and the same bytes every time."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

from goalscope.base.optional_packages import package
from goalscope.base.text import terminal_safe
from goalscope.base.types import GoalscopeError

__all__ = [
    "COLOURS",
    "GREY",
    "INK",
    "MARKERS",
    "Figure",
    "draw",
    "draw_figure",
    "shortened",
    "wrapped",
]

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
"""The palette of Okabe and Ito, safe for colour-blind readers and for print."""
GREY, INK = "#999999", "#222222"
MARKERS = "osD^vPX"
"""One for each colour, so that a print without colours can be read."""

_STYLE = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#666666",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7,
    "xtick.bottom": False,
    "ytick.left": False,
    "legend.frameon": False,
}


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture with its caption.

    Attributes:
        name: Name of its file.
        caption: How to read it, and the number of cases.
        svg: The picture.
    """

    name: str
    caption: str
    svg: str


def draw_figure(
    name: str, caption: str, size: tuple[float, float], paint: Callable[[Any], None]
) -> Figure:
    """Draw a figure; see `draw`. The caption's first sentence describes it for screen readers."""
    return Figure(name, caption, draw(name, caption.partition(". ")[0], size, paint))


def draw(name: str, title: str, size: tuple[float, float], paint: Callable[[Any], None]) -> str:
    """Draw a picture as SVG; the same picture always gives the same bytes.

    Args:
        name: Seed of the ids in the SVG.
        title: Its description for screen readers.
        size: Width and height in inches.
        paint: Paints on a Matplotlib figure.

    Raises:
        GoalscopeError: Matplotlib is missing.
    """
    mpl, figures, canvas = (
        package(module, "Figures need", GoalscopeError)
        for module in ("matplotlib", "matplotlib.figure", "matplotlib.backends.backend_agg")
    )
    svg = io.StringIO()
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # the SVG has it all the same
        mpl.rcdefaults()
        mpl.rcParams.update({**_STYLE, "svg.hashsalt": name})
        figure = figures.Figure(figsize=size, layout="constrained")
        canvas.FigureCanvasAgg(figure)
        paint(figure)
        figure.draw_without_rendering()  # the first layout has not seen yet how wide the text is
        told = {"Title": shortened(title, 300), "Date": None, "Creator": None}
        figure.savefig(svg, format="svg", metadata=told)
    return svg.getvalue()


def shortened(text: str, most: int) -> str:
    """`text` on one line, cut to a length, without characters that must not be drawn."""
    shown = re.sub(
        "[\ufffe\uffff\ufdd0-\ufdef]", "\N{REPLACEMENT CHARACTER}", terminal_safe(text).plain
    )
    line = " ".join(shown.split())
    return line if len(line) <= most else line[: most - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}"


def wrapped(text: str, most: int, width: int) -> str:
    """The same, on lines of a width."""
    return "\n".join(wrap(shortened(text, most), width))
