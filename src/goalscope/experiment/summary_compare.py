"""How steady an evaluator is: what the order of two outcomes does to its scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from goalscope.experiment.summary import NO_INTERVAL, Entry, Estimate
from goalscope.judge import Pair, Trial, order_effect
from goalscope.stats import bootstrap_mean

__all__ = ["Comparison", "comparisons_table", "read_comparison"]

COLUMNS = ("judge", "methods", "profiles", "comparisons asked", "read", "order effect")
NOTES = (
    "Two methods' outcomes for one person, scored side by side in both orders. Order effect: mean "
    "score of what was shown first less that of what was shown second, of 3 points; 0 for a judge "
    "whom the order does not sway. A comparison counts if all four of its scores could be read.",
    "Intervals are 95 %, by a bootstrap over profiles. A pair in which one run left nothing is "
    "shown to no judge. "
    f"{NO_INTERVAL}",
)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two methods' outcomes for one person, as one evaluator scored them.

    Attributes:
        judge: The evaluator's label.
        methods: Both, in the order in which they were planned.
        profile: Name of the person.
        orders: Each time that it was asked: scores with the first method first, and second.
    """

    judge: str
    methods: str
    profile: str
    orders: tuple[tuple[Pair, Pair], ...]


def read_comparison(spec: Mapping[str, Any], result: Mapping[str, Any], judge: str) -> Comparison:
    """A cell of the kind "compare"."""
    one, other = spec["of"]
    orders = tuple((_pair(first), _pair(second)) for first, second in result["orders"])
    return Comparison(
        judge, ", ".join(run["settings"]["method"] for run in (one, other)), one["profile"], orders
    )


def comparisons_table(
    found: Sequence[Comparison],
) -> tuple[tuple[str, ...], list[tuple[Entry, ...]], tuple[str, ...]]:
    """Columns, rows and notes: for each evaluator all pairs of methods, and each of them."""
    rows: list[tuple[Entry, ...]] = []
    for judge in dict.fromkeys(each.judge for each in found):
        own = [each for each in found if each.judge == judge]
        pairs = dict.fromkeys(each.methods for each in own)
        for methods in (None, *pairs) if len(pairs) > 1 else pairs:
            part = [each for each in own if methods in (None, each.methods)]
            rows.append((judge, methods or "all", *_figures(part)))
    return COLUMNS, rows, NOTES


def _figures(found: Sequence[Comparison]) -> tuple[int, int, int, Estimate | None]:
    """Profiles, comparisons asked and read, and the order effect."""
    every = [(each.profile, orders) for each in found for orders in each.orders]
    effect = order_effect([orders for _, orders in every])
    profiles = len({each.profile for each in found})
    if effect.mean is None:
        return profiles, effect.asked, effect.read, None
    single = [(profile, order_effect([orders]).mean) for profile, orders in every]
    read = [(profile, value) for profile, value in single if value is not None]
    interval = bootstrap_mean([value for _, value in read], [profile for profile, _ in read])
    return profiles, effect.asked, effect.read, Estimate(effect.mean, interval)


def _pair(trials: Sequence[Mapping[str, Any]]) -> Pair:
    first, second = (Trial(**trial) for trial in trials)
    return first, second
