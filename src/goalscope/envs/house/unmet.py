"""What the newest words ask for and did not get, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from goalscope.envs.house import vocabulary as v
from goalscope.envs.house.heard import Hearing, Request
from goalscope.envs.house.meeting import brought, meant
from goalscope.envs.house.names import readable, the
from goalscope.envs.house.view import View
from goalscope.types import StepResult

__all__ = ["unmet"]


def unmet(
    view: View,
    hearing: Hearing,
    results: Sequence[StepResult],
    start: Mapping[str, Mapping[str, Any]],
) -> Iterator[str]:
    """Why requests of the newest words could not even be tried, one sentence each.

    Args:
        view: The house after `results`.
        hearing: What the person said.
        results: What was done for the newest words.
        start: Metadata by id, of the start.
    """
    done = {view.type_of(each.action.target) for each in results if each.ok}
    left = [each for each in hearing.newest if done.isdisjoint(each.object_types)]
    hands = [each for each in brought(hearing.wanted) if each in left]
    held = view.table[view.held]["objectType"] if view.held else ""
    if hands and len(brought(hearing.wanted)) > 1:
        yield f"I can hold one thing at a time: where should {_listed(hands)} go?"
    elif hands and held and held not in hands[0].object_types:
        yield f"My hand is full: it holds {the(view.names[view.held])}."
    for request in left:
        if request.passing or request in hands:
            continue
        things = meant(view, request, start)
        name = readable(request.object_types[0])
        waits = any(
            other.verb == "slice" and f"{kind}Sliced" in request.object_types
            for other in hearing.wanted
            for kind in other.object_types
        )
        if not things and not waits:
            yield f"There is no {' '.join([*_qualities(request), name])} here."
        elif request.number > len(things) and not waits:
            yield f"I see only {len(things)} of these here: {name}."
        elif request.verb == "put" and not request.destination_types:
            yield f"I do not know where to put {_listed([request])}."


def _qualities(request: Request) -> list[str]:
    """The adjectives that the request names."""
    words = {state: word for word, state in reversed(v.QUALITIES.items())}
    return [words[state] for state in request.states]


def _listed(requests: Sequence[Request]) -> str:
    """What requests are about: "the mug and the plate"."""
    every = [f"the {readable(kind)}" for each in requests for kind in _kinds(each)]
    first, last = [*dict.fromkeys(every)][:-1], every[-1]
    if len(first) > 2:
        first, last = first[:2], f"{len(first) - 1} other things"
    return f"{', '.join(first)} and {last}" if first else last


def _kinds(request: Request) -> Sequence[str]:
    return request.object_types if request.every else request.object_types[:1]
