"""Tables `users`, `tokens`, `sessions` and `method_approvals`."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0013"
down_revision = "0012"


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "users",
        sa.Column("name", sa.Text(), primary_key=True),
        sa.Column("full_name", sa.Text(), nullable=False),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("extra_rights", sa.JSON(), nullable=False),
        sa.Column("password_hash", sa.Text()),
        sa.Column("external_id", sa.Text(), unique=True),
        sa.Column("disabled", sa.Boolean(), nullable=False),
        sa.Column("created", UtcTime(), nullable=False),
        sa.Column("last_seen", UtcTime()),
        sa.Column("revision", sa.Integer(), nullable=False),
    )
    op.create_table(
        "tokens",
        sa.Column("id", sa.Text(), primary_key=True),
        sa.Column("sha256", sa.Text(), nullable=False, unique=True),
        sa.Column("label", sa.Text(), nullable=False),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("created", UtcTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.Column("expires", UtcTime(), nullable=False),
        sa.Column("last_used", UtcTime()),
        sa.Column("revoked", UtcTime()),
    )
    op.create_table(
        "sessions",
        sa.Column("sha256", sa.Text(), primary_key=True),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("subject", sa.Text(), nullable=False, index=True),
        sa.Column("created", UtcTime(), nullable=False),
        sa.Column("expires", UtcTime(), nullable=False),
    )
    op.create_table(
        "method_approvals",
        sa.Column("sha256", sa.Text(), primary_key=True),
        sa.Column("approved", UtcTime(), nullable=False),
        sa.Column("approved_by", sa.Text(), nullable=False),
    )


def downgrade() -> None:
    """Drop the tables."""
    for table in ("method_approvals", "sessions", "tokens", "users"):
        op.drop_table(table)
