"""Matplotlib, as the report uses it: one style, text as it is, and the same bytes every time."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from xml.dom import minidom

from goalscope.extras import package
from goalscope.plain import plain
from goalscope.types import GoalscopeError

__all__ = ["COLOURS", "GREY", "INK", "PALE", "Drawing", "clean", "draw", "shortened"]

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
"""Those of Okabe and Ito, which people who see few colours tell apart, and so does print."""
GREY, PALE, INK = "#999999", "#DDDDDD", "#222222"

_FONTS = "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif"
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
    "hatch.linewidth": 0.6,
    "legend.frameon": False,
}


@dataclass(frozen=True, slots=True)
class Drawing:
    """A picture in both formats.

    Attributes:
        svg: Of the same bytes whenever the same is drawn; its ids begin with its name.
        png: At 200 dots per inch.
    """

    svg: str
    png: bytes


def draw(name: str, title: str, size: tuple[float, float], paint: Callable[[Any], None]) -> Drawing:
    """Draw a picture.

    Args:
        name: Unique on a page; of letters, digits, `.`, `_` and `-`.
        title: What it shows, for those who do not see it.
        size: Width and height in inches.
        paint: Paints on a Matplotlib figure.

    Raises:
        GoalscopeError: Matplotlib is missing.
    """
    mpl, figures, canvas = (
        package(module, "Figures need", GoalscopeError)
        for module in ("matplotlib", "matplotlib.figure", "matplotlib.backends.backend_agg")
    )
    svg, png = io.StringIO(), io.BytesIO()
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # the SVG has it all the same
        mpl.rcdefaults()
        mpl.rcParams.update({**_STYLE, "svg.hashsalt": name})
        figure = figures.Figure(figsize=size, layout="constrained")
        canvas.FigureCanvasAgg(figure)
        paint(figure)
        figure.draw_without_rendering()  # the first layout has not seen yet how wide the text is
        figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
        figure.savefig(png, format="png", dpi=200, metadata={"Software": None})
    return Drawing(_tidy(svg.getvalue(), name, clean(title)), png.getvalue())


def clean(text: str) -> str:
    """`text` without what a page or a picture must not hold, such as control characters."""
    return re.sub("[\ufffe\uffff\ufdd0-\ufdef]", "\N{REPLACEMENT CHARACTER}", plain(text).plain)


def shortened(text: str, most: int) -> str:
    """`text` in one line of at most so many characters, without what must not be drawn."""
    line = " ".join(clean(text).split())
    return line if len(line) <= most else line[: most - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}"


def _tidy(text: str, name: str, title: str) -> str:
    """The bare `svg` element: it has a title, its own ids, and no style for the page around it."""
    document: Any = minidom.parseString(text.encode())
    root = document.documentElement
    for node in _descendants(root):
        if node.nodeType == node.COMMENT_NODE or node.nodeName in ("metadata", "style"):
            node.parentNode.removeChild(node)
        elif node.nodeType == node.ELEMENT_NODE:
            _rename(node, name)
    root.setAttribute("style", "stroke-linejoin: round; stroke-linecap: butt")
    root.setAttribute("role", "img")
    root.setAttribute("aria-labelledby", f"{name}-title")
    heading = document.createElement("title")
    heading.setAttribute("id", f"{name}-title")
    heading.appendChild(document.createTextNode(title))
    root.insertBefore(heading, root.firstChild)
    return str(root.toxml()) + "\n"


def _rename(node: Any, name: str) -> None:
    for key, value in list(node.attributes.items()):
        if key == "id":
            node.setAttribute(key, f"{name}-{value}")
        elif key.endswith("href") and value.startswith("#"):
            node.setAttribute(key, f"#{name}-{value[1:]}")
        elif "url(#" in value:
            node.setAttribute(key, value.replace("url(#", f"url(#{name}-"))
        elif key == "style" and node.nodeName == "text":
            node.setAttribute(key, re.sub(r"(font: [^;]*px) [^;]*", rf"\1 {_FONTS}", value))


def _descendants(node: Any) -> list[Any]:
    found: list[Any] = []
    for child in node.childNodes:
        found += [child, *_descendants(child)]
    return found
