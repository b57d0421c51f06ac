"""Column `continues` of the runs: id of the run whose first part a run continues."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the column; no earlier run is linked to its first part."""
    op.add_column("runs", sa.Column("continues", sa.Text()))


def downgrade() -> None:
    """Drop the column."""
    op.drop_column("runs", "continues")
