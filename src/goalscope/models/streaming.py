"""A chat completion that comes piece by piece, as server-sent events."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import Any

from goalscope.models import OnText

__all__ = ["Streamed"]

_LONGEST = 1 << 20
"""Bytes of a line."""


class Streamed:
    """Puts a streamed chat completion together.

    Args:
        heard: Is told the text so far, whenever it has grown.
    """

    def __init__(self, heard: OnText) -> None:
        self._heard = heard
        self._rest = bytearray()
        self._ended = False
        self._message: dict[str, str] = {}
        self._finish: str | None = None
        self._others: dict[str, Any] = {}

    def take(self, data: bytes) -> None:
        """Take in the next bytes.

        Raises:
            AttributeError: They are no such events; or LookupError, RecursionError, TypeError,
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
        """JSON as it would have come in one piece; empty if it was broken off."""
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
            for key in ("content", "refusal"):
                if isinstance(piece := delta.get(key), str):
                    self._message[key] = self._message.get(key, "") + piece
            if delta.get("content"):
                self._heard(self._message["content"])
