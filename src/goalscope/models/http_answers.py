"""Parse servers' answers: streamed chat completions and errors."""

from __future__ import annotations

import email.utils
import json
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, cast

from goalscope.models import OnText

if TYPE_CHECKING:
    import httpx2

__all__ = ["Streamed", "codes_of", "failed", "message_of", "said_in", "seconds_asked", "thought_in"]

_LONGEST = 1 << 20
"""Bytes of a line."""


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
    """The text of a message, or of a piece of one, without parts that are thoughts."""
    content = message.get("content")
    if not isinstance(content, list):
        return content if isinstance(content, str) else None
    parts = (part for part in _parts(message) if part.get("type") in ("text", None))
    said = [part["text"] for part in parts if isinstance(part.get("text"), str)]
    return "".join(said) if said else None


def thought_in(message: Mapping[str, Any]) -> bool:
    """Whether a message, or a piece of one, holds a thought beside what it says."""
    kinds = [part.get("type") for part in _parts(message)]
    return any(message.get(key) for key in _THOUGHTS) or "thinking" in kinds or "reasoning" in kinds


def _parts(message: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The parts of a content that is made of parts."""
    content = message.get("content")
    parts = cast("list[Any]", content) if isinstance(content, list) else []
    return [cast("dict[str, Any]", part) for part in parts if isinstance(part, dict)]


class Streamed:
    """Assembles a streamed chat completion.

    Args:
        on_text: Called with the text so far, whenever it has grown.
    """

    def __init__(self, on_text: OnText) -> None:
        self._on_text = on_text
        self._rest = bytearray()
        self._ended = False
        self._message: dict[str, Any] = {}
        self._finish: str | None = None
        self._others: dict[str, Any] = {}

    def take(self, data: bytes) -> None:
        """Process the next bytes.

        Raises:
            AttributeError: The events are invalid; likewise LookupError, RecursionError, TypeError,
                ValueError.
        """
        self._rest += data
        if len(self._rest) > len(data) + _LONGEST:
            raise ValueError("a line without end")
        if b"\n" not in data and b"\r" not in data:
            return
        lines = self._rest.splitlines(keepends=True)
        self._rest = bytearray() if lines[-1].endswith((b"\n", b"\r")) else lines.pop()
        for line in lines:
            said = bytes(line).removeprefix(b"data:").strip()
            if said == b"[DONE]":
                self._ended = True
            elif line.startswith(b"data:"):
                self._event(json.loads(said))

    def answer(self) -> bytes:
        """The JSON of the unstreamed answer; empty if the stream broke off."""
        with suppress(ValueError):  # of a last line that was broken off
            self.take(b"\n")
        if not (self._ended or self._finish or "error" in self._others):
            return b""
        choice = {"message": self._message, "finish_reason": self._finish}
        return json.dumps({**self._others, "choices": [choice]}).encode()

    def _event(self, event: dict[str, Any]) -> None:
        self._others |= {key: event[key] for key in ("usage", "error") if event.get(key)}
        for choice in event.get("choices") or ():
            self._finish = choice.get("finish_reason") or self._finish
            delta: dict[str, Any] = choice.get("delta") or {}
            said = said_in(delta)
            for key, piece in (("content", said), ("refusal", delta.get("refusal"))):
                if isinstance(piece, str):
                    self._message[key] = self._message.get(key, "") + piece
            if thought_in(delta):
                self._message["reasoning"] = True
            if said:
                self._on_text(self._message["content"])
