"""Run by Alembic: the revisions, on the connection and in the transaction of the store."""

from alembic import context

from goalscope.database.tables import VERSION_TABLE, Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    version_table=VERSION_TABLE,
)
with context.begin_transaction():
    context.run_migrations()
