"""What experiments measured, cell by cell, in the same kind of file as episodes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from goalscope.store import Ended, Store, dumps, explained, round_from_json
from goalscope.types import InvalidInputError

__all__ = ["Cell", "Results", "cell_key"]


@dataclass(frozen=True, slots=True)
class Cell:
    """The smallest piece of an experiment, measured exactly once.

    Attributes:
        key: Hash of the spec.
        spec: All that is needed to measure it, as JSON; `kind` says what it is.
        attempts: How often it was begun.
        error: Why the last attempt failed; None while nothing has.
        identity: What it was measured with; None until then.
        result: What was measured, as JSON; None until then.
    """

    key: str
    spec: Mapping[str, Any]
    attempts: int = 0
    error: str | None = None
    identity: Mapping[str, str] | None = None
    result: Mapping[str, Any] | None = None


def cell_key(spec: Mapping[str, Any]) -> str:
    """The key of a spec: equal specs have equal keys, whatever the order of their entries."""
    return hashlib.sha256(dumps(spec, sort_keys=True).encode()).hexdigest()[:16]


class Results(Store):
    """The cells of one experiment, and the episodes that were run for them."""

    @property
    def about(self) -> dict[str, Any]:
        """What the experiment says of itself: name, title, source, and what was asked for."""
        with explained(self.path):
            rows = self._connection.execute("SELECT name, value FROM about").fetchall()
        return {name: json.loads(value) for name, value in rows}

    def describe(self, facts: Mapping[str, Any]) -> None:
        """Keep facts of the experiment, each in the place of an earlier one of its name."""
        with self.transaction():
            self._connection.executemany(
                "INSERT OR REPLACE INTO about VALUES (?, ?)",
                [(name, dumps(value)) for name, value in facts.items()],
            )

    def check(self, identity: Mapping[str, str]) -> None:
        """Refuse to go on where cells were measured with something else.

        Args:
            identity: What the next cells will be measured with; see `identity_of`.

        Raises:
            InvalidInputError: Another code, other prompts, or other weights of the same model.
        """
        done = [cell.identity for cell in self.cells() if cell.identity]
        changed = [
            name
            for name, value in identity.items()
            if any(d.get(name, value) != value for d in done)
        ]
        if changed:
            raise InvalidInputError(
                f"{self.path} holds results of another {' and another '.join(changed)}. Name "
                "another folder with --results, or say --anyway to keep them beside new ones."
            )

    def plan(self, specs: Iterable[Mapping[str, Any]]) -> list[Cell]:
        """The cells of these specs, as far as they are; those that are new are noted."""
        keys = {cell_key(spec): spec for spec in specs}
        with self.transaction():
            self._connection.executemany(
                "INSERT OR IGNORE INTO cells (key, spec) VALUES (?, ?)",
                [(key, dumps(spec)) for key, spec in keys.items()],
            )
        return self.planned(keys.values())

    def planned(self, specs: Iterable[Mapping[str, Any]]) -> list[Cell]:
        """The cells of these specs that are there, each once, in the order of the specs."""
        found = {cell.key: cell for cell in self.cells()}
        keys = dict.fromkeys(map(cell_key, specs))
        return [found[key] for key in keys if key in found]

    def cells(self) -> list[Cell]:
        """All cells, in the order in which they were planned."""
        with explained(self.path):
            rows = self._connection.execute(
                "SELECT key, spec, attempts, error, identity, result FROM cells ORDER BY rowid"
            ).fetchall()
        return [
            Cell(
                key,
                json.loads(spec),
                attempts,
                error,
                identity and json.loads(identity),
                result and json.loads(result),
            )
            for key, spec, attempts, error, identity, result in rows
        ]

    def ask_for(self, cells: Iterable[Cell], command: str = "") -> None:
        """Note that these are the cells of the newest plan with their settings.

        Args:
            cells: That were planned.
            command: What a person said to have them measured.
        """
        asked: dict[str, dict[str, Any]] = {}
        for cell in cells:
            subject = dumps(_subject(cell.spec), sort_keys=True)
            asked.setdefault(subject, {"command": command, "keys": []})["keys"].append(cell.key)
        self.describe({"asked": {**self.about.get("asked", {}), **asked}})

    def asked_for(self) -> list[Cell]:
        """The cells of the newest plan with each setting.

        Cells that a later plan with the same settings leaves out are passed over: those of people
        who have been edited since, or beyond a limit.
        """
        plans = self.about.get("asked", {}).values()
        asked = {key for plan in plans for key in plan["keys"]}
        return [cell for cell in self.cells() if cell.key in asked]

    def commands(self, cells: Iterable[Cell]) -> list[str]:
        """The commands that asked for these cells, each once."""
        keys = {cell.key for cell in cells}
        plans = self.about.get("asked", {}).values()
        found = [plan["command"] for plan in plans if keys & set(plan["keys"])]
        return [command for command in dict.fromkeys(found) if command]

    def begin_cell(self, key: str, attempts: int = 1) -> None:
        """Note that a cell is begun, or was begun so many times; a kill leaves this behind."""
        with self.transaction():
            self._connection.execute(
                "UPDATE cells SET attempts = attempts + ? WHERE key = ?", (attempts, key)
            )

    def keep(self, key: str, result: Mapping[str, Any], identity: Mapping[str, str]) -> None:
        """Store a cell's result, and its episode if it is one, together or not at all.

        A cell that has a result keeps it.

        Args:
            key: Of the cell.
            result: What was measured. An `episode` in it, as `goalscope.experiment.work` makes it,
                becomes an episode of this store, and its id stands in its place.
            identity: What it was measured with.
        """
        with self.transaction():
            row = self._connection.execute(
                "SELECT result IS NULL FROM cells WHERE key = ?", (key,)
            ).fetchone()
            if row != (1,):
                return
            if "episode" in result:
                result = {**result, "episode": self._adopt(result["episode"])}
            self._connection.execute(
                "UPDATE cells SET result = ?, identity = ?, error = NULL WHERE key = ?",
                (dumps(result), dumps(identity), key),
            )

    def fail(self, key: str, error: str) -> None:
        """Note why an attempt at a cell failed."""
        error = error.encode(
            "utf-8", "backslashreplace"
        ).decode()  # SQLite holds no half characters
        with self.transaction():
            self._connection.execute("UPDATE cells SET error = ? WHERE key = ?", (error, key))

    def _adopt(self, episode: Mapping[str, Any]) -> str:
        ended: Ended = episode["ended"]
        id = self.begin(**episode["begin"])
        for text in episode["rounds"]:
            self.append(id, round_from_json(text))
        self.finish(id, ended=ended, score=episode["score"])
        return id


def _subject(spec: Mapping[str, Any]) -> Any:
    """What a plan measures as a whole: of episodes a model in a domain, else all but the row."""
    if spec["kind"] in ("judge", "compare"):
        return _subject(spec["of"] if spec["kind"] == "judge" else spec["of"][0])
    if spec["kind"] == "episode":
        return [spec["model"], spec["settings"]["domain"]]
    return {key: value for key, value in spec.items() if key not in ("row", "case")}
