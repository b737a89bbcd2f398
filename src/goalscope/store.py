"""Episodes on disk: one SQLite file that a crash at any moment leaves whole."""

from __future__ import annotations

import difflib
import json
import os
import secrets
import sqlite3
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
import platformdirs

from goalscope.belief import Belief
from goalscope.calibration import calibration_from_json
from goalscope.episode import Round
from goalscope.types import (
    Action,
    Goal,
    GoalChange,
    GoalscopeError,
    InvalidInputError,
    StepResult,
    Turn,
)

__all__ = [
    "Ended",
    "EpisodeInfo",
    "Store",
    "default_store_path",
    "dumps",
    "explained",
    "round_from_json",
    "round_to_json",
]

Ended = Literal["terminated", "truncated"]

APPLICATION = 0x474F4144  # "GOAD": marks the file as an episode store
MIGRATIONS = (
    """
CREATE TABLE episodes (
    id TEXT PRIMARY KEY,
    created TEXT NOT NULL,
    domain TEXT NOT NULL,
    profile TEXT,
    method TEXT NOT NULL,
    model TEXT NOT NULL,
    task TEXT NOT NULL,
    settings TEXT NOT NULL,
    ended TEXT CHECK (ended IN ('terminated', 'truncated')),
    score REAL CHECK (score BETWEEN 0 AND 1)
) STRICT;
CREATE TABLE rounds (
    episode TEXT NOT NULL REFERENCES episodes (id),
    number INTEGER NOT NULL CHECK (number >= 1),
    json TEXT NOT NULL,
    PRIMARY KEY (episode, number)
) STRICT, WITHOUT ROWID
""",
    """
CREATE TABLE about (
    name TEXT PRIMARY KEY,
    value TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE cells (
    key TEXT PRIMARY KEY,
    spec TEXT NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 0,
    error TEXT,
    identity TEXT,
    result TEXT
) STRICT
""",
    """
UPDATE rounds SET json = json_set(
    json_remove(json, '$.belief.temperature', '$.belief.evidence'),
    '$.belief.calibration', json_object(
        'temperature', json_extract(json, '$.belief.temperature'), 'reference', 0.0,
        'unstated', NULL, 'switching', json_extract(json, '$.belief.evidence') = 'last', 'n', 0,
        'thresholds', json_array()
    ),
    '$.belief.pinned', json_array()
) WHERE CASE WHEN json_valid(json) THEN json_type(json, '$.belief.temperature') END IS NOT NULL;
UPDATE episodes SET settings = json_set(
    json_remove(settings, '$.temperature', '$.evidence'), '$.calibration', NULL
) WHERE CASE WHEN json_valid(settings) THEN json_type(settings, '$.temperature') END IS NOT NULL;
UPDATE cells SET result = json_set(result, '$.calibration', json_object(
    'temperature', 2.0, 'reference', 0.0, 'unstated', NULL, 'switching', 0.0, 'n', 0,
    'thresholds', json_array()
)) WHERE CASE WHEN json_valid(result) THEN json_type(result, '$.role-play') END IS NOT NULL
""",
    """
CREATE TABLE corrections (
    episode TEXT NOT NULL REFERENCES episodes (id),
    after INTEGER NOT NULL,
    json TEXT NOT NULL
) STRICT
""",
)
"""What each version added: the first made the tables, the second those of experiments, the third
made a calibration of the temperature and the kind of evidence, the fourth keeps what is said of the
goals between rounds."""
VERSION = len(MIGRATIONS)
ADVICE = {
    "SQLITE_FULL": "The disk is full: free some space.",
    "SQLITE_BUSY": "Another program is writing to it: close that one and try again.",
    "SQLITE_LOCKED": "Another program is writing to it: close that one and try again.",
    "SQLITE_READONLY": "It may not be written: name another file with --store.",
    "SQLITE_CANTOPEN": "It may not be opened: name another file with --store.",
    "SQLITE_CORRUPT": "It is damaged: move it away, and a new one is begun.",
    "SQLITE_NOTADB": "It is no SQLite file: name another one with --store.",
}


@dataclass(frozen=True, slots=True)
class EpisodeInfo:
    """What the store knows of an episode besides its rounds.

    Attributes:
        id: Short name; a prefix that fits no other episode finds it too.
        created: Start, in UTC, ISO 8601.
        domain: Name of the environment.
        profile: Name of the simulated person; None for a real one.
        method: Name of the method.
        model: Name or path of the language model.
        task: The environment's task.
        settings: The options that a resumed episode needs.
        ended: None while it can go on.
        score: Share of the profile's checks that were met, 0 to 1.
        rounds: Number of rounds stored.
    """

    id: str
    created: str
    domain: str
    profile: str | None
    method: str
    model: str
    task: str
    settings: Mapping[str, Any]
    ended: Ended | None
    score: float | None
    rounds: int


def default_store_path() -> Path:
    """$GOALSCOPE_STORE, or `episodes.db` in the user's data folder."""
    given = os.environ.get("GOALSCOPE_STORE")
    return Path(given) if given else platformdirs.user_data_path("goalscope", False) / "episodes.db"


class Store:
    """The episodes in one file. Every call that writes has reached the disk when it returns."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        """Use an open connection; `Store.open` is the usual way in."""
        self.path = path
        self._connection = connection

    @classmethod
    def open(cls, path: str | Path | None = None) -> Self:
        """Open the store, and create it if it is missing.

        Args:
            path: The file; None for `default_store_path()`.

        Raises:
            GoalscopeError: The file cannot be used, or a newer goalscope wrote it.
        """
        file = Path(path) if path is not None else default_store_path()
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise GoalscopeError(
                f"The folder of the episode store {file} cannot be made: {error.strerror}. "
                "Name another file with --store."
            ) from error
        with explained(file):
            connection = sqlite3.connect(file, timeout=10, isolation_level=None)
            try:
                _prepare(connection, file)
            except BaseException:
                connection.close()
                raise
        return cls(file, connection)

    def close(self) -> None:
        """Close the file; the store cannot be used afterwards."""
        self._connection.close()

    def __enter__(self) -> Self:
        """Return the store itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self.close()

    @contextmanager
    def transaction(self) -> Generator[None]:
        """All that is written inside reaches the disk together, or not at all."""
        with explained(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
            except BaseException:
                self._connection.execute("ROLLBACK")
                raise
            self._connection.execute("COMMIT")

    def begin(
        self,
        *,
        domain: str,
        method: str,
        model: str,
        task: str,
        profile: str | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> str:
        """Start an episode and return its id."""
        id = secrets.token_hex(4)
        created = datetime.now(UTC).isoformat(timespec="seconds")
        row = (id, created, domain, profile, method, model, task, dumps(dict(settings or {})))
        with explained(self.path):
            self._connection.execute(
                "INSERT INTO episodes (id, created, domain, profile, method, model, task, settings)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                [_utf8(value) for value in row],
            )
        return id

    def append(self, id: str, round: Round) -> None:
        """Store one finished round.

        Raises:
            GoalscopeError: The round cannot be written; all earlier ones are kept.
        """
        with explained(self.path):
            try:
                self._connection.execute(
                    "INSERT INTO rounds VALUES (?, ?, ?)", (id, round.number, round_to_json(round))
                )
            except sqlite3.IntegrityError as error:
                raise GoalscopeError(
                    f"Round {round.number} of episode {id} cannot be added: the episode has such a "
                    "round already (does it run in another window?) or is unknown."
                ) from error

    def correct(self, id: str, after: int, correction: Sequence[str]) -> None:
        """Store what the person says of the goals after so many rounds, before the next has it."""
        with explained(self.path):
            self._connection.execute(
                "INSERT INTO corrections VALUES (?, ?, ?)", (id, after, dumps(correction))
            )

    def corrections(self, id: str, after: int) -> list[list[Any]]:
        """Return what the person has said of the goals after so many rounds, in order."""
        with explained(self.path):
            rows = self._connection.execute(
                "SELECT json FROM corrections WHERE episode = ? AND after = ? ORDER BY rowid",
                (id, after),
            ).fetchall()
        return [json.loads(text) for (text,) in rows]

    def finish(self, id: str, *, ended: Ended, score: float | None = None) -> None:
        """Record how an episode ended, with its score (0 to 1) if it has a profile."""
        if score is not None and not 0 <= score <= 1:
            raise ValueError(f"score must lie between 0 and 1, not {score}")
        with explained(self.path):
            self._connection.execute(
                "UPDATE episodes SET ended = ?, score = ? WHERE id = ?", (ended, score, id)
            )

    def rounds(self, id: str) -> list[Round]:
        """Return an episode's rounds in order.

        Raises:
            InvalidInputError: No episode, or more than one, has an id that begins so.
        """
        info = self.episode(id)
        with explained(self.path):
            rows = self._connection.execute(
                "SELECT json FROM rounds WHERE episode = ? ORDER BY number", (info.id,)
            ).fetchall()
        try:
            return [round_from_json(text) for (text,) in rows]
        except (ValueError, LookupError, TypeError) as error:
            raise GoalscopeError(
                f"A round of episode {info.id} in {self.path} cannot be read: {error}"
            ) from error

    def episode(self, id: str) -> EpisodeInfo:
        """Return one episode, found by its id or by a prefix that fits no other.

        Raises:
            InvalidInputError: No episode, or more than one, has an id that begins so.
        """
        known = {info.id: info for info in self.episodes()}
        found = [each for each in known if id and each.startswith(id)]
        if len(found) == 1:
            return known[found[0]]
        near = found or difflib.get_close_matches(id, known, n=3, cutoff=0.5)
        hint = f" Did you mean {', '.join(near[:3])}?" if near else ""
        what = "More than one episode has an id that begins with" if found else "No episode is"
        raise InvalidInputError(f'{what} "{id}".{hint} `goalscope episodes` lists them all.')

    def episodes(self) -> list[EpisodeInfo]:
        """Return all episodes, oldest first."""
        with explained(self.path):
            rows = self._connection.execute(
                "SELECT id, created, domain, profile, method, model, task, settings, ended, score,"
                " (SELECT count(*) FROM rounds WHERE episode = id)"
                " FROM episodes ORDER BY created, rowid"
            ).fetchall()
        return [
            EpisodeInfo(
                *head, settings=json.loads(settings), ended=ended, score=score, rounds=rounds
            )
            for *head, settings, ended, score, rounds in rows
        ]


def round_to_json(round: Round) -> str:
    """Write a round as strict JSON in ASCII; -inf, which JSON lacks, as the string "-inf".

    Raises:
        GoalscopeError: A number is NaN or +inf.
    """
    belief = round.belief
    return dumps(
        {
            "number": round.number,
            "turn": asdict(round.turn),
            "belief": belief
            and {
                "goals": [goal.text for goal in belief.goals],
                "log_prior": _numbers(belief.log_prior.tolist()),
                "log_likelihood": [_numbers(row) for row in belief.log_likelihood.tolist()],
                "calibration": asdict(belief.calibration),
                "pinned": [[turns, goal.text] for turns, goal in belief.pinned],
            },
            "changes": [asdict(change) for change in round.changes],
            "results": [asdict(result) for result in round.results],
            "replans": round.replans,
            "status": round.status,
            "notes": list(round.notes),
            "terminated": round.terminated,
            "question": round.question,
            "state": round.state,
        }
    )


def round_from_json(text: str) -> Round:
    """Read what `round_to_json` wrote; the round is equal in every value."""
    data = json.loads(text)
    belief = data["belief"]
    if belief is not None:
        goals = tuple(Goal(goal) for goal in belief["goals"])
        table = np.array(belief["log_likelihood"], dtype=np.float64)
        belief = Belief(
            goals,
            np.array(belief["log_prior"], dtype=np.float64),
            table.reshape(len(belief["log_likelihood"]), len(goals)),
            calibration_from_json(belief["calibration"]),
            tuple((turns, Goal(text)) for turns, text in belief["pinned"]),
        )
    return Round(
        number=data["number"],
        turn=Turn(**data["turn"]),
        belief=belief,
        changes=tuple(
            GoalChange(
                change["kind"],
                Goal(**change["goal"]),
                change["reason"],
                final=change.get("final", change["reason"].startswith(("unsafe", "irrelevant"))),
            )
            for change in data["changes"]
        ),
        results=tuple(
            StepResult(
                Action(**result["action"]),
                result["ok"],
                result["observation"],
                result["terminated"],
                result.get("irreversible", False),
            )
            for result in data["results"]
        ),
        replans=data["replans"],
        status=data["status"],
        notes=tuple(data["notes"]),
        terminated=data["terminated"],
        question=data.get("question", ""),
        state=data.get("state", ""),
    )


def _numbers(values: list[float]) -> list[float | str]:
    """Write -inf as a string, which numpy reads back as the number."""
    return ["-inf" if value == -np.inf else value for value in values]


def dumps(value: object, *, sort_keys: bool = False) -> str:
    """Strict JSON; escapes keep a lone surrogate as it is.

    Raises:
        GoalscopeError: A number is NaN or infinite.
    """
    try:
        return json.dumps(value, allow_nan=False, sort_keys=sort_keys)
    except ValueError as error:
        raise GoalscopeError(f"This cannot be stored: {error}") from error


def _utf8(text: str | None) -> str | None:
    """Escape what SQLite cannot hold, such as the bytes of an undecodable file name."""
    return text and text.encode("utf-8", "backslashreplace").decode()


def _prepare(connection: sqlite3.Connection, file: Path) -> None:
    """Refuse another program's file as it is; else make every commit durable, and the tables."""
    _version(connection, file)
    (journal,) = connection.execute("PRAGMA journal_mode = WAL").fetchone()
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")
    (synchronous,) = connection.execute("PRAGMA synchronous").fetchone()
    if (journal, synchronous) != ("wal", 2):
        raise GoalscopeError(
            f"The episode store {file} would not survive a crash (journal {journal}, synchronous "
            f"{synchronous}). Name a file on a local disk with --store."
        )
    if _version(connection, file) < VERSION:
        connection.execute("BEGIN IMMEDIATE")  # of two processes that get here, one migrates
        for migration in MIGRATIONS[_version(connection, file) :]:
            for statement in migration.split(";"):
                connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {APPLICATION}")
        connection.execute(f"PRAGMA user_version = {VERSION}")
        connection.execute("COMMIT")


def _version(connection: sqlite3.Connection, file: Path) -> int:
    """Version of goalscope's tables in the file, 0 if it is empty; other files are refused."""
    application, version, tables = (
        connection.execute(statement).fetchone()[0]
        for statement in (
            "PRAGMA application_id",
            "PRAGMA user_version",
            "SELECT count(*) FROM sqlite_master",
        )
    )
    if not tables:
        return 0
    if application != APPLICATION:
        raise GoalscopeError(f"{file} is another program's file. Name one with --store.")
    if version > VERSION:
        raise GoalscopeError(
            f"The episode store {file} is of version {version}, and this goalscope reads up to "
            f"{VERSION}. Update goalscope, or name another file with --store."
        )
    return version


@contextmanager
def explained(file: Path) -> Generator[None]:
    """Turn SQLite's errors into one line that says what to do."""
    try:
        yield
    except sqlite3.Error as error:
        name = getattr(error, "sqlite_errorname", "")  # such as SQLITE_READONLY_DIRECTORY
        advice = ADVICE.get("_".join(name.split("_")[:2]), "Name another file with --store.")
        raise GoalscopeError(
            f"The episode store {file} cannot be used: {error}. {advice} "
            "What was stored earlier is kept."
        ) from error
