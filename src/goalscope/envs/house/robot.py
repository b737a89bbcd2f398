"""The robot of Sec. 4.2 as an environment, in the embedded house or in AI2-THOR."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from goalscope.envs.house.answers import answered
from goalscope.envs.house.conditions import conditions_met
from goalscope.envs.house.controller import Controller
from goalscope.envs.house.hearing import (
    IRREVERSIBLE,
    Hearing,
    Request,
    ask_permission,
    completes,
    hear,
)
from goalscope.envs.house.names import mentioned, names, readable, the
from goalscope.envs.house.object_types import SINGLE, object_type
from goalscope.envs.house.primitives import Primitives, Refusal
from goalscope.types import Action, GoalscopeError, Profile, StepResult, Turn

__all__ = ["HomeRobot"]

_FLAGS = {
    "open": ("openable", "isOpen", True),
    "close": ("openable", "isOpen", False),
    "turn on": ("toggleable", "isToggled", True),
    "turn off": ("toggleable", "isToggled", False),
    "fill": ("canFillWithLiquid", "isFilledWithLiquid", True),
    "empty": ("canFillWithLiquid", "isFilledWithLiquid", False),
    "slice": ("sliceable", "isSliced", True),
    "cook": ("cookable", "isCooked", True),
    "break": ("breakable", "isBroken", True),
    "dirty": ("dirtyable", "isDirty", True),
    "clean": ("dirtyable", "isDirty", False),
    "use up": ("canBeUsedUp", "isUsedUp", True),
}
"""For each act: the affordance that it needs, the state that it sets, and to what."""

_ONLY_ON_REQUEST = frozenset(
    {"break", "dirty", "use up", "push", "pull", "open", "close", "pick up"}
)
"""Acts that no goal is served by: they are done when the person asks for them."""

_STATES = (
    ("isOpen", "open"), ("isToggled", "on"), ("isSliced", "sliced"), ("isCooked", "cooked"),
    ("isBroken", "broken"), ("isDirty", "dirty"), ("isUsedUp", "used up"),
)  # fmt: skip
_INSIDE = frozenset(
    {"BathtubBasin", "Bowl", "Cup", "GarbageCan", "Mug", "Pot", "Sink", "SinkBasin"}
)
_LAST = frozenset({"ArmChair", "Chair", "Floor", "Stool"})
"""Receptacles that AI2-THOR names for what stands above them, too."""

_SHOWN = 30
"""Most changes that the status lists."""


class HomeRobot:
    """A robot that moves things in a home; implements `goalscope.envs.Environment`.

    The actions are "put" (an object, with a receptacle as the destination), "pick up", "open",
    "close", "turn on", "turn off", "fill" (with water), "empty", "slice", "cook", "break", "clean",
    "dirty", "use up", "push" and "pull". Objects go by the names of `names`, such as "mug" or
    "drawer 2". Each is done as the paper does it: the robot goes to where it can reach the object,
    opens what encloses it, and closes again what it opened.

    Args:
        controller: AI2-THOR's, or `HouseController`; reset to its scene's start.
        notes: What a person should know about the scene, one sentence each.
    """

    def __init__(self, controller: Controller, *, notes: Sequence[str] = ()) -> None:
        self._primitives = Primitives(controller)
        self.notes = tuple(notes)
        self._names: dict[str, str] = {}
        self._start = self._table()
        self._name()

    @property
    def task(self) -> str:
        """The agent and its task, for prompts."""
        return (
            "The agent is a robot in a home. Its task is to interact with the objects there "
            "to accomplish the human's preferences."
        )

    @property
    def completion_phrase(self) -> str:
        """What a person says to end the task."""
        return "Task completed"

    @property
    def metadata(self) -> dict[str, Any]:
        """AI2-THOR's metadata of the present state."""
        return self._primitives.metadata

    def reset(self) -> None:
        """Take the scene back to its start."""
        self._primitives.reset()
        self._names.clear()
        self._name()

    def close(self) -> None:
        """Stop the simulator."""
        self._primitives.controller.stop()

    def fingerprint(self) -> str:
        """A hash of every object's state and place (to 2 cm), and of what the hand holds."""
        rows = [
            [
                own,
                *(thing[key] for _, key, _ in _FLAGS.values()),
                thing["temperature"],
                sorted(thing["parentReceptacles"] or ()),
                [round(thing["position"][axis] * 50) for axis in "xyz"],
            ]
            for own, thing in sorted(self._table().items())
            if not thing["isPickedUp"]
        ]
        held = [each["objectId"] for each in self.metadata["inventoryObjects"]]
        return hashlib.sha256(json.dumps([rows, held]).encode()).hexdigest()

    def status(self) -> str:
        """What is in the hand, and what has changed since the start, one object a line."""
        held = self._held()
        lines = [f"The robot's hand {f'holds {the(self._names[held])}' if held else 'is empty'}."]
        changes = list(self._changes())
        if not changes:
            return f"{lines[0]} Nothing has been changed yet."
        lines += ["Changed so far:", *(f"- {each}" for each in changes[:_SHOWN])]
        if len(changes) > _SHOWN:
            lines.append(f"- and {len(changes) - _SHOWN} more")
        return "\n".join(lines)

    def kinds(self, text: str, limit: int) -> list[str]:
        """Generic names such as "egg" of what can be moved or switched here."""
        usable = ("pickupable", "toggleable", "canFillWithLiquid", "dirtyable")
        kinds = [
            readable(thing["objectType"])
            for thing in self._table().values()
            if any(thing[flag] for flag in usable)
        ]
        return list(dict.fromkeys(kinds))[:limit]

    def mentioned(self, utterances: Sequence[str]) -> list[str]:
        """Generic names of things here that the person spoke of, and did not refuse."""
        objects = self.metadata["objects"]
        hearing = hear([Turn("", each) for each in utterances], objects)
        kinds = {readable(each["objectType"]): each["objectType"] for each in objects}
        found = mentioned(". ".join(utterances), objects)
        return [kind for kind in found if not hearing.refuses("", kinds[kind])]

    def actions(self, relevant: Sequence[str], turns: Sequence[Turn] = ()) -> list[Action]:
        """What can be done with the objects of these names or generic names.

        For each object: a put into or onto each kind of receptacle that is viable for it, or that
        the person spoke of, and what its affordances allow. What the person ruled out is not
        offered, nor what only a person asks for.
        """
        objects = self.metadata["objects"]
        hearing = hear(turns, objects)
        spoken = set(mentioned(". ".join(turn.utterance for turn in turns), objects))
        wanted = set(relevant)
        found: list[Action] = []
        for own, thing in self._table().items():
            if {self._names[own], readable(thing["objectType"])} & wanted and _is_whole(thing):
                found += [
                    action
                    for action in self._acts(own, thing, spoken)
                    if not self._is_refused(action, thing, hearing)
                ]
        return found

    def phrase(self, action: Action) -> str:
        """The action in words, with generic names: "put the egg in the fridge"."""
        by_name = {name: own for own, name in self._names.items()}
        table = self._table()

        def kind(name: str) -> str:
            return readable(table[by_name[name]]["objectType"]) if name in by_name else name

        words = f"{action.name} the {kind(action.target)}"
        place = table.get(by_name.get(action.destination, ""))
        if place is None:
            return words
        return f"{words} {'in' if _holds_inside(place) else 'on'} the {kind(action.destination)}"

    def fulfilled(self, kind: str) -> list[str]:
        """The puts that things of this kind do not need any more, in words."""
        puts = [
            Action("put", self._names[own], destination=self._place(thing))
            for own, thing in self._table().items()
            if readable(thing["objectType"]) == kind and thing["pickupable"] and self._place(thing)
        ]
        return list(dict.fromkeys(self.phrase(put) for put in puts))

    def requests(self, turns: Sequence[Turn]) -> list[Action]:
        """What the person asked for outright, as far as it is not so already.

        What was moved and is ruled out since goes back to where it was.
        """
        hearing = hear(turns, self.metadata["objects"])
        plan = list(self._returns(hearing))
        for request in hearing.wanted:
            for action in self._meet(request):
                thing = self._table()[self._id(action.target)]
                if action not in plan and not self._is_refused(action, thing, hearing):
                    plan.append(action)
        return plan

    def permission(self, action: Action, turns: Sequence[Turn]) -> str:
        """The question to ask before a slice, a break and the like; empty if it was allowed."""
        if action.name not in IRREVERSIBLE:
            return ""
        own = self._id(action.target)
        kind = self._table()[own]["objectType"] if own else ""
        hearing = hear(turns, self.metadata["objects"])
        if hearing.permits(action.name, kind, action.target):
            return ""
        return ask_permission(action.name, action.target)

    def step(self, action: Action) -> StepResult:
        """Take one action, with all that belongs to it. One that fails changes nothing.

        Raises:
            GoalscopeError: The simulator died, or what a failed action began cannot be taken back.
        """
        own, place = self._id(action.target), self._id(action.destination)
        if problem := self._problem(action, own, place):
            return StepResult(action, False, problem)
        before = self.fingerprint()
        mark = self._primitives.mark()
        try:
            self._do(action, own, place)
        except Refusal as refusal:
            self._primitives.back_to(mark)
            self._name()
            if self.fingerprint() != before:
                raise GoalscopeError(
                    f"{action} failed ({refusal}), and what it began could not be taken back: the "
                    "house is not as it was. The robot stops; look at the house, and start anew."
                ) from None
            return StepResult(action, False, str(refusal))
        self._name()
        lasting = action.name in IRREVERSIBLE
        told = self._told(own)
        told += "; this cannot be undone." if lasting else "."
        return StepResult(action, True, told, irreversible=lasting)

    def answer(self, question: str) -> str | None:
        """Answer a question about where things are and how; None for anything else."""
        return answered(question, self.metadata["objects"])

    def is_completion(self, turn: Turn) -> bool:
        """Whether the person says that the task is complete."""
        return completes(turn.utterance)

    def completion_actions(self) -> list[Action]:
        """None: the task ends by the person's word."""
        return []

    def checks_met(self, profile: Profile) -> list[bool]:
        """Which of the profile's goal conditions hold now; none while nothing has been changed."""
        met = conditions_met(profile.checks, self.metadata["objects"])
        return [any(self._changes()) and each for each in met]

    def _do(self, action: Action, own: str, place: str) -> None:
        robot = self._primitives
        match action.name:
            case "put":
                robot.put(own, place)
            case "pick up":
                robot.pick_up(own)
            case "turn on" | "turn off":
                robot.toggle(own, on=action.name == "turn on")
            case "fill":
                robot.act("FillObjectWithLiquid", own, fillLiquid="water")
            case "push" | "pull":
                robot.act(f"{action.name.title()}Object", own, moveMagnitude="100")
            case "empty":
                robot.act("EmptyLiquidFromObject", own)
            case "use up":
                robot.act("UseUpObject", own)
            case _:
                robot.act(f"{action.name.title()}Object", own)

    def _problem(self, action: Action, own: str, place: str) -> str:
        """Why the action is none that the house may be given; empty where it is one."""
        known = [*_FLAGS, "put", "pick up", "push", "pull"]
        if action.name not in known:
            return f"There is no action {action.name!r:.60}; there are {', '.join(known)}."
        if not own:
            return f"There is nothing here of the name {action.target!r:.60}."
        if type(action.quantity) is not int or action.quantity != 1:
            return "An action is done once: its quantity must be 1."
        if (action.name == "put") != bool(action.destination):
            return "A put needs a destination, and nothing else has one."
        if action.destination and not place:
            return f"There is nothing here of the name {action.destination!r:.60}."
        return ""

    def _acts(self, own: str, thing: Mapping[str, Any], spoken: set[str]) -> Iterator[Action]:
        """What the object's affordances allow now, apart from what only a person asks for."""
        name = self._names[own]
        if thing["pickupable"]:
            seen: set[str] = set()
            for place, other in self._table().items():
                kind = other["objectType"]
                if kind in seen or place in (thing["parentReceptacles"] or ()):
                    seen.add(kind)
                    continue
                if place != own and _suits(thing, other, spoken):
                    seen.add(kind)
                    yield Action("put", name, destination=self._names[place])
        for verb, (needs, state, value) in _FLAGS.items():
            if verb in _ONLY_ON_REQUEST or thing[state] == value:
                continue
            if thing[needs] or (needs == "toggleable" and thing["objectType"] == "StoveBurner"):
                yield Action(verb, name)

    def _meet(self, request: Request) -> list[Action]:
        """The actions that a request still needs."""
        things = self._meant(request.object_types, request.name)
        many = len(things) if request.every else max(request.number, 1)
        if request.verb == "put":
            places = self._meant(request.destination_types, request.destination_name)
            here = set(places)
            there = [
                own for own in things if here & set(self._table()[own]["parentReceptacles"] or ())
            ]
            left = [own for own in things if own not in there and own not in here]
            return [
                Action("put", self._names[own], destination=self._names[place])
                for own in left[: max(many - len(there), 0)]
                if (place := next((each for each in places if each != own), None))
            ]
        if request.verb == "pick up":
            return (
                [] if self._held() else [Action("pick up", self._names[own]) for own in things[:1]]
            )
        if request.verb in ("push", "pull"):
            return [Action(request.verb, self._names[own]) for own in things[:1]]
        needs, state, value = _FLAGS[request.verb]
        table = self._table()
        able = [own for own in things if table[own][needs]]
        unmet = [own for own in able if table[own][state] != value]
        met = len(able) - len(unmet)
        return [Action(request.verb, self._names[own]) for own in unmet[: max(many - met, 0)]]

    def _returns(self, hearing: Hearing) -> Iterator[Action]:
        """Puts of what the robot moved, and should not have, to where it was at the start."""
        for own, thing in self._table().items():
            was = self._start.get(own)
            if was is None or not thing["pickupable"] or not thing["parentReceptacles"]:
                continue
            home = set(was["parentReceptacles"] or ())
            here = self._place(thing)
            if home & set(thing["parentReceptacles"]) or not home or not here:
                continue
            put = Action("put", self._names[own], destination=here)
            if self._is_refused(put, thing, hearing):
                back = self._place(was)
                if back and not hearing.refuses(
                    "put in", self._table()[self._id(back)]["objectType"]
                ):
                    yield Action("put", self._names[own], destination=back)

    def _meant(self, types: Sequence[str], name: str) -> list[str]:
        """Ids of the things of these types, or the one of this name; whole ones, in their order."""
        if name:
            return [own] if (own := self._id(name)) else []
        return [
            own
            for kind in types
            for own, thing in self._table().items()
            if thing["objectType"] == kind and _is_whole(thing)
        ]

    def _is_refused(self, action: Action, thing: Mapping[str, Any], hearing: Hearing) -> bool:
        if hearing.refuses(action.name, thing["objectType"]):
            return True
        place = self._table().get(self._id(action.destination))
        return place is not None and hearing.refuses("put in", place["objectType"])

    def _changes(self) -> Iterator[str]:
        """What is not as it was at the start, in words."""
        for own, thing in self._table().items():
            name, was = self._names[own], self._start.get(own)
            if was is None:
                continue
            parts = [
                word if thing[key] else f"no longer {word}"
                for key, word in _STATES
                if thing[key] != was[key]
            ]
            if thing["isFilledWithLiquid"] != was["isFilledWithLiquid"]:
                liquid = thing["fillLiquid"] or "liquid"
                parts.append(f"filled with {liquid}" if thing["isFilledWithLiquid"] else "emptied")
            if thing["isPickedUp"]:
                parts.append("in the robot's hand")
            elif self._place(thing) != self._place(was):
                parts.append(f"now {self._where(thing)}")
            if parts:
                yield f"{name}: {', '.join(parts)}"

    def _place(self, thing: Mapping[str, Any]) -> str:
        """The name of what the thing is in or on: not the floor, if there is anything else."""
        table = self._table()
        listed = [own for own in thing["parentReceptacles"] or () if own in table]
        listed.sort(
            key=lambda own: (table[own]["objectType"] in _LAST, not table[own]["pickupable"])
        )
        return self._names[listed[0]] if listed else ""

    def _told(self, own: str) -> str:
        """How the object is now, in words."""
        thing, name = self._table()[own], the(self._names[own])
        states = [word for key, word in _STATES if thing[key]]
        if thing["isFilledWithLiquid"]:
            states.append(f"filled with {thing['fillLiquid'] or 'a liquid'}")
        where = "in the robot's hand" if thing["isPickedUp"] else self._where(thing)
        return f"{name[:1].upper()}{name[1:]} is {', '.join([*states, where])}"

    def _where(self, thing: Mapping[str, Any]) -> str:
        """Where the thing is, in words: "in the fridge"."""
        name = self._place(thing)
        place = self._table().get(self._id(name))
        if place is None:
            return "nowhere to be seen"
        return f"{'in' if _holds_inside(place) else 'on'} {the(name)}"

    def _table(self) -> dict[str, dict[str, Any]]:
        return {each["objectId"]: each for each in self.metadata["objects"]}

    def _held(self) -> str:
        held = self.metadata["inventoryObjects"]
        return held[0]["objectId"] if held else ""

    def _id(self, name: str) -> str:
        """The object of this name; empty if there is none."""
        return next((own for own, each in self._names.items() if name and each == name), "")

    def _name(self) -> None:
        """Name what is new, such as slices; a name once given stays."""
        objects = self.metadata["objects"]
        if not self._names:
            self._names = names(objects)
            return
        here = {each["objectId"] for each in objects}
        self._names = {own: name for own, name in self._names.items() if own in here}
        taken = set(self._names.values())
        for thing in objects:
            if thing["objectId"] in self._names:
                continue
            kind = readable(thing["objectType"])
            number = 1
            while f"{kind} {number}" in taken:
                number += 1
            taken.add(f"{kind} {number}")
            self._names[thing["objectId"]] = f"{kind} {number}"


def _holds_inside(place: Mapping[str, Any]) -> bool:
    return place["openable"] or place["objectType"] in _INSIDE


def _is_whole(thing: Mapping[str, Any]) -> bool:
    """Whether the thing itself is still there."""
    return not thing["isSliced"] and not (thing["objectType"] == "Egg" and thing["isBroken"])


def _suits(thing: Mapping[str, Any], place: Mapping[str, Any], spoken: set[str]) -> bool:
    """Whether AI2-THOR lets the thing be put there, or the person spoke of the place.

    AI2-THOR's table alone is too strict: of what people put somewhere, one in fifteen is not in it.
    """
    kind = place["objectType"]
    if not place["receptacle"]:
        return False
    if SINGLE.get(kind):
        return thing["objectType"] == SINGLE[kind]
    return kind in object_type(thing["objectType"]).places or readable(kind) in spoken
