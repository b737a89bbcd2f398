"""A chat completion that comes piece by piece, as server-sent events."""

from __future__ import annotations

import json
from typing import Any

from goalscope.models import Heard

__all__ = ["Streamed"]


class Streamed:
    """Puts a streamed chat completion together.

    Args:
        heard: Is told the text so far, whenever it has grown.
    """

    def __init__(self, heard: Heard) -> None:
        self._heard = heard
        self._rest = b""
        self._message: dict[str, str] = {}
        self._finish: str | None = None
        self._others: dict[str, Any] = {}

    def take(self, data: bytes) -> None:
        """Take in the next bytes.

        Raises:
            AttributeError: They are no such events; or LookupError, TypeError, ValueError.
        """
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            said = line.removeprefix(b"data:").strip()
            if line.startswith(b"data:") and said != b"[DONE]":
                self._event(json.loads(said))

    def answer(self) -> bytes:
        """JSON as it would have come in one piece; empty if it was broken off."""
        if self._finish is None and "error" not in self._others:
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
