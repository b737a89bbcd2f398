"""The tables, as SQLAlchemy maps them; the newest revision in migrations/ makes the same ones."""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    REAL,
    CheckConstraint,
    Dialect,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    Table,
    Text,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

__all__ = [
    "REVISION",
    "TABLES",
    "VERSION_TABLE",
    "AboutRow",
    "AnswerRow",
    "Base",
    "CellRow",
    "CorrectionRow",
    "EpisodeRow",
    "ItemRow",
    "ParticipantRow",
    "RoundRow",
    "StudyRow",
    "Words",
]

REVISION = "0001"
"""The newest of migrations/versions. Their ids have four digits, and grow."""
VERSION_TABLE = "goalscope_version"
"""Name of the table in which Alembic notes the revision."""

Number = Float(53).with_variant(REAL(), "sqlite")  # a STRICT table knows no other name


class Words(TypeDecorator[str]):
    """Any text; what a database cannot hold (half characters, NUL) is written as its escape."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        """Escape it."""
        return value and value.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


class Base(DeclarativeBase):
    """All tables. JSON is ASCII text, which no database reads or rejects."""

    metadata = MetaData(
        naming_convention={
            "pk": "%(table_name)s_pk",
            "fk": "%(table_name)s_%(column_0_name)s_fk",
            "uq": "%(table_name)s_%(column_0_name)s_uq",
            "ck": "%(table_name)s_%(constraint_name)s_ck",
            "ix": "%(table_name)s_%(column_0_name)s_ix",
        }
    )
    type_annotation_map = {str: Words(), float: Number}  # noqa: RUF012 (read by SQLAlchemy)
    __table_args__: Any = {"sqlite_strict": True}  # noqa: RUF012 (so is this)


class EpisodeRow(Base):
    """One episode; `number` counts them as they begin."""

    __tablename__ = "episodes"
    __table_args__ = (
        CheckConstraint("ended IN ('terminated', 'truncated')", "ended"),
        CheckConstraint("score BETWEEN 0 AND 1", "score"),
        {"sqlite_strict": True},
    )

    number: Mapped[int] = mapped_column(primary_key=True)
    id: Mapped[str] = mapped_column(unique=True)
    created: Mapped[str]
    domain: Mapped[str]
    profile: Mapped[str | None]
    method: Mapped[str]
    model: Mapped[str]
    task: Mapped[str]
    settings: Mapped[str] = mapped_column(Text)
    ended: Mapped[str | None]
    score: Mapped[float | None]
    owner: Mapped[str | None] = mapped_column(index=True)


class RoundRow(Base):
    """One round, as `rounds_json` writes it."""

    __tablename__ = "rounds"
    __table_args__ = (CheckConstraint("number >= 1", "number"), {"sqlite_strict": True})

    episode: Mapped[str] = mapped_column(ForeignKey(EpisodeRow.id), primary_key=True)
    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    json: Mapped[str] = mapped_column(Text)


class CorrectionRow(Base):
    """What a person said of the goals after so many rounds; `number` counts these as they come."""

    __tablename__ = "corrections"

    number: Mapped[int] = mapped_column(primary_key=True)
    episode: Mapped[str] = mapped_column(ForeignKey(EpisodeRow.id), index=True)
    after: Mapped[int]
    json: Mapped[str] = mapped_column(Text)


class AboutRow(Base):
    """A fact about an experiment, as JSON."""

    __tablename__ = "about"

    name: Mapped[str] = mapped_column(primary_key=True)
    value: Mapped[str] = mapped_column(Text)


class CellRow(Base):
    """A cell of an experiment; `number` counts them as they are planned."""

    __tablename__ = "cells"

    number: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(unique=True)
    spec: Mapped[str] = mapped_column(Text)
    attempts: Mapped[int] = mapped_column(default=0)
    error: Mapped[str | None]
    identity: Mapped[str | None] = mapped_column(Text)
    result: Mapped[str | None] = mapped_column(Text)


class StudyRow(Base):
    """A study with people who rate episodes; since `closed` it takes no new ones."""

    __tablename__ = "studies"

    number: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    created: Mapped[str]
    plan: Mapped[str] = mapped_column(Text)
    closed: Mapped[str | None]


class ItemRow(Base):
    """What is rated, as it is shown."""

    __tablename__ = "study_items"

    number: Mapped[int] = mapped_column(primary_key=True)
    study: Mapped[int] = mapped_column(ForeignKey(StudyRow.number), index=True)
    view: Mapped[str] = mapped_column(Text)
    episode: Mapped[str]


class ParticipantRow(Base):
    """Who has agreed to take part, in one browser; `external` is the id in their link."""

    __tablename__ = "study_participants"
    __table_args__ = (
        UniqueConstraint("study", "visitor", name="study_participants_visitor_uq"),
        UniqueConstraint("study", "external", name="study_participants_external_uq"),
        {"sqlite_strict": True},
    )

    number: Mapped[int] = mapped_column(primary_key=True)
    study: Mapped[int] = mapped_column(ForeignKey(StudyRow.number))
    visitor: Mapped[str]
    external: Mapped[str]
    joined: Mapped[str]


class AnswerRow(Base):
    """An item that a participant has been given, and what they said of it."""

    __tablename__ = "study_answers"
    __table_args__ = (
        UniqueConstraint("participant", "place", name="study_answers_place_uq"),
        CheckConstraint("rating BETWEEN 0 AND 3", "rating"),
        {"sqlite_strict": True},
    )

    participant: Mapped[int] = mapped_column(ForeignKey(ParticipantRow.number), primary_key=True)
    item: Mapped[int] = mapped_column(ForeignKey(ItemRow.number), primary_key=True, index=True)
    place: Mapped[int]
    rating: Mapped[int | None]
    explanation: Mapped[str] = mapped_column(default="")
    revision: Mapped[int] = mapped_column(default=0)
    opened: Mapped[str | None]
    answered: Mapped[str | None]


TABLES: tuple[Table, ...] = tuple(Base.metadata.sorted_tables)
