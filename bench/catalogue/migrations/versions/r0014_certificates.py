"""Tables `certificates` and `certificate_withdrawals`; overdue calibrations of each run."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0014"
down_revision = "0013"


def upgrade() -> None:
    """Create the tables and the column; earlier runs name no certificates."""
    op.create_table(
        "certificates",
        sa.Column("id", sa.Text(), primary_key=True),
        sa.Column("version", sa.Integer(), primary_key=True),
        sa.Column("channel", sa.Text(), nullable=False, index=True),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("created", UtcTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
    )
    op.create_table(
        "certificate_withdrawals",
        sa.Column("certificate", sa.Text(), primary_key=True),
        sa.Column("withdrawn", UtcTime(), nullable=False),
        sa.Column("withdrawn_by", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
    )
    op.add_column("runs", sa.Column("calibration_overdue", sa.JSON()))


def downgrade() -> None:
    """Drop them."""
    op.drop_column("runs", "calibration_overdue")
    for table in ("certificate_withdrawals", "certificates"):
        op.drop_table(table)
