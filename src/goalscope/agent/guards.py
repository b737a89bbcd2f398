"""Guards on what was read: against harm, misreadings, conditions and irreversible actions.

The only English in them is a short list of stems of words of harm.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal

from goalscope.base.text import plain
from goalscope.language.dialogue_state import GRAVE
from goalscope.language.orders import Order, Reading

Awaited = Literal["", "harm", "yes", "word"]
"""What a question waits for: nothing, who may come to harm, a yes, or the word "yes" itself."""

SAY_YES = 'To confirm exactly what is shown, say "yes".'
"""End of a question that only the word itself answers; see `is_yes`."""

CONFIRM = f"That cannot be undone. {SAY_YES}"
"""End of the question before an irreversible action."""

HARM = "Something may harm somebody, if I understand you, but what is it? I have added nothing."
"""The question after a word of harm that was not read as an allergy or a diet."""

WARY = "You spoke of harm, and I am not sure what must not come."
"""Reason of an order that waits after a word of harm."""

UNSURE = 0.25
"""Margin, in nats, below which an order is asked about; docs/reading.md shows its cost."""

_HARM = re.compile(
    r"allerg|anaphyla|epi-?pen|c(?:o|œ)?eliac|intoleran|\bhives\b|\bswell|\bswoll|\brash\b"
    r"|\bchok|\bpoison",
    re.IGNORECASE,
)
_HINT = re.compile(r"\bthroat\b|hospital", re.IGNORECASE)
"""Words that may be about harm, or only about a cold or a visit: they are asked about once."""


def speaks_of_harm(utterance: str, reading: Reading) -> bool:
    """Whether a word of harm was said, but the reading holds no allergy or diet."""
    said = plain(utterance)
    return not _is_grave(reading) and bool(_HARM.search(said) or _HINT.search(said))


def _is_grave(reading: Reading) -> bool:
    return any(
        each.do in ("avoid", "only") and each.what and each.why in GRAVE for each in reading.orders
    )


def is_yes(utterance: str) -> bool:
    """Whether the utterance is the word that `SAY_YES` asks for; no reading is trusted here."""
    return plain(utterance).casefold().strip(" \t\n.!\"'") == "yes"


def is_wary(said: Iterable[tuple[str, Reading]]) -> bool:
    """Whether a word of harm was said, and since then neither an allergy nor a no.

    A mere hint at harm counts only in the newest utterance.

    Args:
        said: Utterances and their readings, newest first.
    """
    for age, (utterance, reading) in enumerate(said):
        if speaks_of_harm(utterance, reading) and (age == 0 or _HARM.search(plain(utterance))):
            return True
        if _is_grave(reading) or any(each.do == "no" for each in reading.orders):
            return False
    return False


def reason_to_wait(
    order: Order, limit: Order | None = None, *, sure: bool, wary: bool = False
) -> str:
    """Why an order needs the person's yes; "" if it needs none.

    Args:
        order: The order.
        limit: The allergy or diet that forbids it; see `DialogueState.forbids`.
        sure: Whether its reading is sure; see `Reading.sure`.
        wary: See `is_wary`.
    """
    if limit:
        whom = f"{limit.for_}: " if limit.for_ else ""
        return f'You said "no {limit.what}" ({whom}{limit.why}).'
    if wary:
        return WARY
    if order.if_:
        return f'You said "if {order.if_}", which I cannot tell.'
    return "" if sure else "I am not sure that I understood you."
