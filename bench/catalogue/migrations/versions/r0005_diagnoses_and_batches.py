"""Progress, retries and inputs of jobs; table `batches`."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0005"
down_revision = "0004"

_COLUMNS = ("inputs", "version", "submissions", "earlier_attempts", "retries", "queued", "stage", "fraction")


def upgrade() -> None:
    """Add the columns and the table."""
    for column in (
        sa.Column("inputs", sa.JSON(), nullable=False, server_default="{}"),
        sa.Column("version", sa.Text(), nullable=False, server_default=""),
        sa.Column("submissions", sa.Integer(), nullable=False, server_default="1"),
        sa.Column("earlier_attempts", sa.Integer(), nullable=False, server_default="0"),
        sa.Column("retries", sa.JSON(), nullable=False, server_default="[]"),
        sa.Column("queued", UtcTime()),
        sa.Column("stage", sa.Text(), nullable=False, server_default=""),
        sa.Column("fraction", sa.Double()),
    ):
        op.add_column("jobs", column)
    op.create_table(
        "batches",
        sa.Column("id", sa.Text(), primary_key=True),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("settings", sa.JSON(), nullable=False),
        sa.Column("created", UtcTime(), nullable=False),
        sa.Column("items", sa.JSON(), nullable=False),
    )


def downgrade() -> None:
    """Remove both."""
    op.drop_table("batches")
    for column in _COLUMNS:
        op.drop_column("jobs", column)
