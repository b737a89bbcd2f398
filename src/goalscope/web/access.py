"""Who sees which episode."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, HTTPException, Request

from goalscope.store import EpisodeInfo, Store
from goalscope.types import InvalidInputError
from goalscope.web.guard import Visitor, visitor_of

__all__ = ["Guest", "seen_by"]


def _visitor(request: Request) -> Visitor:
    return visitor_of(request.scope)


Guest = Annotated[Visitor, Depends(_visitor)]


def seen_by(visitor: Visitor, store: Store, id: str) -> EpisodeInfo:
    """The episode, if the visitor may see it; nobody learns which ids others have.

    Raises:
        HTTPException: 404.
    """
    try:
        info = store.episode(id)
    except InvalidInputError:
        info = None
    if info is None or info.id != id or not (visitor.is_host or info.owner == visitor.id):
        raise HTTPException(404, "There is no such episode.")
    return info
