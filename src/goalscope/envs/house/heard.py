"""What a person's words come to: requests, what is ruled out, and leave."""

from __future__ import annotations

from dataclasses import dataclass

from goalscope.envs.house.names import readable

__all__ = ["HOME", "Hearing", "Leave", "Request"]

HOME = "home"
"""In place of the types of a destination: wherever the thing was at the start."""

Leave = tuple[str, str, int]
"""An irreversible verb, an object type or a name in the scene, and for how many; 0 for all."""


@dataclass(frozen=True, slots=True)
class Request:
    """Something asked for outright.

    Attributes:
        verb: "put", "pick up", "open", "close", "turn on", "turn off", "slice", "cook", "break",
            "fill", "empty", "clean", "dirty", "push", "pull" or "use up".
        object_types: What to do it to: one of these types, or all of them where `every` is set.
        destination_types: For "put": one of these types; empty where no place was named, or
            `HOME` alone.
        every: Whether every such thing is meant.
        number: How many are meant; 0 where it was not said.
        liquid: For "fill": "water", "coffee", "wine", or "" where it was not said.
        name: The thing's own name in the scene, where that was said: "drawer 2".
        destination_name: The same of the place.
        states: Which of several things of the type is meant, by names and values of AI2-THOR's
            metadata: ("isDirty", True), ("temperature", "Hot").
        at: Types of the places of which one tells which thing is meant: "the mug on the table".
        passing: Whether the same words ask for it to be moved on: "put it in the sink, and then
            in the cabinet". It is done with them, and never again.
    """

    verb: str
    object_types: tuple[str, ...]
    destination_types: tuple[str, ...] = ()
    every: bool = False
    number: int = 0
    liquid: str = ""
    name: str = ""
    destination_name: str = ""
    states: tuple[tuple[str, bool | str], ...] = ()
    at: tuple[str, ...] = ()
    passing: bool = False


@dataclass(frozen=True, slots=True)
class Hearing:
    """What a person's words come to, later words before earlier ones.

    Attributes:
        wanted: What is asked for, in its order.
        refused: Pairs of verb and object type that are ruled out; the verb "" stands for
            anything done to it, and "put in" for putting things there.
        kept_out: Pairs of an object type and the type of a place where it may not be put.
        staying: Object types that are ruled out, but are to stay where they are by now.
        permitted: An irreversible verb, an object type or a name in the scene, and for how many
            things of the type; 0 stands for all of them.
        newest: What of it the newest words asked for.
        missed: Of the newest words, the orders of which nothing could be made, a sentence each.
        exact: Whether the newest words are nothing but orders, refusals, questions and remarks.
        asked: All that was ever asked for, as often as it was.
        stuck: Whether an order of the newest words cannot be followed, or was not understood and
            is no aim such as "tidy up".
        undone: "guesses" where the newest words undo all of them; "besides" where everything is
            put back, and what was guessed is to be switched back, too; else "".
    """

    wanted: tuple[Request, ...] = ()
    refused: frozenset[tuple[str, str]] = frozenset()
    kept_out: frozenset[tuple[str, str]] = frozenset()
    staying: frozenset[str] = frozenset()
    permitted: tuple[Leave, ...] = ()
    newest: tuple[Request, ...] = ()
    missed: tuple[str, ...] = ()
    exact: bool = False
    asked: tuple[Request, ...] = ()
    stuck: bool = False
    undone: str = ""

    def permits(self, verb: str, object_type: str, name: str = "", done: int = 0) -> bool:
        """Whether the person asked in plain words for this act, or said yes to it.

        `name` is the thing's name in the scene, by default that of the only one of its type;
        `done` is to how many things of the type the act was done already.
        """
        name = name or readable(object_type)
        asked = any(
            act == verb and (what == name or (what == object_type and (done < most or not most)))
            for act, what, most in self.permitted
        )
        return asked and not self.refuses(verb, object_type)

    def refuses(self, verb: str, object_type: str, place_type: str = "") -> bool:
        """Whether the person ruled out this act on things of this type, or for a put this place."""
        ruled = {("", object_type), (verb, object_type), ("put in", place_type)} & self.refused
        return bool(ruled) or (object_type, place_type) in self.kept_out
