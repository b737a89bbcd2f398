"""Draws of wrong goals beside the true one, and scripts of people who change their mind.

A draw depends on the seed and the case alone.
"""

from __future__ import annotations

import hashlib
import random
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

from goalscope.base.types import Goal, InvalidInputError, Turn, canonical
from goalscope.datasets.case import Case


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


def drawn_case(
    id: str,
    task: str,
    turns: tuple[Turn, ...],
    rng: random.Random,
    truth: str,
    tiers: Iterable[Sequence[str]],
    goals: int,
    *,
    group: str = "",
) -> Case | str:
    """The case with wrong goals drawn from tiers, see `draw`; the reason where they are too few."""
    drawn = draw(rng, truth, tiers, goals)
    if drawn is None:
        return f"fewer than {goals} goals to choose from"
    return Case(id, group or id, task, turns, *drawn)


def by_shared_words(truth: str, texts: Iterable[str]) -> list[list[str]]:
    """Tiers of texts, those first that share the most words with the true goal."""
    words = _words(truth)
    tiers: dict[int, list[str]] = defaultdict(list)
    for text in texts:
        tiers[len(words & _words(text))].append(text)
    return [tiers[shared] for shared in sorted(tiers, reverse=True)]


def _words(text: str) -> set[str]:
    return set(re.findall(r"\w+", text.casefold()))


AFTER = 3
"""Turns of the second goal."""


def changes_of(cases: Sequence[Case], *, round: int, goals: int, seed: int) -> list[Case]:
    """A script for each dialogue that is long enough to end one, in their order.

    Dialogues of people who had the same other goal come first, one after the other, until there are
    `round` - 1 turns; then the first `AFTER` turns of this one, whose id the script has. No two of
    them share people. Its group is the first goal, since the same dialogues serve for it again.

    Args:
        cases: Real dialogues; those whose goals recur can come first, again and again.
        round: The first round (from 1) of the second goal, 2 or more.
        goals: How many for each script, drawn at random beside the two.
        seed: Of the draw.

    Raises:
        InvalidInputError: There is no script.
    """
    first: dict[str, list[Case]] = {}
    for case in sorted(cases, key=lambda case: case.id):
        first.setdefault(_goal(case), []).append(case)
    scripts = [
        script
        for case in cases
        if len(case.turns) >= AFTER and (script := _script(case, first, round, goals, seed))
    ]
    if not scripts:
        raise InvalidInputError(
            f"No change of mind at round {round} can be scripted from {len(cases)} dialogues: it "
            f"takes {goals} different goals, {round - 1} turns of people who had the same goal, "
            f"and {AFTER} of one who had another. Name another set, an earlier round, or fewer "
            "goals."
        )
    return scripts


def _script(
    last: Case, first: Mapping[str, Sequence[Case]], round: int, goals: int, seed: int
) -> Case | None:
    rng, second = chance(seed, last.id), _goal(last)
    every = sorted(first)
    for goal in rng.sample(every, len(every)):
        people = {last.group}
        turns: list[Turn] = []
        for case in rng.sample(first[goal], len(first[goal])):
            if case.group not in people:
                people.add(case.group)
                turns += case.turns
        if len(turns) >= round - 1 and canonical(goal) != canonical(second):
            break
    else:
        return None
    drawn = draw(rng, goal, [[second], every], goals)
    if drawn is None:
        return None
    support, truth = drawn
    said = (*turns[: round - 1], *last.turns[:AFTER])
    after = [each.text for each in support].index(second)
    truths = (truth,) * (round - 1) + (after,) * AFTER
    return Case(last.id, goal, last.task, said, support, after, truths)


def _goal(case: Case) -> str:
    return case.true_goal.text
