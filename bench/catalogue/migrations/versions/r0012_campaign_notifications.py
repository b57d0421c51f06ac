"""Table `campaign_notifications`: one message of a campaign to one recipient, with its attempts."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0012"
down_revision = "0011"


def upgrade() -> None:
    """Create the table; the column that it replaces did not tell recipients and attempts apart."""
    op.create_table(
        "campaign_notifications",
        sa.Column("id", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("event_id", sa.Integer(), sa.ForeignKey("campaign_events.id"), nullable=False, index=True),
        sa.Column("recipient", sa.JSON(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False, index=True),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("next_attempt", UtcTime()),
        sa.Column("reason", sa.Text(), nullable=False),
    )
    op.drop_column("campaign_events", "notification")


def downgrade() -> None:
    """Drop the table."""
    op.add_column("campaign_events", sa.Column("notification", sa.Text(), nullable=False, server_default=""))
    op.drop_table("campaign_notifications")
