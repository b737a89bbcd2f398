"""Characters that nobody sees, some of which deceive: the one rule of which a text may keep."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Set

__all__ = ["FORMAT", "HIDDEN", "JOINERS", "without_invisible"]

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
