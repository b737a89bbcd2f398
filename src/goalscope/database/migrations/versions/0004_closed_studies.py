"""Studies that take no new participants."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Note when each was closed."""
    op.add_column("studies", sa.Column("closed", sa.Text))
