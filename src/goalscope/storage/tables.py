"""The tables of a database."""

from __future__ import annotations

from sqlalchemy import (
    REAL,
    CheckConstraint,
    Column,
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

__all__ = [
    "ABOUT",
    "ANSWERS",
    "CELLS",
    "CORRECTIONS",
    "EPISODES",
    "ITEMS",
    "METADATA",
    "PARTICIPANTS",
    "ROUNDS",
    "SCHEMA",
    "SCHEMA_VERSION",
    "STUDIES",
    "EscapedText",
]

SCHEMA_VERSION = "0002"
"""Of the tables below: a database with tables of another version is refused."""
METADATA = MetaData(
    naming_convention={
        "pk": "%(table_name)s_pk",
        "fk": "%(table_name)s_%(column_0_name)s_fk",
        "uq": "%(table_name)s_%(column_0_name)s_uq",
        "ck": "%(table_name)s_%(constraint_name)s_ck",
        "ix": "%(table_name)s_%(column_0_name)s_ix",
    }
)
"""All tables. JSON is ASCII text, which no database reads or rejects."""


class EscapedText(TypeDecorator[str]):
    """Any text; lone surrogates and NUL, which databases refuse, are stored as escapes."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        """Escape it."""
        return value and value.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


SCHEMA = Table(
    "goalscope_version",
    METADATA,
    Column("version_num", Text, primary_key=True),
    sqlite_strict=True,
)
"""The version of the tables, in one row."""
EPISODES = Table(
    "episodes",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("id", EscapedText, nullable=False, unique=True),
    Column("created", EscapedText, nullable=False),
    Column("domain", EscapedText, nullable=False),
    Column("profile", EscapedText),
    Column("method", EscapedText, nullable=False),
    Column("model", EscapedText, nullable=False),
    Column("task", EscapedText, nullable=False),
    Column("settings", Text, nullable=False),
    Column("ended", EscapedText),
    Column("score", Float(53).with_variant(REAL(), "sqlite")),  # STRICT knows no other name
    Column("owner", EscapedText, index=True),
    CheckConstraint("ended IN ('terminated', 'truncated')", "ended"),
    CheckConstraint("score BETWEEN 0 AND 1", "score"),
    sqlite_strict=True,
)
"""One episode in each row; `number` counts them as they begin."""
ROUNDS = Table(
    "rounds",
    METADATA,
    Column("episode", EscapedText, ForeignKey("episodes.id"), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("json", Text, nullable=False),
    CheckConstraint("number >= 1", "number"),
    sqlite_strict=True,
)
"""Rounds, as `rounds_json` writes them."""
CORRECTIONS = Table(
    "corrections",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("episode", EscapedText, ForeignKey("episodes.id"), nullable=False, index=True),
    Column("after", Integer, nullable=False),
    Column("json", Text, nullable=False),
    sqlite_strict=True,
)
"""What a person said of the goals after so many rounds; `number` counts these as they come."""
ABOUT = Table(
    "about",
    METADATA,
    Column("name", EscapedText, primary_key=True),
    Column("value", Text, nullable=False),
    sqlite_strict=True,
)
"""Facts about an experiment, as JSON."""
CELLS = Table(
    "cells",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("key", EscapedText, nullable=False, unique=True),
    Column("spec", Text, nullable=False),
    Column("attempts", Integer, nullable=False, default=0),
    Column("error", EscapedText),
    Column("identity", Text),
    Column("result", Text),
    sqlite_strict=True,
)
"""The cells of an experiment; `number` counts them as they are planned."""
STUDIES = Table(
    "studies",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("name", EscapedText, nullable=False, unique=True),
    Column("created", EscapedText, nullable=False),
    Column("plan", Text, nullable=False),
    Column("closed", EscapedText),
    sqlite_strict=True,
)
"""Studies with people who rate episodes; since `closed` one takes no new ones."""
ITEMS = Table(
    "study_items",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("study", Integer, ForeignKey("studies.number"), nullable=False, index=True),
    Column("view", Text, nullable=False),
    Column("episode", EscapedText, nullable=False),
    sqlite_strict=True,
)
"""What is rated, as it is shown."""
PARTICIPANTS = Table(
    "study_participants",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("study", Integer, ForeignKey("studies.number"), nullable=False),
    Column("visitor", EscapedText, nullable=False),
    Column("external", EscapedText, nullable=False),
    Column("joined", EscapedText, nullable=False),
    UniqueConstraint("study", "visitor", name="study_participants_visitor_uq"),
    UniqueConstraint("study", "external", name="study_participants_external_uq"),
    sqlite_strict=True,
)
"""Who has agreed to take part, in one browser; `external` is the id in their link."""
ANSWERS = Table(
    "study_answers",
    METADATA,
    Column("participant", Integer, ForeignKey("study_participants.number"), primary_key=True),
    Column("item", Integer, ForeignKey("study_items.number"), primary_key=True, index=True),
    Column("place", Integer, nullable=False),
    Column("rating", Integer),
    Column("explanation", EscapedText, nullable=False, default=""),
    Column("revision", Integer, nullable=False, default=0),
    Column("opened", EscapedText),
    Column("answered", EscapedText),
    UniqueConstraint("participant", "place", name="study_answers_place_uq"),
    CheckConstraint("rating BETWEEN 0 AND 3", "rating"),
    sqlite_strict=True,
)
"""Items that a participant has been given, and what they said of them."""
