"""Notes, tags and trash of runs; events; losses and alarms of logs."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0008"
down_revision = "0007"
_COLUMNS = ("lost", "alarms", "tags", "revision", "trashed")


def upgrade() -> None:
    """Add tables and columns; losses, alarms and events of earlier runs are read from their logs by the scan."""
    op.add_column("runs", sa.Column("lost", sa.JSON()))
    op.add_column("runs", sa.Column("alarms", sa.JSON()))
    op.add_column("runs", sa.Column("tags", sa.JSON(), nullable=False, server_default="[]"))
    op.add_column("runs", sa.Column("revision", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("runs", sa.Column("trashed", UtcTime()))
    op.create_table(
        "notes",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("run_id", sa.Text(), sa.ForeignKey("runs.id"), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("author", sa.Text(), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
    )
    op.create_table(
        "events",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("run_id", sa.Text(), sa.ForeignKey("runs.id")),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("time_s", sa.Double()),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
    )
    for table in ("notes", "events"):
        op.create_index(f"ix_{table}_run_id", table, ["run_id"])


def downgrade() -> None:
    """Drop tables and columns."""
    for table in ("notes", "events"):
        op.drop_table(table)
    for column in _COLUMNS:
        op.drop_column("runs", column)
