"""How a picture of a room looks, in light and dark."""

from __future__ import annotations

import re
from collections.abc import Mapping

__all__ = ["LEGEND", "pointing", "style_sheet"]

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
.name{font-weight:600}
.label{font-size:11px;text-anchor:middle;dominant-baseline:central;paint-order:stroke;
stroke:var(--floor);stroke-width:2.5px;stroke-linejoin:round}
.after{text-anchor:start}.before{text-anchor:end}
.tip{visibility:hidden;pointer-events:none}.tip rect{fill:var(--ink)}
.tip text{fill:var(--paper);text-anchor:middle;dominant-baseline:central}
.mark{cursor:default}.mark:focus{outline:none}.mark:focus circle{stroke:var(--ink);stroke-width:2}
.number{font-size:10px;font-weight:700;fill:var(--paper)}
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


def style_sheet() -> str:
    """The style sheet with its colours written out, as not every program knows variables."""

    def coloured(colours: Mapping[str, str]) -> str:
        return re.sub(r"var\(--(\w+)\)", lambda found: colours[found[1]], STYLE)

    return f"{coloured(LIGHT)}@media(prefers-color-scheme:dark){{{coloured(DARK)}}}"


def pointing(count: int) -> str:
    """Rules that show the name of a number, which is drawn last, so over everything else."""
    shows = (f"#m{n}:hover~#t{n},#m{n}:focus~#t{n}" for n in range(1, count + 1))
    return "".join(f"{each}{{visibility:visible}}" for each in shows)
