"""Simulated people at home: reading profiles, and checking objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from goalscope.base.inputs import nearest, read_profiles, shown
from goalscope.base.types import InvalidInputError, Profile
from goalscope.envs.house.simulator.object_types import (
    STATES,
    GivenStates,
    object_types,
    unfit_state,
)
from goalscope.envs.house.simulator.state import by_id, is_whole

_FORMS = ("object", "every", "no")
"""The forms of a check, by their main key."""

_Types = str | Annotated[list[str], Field(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Check(GivenStates):
    object: _Types | None = None
    every: _Types | None = None
    no: _Types | None = None
    in_: Annotated[_Types | None, Field(alias="in")] = None
    on: _Types | None = None
    count: Annotated[int, Field(ge=1, le=1000)] | None = None
    isFilledWithLiquid: bool | None = None
    isSliced: bool | None = None
    isPickedUp: bool | None = None

    def __post_init__(self) -> None:
        """Refuse a check that is of no known form, or that nothing could ever meet."""
        leading = [key for key in _FORMS if getattr(self, key) is not None]
        if len(leading) != 1:
            raise ValueError(f"expected exactly one of the keys {', '.join(_FORMS)}.")
        kinds, places = _types(getattr(self, leading[0])), {"in": self.in_, "on": self.on}
        if None not in places.values():
            raise ValueError("'in' and 'on' mean the same. Use only one of them.")
        if self.count is not None and leading != ["object"]:
            raise ValueError(f"'count' is for 'object', not {leading[0]!r}.")
        for key, named in {leading[0]: kinds, **places}.items():
            _examine_types(key, _types(named or []))
        for problem in (unfit_state(key, kinds) for key in self.states):
            if problem:
                raise ValueError(problem)
        if leading == ["every"] and not (self.states or any(places.values())):
            raise ValueError(
                "'every' needs a condition. Add 'in', 'on', or a state such as isOpen."
            )


def load_profiles(path: Path | str | None = None) -> tuple[Profile, ...]:
    """Read profiles from a TOML file; None reads the five built-in ones (Sec. 4.2).

    Each is a table `[[profile]]` with `name`, `scene` (such as "Kitchen1"), `description` (given
    to a simulated human), `replies` (what the scripted human says, in order) and `checks`, a list
    of these forms:

    * `{object = "Apple", in = "Fridge"}`: at least one apple is in a fridge, or with
      `count = 2` at least two are.
    * `{every = "Mug", isDirty = false}`: there are mugs, and all of them are clean.
    * `{no = "Safe", isOpen = true}`: no safe is open.

    Objects are named by AI2-THOR's types, one or a list of which any will do. Beside them may
    stand `in` or `on` (both mean the same: types of receptacles, of which one must hold the
    object) and any of `STATES` with its value; all of them must hold of the same object. An egg on
    a plate on a table is on the table too; on the floor is only what nothing else holds. What was
    sliced, or a thing that went to pieces, counts only where the check says isSliced or isBroken.

    Beside them may stand `welcome`, a list of object types: what the person would not mind being
    changed.

    Raises:
        InvalidInputError: The file cannot be read, or a profile is not of this form; the message
            names the file, the profile, the key, and the nearest key or type that is known.
    """
    source = (
        files("goalscope.envs.house") / "data" / "profiles.toml" if path is None else Path(path)
    )
    profiles = read_profiles(source, _Check, scenes=True)
    for profile in profiles:
        try:
            _examine_types("welcome", profile.welcome)
        except ValueError as error:
            raise InvalidInputError(f"{source.name}, {shown(profile.name)}: {error}") from None
    return profiles


def checks_met(
    checks: Sequence[Mapping[str, Any]], objects: Iterable[Mapping[str, Any]]
) -> list[bool]:
    """Which of the `checks` (see `load_profiles`) hold of the `objects`, AI2-THOR's metadata."""
    table = by_id(objects)
    return [_is_met(check, table) for check in checks]


def types_in(profile: Profile) -> set[str]:
    """The object types that a profile's checks name, those of places among them, or `welcome`."""
    keys = (*_FORMS, "in", "on")
    named = [
        kind for check in profile.checks for key in keys for kind in _types(check.get(key, []))
    ]
    return {*named, *profile.welcome}


def _is_met(check: Mapping[str, Any], by_id: Mapping[str, Mapping[str, Any]]) -> bool:
    (form,) = (key for key in _FORMS if key in check)
    places = [kind for key in ("in", "on") for kind in _types(check.get(key, []))]
    states = {key: check[key] for key in STATES if key in check}
    of_pieces = not {"isSliced", "isBroken"}.isdisjoint(states)
    meant = [
        thing
        for thing in by_id.values()
        if thing["objectType"] in _types(check[form]) and (of_pieces or is_whole(thing))
    ]
    fitting = [
        thing
        for thing in meant
        if all(thing[key] == value for key, value in states.items())
        and (not places or not set(places).isdisjoint(_holders(thing, by_id)))
    ]
    if form == "every":
        return bool(meant) and len(fitting) == len(meant)
    return not fitting if form == "no" else len(fitting) >= check.get("count", 1)


def _holders(thing: Mapping[str, Any], by_id: Mapping[str, Mapping[str, Any]]) -> set[str]:
    """The types of the receptacles that hold `thing`, with those that hold them."""
    waiting: list[str] = list(thing["parentReceptacles"] or ())
    seen: set[str] = set()
    while waiting:
        holder = waiting.pop()
        if holder not in seen and holder in by_id:
            seen.add(holder)
            waiting += by_id[holder]["parentReceptacles"] or ()
    kinds = {by_id[holder]["objectType"] for holder in seen}
    others = any(
        by_id[holder]["objectType"] != "Floor"
        for holder in thing["parentReceptacles"] or ()
        if holder in by_id
    )
    return kinds - {"Floor"} if others else kinds


def _types(value: str | list[str]) -> list[str]:
    return [value] if isinstance(value, str) else value


def _examine_types(key: str, names: Iterable[str]) -> None:
    known = object_types()
    for name in names:
        if name not in known:
            raise ValueError(
                f"{shown(name)} in {key!r} is not an object type; {nearest(name, known)}"
            )
        if key in ("in", "on") and "receptacle" not in known[name].flags:
            raise ValueError(f"{name} in {key!r} is not a receptacle.")
