"""Index of the runs of a specimen, newest first, for the search."""

from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Create the index."""
    op.create_index("runs_of_specimen", "runs", ["specimen", "started", "id"])


def downgrade() -> None:
    """Drop the index."""
    op.drop_index("runs_of_specimen", "runs")
