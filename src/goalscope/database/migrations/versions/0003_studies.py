"""The tables of studies in which people rate episodes."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Make them."""
    op.create_table(
        "studies",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("name", sa.Text, nullable=False, unique=True),
        sa.Column("created", sa.Text, nullable=False),
        sa.Column("plan", sa.Text, nullable=False),
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
