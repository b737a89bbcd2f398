"""What a person says of the goals between rounds."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Make its table."""
    op.create_table(
        "corrections",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("episode", sa.Text, sa.ForeignKey("episodes.id"), nullable=False, index=True),
        sa.Column("after", sa.Integer, nullable=False),
        sa.Column("json", sa.Text, nullable=False),
        sqlite_strict=True,
    )
