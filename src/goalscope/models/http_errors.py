"""What a server's answer says of trouble, wherever servers put it."""

from __future__ import annotations

import email.utils
import time
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import httpx2

__all__ = ["codes_of", "failed", "message_of", "seconds_asked"]


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
