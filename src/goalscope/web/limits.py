"""How much one may ask for: what is beyond is answered with 429, and with when to try again."""

from __future__ import annotations

import math
import re
from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass
from time import monotonic

from fastapi import HTTPException

__all__ = ["GUESSES", "GUESSES_OF_ALL", "STREAMS", "WAITING", "Limits", "Meter", "Rate", "too_much"]

WAITING = 20
"""Pieces of work of one visitor that may wait for the model."""

STREAMS = 12
"""Streams of events that one visitor may have open."""


@dataclass(frozen=True, slots=True)
class Rate:
    """`burst` at once, and one more every so many seconds."""

    burst: int
    every: float


GUESSES = Rate(10, 6.0)
"""Wrong keys and passwords of one address."""
GUESSES_OF_ALL = Rate(200, 0.5)
"""Wrong keys and passwords of everybody."""


@dataclass(frozen=True, slots=True)
class Limit:
    """How often something may be asked for.

    Attributes:
        methods: A pattern of what is counted.
        paths: Another.
        told: What those hear who ask for more.
        visitor: Of one visitor.
        address: Of all visitors at one address.
    """

    methods: str
    paths: str
    told: str
    visitor: Rate
    address: Rate


_MANY = "That was too much at once."
LIMITS = (
    Limit("POST|PUT|PATCH|DELETE", r"/.*", _MANY, Rate(60, 0.5), Rate(1200, 0.02)),
    Limit(
        "POST", r"/api/(episodes|trackers)", "You have begun many conversations in this hour.",
        Rate(30, 120.0), Rate(150, 24.0),
    ),
    Limit(
        "GET", r"/api/\w+/\w+/(why|words|picture\.svg|export\.\w+)", _MANY,
        Rate(60, 0.5), Rate(600, 0.05),
    ),
)  # fmt: skip


def too_much(error: str, wait: float) -> HTTPException:
    """The refusal of what may be asked for again after so many seconds."""
    return HTTPException(429, f"{error} Wait {_told(wait)}.", {"Retry-After": str(math.ceil(wait))})


class Meter:
    """What each of many has spent of a rate; who has not been heard of for longest is forgotten."""

    def __init__(self, rate: Rate) -> None:
        self._rate = rate
        self._left: OrderedDict[Hashable, tuple[float, float]] = OrderedDict()

    def wait(self, who: Hashable) -> float:
        """Seconds until they may have one more; 0 for now."""
        left = self._now(who)
        return 0.0 if left >= 1 else max(1.0, (1 - left) * self._rate.every)

    def take(self, who: Hashable) -> float:
        """Have one, unless they must wait: seconds as for `wait`."""
        wait, left = self.wait(who), self._now(who)
        self._left[who] = (left if wait else left - 1, monotonic())
        self._left.move_to_end(who)
        while len(self._left) > 10_000:
            self._left.popitem(last=False)
        return wait

    def _now(self, who: Hashable) -> float:
        now = monotonic()
        left, when = self._left.get(who, (float(self._rate.burst), now))
        return min(float(self._rate.burst), left + (now - when) / self._rate.every)


class Limits:
    """Keeps everybody to `LIMITS`."""

    def __init__(self) -> None:
        self._meters = [(each, Meter(each.visitor), Meter(each.address)) for each in LIMITS]

    def check(self, method: str, path: str, visitor: str, address: str) -> None:
        """Count a request, which the address pays for, too: a new cookie is no new allowance.

        Args:
            method: Of the request.
            path: Of the request.
            visitor: Their id.
            address: Where they are.

        Raises:
            HTTPException: 429.
        """
        for limit, visitors, addresses in self._meters:
            if re.fullmatch(limit.methods, method) and re.fullmatch(limit.paths, path):
                if wait := max(visitors.wait(visitor), addresses.wait(address)):
                    raise too_much(limit.told, wait)
                visitors.take(visitor)
                addresses.take(address)


def _told(seconds: float) -> str:
    if seconds > 90:
        return f"{math.ceil(seconds / 60)} minutes"
    count = math.ceil(seconds)
    return "a second" if count == 1 else f"{count} seconds"
