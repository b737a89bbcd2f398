"""Text as a plain keyboard types it: for models, readers and catalogues, never for the screen."""

from __future__ import annotations

import html
import re
import unicodedata

from goalscope.invisible import FORMAT, without_invisible

__all__ = ["plain"]

_CHARACTERS = str.maketrans(
    {
        **dict.fromkeys("\u2018\u2019\u201b\u02bc\u00b4\u2032\u0060\uff07", "'"),
        **dict.fromkeys("\u201c\u201d\u201f\u2033\u00ab\u00bb\uff02", '"'),
        **dict.fromkeys("\u2010\u2011\u2012\u2013\u2212\ufe63\uff0d", "-"),
        **dict.fromkeys("\u00a0\u2007\u2009\u200a\u202f\u3000", " "),
    }
)
_ENTITY = re.compile(r"&(?:#\d{1,7}|#x[0-9a-f]{1,6}|[a-z]{2,31});", re.IGNORECASE)
_EMPHASIS = re.compile(
    r"(?<![\w*_~])(\*{1,3}|_{1,3}|~~)(?=[^\s*_~])([^*_~\n]+?)(?<=\S)\1(?![\w*_~])"
)
_SPLIT = re.compile(
    r"\b((?:do|does|did|is|are|was|were|should|would|could|must|need|have|has|had|wo|ca)n) t\b",
    re.IGNORECASE,
)


def plain(text: str) -> str:
    """`text` with the characters of a plain keyboard, composed (NFC), and without markup.

    Apostrophes, quotes, hyphens and spaces of every make become the plain ones; HTML entities,
    Markdown emphasis and invisible characters (see `without_invisible`) go; "don t" is "don't".
    What a person typed is shown and stored as it is.
    """
    if "&" in text:
        text = _ENTITY.sub(lambda entity: html.unescape(entity[0]), text)
    if not text.isascii() or "`" in text:
        text = without_invisible(text.translate(_CHARACTERS), kinds=FORMAT)
        text = unicodedata.normalize("NFC", text)
    return _SPLIT.sub(r"\1't", _EMPHASIS.sub(r"\2", text))
