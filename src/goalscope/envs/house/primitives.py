"""What the robot's actions are made of: going, opening, taking, putting, and taking them back."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from goalscope.base.types import GoalscopeError
from goalscope.envs.house.simulator.controller import Controller
from goalscope.envs.house.simulator.state import ENCLOSING, by_id, innermost, is_at

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
