"""Text as a plain keyboard types it: for models, readers and catalogues, never for the screen."""

from __future__ import annotations

import html
import re
import unicodedata

from goalscope.invisible import FORMAT, without_invisible

__all__ = ["plain"]

_CHARACTERS = str.maketrans(
    {
        **dict.fromkeys(
            "`\u0091\u0092\u00b4\u02b9\u02bb\u02bc\u02c8\u02ca\u02cb\u055a\u05f3\u07f4\u07f5\u1fbd\u1fbf"
            "\u2018\u2019\u201b\u2032\u2035\u275b\u275c\ua78b\ua78c\uff07\uff40",
            "'",
        ),
        **dict.fromkeys(
            "\u0093\u0094\u00ab\u00bb\u02ba\u05f4\u201c\u201d\u201e\u201f\u2033\u2036\u275d\u275e\uff02",
            '"',
        ),
        **dict.fromkeys(
            "\u02d7\u058a\u05be\u1806\u2010\u2011\u2012\u2013\u2043\u2212\u2796\ufe58\ufe63\uff0d",
            "-",
        ),
        **dict.fromkeys("\u1680\u3164\u115f\u1160\uffa0", " "),  # seen as spaces
    }
)
_STYLED = re.compile("[\uff01-\uff5e\uffe0\uffe1\uffe5\uffe6\ufb00-\ufb06\U0001d400-\U0001d7ff]+")
"""Letters of full width, as are ¥ and £, in ligatures, and in mathematical type: bold, on sites."""

_VARIANT = re.compile("[\u034f\u0305\u0331-\u0338]|(?<=\\w)[\u180b-\u180f\ufe00-\ufe0f]")
"""Marks that choose how a letter looks, such as lines under it; emoji keep theirs."""

_MISREAD = re.compile("\u00e2\u20ac[^\\s]|[\u00c2\u00c3][\u0080-\u00bf]")
"""UTF-8 that a program took for Windows-1252: the apostrophe that became three characters."""

_ESCAPE = re.compile(r"\\u([0-9a-fA-F]{4})|\\(['\"])|\x1b\[[0-?]*[ -/]*[@-~]")
"""Characters as programs escape them in texts of theirs, and the styles of a terminal."""

_ENTITY = re.compile(r"&(?:#\d{1,7}|#x[0-9a-f]{1,6}|[a-z]{2,31});", re.IGNORECASE)
_TAG = re.compile(r"</?(?:b|i|u|s|em|strong|del|ins|mark|small|code|span)>", re.IGNORECASE)
_EMPHASIS = re.compile(
    r"(?<![\w*_~])(\*{1,3}|_{1,3}|~~)(?=[^\s*_~])([^*_~\n]+?)(?<=\S)\1(?![\w*_~])"
)
_SPLIT = re.compile(
    r"\b((?:do|does|did|is|are|was|were|should|would|could|must|need|have|has|had|wo|ca)n)"
    r"(?: |[;,\"]|'')t\b",
    re.IGNORECASE,
)


def plain(text: str) -> str:
    """`text` with the characters of a plain keyboard, composed (NFC), and without markup.

    Apostrophes, quotes, hyphens, spaces and letters of every make become the plain ones; HTML
    entities, marks of emphasis in HTML and Markdown, and invisible characters (see
    `without_invisible`) go; "don t" is "don't". What a person typed is shown and stored as it is.
    """
    if "\\" in text or "\x1b" in text:
        text = _ESCAPE.sub(
            lambda found: chr(int(found[1], 16)) if found[1] else found[2] or "", text
        )
    for _ in range(2):  # programs escape twice
        if "&" in text:
            text = _ENTITY.sub(lambda entity: html.unescape(entity[0]), text)
    if "<" in text:
        text = _TAG.sub("", text)
    if not text.isascii() or "`" in text:
        text = _MISREAD.sub(_reread, text)
        text = _STYLED.sub(lambda styled: unicodedata.normalize("NFKC", styled[0]), text)
        text = _VARIANT.sub("", text.translate(_CHARACTERS))
        text = _spaced(without_invisible(text, kinds=FORMAT))
        text = unicodedata.normalize("NFC", text)
    return _SPLIT.sub(r"\1't", _EMPHASIS.sub(r"\2", text))


def _reread(found: re.Match[str]) -> str:
    try:
        return found[0].encode("cp1252" if "\u20ac" in found[0] else "latin-1").decode()
    except UnicodeError:
        return found[0]


def _spaced(text: str) -> str:
    """`text` with plain spaces: those of other widths, and those that do not break."""
    return "".join(" " if unicodedata.category(each) == "Zs" else each for each in text)
