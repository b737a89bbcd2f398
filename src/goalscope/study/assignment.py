"""Who rates what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from random import Random

__all__ = ["assigned"]


def assigned(
    ratings: Mapping[int, int], checks: Sequence[int], *, wanted: int, share: int, rng: Random
) -> list[int]:
    """A new participant's items in order; none where every item has its ratings.

    Those with the fewest ratings come in first, ties at random; the order is random.

    Args:
        ratings: How many each item has, or is about to have.
        checks: Items that everybody gets.
        wanted: Ratings of an item.
        share: Items of a participant, besides the checks.
        rng: Draws.
    """
    if min(ratings.values()) >= wanted:
        return []
    least = sorted(ratings, key=lambda item: (ratings[item], rng.random()))[:share]
    order = [*least, *checks]
    rng.shuffle(order)
    return order
