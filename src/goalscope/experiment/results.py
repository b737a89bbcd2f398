"""Results of experiments by cell, in the same kind of database as episodes."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from sqlalchemy import Connection, select

from goalscope.base.types import InvalidInputError
from goalscope.storage.store import Store, dumps, new_episode, round_from_json, round_row
from goalscope.storage.tables import ABOUT, CELLS, EPISODES, ROUNDS


@dataclass(frozen=True, slots=True)
class Cell:
    """The smallest piece of an experiment, measured exactly once.

    Attributes:
        key: Hash of the spec.
        spec: Everything needed to measure it, as JSON; `kind` is its kind.
        attempts: Attempts that ended in a result or an error. Interrupted attempts, and those whose
            process died, do not count.
        error: Why the last attempt failed; None if it did not.
        identity: What it was measured with; None before it is measured.
        result: The measurement, as JSON; None before it is measured.
    """

    key: str
    spec: Mapping[str, Any]
    attempts: int = 0
    error: str | None = None
    identity: Mapping[str, str] | None = None
    result: Mapping[str, Any] | None = None


def cell_key(spec: Mapping[str, Any]) -> str:
    """The key of a spec; equal specs have equal keys in any order of their entries."""
    return hashlib.sha256(dumps(spec, sort_keys=True).encode()).hexdigest()[:16]


class Results(Store):
    """The cells of one experiment, and their episodes."""

    @property
    def about(self) -> dict[str, Any]:
        """Facts about the experiment: name, title, source, provenance and plans."""
        with self.reading() as connection:
            return {row.name: json.loads(row.value) for row in connection.execute(select(ABOUT))}

    def describe(self, facts: Mapping[str, Any]) -> None:
        """Store facts about the experiment, replacing earlier ones of the same name."""
        with self.writing() as connection:
            for name, value in facts.items():
                text = dumps(value)
                earlier = ABOUT.update().where(ABOUT.c.name == name).values(value=text)
                if not connection.execute(earlier).rowcount:
                    connection.execute(ABOUT.insert(), {"name": name, "value": text})

    def check(self, identity: Mapping[str, str]) -> None:
        """Refuse to continue if cells were measured with other code, prompts or weights.

        Args:
            identity: What the next cells will be measured with; see `identity_of`.

        Raises:
            InvalidInputError: Something differs; the message names it.
        """
        done = [cell.identity for cell in self.cells() if cell.identity]
        changed = [
            name
            for name, value in identity.items()
            if any(d.get(name, value) != value for d in done)
        ]
        if changed:
            raise InvalidInputError(
                f"{self.place} has results from another {' and another '.join(changed)}. Name "
                "another folder with --results, or use --anyway to mix them with new ones."
            )

    def plan(self, specs: Iterable[Mapping[str, Any]]) -> list[Cell]:
        """The cells of these specs; new ones are added."""
        keys = {cell_key(spec): spec for spec in specs}
        with self.writing() as connection:
            known = set(connection.scalars(select(CELLS.c.key)))
            if new := [key for key in keys if key not in known]:
                rows = [{"key": key, "spec": dumps(keys[key])} for key in new]
                connection.execute(CELLS.insert(), rows)
        return self.planned(keys.values())

    def planned(self, specs: Iterable[Mapping[str, Any]]) -> list[Cell]:
        """The existing cells of these specs, without duplicates, in the order of the specs."""
        found = {cell.key: cell for cell in self.cells()}
        keys = dict.fromkeys(map(cell_key, specs))
        return [found[key] for key in keys if key in found]

    def cells(self) -> list[Cell]:
        """All cells, in the order in which they were planned."""
        query = select(CELLS).order_by(CELLS.c.number)
        with self.reading() as connection:
            return [
                Cell(
                    row.key,
                    json.loads(row.spec),
                    row.attempts,
                    row.error,
                    json.loads(row.identity or "null"),
                    json.loads(row.result or "null"),
                )
                for row in connection.execute(query)
            ]

    def ask_for(self, cells: Iterable[Cell], command: str = "") -> None:
        """Record these cells as the latest plan with their settings.

        Args:
            cells: All cells of the plan.
            command: The command line that planned them.
        """
        asked: dict[str, dict[str, Any]] = {}
        for cell in cells:
            subject = dumps(_subject(cell.spec), sort_keys=True)
            asked.setdefault(subject, {"command": command, "keys": []})["keys"].append(cell.key)
        self.describe({"asked": {**self.about.get("asked", {}), **asked}})

    def asked_for(self) -> list[Cell]:
        """The cells of the latest plan with each setting.

        Cells that a later plan with the same settings leaves out are excluded, such as those of
        people edited since, or beyond a limit.
        """
        plans = self.about.get("asked", {}).values()
        asked = {key for plan in plans for key in plan["keys"]}
        return [cell for cell in self.cells() if cell.key in asked]

    def commands(self, cells: Iterable[Cell]) -> list[str]:
        """The command lines that planned these cells, without duplicates."""
        keys = {cell.key for cell in cells}
        plans = self.about.get("asked", {}).values()
        found = [plan["command"] for plan in plans if keys & set(plan["keys"])]
        return [command for command in dict.fromkeys(found) if command]

    def keep(self, key: str, result: Mapping[str, Any], identity: Mapping[str, str]) -> None:
        """Store the result of a cell, with its episode if there is one, in one transaction.

        A cell that has a result keeps it.

        Args:
            key: Of the cell.
            result: The measurement. An `episode` in it, see `measure`, becomes an episode of this
                store and is replaced by its id.
            identity: What it was measured with.
        """
        row = CELLS.c
        with self.writing() as connection:
            empty = select(row.key).where(row.key == key, row.result.is_(None))
            if connection.scalar(empty.with_for_update()) is None:
                return
            if "episode" in result:
                result = {**result, "episode": _adopted(connection, result["episode"])}
            values = {
                "result": dumps(result),
                "identity": dumps(identity),
                "error": None,
                "attempts": row.attempts + 1,
            }
            connection.execute(CELLS.update().where(row.key == key).values(values))

    def fail(self, key: str, error: str) -> None:
        """Store why an attempt at a cell failed."""
        with self.writing() as connection:
            values = {"error": error, "attempts": CELLS.c.attempts + 1}
            connection.execute(CELLS.update().where(CELLS.c.key == key).values(values))


def _adopted(connection: Connection, episode: Mapping[str, Any]) -> str:
    row = new_episode(**episode["begin"])
    row |= {"ended": episode["ended"], "score": episode["score"]}
    connection.execute(EPISODES.insert(), row)
    for each in map(round_from_json, episode["rounds"]):
        connection.execute(ROUNDS.insert(), round_row(row["id"], each))
    return row["id"]


def _subject(spec: Mapping[str, Any]) -> Any:
    """What a plan measures as a whole: episodes of a model in a domain, or all but the row."""
    if spec["kind"] == "judge":
        return _subject(spec["of"])
    if spec["kind"] == "episode":
        return [spec["model"], spec["settings"]["domain"]]
    return {key: value for key, value in spec.items() if key not in ("row", "case")}


@contextmanager
def sole(file: Path) -> Generator[None]:
    """Lock a file of results or beliefs against other writers.

    Raises:
        InvalidInputError: Another process holds the lock.
    """
    lock = FileLock(f"{os.path.realpath(file)}.lock")  # by whatever name each process calls it
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InvalidInputError(
            f"Another process is writing to {file}. Wait for it to finish, or stop it."
        ) from None
    try:
        yield
    finally:
        lock.release()
