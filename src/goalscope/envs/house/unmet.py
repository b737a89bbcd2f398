"""What the newest words ask for and did not get, in words."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from goalscope.envs.house.heard import HOME, Hearing, Request
from goalscope.envs.house.hearing import vocabulary as v
from goalscope.envs.house.meeting import NEEDS, brought, meant, met, serves
from goalscope.envs.house.names import are, readable, the
from goalscope.envs.house.simulator.slices import pieces
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import View
from goalscope.types import StepResult

__all__ = ["unmet"]

_CRACK = 'I can cook an egg only once it is cracked: say "crack the egg".'
_SLICE = 'I can cook {0} only once it is sliced: say "slice {0}".'


def unmet(
    view: View,
    hearing: Hearing,
    results: Sequence[StepResult],
    start: Mapping[str, Mapping[str, Any]],
    over: Collection[Request] = (),
) -> Iterator[str]:
    """Why requests of the newest words were not even tried, one sentence each.

    Args:
        view: The house after `results`.
        hearing: What the person said.
        results: What was done for the newest words.
        start: Metadata by id, of the start.
        over: Requests of earlier words that were met once.
    """
    done = [result.action for result in results if result.ok]
    touched = {name for action in done for name in (action.target, action.destination)}
    cleaned = {action.target for action in done if action.name != "put"}
    left = [
        request
        for request in hearing.newest
        if not any(serves(view, action, request) for action in done)
    ]
    for request in hearing.newest:
        if 0 < (count := len(meant(view, request, start))) < request.number:
            yield f"I see only {count} of these here: {readable(request.object_types[0])}."
    held = view.held_type
    carried = brought(hearing.wanted, over, held)
    hands = [each for each in carried if each in left]
    if hands and len(carried) > 1:
        yield f"I can hold one thing at a time: where should {_listed(hands)} go?"
    elif hands and held and held not in hands[0].object_types:
        yield f"My hand is full: it holds {the(view.names[view.held])}."
    elif hands and held:
        yield f"I hold {the(view.names[view.held])} already."
    elif not hands and any(
        _is_several(view, each, start) for each in carried if each in hearing.newest
    ):
        yield "I can hold one thing at a time."
    for request in left:
        things = meant(view, request, start)
        alike = [each for each in view.objects if each["objectType"] in request.object_types]
        lacks = not things and (request.at or request.states or not alike)
        if request.passing or (not lacks and (request in hands or request.verb == "pick up")):
            continue
        name = readable(request.object_types[0])
        waits = any(
            other.verb in v.CUTTING and pieces(kind) in request.object_types
            for other in hearing.wanted
            for kind in other.object_types
        )
        if not things and alike and not any(map(is_whole, alike)):
            yield f"The {name} {are(name)} {'sliced' if alike[0]['isSliced'] else 'broken'}."
        elif not things and request.at:
            here = {each["objectType"] for each in view.objects} & {*request.at}
            there = readable(min(here, default=request.at[0]))
            yield f"There {are(name)} no {name} at the {there}."
        elif not things and waits:
            continue
        elif not things and request.verb == "cook" and (whole := _whole(view, request)):
            yield _CRACK if whole == "Egg" else _SLICE.format(the(readable(whole)))
        elif not things:
            yield f"There {are(name)} no {' '.join([*_qualities(request), name])} here."
        elif request.verb in ("push", "pull"):
            moved = any(view.table[own]["moveable"] for own in things)
            yield (
                f"I have moved {the(name)} already."
                if moved
                else f"I cannot {request.verb} {the(name)}."
            )
        elif not any(view.table[own][NEEDS[request.verb]] for own in things):
            yield f"I cannot {request.verb} {the(name)}."
        elif request.verb == "put" and not request.destination_types:
            yield f"I do not know where to put {_listed([request])}."
        elif (so := met(view, request, start)) and (
            cleaned if request.verb == "clean" else touched
        ).isdisjoint(map(view.names.get, so)):
            back = request.destination_types == (HOME,)
            if not (back and hearing.undone and done):
                several = back and len(so) > 1
                yield (
                    "They are where they were already." if several else view.is_so(request.verb, so)
                )


def _is_several(view: View, request: Request, start: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether several things are to be brought."""
    return (request.every or request.number > 1) and len(meant(view, request, start)) > 1


def _whole(view: View, request: Request) -> str:
    """The type of what is here and whole, and would give what the request is for."""
    here = [each["objectType"] for each in view.objects if is_whole(each)]
    return next((kind for kind in here if pieces(kind) in request.object_types), "")


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
