"""Run by Alembic: the revisions, on the connection and in the transaction of the store."""

from alembic import context

from goalscope.database.tables import METADATA, VERSION_TABLE

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=METADATA,
    version_table=VERSION_TABLE,
)
with context.begin_transaction():
    context.run_migrations()
