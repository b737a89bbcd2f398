"""Files of JSON objects, read row by row; what is broken is refused with its place."""

from __future__ import annotations

import gzip
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from goalscope.base.inputs import RepeatedKeyError, parse_json, shown
from goalscope.base.types import InvalidInputError, checked_text

LARGEST_FILE = 1 << 30  # bytes, unpacked
LONGEST_LINE = 1 << 26  # bytes


@dataclass(frozen=True, slots=True)
class Row:
    """A JSON object of a file; every reading of it checks what it reads.

    Attributes:
        label: The file and the place in it, such as "val.json.zip, dialogue 'PMUL1635'".
        values: What stands there.
    """

    label: str
    values: Mapping[str, Any]

    def text(self, key: str, *, empty: bool = False) -> str:
        """The text under `key`, without whitespace around it; `""` only where it may be empty."""
        value = self._need(key, str, "a text")
        if empty and not value.strip():
            return ""
        return self._checked(value, key)

    def entries(self, key: str) -> list[object]:
        """The list under `key`."""
        return self._need(key, list, "a list")

    def texts(self, key: str) -> list[str]:
        """The list of texts under `key`, without blank ones."""
        values = self._need(key, list, "a list of texts")
        if not all(isinstance(value, str) for value in values):
            raise InvalidInputError(f"{self.label}: {key!r} must be a list of texts.")
        return [self._checked(value, key) for value in values if value.strip()]

    def row(self, key: str) -> Row:
        """The object under `key`."""
        return Row(f"{self.label}, {shown(key)}", self._need(key, dict, "an object"))

    def rows(self, key: str) -> list[Row]:
        """The objects in the list under `key`."""
        found: list[Row] = []
        for number, value in enumerate(self._need(key, list, "a list of objects"), 1):
            label = f"{self.label}, {key!r} number {number}"
            if not isinstance(value, dict):
                raise InvalidInputError(f"{label} must be an object, not {shown(value)}.")
            found.append(Row(label, cast("dict[str, Any]", value)))
        return found

    def _need(self, key: str, kind: type, what: str) -> Any:
        if key not in self.values:
            raise InvalidInputError(f"{self.label}: the key {shown(key)} is missing.")
        value = self.values[key]
        if not isinstance(value, kind):
            raise InvalidInputError(
                f"{self.label}: {shown(key)} must be {what}, not {shown(value)}."
            )
        return value

    def _checked(self, text: str, key: str) -> str:
        try:
            return checked_text(text, f"text under {key!r}")
        except InvalidInputError as error:
            raise InvalidInputError(f"{self.label}: {error}") from None


def line_rows(file: Path, hint: str = "Download it again.") -> Iterator[Row]:
    """The objects of a JSON Lines file, packed with gzip if its name ends in `.gz`.

    Blank lines are passed over.

    Args:
        file: In UTF-8.
        hint: What to do if it is no such file.

    Raises:
        InvalidInputError: The file cannot be read or unpacked, or a line is no JSON object; names
            the line.
    """
    number = 0
    try:
        with gzip.open(file) if file.suffix == ".gz" else file.open("rb") as lines:
            while line := lines.readline(LONGEST_LINE):
                number += 1
                label = f"{file}, line {number}"
                if len(line) == LONGEST_LINE:
                    raise InvalidInputError(f"{label}: longer than {LONGEST_LINE} bytes.")
                if line.strip():
                    text = line.decode("utf-8-sig")
                    yield Row(label, _object(_parsed(text, label, hint), label, hint))
    except UnicodeDecodeError:
        raise InvalidInputError(
            f"{file}, line {number}: not UTF-8. Save the file as UTF-8, not compressed. {hint}"
        ) from None
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise InvalidInputError(
            f"{file} cannot be read after line {number}: {error}. {hint}"
        ) from None


def json_rows(file: Path, *, member: str | None = None) -> Iterator[Row]:
    """The objects of a file that is one JSON list, or one JSON object of named objects.

    Args:
        file: JSON, or a zip archive where `member` is given.
        member: The JSON file within the archive.

    Raises:
        InvalidInputError: The file cannot be read or unpacked, or is not of that form.
    """
    try:
        with ExitStack() as opened:
            archive = opened.enter_context(zipfile.ZipFile(file)) if member else None
            source = archive.open(member) if archive and member else file.open("rb")
            data = opened.enter_context(source).read(LARGEST_FILE + 1)
        if len(data) > LARGEST_FILE:
            raise InvalidInputError(f"{file} holds more than {LARGEST_FILE} bytes.")
    except KeyError:
        raise InvalidInputError(f"{file} holds no {member}. Download it again.") from None
    except (OSError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise InvalidInputError(f"{file} cannot be read: {error}. Download it again.") from None
    found = _parsed(data, str(file))
    if isinstance(found, list):
        named = enumerate(cast("list[object]", found), 1)
    elif isinstance(found, dict):
        named = cast("dict[str, object]", found).items()
    else:
        raise InvalidInputError(f"{file} must be a JSON list or object, not {shown(found)}.")
    for name, value in named:
        label = f"{file}, dialogue {shown(name)}"
        yield Row(label, {**_object(value, label), "id": str(name)})


def _parsed(
    text: str | bytes,
    label: str,
    hint: str = "Download the file again.",
) -> object:
    try:
        return parse_json(text)
    except RepeatedKeyError as error:
        raise InvalidInputError(f"{label}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"{label}: not JSON: {error}. {hint}".strip()) from None


def _object(value: object, label: str, hint: str = "") -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InvalidInputError(
            f"{label}: expected a JSON object, got {shown(value)}. {hint}".strip()
        )
    return cast("dict[str, Any]", value)
