"""Column `bench` of runs and events: the name of the bench in a service that has several."""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
_TABLES = ("runs", "events")


def upgrade() -> None:
    """Add the columns; earlier runs and events name no bench."""
    for table in _TABLES:
        op.add_column(table, sa.Column("bench", sa.Text()))
    op.create_index("runs_of_bench", "runs", ["bench", "started", "id"])


def downgrade() -> None:
    """Drop them."""
    op.drop_index("runs_of_bench", "runs")
    for table in _TABLES:
        op.drop_column(table, "bench")
