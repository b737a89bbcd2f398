"""Text from people, models, catalogues and scenes, made safe for a terminal."""

from __future__ import annotations

from pathlib import PurePath

from rich.text import Text

from goalscope.invisible import without_invisible

__all__ = ["domain_shown", "model_shown", "terminal_safe"]

SHOWN = {"Smollm2 135M 8k Lc100K Mix1 Ep2": "SmolLM2-135M-Instruct"}
"""The known names of models whose files, and so episodes and calibrations, name them otherwise."""


def terminal_safe(text: str, style: str = "") -> Text:
    """Text without markup, escape sequences or characters that reorder the line."""
    lines = text.replace("\t", " ").replace("\r\n", "\n").split("\n")
    shown = (without_invisible(line, "\N{REPLACEMENT CHARACTER}") for line in lines)
    return Text("\n".join(shown), style)


def domain_shown(name: str) -> str:
    """A domain's name as people know it: a file of their own goes by its name alone."""
    return PurePath(name).name


def model_shown(name: str) -> str:
    """A model's name, or two in one, as people know it."""
    for own, known in SHOWN.items():
        name = name.replace(own, known)
    return name
