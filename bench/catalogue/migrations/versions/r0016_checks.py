"""Tables `check_records` and `check_baselines`; failed checks of each run."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0016"
down_revision = "0015"
_TEXTS = ("unit", "specimen", "bench", "instrument", "serial")
_NUMBERS = ("value", "standard_deviation", "standard_uncertainty", "independent_samples", "duration_s")


def upgrade() -> None:
    """Create the tables and the column; earlier runs name no checks."""
    op.create_table(
        "check_records",
        sa.Column("run", sa.Text(), sa.ForeignKey("runs.id"), primary_key=True),
        sa.Column("check_kind", sa.Text(), primary_key=True),
        sa.Column("channel", sa.Text(), primary_key=True),
        sa.Column("measured", UtcTime(), nullable=False, index=True),
        sa.Column("samples", sa.Integer(), nullable=False),
        sa.Column("temperature_c", sa.Double()),
        *(sa.Column(name, sa.Text(), nullable=False) for name in _TEXTS),
        *(sa.Column(name, sa.Double(), nullable=False) for name in _NUMBERS),
    )
    op.create_table(
        "check_baselines",
        sa.Column("id", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("check_kind", sa.Text(), nullable=False),
        sa.Column("channel", sa.Text(), nullable=False, index=True),
        sa.Column("specimen", sa.Text(), nullable=False),
        sa.Column("since", UtcTime(), nullable=False),
        sa.Column("author", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
    )
    op.add_column("runs", sa.Column("failed_checks", sa.JSON()))


def downgrade() -> None:
    """Drop them."""
    op.drop_column("runs", "failed_checks")
    for table in ("check_baselines", "check_records"):
        op.drop_table(table)
