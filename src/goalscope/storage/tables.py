"""The tables of a database."""

from __future__ import annotations

from sqlalchemy import (
    CheckConstraint,
    Column,
    Dialect,
    Double,
    ForeignKey,
    Integer,
    MetaData,
    Table,
    Text,
    TypeDecorator,
    UniqueConstraint,
)

SCHEMA_VERSION = "0004"
"""Version of the tables below; a database with another version is refused."""
METADATA = MetaData()
"""All tables. JSON is ASCII text, which no database reads or rejects."""


class EscapedText(TypeDecorator[str]):
    """Any text; lone surrogates and NUL, which databases refuse, are stored as escapes."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        """Escape it."""
        return value and value.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


SCHEMA = Table("goalscope_version", METADATA, Column("version_num", Text, primary_key=True))
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
    Column("score", Double),
    CheckConstraint("ended IN ('terminated', 'truncated')"),
    CheckConstraint("score BETWEEN 0 AND 1"),
)
"""One episode in each row; `number` counts them as they begin."""
ROUNDS = Table(
    "rounds",
    METADATA,
    Column("episode", EscapedText, ForeignKey("episodes.id"), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("query", EscapedText, nullable=False),
    Column("utterance", EscapedText, nullable=False),
    Column("json", Text, nullable=False),
    CheckConstraint("number >= 0"),
)
"""Rounds, as `round_to_json` writes them; the turn stands in columns of its own to be searched.

Tracking keeps the state before the first turn as round 0, which is no round of the episode.
"""
CORRECTIONS = Table(
    "corrections",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("episode", EscapedText, ForeignKey("episodes.id"), nullable=False, index=True),
    Column("after", Integer, nullable=False),
    Column("json", Text, nullable=False),
)
"""What a person said of the goals after so many rounds; `number` counts these as they come."""
ABOUT = Table(
    "about",
    METADATA,
    Column("name", EscapedText, primary_key=True),
    Column("value", Text, nullable=False),
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
)
"""Studies with people who rate episodes; since `closed` one takes no new ones."""
ITEMS = Table(
    "study_items",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("study", Integer, ForeignKey("studies.number"), nullable=False, index=True),
    Column("view", Text, nullable=False),
    Column("episode", EscapedText, nullable=False),
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
    UniqueConstraint("study", "visitor"),
    UniqueConstraint("study", "external"),
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
    UniqueConstraint("participant", "place"),
    CheckConstraint("rating BETWEEN 0 AND 3"),
)
"""Items that a participant has been given, and what they said of them."""
