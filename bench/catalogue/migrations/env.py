"""What Alembic executes: the steps that a database lacks, on the connection that was handed in."""

from alembic import context

from bench.catalogue.models import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    # SQLite cannot alter a column; there, a changed table is written anew.
    render_as_batch=True,
)
with context.begin_transaction():
    context.run_migrations()
