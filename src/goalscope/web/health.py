"""Whether the model behind the page answers."""

from __future__ import annotations

import asyncio
import time
from concurrent.futures import Future

from fastapi import HTTPException
from pydantic import BaseModel

from goalscope.models import Model
from goalscope.types import Message
from goalscope.web.desk import Desk

__all__ = ["Health", "Probe"]

WAIT = 8.0
"""Seconds that a model gets; one that works for others for so long counts as one that hangs."""


class Health(BaseModel):
    """That the model works, and after how many seconds it had scored a word."""

    seconds: float


class Probe:
    """Has the model score a word, at the desk, once for all who ask meanwhile.

    Args:
        model: The model.
        desk: Where it works.
    """

    def __init__(self, model: Model, desk: Desk) -> None:
        self._model, self._desk = model, desk
        self._trial: Future[object] | None = None

    async def answered(self) -> float:
        """Seconds that it took.

        Raises:
            ModelError: The model fails.
            HTTPException: 503: it does not answer in time.
        """
        start = time.monotonic()
        if self._trial is None or self._trial.done():
            self._trial = self._desk.submit("health", self._score, lambda place: None)
        trial = asyncio.wrap_future(self._trial)
        trial.add_done_callback(lambda done: done.cancelled() or done.exception())  # seen, if late
        done, _ = await asyncio.wait([trial], timeout=WAIT)
        if not done:
            told = f"The model has not answered for {WAIT:.0f} s: it works for others, or hangs."
            raise HTTPException(503, told)
        await trial
        return time.monotonic() - start

    def _score(self) -> None:
        self._model.token_logprobs([[Message("user", "Are you there?")]], ["Yes."])
