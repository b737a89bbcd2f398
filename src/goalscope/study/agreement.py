"""How far raters agree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["krippendorff_alpha"]


def krippendorff_alpha(units: Sequence[Sequence[int]]) -> float | None:
    """Krippendorff's alpha of ordinal ratings: 1 where all agree, 0 where chance would do as well.

    Args:
        units: The ratings of each item, whoever gave them; items with fewer than two are left out.

    Returns:
        Alpha; None where no item has two ratings, or all ratings are equal.
    """
    rated = [unit for unit in units if len(unit) > 1]
    values = np.unique([value for unit in rated for value in unit])
    if len(values) < 2:
        return None
    counts = np.array([[unit.count(v) for v in values.tolist()] for unit in map(list, rated)])
    pairs = counts[:, :, None] * counts[:, None, :] - counts[:, :, None] * np.eye(len(values))
    observed = (pairs / (counts.sum(1) - 1)[:, None, None]).sum(0)
    total = counts.sum(0)
    upto = total.cumsum() - total / 2  # differences of these are distances between ranks
    distance = (upto[:, None] - upto) ** 2
    expected = np.outer(total, total) * distance
    return float(1 - (total.sum() - 1) * (observed * distance).sum() / expected.sum())
