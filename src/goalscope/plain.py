"""Text from people, models, catalogues and scenes, as a terminal may show it."""

from __future__ import annotations

import unicodedata

from rich.text import Text

__all__ = ["plain"]

HIDDEN = {"Cc", "Cf", "Cs", "Co", "Zl", "Zp"}  # control, format (bidi), surrogates, separators


def plain(text: str, style: str = "") -> Text:
    """Text without markup, escape sequences or characters that reorder the line."""
    shown = "".join(
        each
        if each == "\n" or unicodedata.category(each) not in HIDDEN
        else "\N{REPLACEMENT CHARACTER}"
        for each in text.replace("\t", " ").replace("\r\n", "\n")
    )
    return Text(shown, style)
