"""Goal tracking for other programs, by HTTP."""

from __future__ import annotations

import asyncio
from asyncio import wrap_future
from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, HTTPException, Path, Query
from pydantic import BaseModel, Field

from goalscope.store import EpisodeInfo, Store
from goalscope.tracker import Correction
from goalscope.tracking import Tracked, Trackers
from goalscope.types import TRACKING
from goalscope.web.access import seen_by, unknown
from goalscope.web.guard import Guest, Visitor
from goalscope.web.queue import ModelQueue
from goalscope.web.refusals import Given
from goalscope.web.views import EpisodeView, TrackerView, Why

__all__ = ["CorrectionGiven", "tracking_routes"]


class OpenTracker(Given):
    """A new session.

    `task` is the assistant's, in a sentence; `goals` is what the person may want. With `propose`
    the server's model adds goals when none explains the words, and takes its own out again.
    """

    task: str
    goals: list[str] = Field(default=[])
    propose: bool = False


class TurnGiven(Given):
    """What the assistant said, if anything, and what the person answered."""

    query: str = ""
    utterance: str


class GoalsGiven(Given):
    """Goals to add; each is scored on all past turns."""

    goals: list[str]


class CorrectionGiven(Given):
    """What the person says of a goal.

    "pin": it is this one, perhaps a new one. "veto": it is not, and is not proposed again.
    "reword": it is this one, in the words of `text`.
    """

    kind: Correction
    goal: str
    text: str = ""


class TrackerList(BaseModel):
    """Sessions, newest first."""

    trackers: list[EpisodeView]


def tracking_routes(trackers: Trackers, desk: ModelQueue, store: Store) -> APIRouter:
    """What programs may ask for, each of its own sessions.

    Args:
        trackers: The sessions.
        desk: Where the model works.
        store: Of the sessions.
    """
    router = APIRouter(prefix="/api/trackers", tags=["tracking"])

    def seen(id: str, visitor: Visitor) -> EpisodeInfo:
        info = seen_by(visitor, store, id, "session")
        if info.domain != TRACKING:
            raise unknown("session")
        return info

    def own(id: str, visitor: Visitor) -> None:
        if not visitor.owns(seen(id, visitor).owner):
            raise HTTPException(403, "This is somebody else's session, which only they change.")

    async def at_desk(work: Callable[[], Tracked]) -> TrackerView:
        return await wrap_future(desk.submit(lambda: TrackerView.of(work())))

    @router.post("", status_code=201)
    async def open_session(given: OpenTracker, visitor: Guest) -> TrackerView:
        """Open a session, which stays until it is deleted, also when the server starts anew.

        The same request again, perhaps since its answer was lost, opens another session; `GET`
        lists yours, so that one in which nothing was said can be deleted.
        """
        return await at_desk(
            lambda: trackers.open(given.task, given.goals, propose=given.propose, owner=visitor.id)
        )

    @router.get("")
    def sessions(
        visitor: Guest,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        offset: Annotated[int, Query(ge=0, le=10**9)] = 0,
    ) -> TrackerList:
        """Your own sessions, newest first; `rounds` is the number of turns."""
        found = store.episodes(
            owner=visitor.id, domain=TRACKING, newest_first=True, limit=limit, offset=offset
        )
        return TrackerList(trackers=[EpisodeView.of(info, mine=True) for info in found])

    @router.get("/{id}")
    def belief(id: str, visitor: Guest) -> TrackerView:
        """The belief as it is now, and what to do next."""
        return TrackerView.of(trackers.read(seen(id, visitor).id))

    @router.put("/{id}/turns/{turn}")
    async def observe(
        id: str, turn: Annotated[int, Path(ge=1)], given: TurnGiven, visitor: Guest
    ) -> TrackerView:
        """Take in a turn; the first is 1.

        It is stored when the answer comes. The same request again counts once, and has the same
        answer; the same turn in other words, or one that is not the next, is a conflict (409).
        """
        await asyncio.to_thread(own, id, visitor)
        return await at_desk(lambda: trackers.observe(id, turn, given.query, given.utterance))

    @router.post("/{id}/goals")
    async def add_goals(id: str, given: GoalsGiven, visitor: Guest) -> TrackerView:
        """Add goals; those that are there already change nothing."""
        await asyncio.to_thread(own, id, visitor)
        return await at_desk(lambda: trackers.add(id, given.goals))

    @router.post("/{id}/corrections")
    async def correct(id: str, given: CorrectionGiven, visitor: Guest) -> TrackerView:
        """Take in what the person says of the goals themselves."""
        await asyncio.to_thread(own, id, visitor)
        return await at_desk(lambda: trackers.correct(id, given.kind, given.goal, given.text))

    @router.get("/{id}/why")
    def why(id: str, visitor: Guest, goal: str = "") -> Why:
        """What each utterance says for a goal; for the likeliest one if none is named."""
        return Why.of(*trackers.why(seen(id, visitor).id, goal))

    @router.post("/{id}/close")
    async def close(id: str, visitor: Guest) -> TrackerView:
        """End a session; it can still be read."""
        await asyncio.to_thread(own, id, visitor)
        return await at_desk(lambda: trackers.close(id))

    @router.delete("/{id}", status_code=204)
    def delete(id: str, visitor: Guest) -> None:
        """Delete a session with all that was said in it."""
        own(id, visitor)
        trackers.delete(id)

    return router
