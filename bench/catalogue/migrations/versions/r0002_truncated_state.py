"""Run state `truncated`, called `cut_off` before."""

from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Rename the state in all runs."""
    op.execute("UPDATE runs SET state = 'truncated' WHERE state = 'cut_off'")


def downgrade() -> None:
    """Restore the old name."""
    op.execute("UPDATE runs SET state = 'cut_off' WHERE state = 'truncated'")
