"""TOML and JSON written by people and their programs; errors name the place and the remedy."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from reprlib import Repr
from typing import Any, cast

from goalscope.base.types import InvalidInputError, Profile

__all__ = ["RepeatedKeyError", "is_list", "lists_of", "nearest", "parse_json"]
__all__ += ["read_profiles", "read_table", "refuse_unknown", "shown"]

_REPR = Repr()
_REPR.maxstring = _REPR.maxother = 80


def shown(value: object) -> str:
    """`value` on one short line, without control characters, for a message."""
    try:
        return _REPR.repr(value)
    except ValueError:
        return "a number of thousands of digits"


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint that names the known word most like `word`, or else some of those known."""
    known = list(known)
    found = difflib.get_close_matches(word[:80], known, 1)
    if found:
        return f"did you mean {found[0]!r}?"
    more = ", ..." if len(known) > 20 else "."
    return f"known are {', '.join(known[:20])}{more}"


def refuse_unknown(table: Mapping[str, Any], known: Sequence[str], label: str) -> None:
    """Refuse keys of `table` that are not `known`; `label` says where it stands."""
    for key in table:
        if key not in known:
            raise InvalidInputError(
                f"{label}: the key {shown(key)} is unknown; {nearest(key, known)}"
            )


def lists_of(
    keys: Sequence[str], known: Collection[str]
) -> Callable[[Mapping[str, Any], str], None]:
    """What refuses a check but lists of `known` names under `keys`, such as `has = ["roses"]`.

    It is the `examine` of `read_profiles`.
    """

    def examine(check: Mapping[str, Any], label: str) -> None:
        refuse_unknown(check, keys, label)
        if not check:
            raise InvalidInputError(f"{label}: it has no condition; {nearest('', keys)}")
        for key, names in check.items():
            if not is_list(names, str) or not names:
                one = next(iter(known), "")
                raise InvalidInputError(
                    f"{label}: {key!r} must be a list of texts, such as {[one]}."
                )
            for name in names:
                if name not in known:
                    raise InvalidInputError(
                        f"{label}: {shown(name)} is unknown; {nearest(name, known)}"
                    )

    return examine


def is_list(value: object, kind: type) -> bool:
    """Whether `value` is a list of nothing but `kind`."""
    return isinstance(value, list) and all(
        isinstance(entry, kind) for entry in cast("list[object]", value)
    )


def read_table(source: Path | Traversable, subject: str) -> dict[str, Any]:
    """Read a TOML file in UTF-8; `subject` opens the messages, such as "The profiles a.toml are".

    Raises:
        InvalidInputError: The file cannot be read, or is not TOML.
    """
    try:
        data = source.read_bytes()
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise InvalidInputError(
            f"{subject} not readable: {cause}. Give the path of a TOML file."
        ) from None
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise InvalidInputError(f"{subject} not UTF-8. Save the file as UTF-8.") from None
    except (ValueError, RecursionError) as error:
        cause = str(error)
        cause = cause if len(cause) < 200 and cause.isprintable() else shown(cause)
        raise InvalidInputError(f"{subject} not valid TOML: {cause}.") from None


class RepeatedKeyError(ValueError):
    """A JSON object has a key twice, of which one would be lost."""


def parse_json(text: str | bytes) -> Any:
    """The value of a JSON text.

    Raises:
        RepeatedKeyError: An object has a key twice.
        ValueError: It is not JSON.
        RecursionError: It is nested too deeply.
    """
    return json.loads(text, object_pairs_hook=_once)


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise RepeatedKeyError(f"the key {shown(twice)} stands there twice. Remove one of them.")
    return found


def read_profiles(
    source: Path | Traversable,
    examine: Callable[[Mapping[str, Any], str], None],
    *,
    scenes: bool = False,
) -> tuple[Profile, ...]:
    """Read the tables `[[profile]]` of a TOML file.

    Args:
        source: The file.
        examine: Refuses a check that is of no known form; its second argument says where it stands.
        scenes: Whether each profile names a `scene`.

    Raises:
        InvalidInputError: The file cannot be read, or a profile is not of this form; the message
            names the file, the profile, the key, and the nearest key that is known.
    """
    label = source.name
    tables = read_table(source, f"The profiles {label} are")
    refuse_unknown(tables, ("profile",), label)
    rows = tables.get("profile")
    if not is_list(rows, dict) or not rows:
        raise InvalidInputError(f"{label}: there is no [[profile]] table. Add at least one.")
    texts = ("name", "description", "scene") if scenes else ("name", "description")
    profiles = tuple(
        _profile(row, texts, examine, f"{label}, profile {n}") for n, row in enumerate(rows, 1)
    )
    seen: set[str] = set()
    for profile in profiles:
        if profile.name in seen:
            raise InvalidInputError(
                f"{label}: two profiles are named {shown(profile.name)}. Rename one."
            )
        seen.add(profile.name)
    return profiles


def _profile(
    row: Mapping[str, Any],
    texts: Sequence[str],
    examine: Callable[[Mapping[str, Any], str], None],
    label: str,
) -> Profile:
    name = row.get("name")
    if isinstance(name, str):
        label = f"{label} {shown(name)}"
    keys = (*texts, "replies", "checks")
    refuse_unknown(row, (*keys, "welcome"), label)
    for key in keys:
        if key not in row:
            raise InvalidInputError(f"{label}: the key {key!r} is missing.")
    for key in texts:
        if not isinstance(row[key], str) or not row[key].strip():
            raise InvalidInputError(f"{label}: {key!r} must be a text that is not empty.")
    replies, checks = row["replies"], row["checks"]
    if not is_list(replies, str) or not replies or not all(r.strip() for r in replies):
        raise InvalidInputError(f"{label}: 'replies' must be a list of texts, none empty.")
    if not is_list(checks, dict) or not checks:
        raise InvalidInputError(f"{label}: 'checks' must be a list of tables.")
    for number, check in enumerate(checks, 1):
        examine(check, f"{label}, check {number}")
    scene, welcome = row.get("scene", ""), row.get("welcome", [])
    if not is_list(welcome, str) or not all(each.strip() for each in welcome):
        raise InvalidInputError(f"{label}: 'welcome' must be a list of texts, none empty.")
    texts = (row["name"], row["description"])
    return Profile(*texts, tuple(replies), tuple(checks), scene, tuple(welcome))
