"""Text from people, models, catalogues and scenes: made plain to be read, and safe to be shown."""

from __future__ import annotations

import html
import re
import shlex
import unicodedata
from collections.abc import Set
from pathlib import PurePath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.text import Text


JOINERS = "\N{ZERO WIDTH NON-JOINER}\N{ZERO WIDTH JOINER}"
"""They shape the words of some scripts (Persian, Hindi, Malayalam), and emoji such as families."""

FORMAT = frozenset({"Cf"})
"""The Unicode category of marks that change how text looks, such as those of its direction."""

HIDDEN = FORMAT | {"Cc", "Cs", "Co", "Zl", "Zp"}
"""Also controls, surrogates, private characters, and separators of lines."""

_SCRIPTS = (  # whose letters join or stack, from Hebrew to Adlam
    "\u0590-\u109f\u1700-\u18af\u1900-\u1cff\ua800-\uab2f\uabc0-\uabff\ufb50-\ufdff\ufe70-\ufefe"
    "\U00010a00-\U00011fff\U0001e900-\U0001e95f"
)
_EMOJI = "\u2190-\u2bff\ufe0f\U0001f000-\U0001faff"  # with the mark of their style
_KEPT = re.compile(
    f"(?<=[{_SCRIPTS}])[{JOINERS}]{{1,3}}|[{JOINERS}]{{1,3}}(?=[{_SCRIPTS}])"
    f"|(?<=[{_EMOJI}])\N{ZERO WIDTH JOINER}(?=[{_EMOJI}])"
    "|[\u0600-\u0605\u06dd\u070f\u0890\u0891\u08e2\U000110bd\U000110cd]"  # seen around numbers
)


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


SHOWN = {"Smollm2 135M 8k Lc100K Mix1 Ep2": "SmolLM2-135M-Instruct"}
"""The known names of models whose files, and so episodes and calibrations, name them otherwise."""


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
        while (reread := _MISREAD.sub(_reread, text)) != text:  # programs misread twice
            text = reread
        text = _STYLED.sub(lambda styled: unicodedata.normalize("NFKC", styled[0]), text)
        text = _VARIANT.sub("", text.translate(_CHARACTERS))
        text = without_invisible(text, kinds=FORMAT)
        text = "".join(" " if unicodedata.category(c) == "Zs" else c for c in text)
        text = unicodedata.normalize("NFC", text)
    return _SPLIT.sub(r"\1't", _EMPHASIS.sub(r"\2", text))


def without_invisible(text: str, instead: str = "", *, kinds: Set[str] = HIDDEN) -> str:
    """`text` with every invisible character replaced.

    Joiners stay beside a letter of a script that uses them, and between emoji. Elsewhere they are
    dropped: they would only make two texts that look the same differ.

    Args:
        text: Of anyone.
        instead: What stands in the place of each.
        kinds: Unicode categories of what is replaced.
    """
    if text.isprintable():
        return text
    kept = {place for match in _KEPT.finditer(text) for place in range(*match.span())}
    return "".join(
        each
        if unicodedata.category(each) not in kinds or place in kept
        else ""
        if each in JOINERS
        else instead
        for place, each in enumerate(text)
    )


def terminal_safe(text: str, style: str = "") -> Text:
    """Text without markup, escape sequences or characters that reorder the line."""
    from rich.text import Text

    lines = text.replace("\t", " ").replace("\r\n", "\n").split("\n")
    shown = (without_invisible(line, "\N{REPLACEMENT CHARACTER}") for line in lines)
    return Text("\n".join(shown), style)


def command_line(*words: object) -> str:
    """The command line of goalscope with these words, quoted for a shell."""
    return shlex.join(["goalscope", *map(str, words)])


def domain_shown(name: str) -> str:
    """A domain's name as people know it: a file of their own goes by its name alone."""
    return PurePath(name).name


def model_shown(name: str) -> str:
    """A model's name, or two in one, as people know it."""
    for own, known in SHOWN.items():
        name = name.replace(own, known)
    return name


def _reread(found: re.Match[str]) -> str:
    try:
        return found[0].encode("cp1252" if "\u20ac" in found[0] else "latin-1").decode()
    except UnicodeError:
        return found[0]


def is_question(said: str) -> bool:
    """Whether an utterance ends in a question mark, be it of full width or Arabic."""
    return plain(said).rstrip().endswith(("?", "\uff1f", "\u061f"))
