"""Columns `copy_url`, `copied`, `removed` and `fetched` of the runs: the copy of the log in a log store."""

import sqlalchemy as sa
from alembic import op

from bench.catalogue.models import UtcTime

revision = "0018"
down_revision = "0017"
_TIMES = ("copied", "removed", "fetched")


def upgrade() -> None:
    """Add the columns; no earlier log has a copy."""
    op.add_column("runs", sa.Column("copy_url", sa.Text()))
    for name in _TIMES:
        op.add_column("runs", sa.Column(name, UtcTime()))


def downgrade() -> None:
    """Drop the columns."""
    for name in ("copy_url", *_TIMES):
        op.drop_column("runs", name)
