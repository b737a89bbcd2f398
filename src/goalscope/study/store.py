"""Studies in the store: their items, participants and answers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime, timedelta
from random import Random
from typing import Any

from sqlalchemy import ColumnElement, Connection, Row, Select, and_, or_, select
from sqlalchemy.exc import IntegrityError

from goalscope.base.inputs import nearest, validated
from goalscope.base.types import ConflictError, InvalidInputError
from goalscope.storage.store import Store, dumps
from goalscope.storage.tables import ANSWERS, ITEMS, PARTICIPANTS, STUDIES
from goalscope.study.plan import Item, Plan, chosen_episodes, item_of

HOLD = timedelta(hours=1)
"""How long items stay reserved for a participant who has not finished."""


@dataclass(frozen=True, slots=True)
class Study:
    """A study in the store.

    Attributes:
        number: Number in the store.
        created: In UTC, ISO 8601.
        plan: Its definition.
        closed: When it was closed to new participants; None while it is open.
    """

    number: int
    created: str
    plan: Plan
    closed: str | None


@dataclass(frozen=True, slots=True)
class Answer:
    """An item assigned to a participant, and their rating of it.

    Attributes:
        item: Its number in the store.
        place: Position in the participant's order, from 1.
        rating: 0 to 3; None before there is one.
        explanation: Why.
        revision: Counts changes of the answer; 0 before there is a rating.
        opened: When it was first shown, in UTC, ISO 8601.
        answered: When the first rating was saved.
        episode: The item's episode.
    """

    item: int
    place: int
    rating: int | None
    explanation: str
    revision: int
    opened: str | None
    answered: str | None
    episode: str


@dataclass(frozen=True, slots=True)
class Participant:
    """A person who has agreed to take part.

    Attributes:
        number: Number in the store, counted over all studies.
        external: The id in their link.
        joined: When they agreed, in UTC, ISO 8601.
        answers: In the order of their items.
    """

    number: int
    external: str
    joined: str
    answers: tuple[Answer, ...]

    @property
    def finished(self) -> bool:
        """Whether all items have a rating."""
        return all(each.rating is not None for each in self.answers)


class StudyStore:
    """The studies of a store."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, plan: Plan) -> Study:
        """Create a study of the current episodes.

        Raises:
            InvalidInputError: Its name is taken, or there are no episodes to rate.
        """
        items = [
            {"view": dumps(asdict(item_of(self._store, info, plan))), "episode": info.id}
            for info in chosen_episodes(self._store, plan)
        ]
        values = {"name": plan.name, "created": _now(), "plan": dumps(asdict(plan))}
        with self._store.writing() as connection:
            try:
                made = connection.execute(STUDIES.insert(), values).inserted_primary_key
            except IntegrityError as error:
                raise InvalidInputError(
                    f'There is already a study "{plan.name}". Choose another name.'
                ) from error
            assert made is not None
            connection.execute(ITEMS.insert(), [{"study": made.number, **item} for item in items])
        return self.named(plan.name)

    def all(self) -> list[Study]:
        """All studies, in the order of creation."""
        with self._store.reading() as connection:
            return [
                _read_study(row) for row in connection.execute(select(STUDIES).order_by("number"))
            ]

    def named(self, name: str) -> Study:
        """The study with this name.

        Raises:
            InvalidInputError: There is none.
        """
        with self._store.reading() as connection:
            row = connection.execute(select(STUDIES).where(STUDIES.c.name == name)).one_or_none()
            if row is not None:
                return _read_study(row)
            known = connection.scalars(select(STUDIES.c.name)).all()
        new = f"`{self._store.command('study', 'new', 'FILE')}` creates one in this store."
        hint = nearest(name, known) if known else new
        raise InvalidInputError(f'There is no study "{name}"; {hint}')

    def close(self, study: Study) -> None:
        """Close the study to new participants; those who have begun may finish."""
        with self._store.writing() as connection:
            here = STUDIES.c.number == study.number
            connection.execute(
                STUDIES.update().where(here, STUDIES.c.closed.is_(None)).values(closed=_now())
            )

    def delete(self, study: Study) -> None:
        """Delete a study with all its participants and answers."""
        people = select(PARTICIPANTS.c.number).where(PARTICIPANTS.c.study == study.number)
        with self._store.writing() as connection:
            connection.scalar(_locked(study))  # as `join` does
            connection.execute(ANSWERS.delete().where(ANSWERS.c.participant.in_(people)))
            for table in (PARTICIPANTS, ITEMS):
                connection.execute(table.delete().where(table.c.study == study.number))
            connection.execute(STUDIES.delete().where(STUDIES.c.number == study.number))

    def over(self, study: Study) -> str:
        """Why the study takes no new participants, in a sentence; empty if it does."""
        with self._store.reading() as connection:
            return "" if _order(connection, study) else _over(study)

    def items(self, study: Study) -> dict[int, str]:
        """The episodes by item number."""
        query = select(ITEMS).where(ITEMS.c.study == study.number)
        with self._store.reading() as connection:
            return {row.number: row.episode for row in connection.execute(query)}

    def participants(self, study: Study) -> list[Participant]:
        """All participants, with their answers."""
        with self._store.reading() as connection:
            return _participants(connection, study)

    def participant(self, study: Study, visitor: str, external: str) -> Participant | None:
        """The participant with this id in this browser, if they have agreed.

        An id belongs to the browser in which its owner agreed: ids are not secret, and another
        browser could be anybody's.

        Raises:
            ConflictError: The id has been used in another browser, or another id in this one.
        """
        with self._store.reading() as connection:
            return _participant(connection, study, visitor, external)

    def join(self, study: Study, visitor: str, external: str) -> Participant:
        """Add a participant with items to rate; one who has agreed before keeps theirs.

        Raises:
            ConflictError: As for `participant`; or nobody new can take part (see `over`).
        """
        with self._store.writing() as connection:
            now = connection.execute(_locked(study)).one()
            there = _participant(connection, study, visitor, external)
            if there is not None:
                return there
            study = _read_study(now)
            order = _order(connection, study)
            if not order:
                raise ConflictError(_over(study))
            who = {"study": study.number, "visitor": visitor, "external": external}
            made = connection.execute(PARTICIPANTS.insert(), who | {"joined": _now()})
            assert made.inserted_primary_key is not None
            number = made.inserted_primary_key.number
            answers = [
                {"participant": number, "item": item, "place": place}
                for place, item in enumerate(order, 1)
            ]
            connection.execute(ANSWERS.insert(), answers)
            (joined,) = _read(
                connection, select(PARTICIPANTS).where(PARTICIPANTS.c.number == number)
            )
            return joined

    def forget(self, study: Study, number: int) -> None:
        """Delete a participant and all their answers.

        Raises:
            InvalidInputError: There is no participant with this number.
        """
        row = PARTICIPANTS.c
        here = (row.study == study.number, row.number == number)
        with self._store.writing() as connection:
            if connection.scalar(select(row.number).where(*here)) is None:
                raise InvalidInputError(f"Study {study.plan.name} has no participant {number}.")
            connection.execute(ANSWERS.delete().where(ANSWERS.c.participant == number))
            connection.execute(PARTICIPANTS.delete().where(*here))

    def open(self, participant: Participant, place: int) -> tuple[Item, Answer]:
        """An item and its answer so far; records when it is first shown.

        Raises:
            InvalidInputError: The participant has no such item.
        """
        with self._store.reading() as connection:
            row = _answer(connection, participant, place)
        if row.opened is None:
            with self._store.writing() as connection:
                unseen = _to(participant, place), ANSWERS.c.opened.is_(None)
                connection.execute(ANSWERS.update().where(*unseen).values(opened=_now()))
        item = validated(json.loads(row.view), Item, f"Item {row.item}")
        return item, _read_answer(row)

    def answer(
        self, participant: Participant, place: int, rating: int, explanation: str, revision: int
    ) -> Answer:
        """Save an answer; repeats change nothing, and an older one never replaces a newer one.

        Args:
            participant: The participant who gives it.
            place: Place of the item.
            rating: 0 to 3.
            explanation: Why.
            revision: One more than that of the answer that it replaces.

        Raises:
            ConflictError: There is another answer with this revision, or a newer one.
            InvalidInputError: The participant has no such item.
        """
        with self._store.writing() as connection:
            row = _answer(connection, participant, place, lock=True)
            if revision > row.revision:
                values = {"rating": rating, "explanation": explanation, "revision": revision}
                values["answered"] = row.answered or _now()
                connection.execute(ANSWERS.update().where(_to(participant, place)).values(values))
                row = _answer(connection, participant, place)
            elif (revision, rating, explanation) != (row.revision, row.rating, row.explanation):
                raise ConflictError("A newer answer to this question is already saved.")
            return _read_answer(row)


def assigned(ratings: Mapping[int, int], *, wanted: int, share: int, rng: Random) -> list[int]:
    """A new participant's items in order; empty if every item has its ratings.

    Those with the fewest ratings are chosen, ties at random; the order is random.

    Args:
        ratings: Ratings that each item has or is about to have.
        wanted: Ratings wanted per item.
        share: Items per participant.
        rng: Random number generator.
    """
    if min(ratings.values()) >= wanted:
        return []
    least = sorted(ratings, key=lambda item: (ratings[item], rng.random()))[:share]
    rng.shuffle(least)
    return least


def _locked(study: Study) -> Select[Any]:
    return select(STUDIES).where(STUDIES.c.number == study.number).with_for_update()


def _order(connection: Connection, study: Study) -> list[int]:
    """The items of the next participant; empty if the study takes no new participants."""
    if study.closed:
        return []
    plan, others = study.plan, _participants(connection, study)
    items = select(ITEMS.c.number).where(ITEMS.c.study == study.number).order_by("number")
    ratings = dict.fromkeys(connection.scalars(items), 0)
    since = datetime.now(UTC) - HOLD
    for each in others:
        if each.finished or datetime.fromisoformat(each.joined) > since:
            for answer in each.answers:
                ratings[answer.item] += 1
    return assigned(
        ratings,
        wanted=plan.ratings_per_item,
        share=plan.items_per_participant,
        rng=Random(f"{plan.seed}:{len(others)}"),
    )


def _over(study: Study) -> str:
    why = "is closed" if study.closed else "has all the ratings that it needs"
    return f"This study {why}, so it takes no new participants. Thank you for your interest."


def _participant(
    connection: Connection, study: Study, visitor: str, external: str
) -> Participant | None:
    row = PARTICIPANTS.c
    same = or_(row.visitor == visitor, row.external == external)
    query = select(PARTICIPANTS).where(row.study == study.number, same)
    for each in connection.execute(query):
        if each.visitor != visitor:
            raise ConflictError("You started this study in another browser. Please continue there.")
        if each.external != external:
            raise ConflictError("Somebody has already taken part in this study with this browser.")
    return next(iter(_read(connection, query)), None)


def _participants(connection: Connection, study: Study) -> list[Participant]:
    query = select(PARTICIPANTS).where(PARTICIPANTS.c.study == study.number).order_by("number")
    return _read(connection, query)


def _read(connection: Connection, people: Select[Any]) -> list[Participant]:
    rows = connection.execute(people).all()
    query = _answers().where(ANSWERS.c.participant.in_([row.number for row in rows]))
    answers: dict[int, list[Answer]] = {}
    for row in connection.execute(query.order_by(ANSWERS.c.place)):
        answers.setdefault(row.participant, []).append(_read_answer(row))
    return [
        Participant(row.number, row.external, row.joined, tuple(answers.get(row.number, ())))
        for row in rows
    ]


def _answers() -> Select[Any]:
    """Answers, each with its item."""
    return select(ANSWERS, ITEMS.c.view, ITEMS.c.episode).join_from(ANSWERS, ITEMS)


def _to(participant: Participant, place: int) -> ColumnElement[bool]:
    row = ANSWERS.c
    return and_(row.participant == participant.number, row.place == place)


def _answer(
    connection: Connection, participant: Participant, place: int, *, lock: bool = False
) -> Row[Any]:
    query = _answers().where(_to(participant, place))
    found = connection.execute(query.with_for_update(of=ANSWERS) if lock else query).one_or_none()
    if found is None:
        raise InvalidInputError(f"There is no question {place}.")
    return found


def _read_answer(row: Row[Any]) -> Answer:
    return Answer(**{field.name: getattr(row, field.name) for field in fields(Answer)})


def _read_study(row: Row[Any]) -> Study:
    plan = validated(json.loads(row.plan), Plan, f"The study {row.name}")
    return Study(row.number, row.created, plan, row.closed)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
