"""The robot of Sec. 4.2 as an environment, in the embedded house or in AI2-THOR."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from goalscope.base.nouns import contains, singulars
from goalscope.base.types import Action, GoalscopeError, InvalidInputError, Profile, StepResult
from goalscope.envs import Checks, Pick, Proactive, Resolution, State
from goalscope.envs.house.actions import (
    FILLS,
    IRREVERSIBLE,
    NAMES,
    Primitives,
    Refusal,
    afforded,
    cooks,
    starts,
    undoing,
)
from goalscope.envs.house.finding import Finder, asked_about, bound, facts_of, worded
from goalscope.envs.house.profiles import checks_met, types_in
from goalscope.envs.house.resolve import Resolver
from goalscope.envs.house.simulator.object_types import LASTING, PREDICATES
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.simulator.world import Controller
from goalscope.envs.house.view import STATES, View, readable, the
from goalscope.envs.scenarios import Scenario, shipped_scenarios
from goalscope.language.dialogue_state import DialogueState, exceptions
from goalscope.language.matcher import Matcher
from goalscope.language.orders import Order, Verb, orders_from_text, with_examples
from goalscope.models.embedding import embedded

SAME_PLACE = 0.01
"""Metres within which an object has not moved."""

_EXACTLY = Matcher(strict=True)

_SHOWN = 30
"""Most changes that the status lists."""

_THING = ("what", "quantity", "where")

_USABLE = ("pickupable", "toggleable", "canFillWithLiquid", "dirtyable")
"""Affordances of what may serve a goal."""


class HomeRobot(Proactive):
    """A robot in a home.

    Orders use `verbs`.

    The actions are "put" (an object, with a receptacle as the destination), "pick up", "open",
    "close", "turn on", "turn off", "fill" (with water), "fill with coffee", "fill with wine",
    "empty", "slice", "cook", "break", "clean", "dirty", "use up", "push", "pull", and "finish",
    which ends the task and has no object. Objects go by the names of `names`, such as "mug" or
    "drawer 2". Each is done as the paper does it: the robot goes to where it can reach the object,
    opens what encloses it, and closes again what it opened.

    Args:
        controller: AI2-THOR's, or `HouseController`; reset to its scene's start.
        notes: What a person should know about the scene, one sentence each.
    """

    task = (
        "The agent is a robot in a home. Its task is to interact with the objects there "
        "to accomplish the human's preferences."
    )
    verbs = (
        Verb("put", "bring or move a thing to a place", ("what", "quantity", "for", "where")),
        Verb("pick up", "take a thing in the hand", _THING),
        Verb("open", "open it", _THING),
        Verb("close", "close it", _THING),
        Verb("turn on", "switch it on", _THING),
        Verb("turn off", "switch it off", _THING),
        Verb("fill", "fill it, with water unless said", ("what", "quantity", "for", "where")),
        Verb("empty", "pour it out", _THING),
        Verb("slice", "cut it", _THING, irreversible=True),
        Verb("cook", "boil, fry, toast or warm it, in the place said", _THING, irreversible=True),
        Verb("clean", "wash or wipe it", _THING),
        Verb("make", "prepare a drink or dish", ("what", "quantity", "for", "where")),
        Verb("break", "break it", _THING, irreversible=True),
        Verb("push", "push it", _THING),
        Verb("pull", "pull it", _THING),
        Verb("finish", "the task is done", (), ends=True, phrase="Task completed"),
    )
    agreed = 0.3

    def __init__(self, controller: Controller, *, notes: Sequence[str] = ()) -> None:
        self._primitives = Primitives(controller)
        self.verbs = with_examples(type(self).verbs, "goalscope.envs.house")
        self.notes = tuple(notes)
        self._start = self._view = View(self.metadata)
        self._done: list[tuple[Action, View]] = []
        self._undoing: list[Action] = []
        self._spots: dict[str, list[tuple[list[float], str]]] = {}
        self._fingerprint()

    @property
    def metadata(self) -> dict[str, Any]:
        """AI2-THOR's metadata of the present state."""
        return self._primitives.metadata

    def reset(self) -> None:
        """Take the scene back to its start."""
        self._primitives.reset()
        self._view = View(self.metadata)
        self._done.clear()
        self._undoing.clear()

    @property
    def names(self) -> dict[str, str]:
        """What each object is called, by its id."""
        return dict(self._view.names)

    def __exit__(self, *error: object) -> None:
        """Stop the simulator."""
        self._primitives.controller.stop()

    def _fingerprint(self) -> str:
        """A hash of every object's state and place.

        Places nearer than 1 cm to one where the object has been count as that one; what the robot
        carries is in its hand, wherever it stands.
        """
        rows = [
            [own, *(thing[key] for key in (*PREDICATES, "fillLiquid", "openness")), self._spot(own)]
            for own, thing in sorted(self._view.table.items())
        ]
        return hashlib.sha256(json.dumps(rows).encode()).hexdigest()

    def _spot(self, own: str) -> str:
        """Where the object is; a place where it has been before has the name from then."""
        thing = self._view.table[own]
        if self._view.held and self._view.held in (own, *(thing["parentReceptacles"] or ())):
            return "hand"
        here = [thing["position"][axis] for axis in "xyz"]
        known = self._spots.setdefault(own, [])
        for place, name in known:
            if math.dist(place, here) < SAME_PLACE:
                return name
        name = " ".join(f"{each:.2f}" for each in here)
        known.append((here, name))
        return name

    def state(self) -> State:
        """The object in the hand, and all changes since the start, one object per line."""
        here = self._view.here(self._start.table)
        return State(self._status(), self._fingerprint(), here)

    def _status(self) -> str:
        held = self._view.held
        hand = f"The robot's hand {f'holds {the(self._view.names[held])}' if held else 'is empty'}."
        changes = [text for _, text in self._view.changes(self._start.table)]
        if not changes:
            return f"{hand} Nothing has been changed yet."
        lines = [hand, "Changed so far:", *(f"- {each}" for each in changes[:_SHOWN])]
        if len(changes) > _SHOWN:
            lines.append(f"- and {len(changes) - _SHOWN} more")
        return "\n".join(lines)

    def resolve(self, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
        """See `Environment.resolve`; limits need no action, because they bind later ones."""
        if order.do == "undo":
            return self._undo(dialogue)
        view, done = self._view, [action for action, _ in self._done]
        if missing := [each for each in exceptions(order) if not worded(view, each)]:
            return Resolution(why=f"There is no {missing[0]:.60} here, so all stays as it is.")
        finder, untouched = Finder(view, pick), bound(view, dialogue)
        return Resolver(view, self._start, finder, done, untouched, dialogue.asked).resolve(order)

    def irreversible(self, action: Action) -> bool:
        """Whether the action slices, breaks, uses up or cooks something.

        What is put on a lit burner, or in a microwave that is then turned on, is cooked, too.
        """
        return action.name in IRREVERSIBLE or bool(cooks(self._view, action))

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names such as "egg" of what can be moved or switched here, nearest first."""
        usable = (thing for thing in self._view.objects if any(thing[flag] for flag in _USABLE))
        names = list(dict.fromkeys(readable(thing["objectType"]) for thing in usable))
        if text and names:
            vectors = embedded([text, *names])
            nearest: list[int] = np.argsort(-(vectors[1:] @ vectors[0]), kind="stable").tolist()
            names = [names[i] for i in nearest]
        return names[:limit]

    def actions(self, name: str, dialogue: DialogueState) -> list[Action]:
        """What can be done with the objects of a name or generic name.

        For each object: a put into or onto each kind of receptacle that is viable for it, and what
        its affordances allow. What the person ruled out is not offered, nor what only they ask for,
        nor anything with a thing that they have ordered something for.
        """
        view, untouched = self._view, bound(self._view, dialogue)
        taken = untouched | asked_about(view, dialogue)
        return [
            action
            for own in self._called(name)
            if own not in taken
            for action in afforded(view, own)
            if view.id(action.destination) not in untouched
        ]

    def possible(self, terms: Sequence[str]) -> list[Action]:
        """See `Proactive.possible`: all that the affordances of these objects allow."""
        owns = dict.fromkeys(own for term in terms for own in self._called(term.casefold()))
        found = (action for own in owns for action in afforded(self._view, own, asked=True))
        return [*found, Action("finish")]

    def _called(self, name: str) -> list[str]:
        """Ids of the whole objects of a name or generic name."""
        names = self._view.names
        return [
            own
            for own, thing in self._view.table.items()
            if name in (names[own], readable(thing["objectType"])) and is_whole(thing)
        ]

    def phrase(self, action: Action) -> str:
        """The action in words, with generic names: "put the egg in the fridge"."""
        return self._view.phrase(action)

    def serving(self, need: str, dialogue: DialogueState) -> list[Action]:
        """What does an order such as "put mug | where coffee machine", of generic names.

        Nothing that touches what the person ruled out, or has ordered something for, and nothing
        that heats or lets water run.
        """
        try:
            orders = orders_from_text(need, self.verbs)
        except InvalidInputError:
            return []
        view = self._view
        taken = bound(view, dialogue) | asked_about(view, dialogue)
        found: list[Action] = []
        for order in orders:
            if any(verb.name == order.do for verb in self.verbs):
                found += self.resolve(order, dialogue, _EXACTLY).actions
        touched = {view.id(name) for each in found for name in each.things}
        if touched & taken or any(starts(view, each) for each in found):
            return []
        return found

    def like(self, text: str, most: int) -> list[Scenario]:
        """See `Proactive.like`."""
        return shipped_scenarios("house")(text, most)

    def room(self) -> str:
        """The kinds of things in the room."""
        return ", ".join(sorted({readable(each["objectType"]) for each in self._view.objects}))

    def _undo(self, dialogue: DialogueState) -> Resolution:
        """What brings back what was changed; what is ruled out stays as it is.

        Afterwards the results count as never done, and so do the actions, once they are taken.
        """
        actions = [each.action for each in dialogue.to_undo if each.ok and not each.terminated]
        done, count = [action for action, _ in self._done], len(actions)
        starts = range(len(done) - count, -1, -1)
        first = next((i for i in starts if actions and done[i : i + count] == actions), -1)
        if first < 0:
            return Resolution(why="I do not know how to undo that.")
        end = first + count
        states = [*(before for _, before in self._done), self._view]
        was, then = states[first].table, states[end].table
        del self._done[first:end]
        found = undoing(self._view, was, then, actions, bound(self._view, dialogue))
        self._undoing = list(found.actions)
        if not (found.actions or found.why):
            return Resolution(why="Everything is as it was before that.")
        return found

    def step(self, action: Action) -> StepResult:
        """Execute an action with all its steps. A failed action changes nothing.

        Raises:
            GoalscopeError: The simulator died, or what a failed action began cannot be taken back.
        """
        if action == Action("finish"):
            return StepResult(action, True, "The task is finished.", terminated=True)
        own, place = self._view.id(action.target), self._view.id(action.destination)
        if problem := _problem(action, own, place):
            return StepResult(action, False, problem)
        before, mark = self._fingerprint(), self._primitives.mark()
        try:
            self._do(action, own, place)
        except Refusal as refusal:
            self._primitives.back_to(mark)
            self._view = View(self.metadata, self._view.names)
            if self._fingerprint() != before:
                raise GoalscopeError(
                    f"{action} failed ({refusal}), and what it began could not be taken back: the "
                    "house is not as it was. The robot stops; look at the house, and start anew."
                ) from None
            return StepResult(action, False, self._named(str(refusal)))
        if action in self._undoing:
            self._undoing.remove(action)
        else:  # what only undoes is forgotten like what it undoes
            self._undoing.clear()
            self._done.append((action, self._view))
        old, self._view = self._view, View(self.metadata, self._view.names)
        besides = map(self._named, self._primitives.told())
        told = "; ".join([self._view.told(own, old.table[own]), *besides])
        if any(
            thing[state] and not old.table.get(each, thing)[state]
            for each, thing in self._view.table.items()
            for state in LASTING
        ):
            return StepResult(action, True, f"{told}; this cannot be undone.", irreversible=True)
        return StepResult(action, True, f"{told}.")

    def answer(self, question: Order, said: str, dialogue: DialogueState, pick: Pick) -> str:
        """Where the things asked about are, and in what state; without a name, what is here."""
        if question.about in ("total", "enough"):
            return ""
        if (question.what or question.where).casefold() in ("", "here", "room"):
            words = singulars(said)
            named = [name for name in self.names.values() if contains(words, singulars(name))]
            named.sort(key=len, reverse=True)
            named += [f"anything {word}" for _, word in STATES if word in words]
            if not named:
                return f"{self._status()}\nHere: {self.room()}."
            question = replace(question, what=named[0])
        return facts_of(Finder(self._view, pick), question)

    def checks_met(self, profile: Profile) -> Checks:
        """Which goal conditions hold, and what changed of types that the profile names nowhere."""
        met = checks_met(profile.checks, self._view.objects)
        if not profile.welcome:
            return Checks(tuple(met))
        kinds, table = types_in(profile), self._view.table
        changed = [own for own, _ in self._view.changes(self._start.table)]
        others = [self.names[own] for own in changed if table[own]["objectType"] not in kinds]
        return Checks(tuple(met), tuple(others))

    def _named(self, text: str) -> str:
        """The text with the objects' names in place of their ids."""
        for own, name in sorted(self.names.items(), reverse=True):
            text = text.replace(own, the(name))
        return text

    def _do(self, action: Action, own: str, place: str) -> None:
        robot = self._primitives
        match action.name:
            case "put":
                robot.put(own, place)
            case "pick up":
                robot.pick_up(own)
            case "turn on" | "turn off":
                robot.toggle(own, on=action.name == "turn on")
            case name if name in FILLS:
                robot.act("FillObjectWithLiquid", own, fillLiquid=FILLS[name])
            case "push" | "pull":
                robot.act(f"{action.name.title()}Object", own, moveMagnitude="100")
            case "empty":
                robot.act("EmptyLiquidFromObject", own)
            case name:
                robot.act(f"{name.title().replace(' ', '')}Object", own)


def _problem(action: Action, own: str, place: str) -> str:
    """Why the action is none that the house may be given; empty where it is one."""
    if action.name not in NAMES:
        return f"There is no action {action.name!r:.60}; there are {', '.join(NAMES)}."
    if not own:
        return f"There is nothing here of the name {action.target!r:.60}."
    if type(action.quantity) is not int or action.quantity != 1:
        return "An action is done once: its quantity must be 1."
    if (action.name == "put") != bool(action.destination):
        return "A put needs a destination, and nothing else has one."
    if action.destination and not place:
        return f"There is nothing here of the name {action.destination!r:.60}."
    return ""
