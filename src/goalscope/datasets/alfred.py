"""ALFRED: instructions to a robot, with several people's sentences for the same task."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from goalscope.base.types import Turn, canonical
from goalscope.datasets.case import OPENING, Case
from goalscope.datasets.files import Row, line_rows
from goalscope.datasets.goal_sets import chance, draw

__all__ = ["TASK", "alfred"]

TASK = "Do a household task in this room for the human."
"""What the assistant is to do, in a sentence."""

_Plan = tuple[str, ...]  # the type of the task, then what it is done with


def alfred(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """One turn for each trajectory; instead of one that is left out, the reason.

    The file goes by the type of the task, so the seed puts the trajectories in another order: the
    first ones are a fair sample. What belongs to one plan is one group, as it shares its meaning.

    One sentence is what the person says, another one of the same trajectory the true goal. The
    wrong goals are sentences for other plans, no two for one plan, and never a text that somebody
    said for the true plan. "hard" takes plans of the same type that differ in one thing, then
    in two, and so on, and then other types. Plans that differ in the lamp alone are one: people
    just say "lamp".

    Raises:
        InvalidInputError: The file is broken.
    """
    trajectories = [(row.text("task_id"), _plan(row), _sentences(row)) for row in line_rows(file)]
    gathered: dict[_Plan, dict[str, str]] = {}
    for _, plan, sentences in trajectories:
        for key, text in sentences.items():
            own = gathered.setdefault(plan, {})
            own[key] = min(text, own.get(key, text))
    said = {plan: dict(sorted(gathered[plan].items())) for plan in sorted(gathered)}
    tiers = {plan: _tiers(plan, said, goal_set) for plan in said}
    for id, plan, sentences in sorted(trajectories, key=lambda each: _place(seed, each[0])):
        if len(sentences) < 2:
            yield "fewer than two different sentences"
            continue
        rng = chance(seed, id)
        words, goal = rng.sample(list(sentences.values()), 2)
        wrong = (_one_each(rng, tier, said, said[plan], 2 * goals) for tier in tiers[plan])
        drawn = draw(rng, goal, wrong, goals)
        if drawn is None:
            yield f"fewer than {goals} plans in the file"
            continue
        yield Case(id, "|".join(plan), TASK, (Turn(OPENING, words),), *drawn)


def _place(seed: int, id: str) -> tuple[float, str]:
    """Where a trajectory stands, whatever others there are."""
    return chance(seed, f"place of {id}").random(), id


def _plan(row: Row) -> _Plan:
    parameters = row.row("pddl_params")
    keys = ("object_target", "mrecep_target", "parent_target")
    sliced = bool(parameters.values.get("object_sliced"))
    return (
        row.text("task_type"),
        *(parameters.text(key, empty=True) for key in keys),
        "sliced" if sliced else "",
    )


def _sentences(row: Row) -> dict[str, str]:
    texts = (person.text("task_desc", empty=True) for person in row.rows("anns"))
    return {canonical(text): text for text in texts if canonical(text)}


def _tiers(plan: _Plan, plans: Iterable[_Plan], goal_set: str) -> list[list[_Plan]]:
    if goal_set == "random":
        return [[other for other in plans if other != plan]]
    tiers: list[list[_Plan]] = [[] for _ in range(len(plan) + 1)]
    for other in plans:
        apart = sum(a != b for a, b in zip(plan, other, strict=True))
        tiers[apart if plan[0] == other[0] else -1].append(other)
    return tiers[1:]


def _one_each(
    rng: random.Random,
    plans: list[_Plan],
    said: Mapping[_Plan, Mapping[str, str]],
    taken: Mapping[str, str],
    most: int,
) -> list[str]:
    """A sentence for each of at most so many plans, none of them among those taken."""
    found: list[str] = []
    for plan in rng.sample(plans, min(len(plans), most)):
        if texts := [text for key, text in said[plan].items() if key not in taken]:
            found.append(rng.choice(texts))
    return found
