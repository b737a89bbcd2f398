"""TOML, JSON and CSV written by people and their programs, read into typed values.

An error names the file, the place in it, what was expected, what came, and the nearest known key.
"""

from __future__ import annotations

import csv
import difflib
import io
import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path
from reprlib import Repr
from types import GenericAlias
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

from goalscope.base.types import InvalidInputError, Profile, pluralize

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from pydantic_core import ErrorDetails

T = TypeVar("T")

_REPR = Repr()
_REPR.maxstring = _REPR.maxother = 80

_MISSPELT = 0.75  # likeness of "trew" and "true"
_UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")
_MISSING_KEY = ("missing", "missing_argument")
_MUST_BE = {
    "dataclass_type": "a table of keys",
    "dict_type": "a table of keys",
    "model_type": "a table of keys",
    "list_type": "a list",
    "tuple_type": "a list",
    "string_type": "a text",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "predicate_failed": "a text that is not blank",
}
"""What an error of pydantic's is about, in the words of the people who write the files."""


def shown(value: object) -> str:
    """`value` on one short line, without control characters, for a message."""
    try:
        return _REPR.repr(value)
    except ValueError:
        return "a number of thousands of digits"


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint that names the known word most like `word`, or else some of those known."""
    known = list(known)
    alike = difflib.get_close_matches(word[:80], known, 1)
    if alike:
        return f"did you mean {alike[0]!r}?"
    more = ", ..." if len(known) > 20 else "."
    return f"known are {', '.join(known[:20])}{more}"


def _text(source: Path | Traversable, label: str, kind: str) -> str:
    """The text of a file in UTF-8 that is to be of a kind."""
    try:
        return source.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise InvalidInputError(
            f"{label} is not UTF-8: byte {error.object[error.start]:#04x} in line {line}. Save the "
            "file as UTF-8."
        ) from None
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise InvalidInputError(
            f"{label} is not readable: {cause}. Give the path of a {kind} file."
        ) from None


def read_table(source: Path | Traversable) -> dict[str, Any]:
    """Read a TOML file in UTF-8.

    Raises:
        InvalidInputError: The file cannot be read, or is not TOML.
    """
    text = _text(source, str(source), "TOML")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        cause = str(error)
        cause = cause if len(cause) < 200 and cause.isprintable() else shown(cause)
        raise InvalidInputError(f"{source} is not valid TOML: {cause}.") from None


def read_toml(source: Path | Traversable, kind: type[T]) -> T:
    """Read a TOML file as a `kind`, see `validated`.

    Raises:
        InvalidInputError: The file cannot be read, is not TOML, or is not of this kind.
    """
    return validated(read_table(source), kind, source.name)


def validated(data: object, kind: type[T], label: str, *, ignore_extra: bool = False) -> T:
    """The values of TOML or JSON as a `kind`: a dataclass, a pydantic model, a tuple of such.

    Lists become tuples and tables become classes; nothing else is converted, and no key may be
    unknown. Limits stand in the annotations, such as `Annotated[int, annotated_types.Ge(1)]`. A
    `ValueError` of a `__post_init__` or a validator is reported with its place.

    Args:
        data: What was parsed from the file.
        kind: What to make of it.
        label: What errors call the data, such as the name of the file.
        ignore_extra: Whether to pass over unknown keys, but for what looks like a misspelt one.

    Raises:
        InvalidInputError: The data is not of this kind.
    """
    from pydantic import ValidationError

    adapter = _adapter(kind)
    try:
        text = json.dumps([data], default=str)  # TOML has dates
        try:
            return adapter.validate_json(text, strict=True)[0]
        except ValidationError as error:
            faults = error.errors(include_url=False)
        schema = _schema(kind)
        placed = [(fault, _place(fault, data, schema, label)) for fault in faults]
        placed = [pair for pair in placed if not (ignore_extra and _is_more(*pair))]
        if not placed:
            return adapter.validate_json(text, strict=True, extra="ignore")[0]
    except (ValueError, RecursionError):
        raise InvalidInputError(
            f"{label}: it is nested too deeply, or has too long a number."
        ) from None
    raise InvalidInputError(_message(placed))


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter

    # Only from outside does a configuration reach a plain dataclass: hence the tuple.
    alone: Any = GenericAlias(tuple, (kind,))
    return TypeAdapter[Any](alone, config={"extra": "forbid", "allow_inf_nan": False})


@cache
def _schema(kind: Any) -> Mapping[str, Any]:
    return _adapter(kind).json_schema()


class _Place(NamedTuple):
    """A place in the data: a table or list, a key in it or "", and the value with its schemas."""

    table: str
    key: str
    value: Any
    schemas: Sequence[Mapping[str, Any]]
    depth: int

    def __str__(self) -> str:
        return f"{self.table}, {self.key}" if self.key else self.table

    @property
    def known(self) -> list[Any]:
        """The keys that a table may have here, or the values that there may be."""
        return [
            name
            for one in self.schemas
            for name in (*one.get("properties", ()), *_choices(one.get("propertyNames", one)))
        ]


def _is_more(error: ErrorDetails, place: _Place) -> bool:
    """Whether a key is merely unknown, and not one misspelt that the table lacks."""
    if error["type"] not in _UNKNOWN_KEY:
        return False
    lacking = [key for key in place.known if key not in place.value]
    return not difflib.get_close_matches(str(error["loc"][-1]).casefold(), lacking, 1, _MISSPELT)


def _message(errors: Sequence[tuple[ErrorDetails, _Place]]) -> str:
    """One sentence on the error that says most: on an unknown key, or else the innermost."""
    first, place = max(errors, key=lambda pair: (_has_unknown_key(pair[0]), pair[1].depth))
    kind, value, loc, known = first["type"], shown(first["input"]), first["loc"], place.known
    if kind == "json_invalid":
        return f"{place}: {first['msg'].removeprefix('Invalid JSON: ')}."
    if kind in _MISSING_KEY:
        return f"{place}: the key {loc[-1]!r} is missing."
    if _has_unknown_key(first):
        key = str(loc[-2] if loc[-1] == "[key]" else loc[-1])
        return f"{place}: the key {shown(key)} is unknown; {nearest(key, known)}"
    same = [one for one, at in errors if at == place]
    if all(one["type"] == "literal_error" for one in same):
        return f"{place}: {value} is unknown; {nearest(str(first['input']), known)}"
    if kind == "value_error":
        return f"{place}: {first.get('ctx', {})['error']}"
    subject = f"{place.table}: {place.key!r}" if place.key else place.table
    kinds = [
        _MUST_BE.get(one["type"]) or one.get("ctx", {})["expected"]
        for one in same
        if one["type"] in (*_MUST_BE, "literal_error")
    ]
    if kind in (*_MUST_BE, "literal_error"):
        return f"{subject} must be {' or '.join(dict.fromkeys(kinds))}, not {value}."
    text = re.sub(r"^\w+ should", "must", first["msg"]).replace(" after validation", "")
    text = text.replace("greater than or equal to", "at least")
    text = text.replace("less than or equal to", "at most")
    return f"{subject} {text}{'' if ', not ' in text else f', not {value}'}."


def _has_unknown_key(error: ErrorDetails) -> bool:
    return error["type"] in _UNKNOWN_KEY or "[key]" in error["loc"][-1:]


def _choices(schema: Mapping[str, Any]) -> Sequence[Any]:
    return schema.get("enum") or ([schema["const"]] if "const" in schema else [])


def _place(error: ErrorDetails, data: Any, schema: Mapping[str, Any], label: str) -> _Place:
    """Where an error is; the names of a union's members in its location are passed over."""
    path, key, depth = error["loc"][1:], "", 0
    if _has_unknown_key(error) or error["type"] in _MISSING_KEY:
        path = path[: -2 if path[-1] == "[key]" else -1]
    schemas = [*_resolved(schema["prefixItems"][0], schema)]
    for part in path:
        if isinstance(data, dict) and part in data:
            label, key = f"{label}, {key}" if key else label, str(part)
            data = cast("dict[str, Any]", data)[key]
            others = [one.get("additionalProperties") for one in schemas]
            inner = [one.get("properties", {}).get(key) for one in schemas] + others
        elif isinstance(data, list) and isinstance(part, int):
            data = cast("list[Any]", data)[part]
            label, key = f"{label}, {key or 'entry'} {part + 1}", ""
            name = cast("dict[str, Any]", data).get("name") if isinstance(data, dict) else None
            label = f"{label} {shown(name)}" if isinstance(name, str) else label
            inner = [one.get("items") for one in schemas]
        else:
            continue
        depth += 1
        schemas = [one for node in inner for one in _resolved(node, schema)]
    return _Place(label, key, data, schemas, depth)


def _resolved(node: Any, schema: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """The members of a JSON schema that is a union, and what its references refer to."""
    if not isinstance(node, dict):
        return
    node = cast("dict[str, Any]", node)
    if "$ref" in node:
        node = schema["$defs"][node["$ref"].rpartition("/")[2]]
    for member in node.get("anyOf", ()):
        yield from _resolved(member, schema)
    yield node


def read_csv(source: Path | Traversable, label: str) -> Iterator[list[str]]:
    """The rows of a CSV file in UTF-8, without blank ones; the first has the headings.

    Cells end with the comma, semicolon or tab that the first line has most of.

    Args:
        source: The file.
        label: What errors call it, such as "The catalogue shop.csv".

    Raises:
        InvalidInputError: The file cannot be read or is no text in UTF-8, a quotation mark is not
            closed or stands alone in a quoted cell, or a row has more cells than there are columns;
            the message names the line.
    """
    text = _text(source, label, "CSV")
    if "\0" in text:
        raise InvalidInputError(
            f"{label} has NUL bytes: it is no text file, or is UTF-16. Save it as CSV in UTF-8."
        )
    separator = max(",;\t", key=text.partition("\n")[0].count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    line, columns = 1, 0
    try:
        for row in reader:
            columns = columns or len(row)
            if any(row[columns:]) or (line < reader.line_num and 0 < len(row) < columns):
                raise csv.Error(f"{pluralize(len(row), 'cell')} for {pluralize(columns, 'column')}")
            if any(map(str.strip, row)):
                yield row
            line = reader.line_num + 1
    except csv.Error as error:
        raise InvalidInputError(
            f"{label} is not valid CSV in the row that begins in line {line}: {error}. Look for a "
            "separator in a cell without quotation marks, a quotation mark that is not closed or, "
            "within a cell, not doubled, or a very long cell."
        ) from None


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
    table = dict(pairs)
    if len(table) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise RepeatedKeyError(f"the key {shown(twice)} stands there twice. Remove one of them.")
    return table


@dataclass(frozen=True, slots=True)
class _Profiles:
    profile: tuple[Profile, ...]


def read_profiles(
    source: Path | Traversable, checks: Any = Mapping[str, Any], *, scenes: bool = False
) -> tuple[Profile, ...]:
    """Read the tables `[[profile]]` of a TOML file.

    Args:
        source: The file.
        checks: The type of a check, such as `dict[Literal["has"], list[str]]`; see `validated`.
        scenes: Whether each profile names a `scene`.

    Raises:
        InvalidInputError: The file cannot be read, or a profile is not of this form; the message
            names the file, the profile, the key, and the nearest key that is known.
    """
    profiles = read_toml(source, _Profiles).profile
    if not profiles:
        raise InvalidInputError(f"{source.name}: there is no [[profile]] table. Add at least one.")
    names = [profile.name for profile in profiles]
    for n, profile in enumerate(profiles, 1):
        label = f"{source.name}, profile {n} {shown(profile.name)}"
        if names.index(profile.name) < n - 1:
            raise InvalidInputError(f"{label}: another profile has the same name. Rename one.")
        needed = ("name", "description", "replies", "checks", *(("scene",) if scenes else ()))
        for key in needed:
            if not getattr(profile, key):
                raise InvalidInputError(f"{label}: {key!r} is missing or empty.")
        if not scenes and profile.scene:
            raise InvalidInputError(f"{label}: the key 'scene' is unknown here. Leave it out.")
        texts = (profile.name, profile.description, *profile.replies, *profile.welcome)
        if not all(text.strip() for text in texts):
            raise InvalidInputError(f"{label}: a text is blank.")
        for number, check in enumerate(profile.checks, 1):
            validated(check, checks, f"{label}, check {number}")
    return profiles
