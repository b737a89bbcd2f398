"""The tables of episodes, and those of experiments."""

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
