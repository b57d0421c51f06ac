"""Script that Alembic executes: runs the missing migrations on the given connection."""

from alembic import context

from bench.catalogue.models import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    # SQLite cannot alter a column: a changed table is copied instead.
    render_as_batch=True,
)
with context.begin_transaction():
    context.run_migrations()
