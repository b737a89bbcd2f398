"""Parse servers' answers: messages and errors."""

from __future__ import annotations

import email.utils
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import httpx2

__all__ = ["codes_of", "failed", "message_of", "said_in", "seconds_asked", "thought_in"]


def seconds_asked(response: httpx2.Response) -> float | None:
    """Seconds that the headers ask to wait: a number, or up to a date; None if they do not."""
    for name, unit in (("retry-after-ms", 1000), ("retry-after", 1)):
        said = response.headers.get(name, "")
        try:
            return max(0.0, float(said) / unit)
        except ValueError:
            pass
        try:
            return max(0.0, email.utils.parsedate_to_datetime(said).timestamp() - time.time())
        except (ValueError, OverflowError):
            pass
    return None


def _error(answer: object) -> dict[str, Any]:
    """The error object of an answer, wherever servers put it; empty if there is none."""
    found: object = answer
    if isinstance(answer, dict):
        rows = cast("dict[str, Any]", answer)
        found = rows.get("error", rows)
    if isinstance(found, str):
        return {"message": found}
    return cast("dict[str, Any]", found) if isinstance(found, dict) else {}


def failed(answer: object) -> bool:
    """Whether an answer holds an error, as some proxies' do that come with HTTP 200."""
    return isinstance(answer, dict) and bool(cast("dict[str, Any]", answer).get("error"))


def message_of(answer: object) -> str:
    """The error in words; empty if there are none."""
    error = _error(answer)
    return str(error.get("message") or error.get("detail") or "")


def codes_of(answer: object) -> set[str]:
    """The names by which servers tell errors apart."""
    return {str(_error(answer).get(key)) for key in ("code", "type")}


_THOUGHTS = ("reasoning_content", "reasoning", "thinking", "reasoning_details")


def said_in(message: Mapping[str, Any]) -> str | None:
    """The text of a message, without parts that are thoughts."""
    content = message.get("content")
    if not isinstance(content, list):
        return content if isinstance(content, str) else None
    parts = (part for part in _parts(message) if part.get("type") in ("text", None))
    said = [part["text"] for part in parts if isinstance(part.get("text"), str)]
    return "".join(said) if said else None


def thought_in(message: Mapping[str, Any]) -> bool:
    """Whether a message holds a thought beside what it says."""
    kinds = [part.get("type") for part in _parts(message)]
    return any(message.get(key) for key in _THOUGHTS) or "thinking" in kinds or "reasoning" in kinds


def _parts(message: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The parts of a content that is made of parts."""
    content = message.get("content")
    parts = cast("list[Any]", content) if isinstance(content, list) else []
    return [cast("dict[str, Any]", part) for part in parts if isinstance(part, dict)]
