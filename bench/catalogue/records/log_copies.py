"""Copies of logs in a log store: which logs have none yet, and which logs have one for long."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import Engine, func, select
from sqlalchemy.orm import sessionmaker

from bench.catalogue.models import RunRow


class LogCopies:
    """Runs of a catalogue by the state of the copies of their logs; safe from any thread."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def list_waiting(self, url: str) -> Sequence[str]:
        """Return the ids of the runs with a complete log and no copy in a store, the oldest first.

        Args:
            url: address of the store. Copies in another one do not count, unless the log is there only.
        """
        has_copy = func.coalesce(RunRow.copy_url, "").startswith(f"{url}/", autoescape=True)
        query = select(RunRow.id).where(
            RunRow.log_sha256.is_not(None), RunRow.trashed.is_(None), RunRow.removed.is_(None), ~has_copy
        )
        with self._sessions() as session:
            return session.scalars(query.order_by(RunRow.started, RunRow.id)).all()

    def list_removable(self, before: datetime) -> Sequence[RunRow]:
        """Return the runs outside the trash whose log is here unchanged and was copied long ago, the oldest first.

        Args:
            before: UTC before which the log was copied, or fetched if this was later.
        """
        query = select(RunRow).where(
            RunRow.copy_url.is_not(None),
            RunRow.removed.is_(None),
            RunRow.trashed.is_(None),
            func.coalesce(RunRow.integrity, "intact") == "intact",
            func.coalesce(RunRow.fetched, RunRow.copied) <= before,
        )
        with self._sessions() as session:
            return session.scalars(query.order_by(RunRow.started, RunRow.id)).all()
