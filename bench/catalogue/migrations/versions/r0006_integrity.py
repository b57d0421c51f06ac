"""Columns `integrity`, `found_sha256` and `checked` of the runs: result of the comparison with the stored hash."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the columns; no earlier run was checked."""
    op.add_column("runs", sa.Column("integrity", sa.String(16)))
    op.add_column("runs", sa.Column("found_sha256", sa.Text()))
    op.add_column("runs", sa.Column("checked", UtcTime()))


def downgrade() -> None:
    """Drop the columns."""
    for column in ("integrity", "found_sha256", "checked"):
        op.drop_column("runs", column)
