"""Draws the wrong goals beside the true one; the draw depends on the seed and the case alone."""

from __future__ import annotations

import hashlib
import random
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence

from goalscope.base.types import Goal, canonical

__all__ = ["by_shared_words", "chance", "draw", "goal_key"]


def chance(seed: int, id: str) -> random.Random:
    """The random numbers of one case, whatever other cases there are."""
    return random.Random(f"{seed} {id}")


def goal_key(text: str) -> str:
    """A short hash of a goal's `canonical`."""
    return hashlib.sha256(canonical(text).encode()).hexdigest()[:12]


def draw(
    rng: random.Random, truth: str, tiers: Iterable[Sequence[str]], goals: int
) -> tuple[tuple[Goal, ...], int] | None:
    """The true goal at a random place among wrong ones; and that place.

    A tier is used up, at random, before the next one is looked at. Texts of one `canonical` count
    once. None if there are too few.
    """
    seen = {canonical(truth)}
    wrong: list[str] = []
    for tier in tiers:
        for text in rng.sample(tier, len(tier)):
            if len(wrong) < goals - 1 and canonical(text) not in seen:
                seen.add(canonical(text))
                wrong.append(text)
        if len(wrong) == goals - 1:
            break
    if len(wrong) < goals - 1:
        return None
    rng.shuffle(wrong)
    place = rng.randrange(goals)
    return tuple(map(Goal, [*wrong[:place], truth, *wrong[place:]])), place


def by_shared_words(truth: str, texts: Iterable[str]) -> list[list[str]]:
    """Tiers of texts, those first that share the most words with the true goal."""
    words = _words(truth)
    tiers: dict[int, list[str]] = defaultdict(list)
    for text in texts:
        tiers[len(words & _words(text))].append(text)
    return [tiers[shared] for shared in sorted(tiers, reverse=True)]


def _words(text: str) -> set[str]:
    return set(re.findall(r"\w+", text.casefold()))
