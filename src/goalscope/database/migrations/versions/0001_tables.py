"""The tables of episodes, of experiments, and of studies in which people rate episodes."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make them."""
    number = sa.Float(53).with_variant(sa.REAL(), "sqlite")
    op.create_table(
        "episodes",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("created", sa.Text, nullable=False),
        sa.Column("domain", sa.Text, nullable=False),
        sa.Column("profile", sa.Text),
        sa.Column("method", sa.Text, nullable=False),
        sa.Column("model", sa.Text, nullable=False),
        sa.Column("task", sa.Text, nullable=False),
        sa.Column("settings", sa.Text, nullable=False),
        sa.Column("ended", sa.Text),
        sa.Column("score", number),
        sa.Column("owner", sa.Text, index=True),
        sa.CheckConstraint("ended IN ('terminated', 'truncated')", "ended"),
        sa.CheckConstraint("score BETWEEN 0 AND 1", "score"),
        sqlite_strict=True,
    )
    op.create_table(
        "rounds",
        sa.Column("episode", sa.Text, sa.ForeignKey("episodes.id"), primary_key=True),
        sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("json", sa.Text, nullable=False),
        sa.CheckConstraint("number >= 1", "number"),
        sqlite_strict=True,
    )
    op.create_table(
        "corrections",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("episode", sa.Text, sa.ForeignKey("episodes.id"), nullable=False, index=True),
        sa.Column("after", sa.Integer, nullable=False),
        sa.Column("json", sa.Text, nullable=False),
        sqlite_strict=True,
    )
    op.create_table(
        "about",
        sa.Column("name", sa.Text, primary_key=True),
        sa.Column("value", sa.Text, nullable=False),
        sqlite_strict=True,
    )
    op.create_table(
        "cells",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("key", sa.Text, nullable=False, unique=True),
        sa.Column("spec", sa.Text, nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("error", sa.Text),
        sa.Column("identity", sa.Text),
        sa.Column("result", sa.Text),
        sqlite_strict=True,
    )
    op.create_table(
        "studies",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("name", sa.Text, nullable=False, unique=True),
        sa.Column("created", sa.Text, nullable=False),
        sa.Column("plan", sa.Text, nullable=False),
        sa.Column("closed", sa.Text),
        sqlite_strict=True,
    )
    op.create_table(
        "study_items",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), nullable=False, index=True),
        sa.Column("view", sa.Text, nullable=False),
        sa.Column("episode", sa.Text, nullable=False),
        sqlite_strict=True,
    )
    op.create_table(
        "study_participants",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), nullable=False),
        sa.Column("visitor", sa.Text, nullable=False),
        sa.Column("external", sa.Text, nullable=False),
        sa.Column("joined", sa.Text, nullable=False),
        sa.UniqueConstraint("study", "visitor", name="study_participants_visitor_uq"),
        sa.UniqueConstraint("study", "external", name="study_participants_external_uq"),
        sqlite_strict=True,
    )
    op.create_table(
        "study_answers",
        sa.Column(
            "participant",
            sa.Integer,
            sa.ForeignKey("study_participants.number"),
            primary_key=True,
            autoincrement=False,
        ),
        sa.Column(
            "item",
            sa.Integer,
            sa.ForeignKey("study_items.number"),
            primary_key=True,
            autoincrement=False,
            index=True,
        ),
        sa.Column("place", sa.Integer, nullable=False),
        sa.Column("rating", sa.Integer),
        sa.Column("explanation", sa.Text, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("opened", sa.Text),
        sa.Column("answered", sa.Text),
        sa.UniqueConstraint("participant", "place", name="study_answers_place_uq"),
        sa.CheckConstraint("rating BETWEEN 0 AND 3", "rating"),
        sqlite_strict=True,
    )
