"""Guards that hold whatever the reader reads: of harm, of doubt, of conditions, of the lasting.

They are plain code and know no phrasing, but for two short lists: the stems of words of harm.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from goalscope.orders import Order, Reading, orders_to_text
from goalscope.standing import GRAVE

__all__ = ["CONFIRM", "HARM", "SAY_YES", "UNSURE", "WARY"]
__all__ += ["is_wary", "is_yes", "reason_to_wait", "speaks_of_harm", "whether"]

SAY_YES = 'To confirm exactly what is shown, say "yes".'
"""How a question ends that only the very word answers: see `is_yes`."""

CONFIRM = f"That cannot be undone. {SAY_YES}"
"""How a round's question ends before what nobody can undo."""

HARM = "Something may harm somebody, if I understand you, but what is it? I have added nothing."
"""A round's question where a word of harm was said, and no allergy was read."""

WARY = "You spoke of harm, and I am not sure what must not come."
"""Why an order waits after a word of harm."""

UNSURE = 0.25
"""Nats: below this margin an order is asked about. See docs/reading.md for its cost."""

_HARM = re.compile(
    r"allerg|anaphyla|epi-?pen|c(?:o|œ)?eliac|intoleran|\bhives\b|\bswell|\bswoll|\brash\b"
    r"|\bchok|\bpoison",
    re.IGNORECASE,
)
_HINT = re.compile(r"\bthroat\b|hospital", re.IGNORECASE)
"""Of harm, or of a cold and of a visit to the ward: asked about once."""


def speaks_of_harm(utterance: str, reading: Reading) -> bool:
    """Whether a word of harm was said of which the reading holds no allergy or diet."""
    return not _is_grave(reading) and bool(_HARM.search(utterance) or _HINT.search(utterance))


def _is_grave(reading: Reading) -> bool:
    return any(
        each.do in ("avoid", "only") and each.what and each.why in GRAVE for each in reading.orders
    )


def is_yes(utterance: str) -> bool:
    """Whether the very word was said that `SAY_YES` asks for: no reading is trusted with that."""
    return utterance.casefold().strip(" \t\n.!\"'") == "yes"


def is_wary(said: Iterable[tuple[str, Reading]]) -> bool:
    """Whether a word of harm was said, and since then neither an allergy nor a no.

    What only hints at harm holds for as long as it is the newest that was said.

    Args:
        said: Utterances and their readings, newest first.
    """
    for age, (utterance, reading) in enumerate(said):
        if speaks_of_harm(utterance, reading) and (age == 0 or _HARM.search(utterance)):
            return True
        if _is_grave(reading) or any(each.do == "no" for each in reading.orders):
            return False
    return False


def reason_to_wait(
    order: Order, limit: Order | None = None, *, sure: bool, wary: bool = False
) -> str:
    """Why an order needs the person's yes, whatever it does; "" where it needs none.

    Args:
        order: The order.
        limit: The allergy or diet that forbids it; see `Standing.forbids`.
        sure: Whether its reading is.
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


def whether(orders: Sequence[Order], reasons: Sequence[str], end: str) -> str:
    """The question that lets orders go ahead: why they wait, what was understood, and its end."""
    if not orders:
        return ""
    understood = "; ".join(orders_to_text(orders).replace(" | ", " ").splitlines())
    why = filter(None, dict.fromkeys(reasons))
    return " ".join([*why, f'I understood "{understood}".', end])
