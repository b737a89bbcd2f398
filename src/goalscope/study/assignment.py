"""Who rates what."""

from __future__ import annotations

from collections.abc import Mapping
from random import Random

__all__ = ["assigned"]


def assigned(ratings: Mapping[int, int], *, wanted: int, share: int, rng: Random) -> list[int]:
    """A new participant's items in order; none where every item has its ratings.

    Those with the fewest ratings come in, ties at random; the order is random.

    Args:
        ratings: How many each item has, or is about to have.
        wanted: Ratings of an item.
        share: Items of a participant.
        rng: Draws.
    """
    if min(ratings.values()) >= wanted:
        return []
    least = sorted(ratings, key=lambda item: (ratings[item], rng.random()))[:share]
    rng.shuffle(least)
    return least
