"""Column `ending` of the runs, derived where outcome and reason determine it."""

import sqlalchemy as sa
from alembic import op

from bench.endings import derive_ending

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Add the column and fill it."""
    op.add_column("runs", sa.Column("ending", sa.String(16)))
    runs = sa.table("runs", *(sa.column(name) for name in ("id", "outcome", "reason", "ending")))
    connection = op.get_bind()
    for run_id, outcome, reason in connection.execute(sa.select(runs.c.id, runs.c.outcome, runs.c.reason)).all():
        ending = derive_ending(outcome, reason)
        connection.execute(sa.update(runs).where(runs.c.id == run_id).values(ending=ending))


def downgrade() -> None:
    """Drop the column."""
    op.drop_column("runs", "ending")
