"""Copies of logs in a log store: which logs have none yet."""

from collections.abc import Sequence

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
