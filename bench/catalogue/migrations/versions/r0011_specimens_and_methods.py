"""Tables `specimens` and `methods`; version and hash of the method of each run."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0011"
down_revision = "0010"


def upgrade() -> None:
    """Create the tables and columns; the methods of earlier runs are known by name only."""
    op.create_table(
        "specimens",
        sa.Column("serial", sa.Text(), primary_key=True),
        sa.Column("description", sa.Text(), nullable=False),
        sa.Column("damper_kind", sa.Text(), nullable=False),
        sa.Column("drive_kind", sa.Text()),
        sa.Column("limits", sa.JSON(), nullable=False),
        sa.Column("registered", UtcTime(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
    )
    op.create_table(
        "methods",
        sa.Column("name", sa.Text(), primary_key=True),
        sa.Column("version", sa.Integer(), primary_key=True),
        sa.Column("sha256", sa.Text(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("created", UtcTime(), nullable=False),
    )
    op.add_column("runs", sa.Column("method_version", sa.Integer()))
    op.add_column("runs", sa.Column("method_sha256", sa.Text()))


def downgrade() -> None:
    """Drop both."""
    for column in ("method_sha256", "method_version"):
        op.drop_column("runs", column)
    for table in ("methods", "specimens"):
        op.drop_table(table)
