"""Studies in the store: their items, who takes part, and every answer as it is given."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from random import Random

from sqlalchemy import delete, or_, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from goalscope.database.tables import AnswerRow, ItemRow, ParticipantRow, StudyRow
from goalscope.envs.tables import nearest
from goalscope.rounds_json import dumps
from goalscope.store import Store
from goalscope.study.assignment import assigned
from goalscope.study.items import Item, chosen_episodes, item_of
from goalscope.study.people import Answer, Participant
from goalscope.study.plan import BEST, Plan, plan_of
from goalscope.types import ConflictError, InvalidInputError, Turn

__all__ = ["Book", "Study"]

HOLD = timedelta(hours=1)
"""For how long the items of people who have not finished are kept for them."""


@dataclass(frozen=True, slots=True)
class Study:
    """A study in the store.

    Attributes:
        number: In the store.
        created: In UTC, ISO 8601.
        plan: What it is.
        closed: Since when it takes no new participants; None while it does.
    """

    number: int
    created: str
    plan: Plan
    closed: str | None


class Book:
    """The studies of a store."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, plan: Plan) -> Study:
        """Make a study of the episodes as they are now.

        Raises:
            InvalidInputError: Its name is taken, or its episodes cannot be rated.
        """
        rows = [
            ItemRow(view=dumps(asdict(item_of(self._store, info, plan))), episode=info.id)
            for info in chosen_episodes(self._store, plan)
        ]
        with self._store.writing() as session:
            study = StudyRow(name=plan.name, created=_now(), plan=dumps(asdict(plan)))
            session.add(study)
            try:
                session.flush()
            except IntegrityError as error:
                raise InvalidInputError(
                    f'There is a study "{plan.name}" already. Choose another name.'
                ) from error
            for row in rows:
                row.study = study.number
                session.add(row)
            return _study(study)

    def all(self) -> list[Study]:
        """All studies, in the order in which they were made."""
        with self._store.reading() as session:
            return [_study(row) for row in session.scalars(select(StudyRow).order_by("number"))]

    def named(self, name: str) -> Study:
        """The study of this name.

        Raises:
            InvalidInputError: There is none.
        """
        with self._store.reading() as session:
            row = session.scalar(select(StudyRow).where(StudyRow.name == name))
            if row is not None:
                return _study(row)
            known = session.scalars(select(StudyRow.name)).all()
        hint = nearest(name, known) if known else "`goalscope study new` makes one in this store."
        raise InvalidInputError(f'There is no study "{name}"; {hint}')

    def close(self, study: Study) -> None:
        """Let nobody new take part; who has begun may finish."""
        with self._store.writing() as session:
            row = session.get_one(StudyRow, study.number)
            row.closed = row.closed or _now()

    def delete(self, study: Study) -> None:
        """Delete a study with all its participants and answers."""
        people = select(ParticipantRow.number).where(ParticipantRow.study == study.number)
        with self._store.writing() as session:
            session.get(StudyRow, study.number, with_for_update=True)  # whoever joins does so, too
            session.execute(delete(AnswerRow).where(AnswerRow.participant.in_(people)))
            for row in (ParticipantRow, ItemRow):
                session.execute(delete(row).where(row.study == study.number))
            session.execute(delete(StudyRow).where(StudyRow.number == study.number))

    def over(self, study: Study) -> str:
        """Why nobody new can take part, in a sentence; empty where they can."""
        with self._store.reading() as session:
            return "" if _order(session, study) else _over(study)

    def items(self, study: Study) -> dict[int, str]:
        """The episodes by their items' numbers."""
        query = select(ItemRow).where(ItemRow.study == study.number)
        with self._store.reading() as session:
            return {row.number: row.episode for row in session.scalars(query)}

    def participants(self, study: Study) -> list[Participant]:
        """All who have agreed, with their answers."""
        with self._store.reading() as session:
            return _participants(session, study)

    def participant(self, study: Study, visitor: str, external: str) -> Participant | None:
        """Who takes part by a link with this id in this browser, if they have agreed.

        An id belongs to the browser in which its owner agreed: ids are no secrets, and another
        browser could be anybody's.

        Raises:
            ConflictError: The id has been used in another browser, or another id in this one.
        """
        with self._store.reading() as session:
            return _participant(session, study, visitor, external)

    def join(self, study: Study, visitor: str, external: str) -> Participant:
        """Note that somebody agrees, and give them their items; who has agreed keeps theirs.

        Raises:
            ConflictError: As for `participant`; or nobody new can take part (see `over`).
        """
        with self._store.writing() as session:
            now = session.get_one(StudyRow, study.number, with_for_update=True)
            there = _participant(session, study, visitor, external)
            if there is not None:
                return there
            study = _study(now)
            order = _order(session, study)
            if not order:
                raise ConflictError(_over(study))
            row = ParticipantRow(
                study=study.number, visitor=visitor, external=external, joined=_now()
            )
            session.add(row)
            session.flush()
            session.add_all(
                AnswerRow(participant=row.number, item=item, place=place)
                for place, item in enumerate(order, 1)
            )
            session.flush()
            return _read(session, [row])[0]

    def forget(self, study: Study, number: int) -> None:
        """Delete a participant and all their answers, as they may ask for.

        Raises:
            InvalidInputError: There is none of this number.
        """
        row = ParticipantRow
        with self._store.writing() as session:
            found = session.scalar(
                select(row).where(row.study == study.number, row.number == number)
            )
            if found is None:
                raise InvalidInputError(f"Study {study.plan.name} has no participant {number}.")
            session.execute(delete(AnswerRow).where(AnswerRow.participant == number))
            session.delete(found)

    def open(self, participant: Participant, place: int) -> tuple[Item, Answer]:
        """An item and the answer to it so far; notes when it is first seen.

        Raises:
            InvalidInputError: They have no such item.
        """
        with self._store.reading() as session:
            row = _answer(session, participant, place)
            item = session.get_one(ItemRow, row.item)
            found = _item(item), _as_answer(row, item)
        if found[1].opened is None:
            with self._store.writing() as session:
                row = _answer(session, participant, place)
                row.opened = row.opened or _now()
        return found

    def answer(
        self, participant: Participant, place: int, rating: int, explanation: str, revision: int
    ) -> Answer:
        """Keep an answer; the same again changes nothing, and an older one never replaces a newer.

        Args:
            participant: Who gives it.
            place: Of the item.
            rating: 0 to 3.
            explanation: Why.
            revision: One more than that of the answer that it is to replace.

        Raises:
            ConflictError: There is another answer of this revision, or a newer one.
            InvalidInputError: They have no such item, or the rating is none.
        """
        if not 0 <= rating <= BEST:
            raise InvalidInputError(f"A rating is a number from 0 to {BEST}.")
        with self._store.writing() as session:
            row = _answer(session, participant, place, lock=True)
            if revision > row.revision:
                row.rating, row.explanation, row.revision = rating, explanation, revision
                row.answered = row.answered or _now()
            elif (revision, rating, explanation) != (row.revision, row.rating, row.explanation):
                raise ConflictError("A newer answer to this question is already saved.")
            return _as_answer(row, session.get_one(ItemRow, row.item))


def _order(session: Session, study: Study) -> list[int]:
    """The items of the next participant; none where nobody new can take part."""
    if study.closed:
        return []
    plan, others = study.plan, _participants(session, study)
    items = select(ItemRow.number).where(ItemRow.study == study.number).order_by("number")
    ratings = dict.fromkeys(session.scalars(items), 0)
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
    return f"This study {why}, so nobody new can take part. Thank you for your interest."


def _participant(session: Session, study: Study, visitor: str, external: str) -> Participant | None:
    row = ParticipantRow
    same = or_(row.visitor == visitor, row.external == external)
    found = session.scalars(select(row).where(row.study == study.number, same)).all()
    for each in found:
        if each.visitor != visitor:
            raise ConflictError(
                "This study was begun with your id in another browser. Please go on there."
            )
        if each.external != external:
            raise ConflictError("Somebody has taken part in this study with this browser already.")
    return _read(session, found)[0] if found else None


def _participants(session: Session, study: Study) -> list[Participant]:
    query = select(ParticipantRow).where(ParticipantRow.study == study.number).order_by("number")
    return _read(session, session.scalars(query).all())


def _read(session: Session, rows: Sequence[ParticipantRow]) -> list[Participant]:
    query = select(AnswerRow, ItemRow).join(ItemRow, ItemRow.number == AnswerRow.item)
    if len(rows) == 1:
        query = query.where(AnswerRow.participant == rows[0].number)
    else:
        query = query.where(ItemRow.study.in_({row.study for row in rows}))
    answers: dict[int, list[Answer]] = {}
    for answer, item in session.execute(query.order_by(AnswerRow.place)):
        answers.setdefault(answer.participant, []).append(_as_answer(answer, item))
    return [
        Participant(row.number, row.external, row.joined, tuple(answers.get(row.number, ())))
        for row in rows
    ]


def _answer(
    session: Session, participant: Participant, place: int, *, lock: bool = False
) -> AnswerRow:
    row = AnswerRow
    query = select(row).where(row.participant == participant.number, row.place == place)
    found = session.scalar(query.with_for_update() if lock else query)
    if found is None:
        raise InvalidInputError(f"There is no question {place}.")
    return found


def _as_answer(row: AnswerRow, item: ItemRow) -> Answer:
    return Answer(
        row.item,
        row.place,
        row.rating,
        row.explanation,
        row.revision,
        row.opened,
        row.answered,
        item.episode,
    )


def _item(row: ItemRow) -> Item:
    view = json.loads(row.view)
    turns = (Turn(**turn) for turn in view["transcript"])
    return Item(
        view["task"], tuple(view["possible"]), view["profile"], view["outcome"], tuple(turns)
    )


def _study(row: StudyRow) -> Study:
    plan = plan_of(json.loads(row.plan), f"The study {row.name}")
    return Study(row.number, row.created, plan, row.closed)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
