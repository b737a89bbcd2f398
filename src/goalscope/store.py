"""Episodes in a database, which a crash at any moment leaves whole."""

from __future__ import annotations

import difflib
import json
import secrets
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any, Literal, Self

from sqlalchemy import ColumnElement, Connection, Engine, Row, Select, func, or_, select
from sqlalchemy.exc import IntegrityError

from goalscope.database.errors import explained
from goalscope.database.opening import WRITING, default_place, opened
from goalscope.database.tables import CORRECTIONS, EPISODES, ROUNDS, EscapedText
from goalscope.episode import Round
from goalscope.rounds_json import dumps, round_from_json, round_to_json, turn_like
from goalscope.types import ConflictError, GoalscopeError, InvalidInputError

__all__ = ["Ended", "EpisodeInfo", "Store", "new_episode"]

Ended = Literal["terminated", "truncated"]
"""How an episode ended: its task complete, or its last round over."""

_CHANGED = "Episode {} has gone on meanwhile (in another window?). Try again."


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
        owner: Who may see it, where that matters.
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
    owner: str | None = None

    @property
    def ending(self) -> str:
        """How it ended, in words for people: "done", "out of rounds" or "not ended"."""
        return {None: "not ended", "terminated": "done", "truncated": "out of rounds"}[self.ended]


class Store:
    """The episodes in one database. Every call that writes is durable when it returns.

    Threads may share a store; each call takes a connection of its own.

    Attributes:
        place: The file, or the address without its password.
    """

    def __init__(self, place: str, engine: Engine) -> None:
        """Use a database that is ready; `Store.open` is the usual way in."""
        self.place = place
        self._engine = engine
        self._writing = engine.execution_options(**WRITING)
        # SQLite has writers poll for their turn, until one of many gets none: threads queue here.
        self._turn = Lock() if engine.dialect.name == "sqlite" else nullcontext()

    @classmethod
    def open(cls, place: str | Path | None = None, *, new: bool = True) -> Self:
        """Open the store, and make what is missing of it.

        Args:
            place: A SQLite file or postgresql://USER:PASSWORD@HOST/DATABASE; None for
                $GOALSCOPE_STORE, or else `episodes.db` in the user's data folder.
            new: Whether a file that is named and is not there may be made.

        Raises:
            InvalidInputError: The file is not there, and none may be made.
            GoalscopeError: It cannot be used, or a newer goalscope made it.
        """
        if not (new or place is None or "://" in str(place) or Path(place).exists()):
            raise InvalidInputError(f"There is no store at {place}. Check the path.")
        return cls(*opened(default_place() if place is None else place))

    def close(self) -> None:
        """Close all connections; the store cannot be used afterwards."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        """Return the store itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()

    @contextmanager
    def reading(self) -> Generator[Connection]:
        """All that is read inside is of one moment, if the database is a file."""
        with explained(self.place), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Generator[Connection]:
        """All that is written inside becomes durable together, or not at all."""
        with explained(self.place), self._turn, self._writing.begin() as connection:
            yield connection

    def begin(
        self,
        *,
        domain: str,
        method: str,
        model: str,
        task: str,
        profile: str | None = None,
        settings: Mapping[str, Any] | None = None,
        owner: str | None = None,
    ) -> str:
        """Start an episode and return its id."""
        values = new_episode(
            domain=domain,
            method=method,
            model=model,
            task=task,
            profile=profile,
            settings=settings,
            owner=owner,
        )
        self.add(values)
        return values["id"]

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
        after: Round | Mapping[str, Any] | None = None,
        end: tuple[Ended, float | None] | None = None,
    ) -> None:
        """Store one finished round.

        Args:
            id: Of the episode.
            round: The round.
            new: The episode, of `new_episode`, if it is stored only with this round.
            after: What it builds on, which must still be so: the newest round, or the settings.
            end: How the episode ends with it, and its score; as for `finish`.

        Raises:
            ConflictError: There is such a round already, or what it builds on has changed.
            GoalscopeError: The round cannot be written; all earlier ones are kept.
        """
        values = {"episode": id, "number": round.number, "json": round_to_json(round)}
        with self.writing() as connection:
            if new:
                connection.execute(EPISODES.insert(), new)
            if isinstance(after, Round):
                _still_newest(connection, id, after)
            elif after is not None:
                _still_so(connection, id, after)
            try:
                connection.execute(ROUNDS.insert(), values)
            except IntegrityError as error:
                raise ConflictError(
                    f"Round {round.number} of episode {id} cannot be added: the episode has such a "
                    "round already (does it run in another window?) or is unknown."
                ) from error
            if end:
                _finish(connection, id, *end)

    def correct(self, id: str, after: int, correction: Sequence[str]) -> None:
        """Store what the person says of the goals after so many rounds, before the next has it."""
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
        """Return what the person has said of the goals after so many rounds, in order."""
        row = CORRECTIONS.c
        query = select(row.json).where(row.episode == id, row.after == after).order_by(row.number)
        with self.reading() as connection:
            return [json.loads(text) for text in connection.scalars(query)]

    def amend(self, id: str, old: Round, new: Round) -> None:
        """Store the newest round anew.

        Raises:
            ConflictError: It is not the newest any more, or has been changed meanwhile.
        """
        with self.writing() as connection:
            _still_newest(connection, id, old)
            connection.execute(
                ROUNDS.update()
                .where(ROUNDS.c.episode == id, ROUNDS.c.number == old.number)
                .values(json=round_to_json(new))
            )

    def configure(self, id: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
        """Replace the settings of an episode that has no rounds yet.

        Raises:
            ConflictError: The settings are others than `old` by now, or there is a round.
        """
        settings = dumps(dict(new))
        with self.writing() as connection:
            _still_so(connection, id, old)
            if connection.scalar(select(func.count()).where(ROUNDS.c.episode == id)):
                raise ConflictError(_CHANGED.format(id))
            connection.execute(
                EPISODES.update().where(EPISODES.c.id == id).values(settings=settings)
            )

    def finish(self, id: str, *, ended: Ended, score: float | None = None) -> None:
        """Record how an episode ended, with its score (0 to 1) if it has a profile."""
        with self.writing() as connection:
            _finish(connection, id, ended, score)

    def delete(self, id: str) -> None:
        """Remove an episode with all that was said in it."""
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
                f"A round of episode {info.id} in {self.place} cannot be read: {error}"
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
        what = "More than one episode has an id that begins with" if rows else "No episode is"
        raise InvalidInputError(f'{what} "{id}".{hint} `goalscope episodes` lists them all.')

    def episodes(
        self,
        *,
        owner: str | None = None,
        domain: str | None = None,
        text: str = "",
        newest_first: bool = False,
        limit: int | None = None,
        offset: int = 0,
    ) -> list[EpisodeInfo]:
        """Return the episodes in the order in which they began.

        Args:
            owner: Whose; None for everybody's.
            domain: Of which environment; None for all.
            text: Stands in what was said, or in what the store knows of the episode.
            newest_first: The other way round.
            limit: At most so many.
            offset: After so many others.
        """
        order = EPISODES.c.number.desc() if newest_first else EPISODES.c.number
        found = _matching(owner, text)
        if domain is not None:
            found.append(EPISODES.c.domain == domain)
        query = _infos().where(*found).order_by(order).limit(limit).offset(offset)
        with self.reading() as connection:
            return [_info(row) for row in connection.execute(query)]

    def count(self, *, owner: str | None = None, text: str = "") -> int:
        """Return how many episodes there are; see `episodes`."""
        query = select(func.count()).select_from(EPISODES).where(*_matching(owner, text))
        with self.reading() as connection:
            return connection.scalar(query) or 0


def _finish(connection: Connection, id: str, ended: Ended, score: float | None) -> None:
    if score is not None and not 0 <= score <= 1:
        raise ValueError(f"score must lie between 0 and 1, not {score}")
    connection.execute(
        EPISODES.update().where(EPISODES.c.id == id).values(ended=ended, score=score)
    )


def _still_so(connection: Connection, id: str, settings: Mapping[str, Any]) -> None:
    same = select(EPISODES.c.settings).where(EPISODES.c.id == id).with_for_update()
    if json.loads(connection.scalar(same) or "null") != settings:
        raise ConflictError(_CHANGED.format(id))


def _still_newest(connection: Connection, id: str, round: Round) -> None:
    row = ROUNDS.c
    same = select(row.json).where(row.episode == id, row.number == round.number).with_for_update()
    newer = select(func.count()).where(row.episode == id, row.number > round.number)
    if connection.scalar(same) != round_to_json(round) or connection.scalar(newer):
        raise ConflictError(_CHANGED.format(id))


def _matching(owner: str | None, text: str) -> list[ColumnElement[bool]]:
    row = EPISODES.c
    found: list[ColumnElement[bool]] = []
    if owner is not None:
        found.append(row.owner == owner)
    if text:
        columns = (row.id, row.domain, row.profile, row.method, row.model, row.task)
        said = select(ROUNDS).where(
            ROUNDS.c.episode == row.id, ROUNDS.c.json.ilike(turn_like(text), escape="/")
        )
        stands = (each.icontains(text, autoescape=True) for each in columns)
        found.append(or_(*stands, said.exists()))
    return found


def new_episode(settings: Mapping[str, Any] | None = None, **values: str | None) -> dict[str, Any]:
    """The row of an episode that begins now."""
    return {
        "id": secrets.token_hex(4),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": dumps(dict(settings or {})),
        **values,
    }


def _infos() -> Select[Any]:
    rounds = select(func.count()).where(ROUNDS.c.episode == EPISODES.c.id)
    return select(EPISODES, rounds.scalar_subquery().label("rounds"))


def _info(row: Row[Any]) -> EpisodeInfo:
    return EpisodeInfo(
        row.id,
        row.created,
        row.domain,
        row.profile,
        row.method,
        row.model,
        row.task,
        json.loads(row.settings),
        row.ended,
        row.score,
        row.rounds,
        row.owner,
    )
