"""Column `bench`: the name of the bench in a service that has several."""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
_WITHOUT_BENCH = ("runs", "events")
"""Tables whose earlier rows name no bench."""
_WITH_DEFAULT_BENCH = ("certificates", "check_baselines")
"""Tables whose earlier rows belong to the bench that was the only one."""


def upgrade() -> None:
    """Add the columns."""
    for table in _WITHOUT_BENCH:
        op.add_column(table, sa.Column("bench", sa.Text()))
    for table in _WITH_DEFAULT_BENCH:
        op.add_column(table, sa.Column("bench", sa.Text(), nullable=False, server_default="bench"))
    op.create_index("runs_of_bench", "runs", ["bench", "started", "id"])


def downgrade() -> None:
    """Drop them."""
    op.drop_index("runs_of_bench", "runs")
    for table in (*_WITHOUT_BENCH, *_WITH_DEFAULT_BENCH):
        op.drop_column(table, "bench")
