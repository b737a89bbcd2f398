"""Goal tracking for other programs, over HTTP."""

from __future__ import annotations

import asyncio
from asyncio import wrap_future
from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, HTTPException, Path, Query
from pydantic import BaseModel, Field

from goalscope.base.types import TRACKING
from goalscope.belief.tracker import Correction
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.storage.tracking import Tracked, Trackers
from goalscope.web.errors import RequestBody, Route
from goalscope.web.guard import CurrentVisitor, Visitor, not_found, visible_episode
from goalscope.web.queue import ModelQueue
from goalscope.web.views import EpisodeView, TrackerView, Why

__all__ = ["NewCorrection", "tracking_router"]


class NewSession(RequestBody):
    """A session to open.

    `task` describes the assistant's task in a sentence; `goals` are the goals that the person may
    have. With `propose`, the server's model adds goals when none explains the words, and can remove
    them again.
    """

    task: str
    goals: list[str] = Field(default=[])
    propose: bool = False


class NewTurn(RequestBody):
    """The assistant's message, if any, and the person's reply."""

    query: str = ""
    utterance: str


class NewGoals(RequestBody):
    """Goals to add; each is scored on all past turns."""

    goals: list[str]


class NewCorrection(RequestBody):
    """A correction of a goal by the person.

    "pin": this goal is right; it can be a new one. "veto": it is wrong, and is not proposed again.
    "reword": it is right, in the words of `text`.
    """

    kind: Correction
    goal: str
    text: str = ""


class TrackerList(BaseModel):
    """Sessions, newest first."""

    trackers: list[EpisodeView]


def tracking_router(trackers: Trackers, queue: ModelQueue, store: Store) -> APIRouter:
    """The routes of goal tracking; each visitor reaches their own sessions.

    Args:
        trackers: The sessions.
        queue: Runs what needs the model.
        store: Keeps the sessions.
    """
    router = APIRouter(prefix="/api/trackers", tags=["tracking"], route_class=Route)

    def visible(id: str, visitor: Visitor) -> EpisodeInfo:
        info = visible_episode(visitor, store, id, "session")
        if info.domain != TRACKING:
            raise not_found("session")
        return info

    def require_owner(id: str, visitor: Visitor) -> None:
        if not visitor.owns(visible(id, visitor).owner):
            raise HTTPException(403, "This is somebody else's session; only they can change it.")

    async def queued(work: Callable[[], Tracked]) -> TrackerView:
        return await wrap_future(queue.submit(lambda: TrackerView.of(work())))

    async def queued_for(id: str, visitor: Visitor, work: Callable[[], Tracked]) -> TrackerView:
        await asyncio.to_thread(require_owner, id, visitor)
        return await queued(work)

    @router.post("", status_code=201)
    async def open_session(body: NewSession, visitor: CurrentVisitor) -> TrackerView:
        """Open a session, which is kept until it is deleted, even if the server restarts.

        Repeating the request, for example after a lost response, opens another session. `GET` lists
        your sessions, so that one without turns can be deleted.
        """
        return await queued(
            lambda: trackers.open(body.task, body.goals, propose=body.propose, owner=visitor.id)
        )

    @router.get("")
    def sessions(
        visitor: CurrentVisitor,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        offset: Annotated[int, Query(ge=0, le=10**9)] = 0,
    ) -> TrackerList:
        """Your own sessions, newest first; `rounds` is the number of turns."""
        found = store.episodes(
            owner=visitor.id, domain=TRACKING, newest_first=True, limit=limit, offset=offset
        )
        return TrackerList(trackers=[EpisodeView.of(info, mine=True) for info in found])

    @router.get("/{id}")
    def belief(id: str, visitor: CurrentVisitor) -> TrackerView:
        """The current belief, and advice on what to do next."""
        return TrackerView.of(trackers.read(visible(id, visitor).id))

    @router.put("/{id}/turns/{turn}")
    async def observe(
        id: str, turn: Annotated[int, Path(ge=1)], body: NewTurn, visitor: CurrentVisitor
    ) -> TrackerView:
        """Add a turn; the first is 1.

        It is stored when the response arrives. A repeated request counts once and has the same
        response. The same turn in other words, or a turn that is not the next, is a conflict (409).
        """
        return await queued_for(
            id, visitor, lambda: trackers.observe(id, turn, body.query, body.utterance)
        )

    @router.post("/{id}/goals")
    async def add_goals(id: str, body: NewGoals, visitor: CurrentVisitor) -> TrackerView:
        """Add goals; existing ones change nothing."""
        return await queued_for(id, visitor, lambda: trackers.add(id, body.goals))

    @router.post("/{id}/corrections")
    async def correct(id: str, body: NewCorrection, visitor: CurrentVisitor) -> TrackerView:
        """Correct the goals as the person says."""
        return await queued_for(
            id, visitor, lambda: trackers.correct(id, body.kind, body.goal, body.text)
        )

    @router.get("/{id}/why")
    def why(id: str, visitor: CurrentVisitor, goal: str = "") -> Why:
        """The evidence of each utterance for a goal; by default, the likeliest one."""
        return Why.of(*trackers.why(visible(id, visitor).id, goal))

    @router.post("/{id}/close")
    async def close(id: str, visitor: CurrentVisitor) -> TrackerView:
        """End a session; it can still be read."""
        return await queued_for(id, visitor, lambda: trackers.close(id))

    @router.delete("/{id}", status_code=204)
    def delete(id: str, visitor: CurrentVisitor) -> None:
        """Delete a session and everything said in it."""
        require_owner(id, visitor)
        trackers.delete(id)

    return router
