"""Run by alembic; always on the connection, and inside the transaction, that the store opened."""

from alembic import context

from app.gestures.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    # SQLite cannot alter most of a table in place; alembic then copies it.
    render_as_batch=True,
)
context.run_migrations()
