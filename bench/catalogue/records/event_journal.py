"""Journal of the events: stored when they happen, and replaced by those of the log once it is complete."""

from collections.abc import Sequence
from datetime import UTC, datetime

from sqlalchemy import Engine, delete, select
from sqlalchemy.orm import sessionmaker

from bench.catalogue.models import EventRow, RunRow
from bench.catalogue.records.log_events import LogEvent

ALARM = "alarm"
"""Kind of an event that a person has to know about."""


class EventJournal:
    """Journal of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def record(self, kind: str, text: str, run_id: str | None) -> None:
        """Add an event that has just happened; ``run_id`` is the run in progress, if the catalogue knows it."""
        with self._sessions.begin() as session:
            known = run_id if run_id is not None and session.get(RunRow, run_id) is not None else None
            session.add(EventRow(run_id=known, at=datetime.now(UTC), kind=kind, text=text))

    def replace(self, run_id: str, events: Sequence[LogEvent]) -> None:
        """Store the events of a complete log in place of those that were recorded live, and mark the alarms."""
        with self._sessions.begin() as session:
            session.execute(delete(EventRow).where(EventRow.run_id == run_id))
            session.add_all(EventRow(run_id=run_id, **event._asdict()) for event in events)
            session.get_one(RunRow, run_id).alarms = [event.text for event in events if event.kind == ALARM]

    def list_of_run(self, run_id: str, limit: int, after: int = 0) -> Sequence[EventRow]:
        """Return the events of a run in their order, those with a greater number than ``after``."""
        query = select(EventRow).where(EventRow.run_id == run_id, EventRow.id > after)
        with self._sessions() as session:
            return session.scalars(query.order_by(EventRow.id).limit(limit)).all()

    def list_newest(self, limit: int, before: int | None = None) -> Sequence[EventRow]:
        """Return the events of bench and runs, the newest first, those with a smaller number than ``before``."""
        query = select(EventRow).order_by(EventRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(EventRow.id < before)
        with self._sessions() as session:
            return session.scalars(query).all()
