"""The robot's actions: which are possible, what each is made of, what it cooks, what undoes it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from goalscope.base.types import Action, GoalscopeError
from goalscope.envs import Resolution
from goalscope.envs.house.simulator.object_types import ACTS, PREDICATES, SINGLE, object_type
from goalscope.envs.house.simulator.state import (
    ENCLOSING,
    box_of,
    by_id,
    innermost,
    is_at,
    is_whole,
    spots,
)
from goalscope.envs.house.simulator.world import Controller
from goalscope.envs.house.view import View, the

FILLS = {"fill": "water", "fill with coffee": "coffee", "fill with wine": "wine"}
"""What the actions that fill something fill it with."""

NAMES = (*ACTS, *FILLS, "put", "pick up", "push", "pull", "finish")
"""The names of all actions."""

IRREVERSIBLE = ("break", "slice", "use up", "cook")
"""The actions that nobody can undo."""

_RESTORED = ("turn off", "turn on", "open", "close", "empty", "fill")

_HEATS = frozenset({"Microwave", "StoveBurner", "Toaster"})
_RUNNING = frozenset({"Faucet", "ShowerHead", "StoveKnob"})
"""What nobody leaves on unattended, besides heat: it is turned on when the person asks for it."""

_DEEP = frozenset({"Bowl", "Cup", "Mug"})
"""Vessels out of which nothing should stick."""

_ONLY_ON_REQUEST = frozenset({"break", "dirty", "use up", "open", "close", "empty"})
"""Acts that serve no goal, and are done only when the person asks for them."""

_Table = Mapping[str, Mapping[str, Any]]


def afforded(view: View, own: str, *, asked: bool = False) -> Iterator[Action]:
    """What the object's affordances allow now; it may be put on one receptacle of each type.

    Args:
        view: What is here.
        own: The object.
        asked: Whether what only a person asks for, or what heats, is among it.
    """
    thing, name = view.table[own], view.names[own]
    if thing["pickupable"]:
        inside = set(thing["parentReceptacles"] or ())
        seen = {view.table[place]["objectType"] for place in inside if place in view.table}
        for place, other in view.table.items():
            kind = other["objectType"]
            if kind in seen or place == own:
                continue
            if accepts(other, thing) and _fits(view, thing, other):
                seen.add(kind)
                yield Action("put", name, destination=view.names[place])
    for verb, (needs, state, value) in ACTS.items():
        if thing[state] == value or (verb in _ONLY_ON_REQUEST and not asked):
            continue
        if not asked and starts(view, Action(verb, name)):
            continue
        if thing[needs] or (needs == "toggleable" and thing["objectType"] == "StoveBurner"):
            yield Action(verb, name)
    if asked and thing["pickupable"] and not thing["isPickedUp"]:
        yield Action("pick up", name)
    if asked and (thing["pickupable"] or thing["moveable"]):
        yield from (Action("push", name), Action("pull", name))


def starts(view: View, action: Action) -> bool:
    """Whether the action turns on what heats, or lets water run."""
    return action.name == "turn on" and view.type_of(action.target) in _HEATS | _RUNNING


def cooks(view: View, action: Action) -> list[str]:
    """Ids of what the action would cook: what is raw on a source of heat that is on, or goes on."""
    own, place = view.id(action.target), view.id(action.destination)
    if action.name == "turn on" and own:
        heated = (own, *(view.table[own]["controlledObjects"] or ()))
        return [raw for heat in heated if heat in view.table for raw in _raw(view, heat)]
    if action.name == "put" and own and _is_lit(view, place):
        return _raw(view, own)
    return []


def accepts(place: Mapping[str, Any], thing: Mapping[str, Any]) -> bool:
    """Whether things of this type belong on or in this place."""
    kind = place["objectType"]
    if not place["receptacle"]:
        return False
    if SINGLE.get(kind):
        return thing["objectType"] == SINGLE[kind]
    return kind in object_type(thing["objectType"]).places


def _is_lit(view: View, place: str) -> bool:
    """Whether this is a source of heat that is on, or stands on one."""
    around = [place, *(view.table[place]["parentReceptacles"] or ())] if place else []
    lit = (view.table[own] for own in around if own in view.table)
    return any(each["objectType"] in _HEATS and each["isToggled"] for each in lit)


def _raw(view: View, own: str) -> list[str]:
    """Ids of what is raw among the thing and all that is in it."""
    found: list[str] = []
    queue, seen = [own], {own}
    while queue:
        thing = view.table[queue.pop()]
        if thing["cookable"] and not thing["isCooked"] and is_whole(thing):
            found.append(thing["objectId"])
        inside = {each for each in thing["receptacleObjectIds"] or () if each in view.table} - seen
        queue += sorted(inside)
        seen |= inside
    return found


def _fits(view: View, thing: Mapping[str, Any], place: Mapping[str, Any]) -> bool:
    """Whether there is room for the thing in a vessel, or on a plate; elsewhere there is."""
    if not place["pickupable"]:
        return True
    size, room = box_of(thing).size, box_of(place)
    if place["objectType"] in _DEEP and max(size[0], size[2]) > max(room.size[0], room.size[2]):
        return False
    inside = (view.table.get(own) for own in place["receptacleObjectIds"] or ())
    taken = [box_of(each) for each in inside if each and each["pickupable"]]
    return bool(spots(room, size, taken, (0.0, 0.0)))


def undoing(
    view: View, was: _Table, then: _Table, done: Sequence[Action], untouched: Collection[str]
) -> Resolution:
    """What brings back what some actions changed, and what of it stays.

    Args:
        view: The house now.
        was: Metadata by id, from before the actions.
        then: The same after them.
        done: The actions.
        untouched: Ids of what must not be touched.
    """
    changed = [
        own
        for own, thing in then.items()
        if own in was and any(thing[key] != was[own][key] for key in (*PREDICATES, "fillLiquid"))
    ]
    free = [own for own in changed if own not in untouched]
    plan = _restoring(view, was, free)
    kept = {act.target for act in _restoring(view, was, changed)} - {act.target for act in plan}
    told = [f"I leave {the(name)} alone, as you asked." for name in sorted(kept)]
    pushed = (view.phrase(each) for each in done if each.name in ("push", "pull"))
    lost = (each for own in changed for each in _lost(view, was, own))
    told += [f"I cannot undo that: {each}." for each in (*pushed, *lost)]
    return Resolution(tuple(plan), " ".join(told))


def _restoring(view: View, was: _Table, things: Sequence[str]) -> list[Action]:
    """What brings things back to how they were, as far as anything can."""
    plan: list[Action] = []
    for own in things:
        now, then, name = view.table[own], was[own], view.names[own]
        if not is_whole(now):
            continue
        for verb in _RESTORED:
            needs, state, value = ACTS[verb]
            able = now[needs] and now["objectType"] != "StoveBurner"
            if able and now[state] != then[state] == value:
                filled = (act for act, liquid in FILLS.items() if liquid == then["fillLiquid"])
                plan.append(Action(next(filled, verb) if verb == "fill" else verb, name))
        home = view.place(then)
        if now["pickupable"] and home and (now["isPickedUp"] or view.place(now) != home):
            plan.append(Action("put", name, destination=home))
        if then["isPickedUp"] and not now["isPickedUp"]:
            plan.append(Action("pick up", name))
    held = view.names.get(view.held, "")
    return sorted(
        plan,
        key=lambda act: (
            act.name == "pick up",
            act.name != "turn off",
            act.target != held,
            act.name != "put",
        ),
    )


def _lost(view: View, was: _Table, own: str) -> Iterator[str]:
    """What was done to a thing that nothing brings back."""
    for verb in (*IRREVERSIBLE, "clean"):
        _, state, value = ACTS[verb]
        if view.table[own][state] == value != was[own][state]:
            yield f"{verb} {the(view.names[own])}"


_LOOKS = {30.0: 0, 0.0: 1, 60.0: 2, -30.0: 3}
"""The horizons from which things are best seen, the best first."""
_PLAINER = (
    (
        re.compile(r"(\S+) (?:is not a valid Object Type to|cannot) be placed in"),
        r"\1 does not go in or on",
    ),
    (re.compile(r"No valid positions to place object found"), "There is no room for it"),
)
"""What the simulator says of puts, and what people do."""


class Refusal(Exception):
    """The simulator did not do what it was asked; the message says why, in objects' ids."""


class Primitives:
    """Drives a controller, and keeps what succeeded, so that it can be done again (Sec. 4.2)."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self._done: list[dict[str, Any]] = []
        self._origin = ""
        self._told: list[str] = []
        self.reset()

    @property
    def metadata(self) -> dict[str, Any]:
        """AI2-THOR's metadata of the present state."""
        return self.controller.last_event.metadata

    def reset(self) -> None:
        """Go back to the start of the scene."""
        self._done.clear()
        self._origin = ""
        try:
            self._call(self.controller.reset)
        except Refusal as refusal:
            raise GoalscopeError(f"The scene cannot be begun anew: {refusal}") from None

    def mark(self) -> tuple[int, str]:
        """How much has been done, and where the thing in the hand came from."""
        return len(self._done), self._origin

    def back_to(self, mark: tuple[int, str]) -> None:
        """Undo what was done after `mark`: reset, and do again what stands."""
        count, origin = mark
        standing = self._done[:count]
        if len(standing) < len(self._done):
            self.reset()
            try:
                for step in standing:
                    self._step(**step)
            except Refusal as refusal:
                raise GoalscopeError(
                    f"What was done before could not be done again ({refusal}), so that the house "
                    "is not as it was. The robot stops; look at the house, and start anew."
                ) from None
        self._origin = origin
        self._told.clear()

    def told(self) -> list[str]:
        """What the robot did besides, since it was last asked, in words and objects' ids."""
        told, self._told = self._told, []
        return told

    def act(self, action: str, object_id: str, **arguments: Any) -> None:
        """Reach the object, opening what encloses it, and take one of AI2-THOR's actions on it."""
        opened = self._open_parents(object_id)
        self._approach(object_id)
        self._step(action=action, objectId=object_id, **arguments)
        self._close(opened)

    def pick_up(self, object_id: str) -> None:
        """Take the object in the hand; what is in it is first put back to where it came from."""
        held = self.metadata["inventoryObjects"]
        if held and held[0]["objectId"] == object_id:
            return
        if held:
            if not self._origin:
                raise Refusal("The hand is full, and what it holds came from nowhere.")
            origin = self._origin
            self.put(held[0]["objectId"], origin)
            self._told.append(f"{held[0]['objectId']} went back to {origin}")
        known = by_id(self.metadata["objects"])
        origin = innermost(known[object_id], known)
        self.act("PickupObject", object_id)
        self._origin = origin

    def put(self, object_id: str, place: str) -> None:
        """Bring the object to the place; what is closed is opened for it, and closed again."""
        if is_at(self._object(object_id), place, by_id(self.metadata["objects"])):
            raise Refusal("It is there already.")
        self.pick_up(object_id)
        opened = [*self._open_parents(place), *self._open(place)]
        self._approach(place)
        self._step(action="PutObject", objectId=place, forceAction=True)
        self._close(opened)

    def toggle(self, object_id: str, *, on: bool) -> None:
        """Turn the object on or off; a burner by its knob, and a microwave with its door shut."""
        thing = self._object(object_id)
        if thing["objectType"] == "StoveBurner":
            knobs = [
                each["objectId"]
                for each in self.metadata["objects"]
                if object_id in (each["controlledObjects"] or ())
            ]
            if not knobs:
                raise Refusal("The burner has no knob.")
            object_id = knobs[0]
        elif on and thing["objectType"] == "Microwave" and thing["isOpen"]:
            self._close([object_id])
        self.act("ToggleObjectOn" if on else "ToggleObjectOff", object_id)

    def _open_parents(self, object_id: str, opening: frozenset[str] = frozenset()) -> list[str]:
        """Open every closed receptacle around the object, from the outside in."""
        known = by_id(self.metadata["objects"])
        around = {own for own in known[object_id]["parentReceptacles"] or () if own in known}
        opened: list[str] = []
        for parent in sorted(around - opening, key=lambda own: known[own]["pickupable"]):
            opened += self._open(parent, opening | {object_id})
        return opened

    def _open(self, object_id: str, opening: frozenset[str] = frozenset()) -> list[str]:
        """Open what is shut, turned off first; returns what was opened."""
        thing = self._object(object_id)
        if not thing["openable"] or thing["isOpen"] or thing["objectType"] not in ENCLOSING:
            return []
        opened = self._open_parents(object_id, opening)
        self._approach(object_id)
        if thing["isToggled"]:
            self._step(action="ToggleObjectOff", objectId=object_id)
            self._told.append(f"{object_id} was running, and is off now")
        self._step(action="OpenObject", objectId=object_id)
        return [*opened, object_id]

    def _close(self, opened: list[str]) -> None:
        for each in reversed(opened):
            if self._object(each)["isOpen"]:
                self._approach(each)
                self._step(action="CloseObject", objectId=each)

    def _approach(self, object_id: str) -> None:
        """Teleport to a pose from which the object can be reached, unless it is in the hand."""
        if self._object(object_id)["isPickedUp"]:
            return
        event = self._call(self.controller.step, action="GetInteractablePoses", objectId=object_id)
        poses: list[Mapping[str, Any]] = event.metadata["actionReturn"] or []
        if not event.metadata["lastActionSuccess"] or not poses:
            raise Refusal("There is no place from which the robot can reach it.")
        pose = min(
            poses, key=lambda each: (not each["standing"], _LOOKS.get(float(each["horizon"]), 9))
        )
        self._step(
            action="Teleport",
            position={axis: pose[axis] for axis in "xyz"},
            rotation={"x": 0.0, "y": pose["rotation"], "z": 0.0},
            horizon=pose["horizon"],
            standing=pose["standing"],
        )

    def _object(self, object_id: str) -> Mapping[str, Any]:
        return by_id(self.metadata["objects"])[object_id]

    def _step(self, **step: Any) -> None:
        event = self._call(self.controller.step, **step)
        if not event.metadata["lastActionSuccess"]:
            why = event.metadata["errorMessage"] or f"{step['action']} failed."
            for said, plainer in _PLAINER:
                why = said.sub(plainer, why)
            raise Refusal(why)
        self._done.append(step)

    def _call(self, function: Any, **arguments: Any) -> Any:
        """Call the simulator, which may die on the way."""
        try:
            return function(**arguments)
        except ValueError as error:
            raise Refusal(str(error)) from None
        except Exception as error:
            raise GoalscopeError(
                f"The simulator stopped answering ({type(error).__name__}: {error}). "
                "The finished rounds are kept; start it again and resume the episode."
            ) from error
