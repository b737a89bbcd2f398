"""Who sees which episode."""

from __future__ import annotations

from fastapi import HTTPException

from goalscope.store import EpisodeInfo, Store
from goalscope.types import InvalidInputError
from goalscope.web.guard import Visitor

__all__ = ["seen_by", "unknown"]


def seen_by(visitor: Visitor, store: Store, id: str, what: str = "episode") -> EpisodeInfo:
    """The episode, if the visitor may see it; nobody learns which ids others have.

    Raises:
        HTTPException: 404.
    """
    try:
        info = store.episode(id)
    except InvalidInputError:
        info = None
    if info is None or info.id != id or not (visitor.is_host or visitor.owns(info.owner)):
        raise unknown(what)
    return info


def unknown(what: str) -> HTTPException:
    """The refusal of what is not there, or is not theirs to know of."""
    return HTTPException(404, f"There is no such {what}, or it is somebody else's.")
