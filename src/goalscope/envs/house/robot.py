"""The robot of Sec. 4.2 as an environment, in the embedded house or in AI2-THOR."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Collection, Sequence
from typing import Any

from goalscope import envs
from goalscope.envs.house.answers import answered, asks_what_was_done, resolved
from goalscope.envs.house.conditions import conditions_met
from goalscope.envs.house.deeds import told_of_deeds
from goalscope.envs.house.heard import HOME
from goalscope.envs.house.hearing.completion import completes
from goalscope.envs.house.hearing.hear import IRREVERSIBLE, Hearing, Request, ask_permission, hear
from goalscope.envs.house.hearing.restraint import holds_back, names_a_spot
from goalscope.envs.house.hearing.undoing import NOTHING, lasting, restoring, reverses
from goalscope.envs.house.meeting import FILLS, brought, meet, serves, settled, spent
from goalscope.envs.house.names import mentioned, readable, the
from goalscope.envs.house.offers import NAMES, cooks, is_refused, possible, returns
from goalscope.envs.house.primitives import Primitives, Refusal
from goalscope.envs.house.simulator.controller import Controller
from goalscope.envs.house.simulator.properties import ACTS, LASTING, PREDICATES
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.unmet import unmet
from goalscope.envs.house.view import View
from goalscope.envs.remarks import asks_for_guesses
from goalscope.types import Action, GoalscopeError, Profile, StepResult, Turn, spoken

__all__ = ["HomeRobot"]

SAME_PLACE = 0.01
"""Metres within which an object has not moved."""

_SHOWN = 30
"""Most changes that the status lists."""

_TOLD = 6
"""Most sentences about what an order did not get."""


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
        self._view = View(self.metadata)
        self._first, self._start = self._view, self._view.table
        self._done: list[Action] = []
        self._before: list[View] = []
        self._spots: dict[str, list[tuple[list[float], str]]] = {}
        self.fingerprint()

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
        self._view = View(self.metadata)
        self._done.clear()
        self._before.clear()

    @property
    def names(self) -> dict[str, str]:
        """What each object is called, by its id."""
        return dict(self._view.names)

    def close(self) -> None:
        """Stop the simulator."""
        self._primitives.controller.stop()

    def fingerprint(self) -> str:
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

    def status(self) -> str:
        """What is in the hand, and what has changed since the start, one object a line."""
        held = self._view.held
        hand = f"The robot's hand {f'holds {the(self._view.names[held])}' if held else 'is empty'}."
        changes = list(self._view.changes(self._start))
        if not changes:
            return f"{hand} Nothing has been changed yet."
        lines = [hand, "Changed so far:", *(f"- {each}" for each in changes[:_SHOWN])]
        if len(changes) > _SHOWN:
            lines.append(f"- and {len(changes) - _SHOWN} more")
        return "\n".join(lines)

    def kinds(self, text: str, limit: int) -> list[str]:
        """Generic names such as "egg" of what can be moved or switched here."""
        usable = ("pickupable", "toggleable", "canFillWithLiquid", "dirtyable")
        kinds = [
            readable(thing["objectType"])
            for thing in self._view.objects
            if any(thing[flag] for flag in usable)
        ]
        return list(dict.fromkeys(kinds))[:limit]

    def mentioned(self, utterances: Sequence[str]) -> list[str]:
        """Generic names of things here that the person spoke of, and did not refuse."""
        hearing = self._hear([Turn("", each) for each in utterances])
        kinds = {readable(each["objectType"]): each["objectType"] for each in self._view.objects}
        found = mentioned(". ".join(utterances), self._view.objects)
        return [kind for kind in found if not hearing.refuses("", kinds[kind])]

    def actions(self, relevant: Sequence[str], turns: Sequence[Turn] = ()) -> list[Action]:
        """What can be done with the objects of these names or generic names.

        For each object: a put into or onto each kind of receptacle that is viable for it, or that
        the person spoke of, and what its affordances allow. What the person ruled out is not
        offered, nor what only a person asks for, nor to move what is where they asked for it; nor
        anything where the newest words order, correct, refuse or warn. Where they ask for several
        things to be brought, there is nothing to guess but where what was named goes.
        """
        view, wanted = self._view, set(relevant)
        hearing = self._hear(turns)
        if turns and self._leaves_nothing(hearing, turns):
            return []
        named = set(mentioned(". ".join(spoken(turns)), view.objects))
        stays = {view.names[own] for own in settled(view, hearing.wanted)}
        brings = [each for each in self._carried(hearing) if each in hearing.newest]
        several = {kind for each in brings for kind in each.object_types if len(brings) > 1}
        return [
            action
            for own, thing in view.table.items()
            if {view.names[own], readable(thing["objectType"])} & wanted and is_whole(thing)
            for action in possible(view, own, named)
            if not is_refused(view, action, hearing)
            and not (action.name == "put" and action.target in stays)
            and (not several or self._brings(action, several, named))
        ]

    def phrase(self, action: Action) -> str:
        """The action in words, with generic names: "put the egg in the fridge"."""
        return self._view.phrase(action)

    def fulfilled(self, kind: str) -> list[str]:
        """The puts that things of this kind do not need any more, in words."""
        view = self._view
        puts = [
            Action("put", view.names[own], destination=place)
            for own, thing in view.table.items()
            if readable(thing["objectType"]) == kind
            and thing["pickupable"]
            and (place := view.place(thing))
        ]
        return list(dict.fromkeys(view.phrase(put) for put in puts))

    def requests(self, turns: Sequence[Turn]) -> list[Action]:
        """What the person asked for outright, as far as it is not so already.

        What was moved and is ruled out since goes back to where it was. A hand holds one thing:
        where several are to be brought, the goals tell where to. What was met once is not met anew
        because something else has changed it; and nothing is done for who says that all is done.
        """
        if turns and completes(turns[-1].utterance):
            return []
        hearing = self._hear(turns)
        over = self._over(hearing)
        plan = [
            action
            for action in meet(self._view, hearing.wanted, self._start, over)
            if not is_refused(self._view, action, hearing)
        ]
        asked = {action.target for action in plan}
        back = [*self._undone(hearing), *returns(self._view, self._start, hearing)]
        return [action for action in back if action.target not in asked] + plan

    def is_order(self, turns: Sequence[Turn]) -> bool:
        """Whether the newest words leave nothing to guess.

        They are nothing but orders and refusals that were understood; or one of them cannot be
        followed, or was not understood, and what was meant by it must be said.
        """
        hearing = self._hear(turns)
        if len(self._carried(hearing)) > 1 and self._speaks_of_furniture(turns):
            return False  # things go where the goals tell
        return hearing.exact or hearing.stuck

    def unmet(self, turns: Sequence[Turn], results: Sequence[StepResult]) -> list[str]:
        """What the newest turn asks for outright and did not get, one sentence each.

        Of an aim such as "tidy up" nothing is told where something was done for it.
        """
        hearing = self._hear(turns)
        missed = () if results and not (hearing.stuck or hearing.newest) else hearing.missed
        told = unmet(self._view, hearing, results, self._start, self._over(hearing))
        all_told = list(dict.fromkeys((*missed, *told)))
        if asks_for_guesses(turns[-1].utterance):
            guesses = dict.fromkeys(action.target for action in self._guesses(hearing))
            all_told = [f"{envs.GUESSED}{', '.join(guesses) or 'nothing'}."]
        if hearing.undone == "guesses":
            guesses = self._guesses(hearing)
            back = self._restoring(guesses)
            left = [each for each in guesses if not any(reverses(act, each) for act in back)]
            all_told += [f"I cannot undo that: {self.phrase(each)}." for each in left]
            if not (results or all_told):
                all_told = [NOTHING]
        more = len(all_told) - _TOLD
        return all_told if more <= 0 else [*all_told[:_TOLD], f"And {more} more of that kind."]

    def permission(self, action: Action, turns: Sequence[Turn]) -> str:
        """The question to ask before a slice, a break and the like; empty if it was allowed.

        What is put on a lit burner, or in a microwave that is then turned on, is cooked, too.
        """
        view = self._view
        acts = [("cook", own) for own in cooks(view, action)] if view.id(action.target) else []
        if action.name in IRREVERSIBLE and view.id(action.target):
            acts = [(action.name, view.id(action.target))]
        hearing = self._hear(turns) if acts else None
        for verb, own in acts:
            kind = view.table[own]["objectType"]
            alike = [each for each in view.objects if each["objectType"] == kind]
            _, state, _ = ACTS[verb]
            done = sum(each[state] for each in alike)
            if hearing and not hearing.permits(verb, kind, view.names[own], done):
                return ask_permission(verb, view.names[own])
        return ""

    def reversal(
        self, results: Sequence[StepResult], before: Sequence[StepResult], turns: Sequence[Turn]
    ) -> envs.Reversal:
        """What brings things back to how they were before `results`.

        What the newest words rule out, as in "undo that, but leave the mug", stays; so does what
        nobody can undo.
        """
        if not results:
            return [], []
        first, end = len(before), len(before) + len(results)
        states = [view.table for view in (*self._before, self._view)]
        was, then = states[first], states[end]
        changed = {
            self._view.names[own]
            for own, thing in then.items()
            if own in self._view.names
            and own in was
            and any(thing[key] != was[own][key] for key in (*PREDICATES, "fillLiquid"))
        }
        ruled, before_that = self._hear(turns), self._hear(turns[:-1])
        back = [
            action
            for action in restoring(self._view, was, changed)
            if not is_refused(self._view, action, ruled)
            or is_refused(self._view, action, before_that)
        ]
        moved = [each.action for each in results if each.action.name in ("push", "pull")]
        left = [f"I cannot undo that: {self.phrase(action)}." for action in moved]
        return back, [*left, *lasting(self._view, was, changed)]

    def step(self, action: Action) -> StepResult:
        """Take one action, with all that belongs to it. One that fails changes nothing.

        Raises:
            GoalscopeError: The simulator died, or what a failed action began cannot be taken back.
        """
        own, place = self._view.id(action.target), self._view.id(action.destination)
        if problem := _problem(action, own, place):
            return StepResult(action, False, problem)
        before, mark = self.fingerprint(), self._primitives.mark()
        try:
            self._do(action, own, place)
        except Refusal as refusal:
            self._primitives.back_to(mark)
            self._view = View(self.metadata, self._view.names)
            if self.fingerprint() != before:
                raise GoalscopeError(
                    f"{action} failed ({refusal}), and what it began could not be taken back: the "
                    "house is not as it was. The robot stops; look at the house, and start anew."
                ) from None
            return StepResult(action, False, self._named(str(refusal)))
        self._done.append(action)
        self._before.append(self._view)
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

    def answer(self, question: str, turns: Sequence[Turn] = ()) -> str | None:
        """Answer a question about things here, or what was done; None for anything else."""
        if (about := asks_what_was_done(question)) is not None:
            return self._told_of(about)
        meant = [question]
        here = {str(each["objectType"]) for each in self._view.objects}
        meant += resolved(question, [turn.utterance for turn in turns[:-1]], here)
        if self._done:
            last = self._done[-1].target
            meant.append(re.sub(r"\b(?:it|them)\b", last, question, flags=re.IGNORECASE))
        replies = (answered(each, self._view.objects, self._view.names) for each in meant)
        told = next((each for each in replies if each is not None), None)
        return told_of_deeds(question, self._done, self._view) if told is None else told

    def _told_of(self, about: str) -> str:
        """What has changed of the things that `about` names, or of all."""
        numbered = [name for name in self._view.names.values() if name[-1:].isdigit()]
        exact = [name for name in numbered if re.search(rf"\b{re.escape(name)}\b", about)]
        if named := exact or mentioned(about, self._view.objects):
            said = re.compile(rf"\b(?:{'|'.join(map(re.escape, named))})(?: \d+)?:")
            changes = [each for each in self._view.changes(self._start) if said.search(each)]
            return f"{'; '.join(changes) or 'I changed nothing about that'}."
        hand, *lines = self.status().replace("\n- ", "; ").splitlines()
        return " ".join([hand, *lines]).replace(":;", ":") + ("." if lines else "")

    def is_completion(self, turn: Turn) -> bool:
        """Whether the person says that the task is complete."""
        return completes(turn.utterance)

    def completion_actions(self) -> list[Action]:
        """None: the task ends by the person's word."""
        return []

    def checks_met(self, profile: Profile) -> list[bool]:
        """Which of the profile's goal conditions hold now; none while nothing has been changed."""
        met = conditions_met(profile.checks, self._view.objects)
        return [any(self._view.changes(self._start)) and each for each in met]

    def _named(self, text: str) -> str:
        """The text with the objects' names in place of their ids."""
        for own, name in sorted(self.names.items(), reverse=True):
            text = text.replace(own, the(name))
        return text

    def _leaves_nothing(self, hearing: Hearing, turns: Sequence[Turn]) -> bool:
        """Whether the newest words order, correct, refuse or warn, so that nothing is guessed."""
        nowhere = any(each.verb == "put" and not each.destination_types for each in hearing.newest)
        nowhere = nowhere and not names_a_spot(turns[-1].utterance)
        if nowhere or len(self._carried(hearing)) > 1:
            return False
        here = {each["objectType"] for each in self._view.objects}
        return bool(hearing.newest) or holds_back(turns[-1].utterance, here)

    def _carried(self, hearing: Hearing) -> list[Request]:
        """What is to be brought: of several things the goals tell where to."""
        return brought(hearing.wanted, self._over(hearing), self._view.held_type)

    def _brings(self, action: Action, kinds: Collection[str], named: Collection[str]) -> bool:
        """Whether an action puts a thing that was named somewhere, but in none of these kinds."""
        there = self._view.type_of(action.destination)
        target = self._view.type_of(action.target)
        return action.name == "put" and readable(target) in named and there not in kinds

    def _speaks_of_furniture(self, turns: Sequence[Turn]) -> bool:
        named = {*mentioned(". ".join(spoken(turns)), self._view.objects)}
        return any(
            thing["receptacle"] and not thing["pickupable"]
            for thing in self._view.objects
            if readable(thing["objectType"]) in named
        )

    def _hear(self, turns: Sequence[Turn]) -> Hearing:
        return hear(turns, self._view.objects, self._view.names, self._start)

    def _undone(self, hearing: Hearing) -> list[Action]:
        """What brings back what nobody asked for."""
        if not hearing.undone:
            return []
        if hearing.undone == "guesses":
            back = self._restoring(self._guesses(hearing))
            return [act for act in back if not is_refused(self._view, act, hearing)]
        guessed = {each.target for each in self._done if not self._asked(each, hearing)}
        back = restoring(self._view, self._start, guessed)
        return [action for action in back if action.name != "put"]

    def _restoring(self, guesses: Sequence[Action]) -> list[Action]:
        """What takes back these acts, as far as anything can."""
        back = restoring(self._view, self._start, {action.target for action in guesses})
        return [act for act in back if any(reverses(act, each) for each in guesses)]

    def _guesses(self, hearing: Hearing) -> list[Action]:
        """What was done that the person never asked for, as far as it is so still."""
        done = (each for each in self._done if not self._asked(each, hearing))
        return [each for each in dict.fromkeys(done) if self._view.holds(each, self._start)]

    def _asked(self, action: Action, hearing: Hearing) -> bool:
        """Whether the person ever asked for this action."""
        own = self._view.id(action.target)
        home = self._view.place(self._start[own]) if own in self._start else ""
        for each in hearing.asked:
            if each.name not in ("", action.target) or not serves(self._view, action, each):
                continue
            to = each.destination_types != (HOME,) or action.destination == home
            if action.name != "put" or (each.verb == "put" and to):
                return True
        return False

    def _over(self, hearing: Hearing) -> list[Request]:
        """Requests of earlier words that were met once."""
        return [*spent(self._first, self._view, hearing, self._done)]

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
            case "use up":
                robot.act("UseUpObject", own)
            case _:
                robot.act(f"{action.name.title()}Object", own)


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
