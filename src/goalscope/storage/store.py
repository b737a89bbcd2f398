"""Stores episodes in a database; a crash at any moment loses nothing that was stored."""

from __future__ import annotations

import difflib
import json
import secrets
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import Any, Literal, Self, TypeVar

from sqlalchemy import ColumnElement, Connection, Engine, Row, Select, func, or_, select
from sqlalchemy.exc import IntegrityError

from goalscope.agent.round import Guess, Round
from goalscope.base.text import command_line
from goalscope.base.types import (
    Action,
    ConflictError,
    Goal,
    GoalChange,
    GoalscopeError,
    InvalidInputError,
    StepResult,
    Turn,
)
from goalscope.belief.belief import belief_from_json, belief_to_json
from goalscope.language.orders import Order, Reading, order_from_json, order_to_json
from goalscope.storage import opening
from goalscope.storage.tables import CORRECTIONS, EPISODES, ROUNDS, EscapedText

T = TypeVar("T")

Ended = Literal["terminated", "truncated"]
"""How an episode ended: task complete, or out of rounds."""

_WORDS = 120
"""Most characters of `EpisodeInfo.first_words`."""

_BEGINNING = 2000
"""Characters of the first utterance that are read for them."""

_CHANGED = "Episode {} was changed elsewhere (in another window?). Try again."


@dataclass(frozen=True, slots=True)
class EpisodeInfo:
    """An episode without its rounds.

    Attributes:
        id: Short name; a unique prefix finds the episode, too.
        created: Start, in UTC, ISO 8601.
        domain: Name of the environment.
        profile: Name of the simulated person; None for a real one.
        method: Name of the method.
        model: Name or path of the language model.
        task: The environment's task.
        settings: The options that a resumed episode needs.
        ended: None while it runs.
        score: See `goalscope.envs.Outcome`, 0 to 1; None without a profile.
        rounds: Number of rounds stored.
        first_words: What the person said first, on one line of at most 120 characters; "" as long
            as they have said nothing.
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
    first_words: str = ""

    @property
    def ending(self) -> str:
        """The ending in words: "done", "out of rounds" or "not ended"."""
        return {None: "not ended", "terminated": "done", "truncated": "out of rounds"}[self.ended]


class Store:
    """The episodes in one database. What a call writes is durable when it returns.

    Threads may share a store; each call uses its own connection.

    Attributes:
        place: The file, or the address without its password.
    """

    def __init__(self, place: str, engine: Engine, given: str | Path | None = None) -> None:
        """Wrap a database that is ready, as it was given; see `Store.open`."""
        self.place, self._given = place, given
        self._engine = engine
        self._writing = engine.execution_options(**opening.WRITING)
        # Writers of SQLite poll for the lock, and one of many may never get it: threads queue here.
        self._turn = Lock() if engine.dialect.name == "sqlite" else nullcontext()

    @classmethod
    def open(cls, place: str | Path | None = None, *, new: bool = True) -> Self:
        """Open the store; a new one is created.

        Args:
            place: A SQLite file or postgresql://USER:PASSWORD@HOST/DATABASE; None for
                $GOALSCOPE_STORE, or else `episodes.db` in the user's data folder.
            new: Whether a missing file may be created.

        Raises:
            InvalidInputError: The file is missing, and none may be created.
            GoalscopeError: It cannot be used, or another version of goalscope made it.
        """
        if not (new or place is None or "://" in str(place) or Path(place).exists()):
            raise InvalidInputError(f"There is no store at {place}. Check the path.")
        named = opening.default_place() if place is None else place
        relative = not ("://" in str(named) or Path(named).is_absolute())
        return cls(*opening.opened(named), named if relative else place)

    @classmethod
    def in_memory(cls, copied: Path | None = None) -> Self:
        """A store of this process alone, which leaves nothing on the disk.

        Args:
            copied: A file that it begins as a copy of, as that is now, even while another process
                writes to it.

        Raises:
            GoalscopeError: The file cannot be read, or a newer goalscope made it.
        """
        return cls(*opening.opened_in_memory(copied))

    def command(self, *words: object) -> str:
        """A command line to be pasted, which is over this store from any folder."""
        store = () if self._given is None else ("--store", opening.pasted(self._given))
        return command_line(*words, *store)

    def close(self) -> None:
        """Close all connections; the store cannot be used afterwards."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        """Return the store itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    @contextmanager
    def reading(self) -> Generator[Connection]:
        """A connection for reading; in a file, all of one snapshot."""
        with opening.explained(self.place), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Generator[Connection]:
        """A connection for writing; all of it becomes durable together, or nothing."""
        with opening.explained(self.place), self._turn, self._writing.begin() as connection:
            yield connection

    def add(self, episode: Mapping[str, Any]) -> None:
        """Store an episode that `new_episode` made."""
        with self.writing() as connection:
            connection.execute(EPISODES.insert(), episode)

    def append(
        self,
        id: str,
        round: Round,
        *,
        new: Mapping[str, Any] | None = None,
        after: Round | None = None,
        end: tuple[Ended, float | None] | None = None,
    ) -> None:
        """Store one finished round.

        Args:
            id: Of the episode.
            round: The round.
            new: The episode, of `new_episode`, if it is stored only with this round.
            after: What must still be the newest round.
            end: How the episode ends with it, and its score; as for `finish`.

        Raises:
            ConflictError: The round exists already, or `after` has changed.
            GoalscopeError: The round cannot be written; all earlier ones are kept.
        """
        with self.writing() as connection:
            if new:
                connection.execute(EPISODES.insert(), new)
            if after:
                _require_newest(connection, id, after)
            try:
                connection.execute(ROUNDS.insert(), round_row(id, round))
            except IntegrityError as error:
                raise ConflictError(
                    f"Cannot add round {round.number} to episode {id}: it already has such a "
                    "round (is it open in another window?), or the episode is unknown."
                ) from error
            if end:
                _finish(connection, id, *end)

    def correct(self, id: str, after: int, correction: Sequence[str]) -> None:
        """Store a correction of the goals that was made after so many rounds."""
        values = {"episode": id, "after": after, "json": dumps(correction)}
        with self.writing() as connection:
            connection.execute(CORRECTIONS.insert(), values)

    def undo_correction(self, id: str, after: int) -> None:
        """Remove the newest correction after so many rounds."""
        row = CORRECTIONS.c
        newest = select(func.max(row.number)).where(row.episode == id, row.after == after)
        with self.writing() as connection:
            connection.execute(CORRECTIONS.delete().where(row.number == newest.scalar_subquery()))

    def corrections(self, id: str, after: int) -> list[list[Any]]:
        """Return the corrections made after so many rounds, in order."""
        row = CORRECTIONS.c
        query = select(row.json).where(row.episode == id, row.after == after).order_by(row.number)
        with self.reading() as connection:
            return [json.loads(text) for text in connection.scalars(query)]

    def amend(self, id: str, old: Round, new: Round) -> None:
        """Replace the newest round.

        Raises:
            ConflictError: It is no longer the newest, or has been changed meanwhile.
        """
        with self.writing() as connection:
            _require_newest(connection, id, old)
            connection.execute(
                ROUNDS.update()
                .where(ROUNDS.c.episode == id, ROUNDS.c.number == old.number)
                .values(json=round_to_json(new))
            )

    def finish(self, id: str, *, ended: Ended, score: float | None = None) -> None:
        """Record how an episode ended, with its score (0 to 1) if it has a profile."""
        with self.writing() as connection:
            _finish(connection, id, ended, score)

    def delete(self, id: str) -> None:
        """Delete an episode with its rounds and corrections."""
        with self.writing() as connection:
            connection.execute(CORRECTIONS.delete().where(CORRECTIONS.c.episode == id))
            connection.execute(ROUNDS.delete().where(ROUNDS.c.episode == id))
            connection.execute(EPISODES.delete().where(EPISODES.c.id == id))

    def rounds(self, id: str, *, since: int = 1) -> list[Round]:
        """Return an episode's rounds in order, from one number on.

        Raises:
            InvalidInputError: No episode, or more than one, has an id that begins so.
        """
        info = self.episode(id)
        wanted = (ROUNDS.c.episode == info.id, ROUNDS.c.number >= since)
        query = select(ROUNDS.c.json).where(*wanted).order_by(ROUNDS.c.number)
        with self.reading() as connection:
            texts = connection.scalars(query).all()
        try:
            return [round_from_json(text) for text in texts]
        except (ValueError, LookupError, TypeError) as error:
            raise GoalscopeError(
                f"Cannot read a round of episode {info.id} in {self.place}: {error}"
            ) from error

    def episode(self, id: str) -> EpisodeInfo:
        """Return one episode, found by its id or by a prefix that fits no other.

        Raises:
            InvalidInputError: No episode, or more than one, has an id that begins so.
        """
        begins = func.substr(EPISODES.c.id, 1, len(id), type_=EscapedText()) == id
        with self.reading() as connection:
            rows = connection.execute(_infos().where(begins).limit(4 if id else 0)).all()
            if len(rows) == 1:
                return _info(rows[0])
            near = [row.id for row in rows] or difflib.get_close_matches(
                id, connection.scalars(select(EPISODES.c.id)), n=3, cutoff=0.5
            )
        hint = f" Did you mean {', '.join(near[:3])}?" if near else ""
        listing = self.command("episodes")
        what = "More than one episode has an id that begins with" if rows else "No episode is"
        raise InvalidInputError(f'{what} "{id}".{hint} `{listing}` lists them all.')

    def episodes(
        self,
        *,
        domain: str | None = None,
        text: str = "",
        newest_first: bool = False,
        limit: int | None = None,
        offset: int = 0,
    ) -> list[EpisodeInfo]:
        """Return the episodes, oldest first.

        Args:
            domain: Of which environment; None for all.
            text: Occurs in a turn, or in the id, domain, profile, method, model or task.
            newest_first: Reverse the order.
            limit: Most episodes.
            offset: Episodes to skip.
        """
        order = EPISODES.c.number.desc() if newest_first else EPISODES.c.number
        found = _matching(domain, text)
        query = _infos().where(*found).order_by(order).limit(limit).offset(offset)
        with self.reading() as connection:
            return [_info(row) for row in connection.execute(query)]

    def count(self, *, domain: str | None = None, text: str = "") -> int:
        """Return how many episodes there are; see `episodes`."""
        found = _matching(domain, text)
        query = select(func.count()).select_from(EPISODES).where(*found)
        with self.reading() as connection:
            return connection.scalar(query) or 0

    def domains(self) -> list[str]:
        """Return the domains of the episodes, in alphabetical order."""
        query = select(EPISODES.c.domain).distinct()
        with self.reading() as connection:
            return sorted(connection.scalars(query))


def _finish(connection: Connection, id: str, ended: Ended, score: float | None) -> None:
    if score is not None and not 0 <= score <= 1:
        raise ValueError(f"score must lie between 0 and 1, not {score}")
    connection.execute(
        EPISODES.update().where(EPISODES.c.id == id).values(ended=ended, score=score)
    )


def _require_newest(connection: Connection, id: str, round: Round) -> None:
    row = ROUNDS.c
    same = select(row.json).where(row.episode == id, row.number == round.number).with_for_update()
    newer = select(func.count()).where(row.episode == id, row.number > round.number)
    if connection.scalar(same) != round_to_json(round) or connection.scalar(newer):
        raise ConflictError(_CHANGED.format(id))


def _matching(domain: str | None, text: str) -> list[ColumnElement[bool]]:
    row = EPISODES.c
    found: list[ColumnElement[bool]] = []
    if domain is not None:
        found.append(row.domain == domain)
    if text:
        columns = (row.id, row.domain, row.profile, row.method, row.model, row.task)
        turn = (ROUNDS.c.query, ROUNDS.c.utterance)
        said = select(ROUNDS).where(ROUNDS.c.episode == row.id, _contained(text, turn))
        found.append(or_(_contained(text, columns), said.exists()))
    return found


def _contained(text: str, columns: Sequence[ColumnElement[str]]) -> ColumnElement[bool]:
    return or_(*(column.icontains(text, autoescape=True) for column in columns))


def round_row(episode: str, round: Round) -> dict[str, Any]:
    """The row of a round.

    Raises:
        GoalscopeError: A number is NaN or +inf.
    """
    return {
        "episode": episode,
        "number": round.number,
        "query": round.turn.query,
        "utterance": round.turn.utterance,
        "json": round_to_json(round),
    }


def new_episode(
    *,
    domain: str,
    method: str,
    model: str,
    task: str,
    profile: str | None = None,
    settings: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The row of an episode that begins now; see `EpisodeInfo`."""
    return {
        "id": secrets.token_hex(4),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "domain": domain,
        "profile": profile,
        "method": method,
        "model": model,
        "task": task,
        "settings": dumps(dict(settings or {})),
    }


def _infos() -> Select[Any]:
    own = ROUNDS.c.episode == EPISODES.c.id
    rounds = select(func.count()).where(own, ROUNDS.c.number > 0).scalar_subquery()
    first = select(func.substr(ROUNDS.c.utterance, 1, _BEGINNING)).where(own, ROUNDS.c.number == 1)
    return select(EPISODES, rounds.label("rounds"), first.scalar_subquery().label("first_words"))


def _info(row: Row[Any]) -> EpisodeInfo:
    line = " ".join((row.first_words or "").split())
    if len(line) > _WORDS:
        line = f"{line[: _WORDS - 3].rstrip()}..."
    values: dict[str, Any] = {each.name: getattr(row, each.name) for each in fields(EpisodeInfo)}
    values["settings"], values["first_words"] = json.loads(row.settings), line
    return EpisodeInfo(**values)


def round_to_json(round: Round) -> str:
    """Write a round as strict JSON in ASCII; see `belief_to_json`.

    Raises:
        GoalscopeError: A number is NaN or +inf.
    """
    return dumps({**_object_of(round), "belief": belief_to_json(round.belief)})


def round_from_json(text: str) -> Round:
    """Read what `round_to_json` wrote; the round is equal in every value."""
    values: dict[str, Any] = json.loads(text)
    belief, reading = values["belief"], values["reading"]
    values["turn"] = Turn(**values["turn"])
    values["belief"] = belief_from_json(belief)
    values["reading"] = reading and _reading(reading)
    values["changes"] = tuple(_with(GoalChange, each, goal=Goal) for each in values["changes"])
    values["results"] = tuple(_with(StepResult, each, action=Action) for each in values["results"])
    for name in ("pending", "released"):
        values[name] = _orders(values[name])
    for name, kind in (("guessed", Guess), ("given_up", Guess), ("listed", Action)):
        values[name] = tuple(kind(**each) for each in values[name])
    for name in ("notes", "retracts"):
        values[name] = tuple(values[name])
    return Round(**values)


def _with(kind: type[T], values: dict[str, Any], **inner: type[Any]) -> T:
    """The dataclass of these values, some of which are dataclasses themselves."""
    return kind(**values | {name: one(**values[name]) for name, one in inner.items()})


def _reading(data: Mapping[str, Any]) -> Reading:
    margins = None if data["margins"] is None else tuple(data["margins"])
    return Reading(_orders(data["orders"]), data["log_probability"], margins)


def _orders(data: Sequence[object]) -> tuple[Order, ...]:
    return tuple(order_from_json(each) for each in data)


def _object_of(value: Any) -> dict[str, Any]:
    """A dataclass as a JSON object."""
    if isinstance(value, Order):
        return order_to_json(value)
    return {field.name: getattr(value, field.name) for field in fields(value)}


def dumps(value: object, *, sort_keys: bool = False) -> str:
    """Strict JSON in ASCII; lone surrogates survive as escapes, dataclasses become objects.

    Raises:
        GoalscopeError: A number is NaN or infinite.
    """
    try:
        return json.dumps(value, allow_nan=False, sort_keys=sort_keys, default=_object_of)
    except ValueError as error:
        raise GoalscopeError(f"This cannot be stored: {error}") from error
