"""Indices for the search: runs of a specimen, newest first, and the newest result of each kind of a run."""

from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Create the indices."""
    op.create_index("jobs_newest_result", "jobs", ["run_id", "kind", "state", "finished", "id"])
    op.create_index("runs_of_specimen", "runs", ["specimen", "started", "id"])


def downgrade() -> None:
    """Drop the indices."""
    op.drop_index("jobs_newest_result", "jobs")
    op.drop_index("runs_of_specimen", "runs")
