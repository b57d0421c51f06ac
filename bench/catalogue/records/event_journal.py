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

    def record(self, kind: str, text: str, run_id: str | None, bench: str | None = None) -> EventRow:
        """Add an event that has just happened, and return it with its number.

        Args:
            kind: kind of the event.
            text: the event for a person.
            run_id: run in progress; left out if the catalogue does not know it.
            bench: name of the bench.
        """
        with self._sessions.begin() as session:
            known = run_id if run_id is not None and session.get(RunRow, run_id) is not None else None
            row = EventRow(run_id=known, bench=bench, at=datetime.now(UTC), kind=kind, text=text)
            session.add(row)
        return row

    def replace(self, run_id: str, events: Sequence[LogEvent]) -> None:
        """Store the events of a complete log in place of those that were recorded live, and mark the alarms."""
        with self._sessions.begin() as session:
            session.execute(delete(EventRow).where(EventRow.run_id == run_id))
            run = session.get_one(RunRow, run_id)
            session.add_all(EventRow(run_id=run_id, bench=run.bench, **event._asdict()) for event in events)
            run.alarms = [event.text for event in events if event.kind == ALARM]

    def list_of_run(self, run_id: str, limit: int, after: int = 0) -> Sequence[EventRow]:
        """Return the events of a run in their order, those with a greater number than ``after``."""
        query = select(EventRow).where(EventRow.run_id == run_id, EventRow.id > after)
        with self._sessions() as session:
            return session.scalars(query.order_by(EventRow.id).limit(limit)).all()

    def list_newest(self, limit: int, before: int | None = None, bench: str | None = None) -> Sequence[EventRow]:
        """Return the events of benches and runs, the newest first.

        Args:
            limit: largest number of events.
            before: only those with a smaller number.
            bench: only those of this bench; None for all.
        """
        query = select(EventRow).order_by(EventRow.id.desc()).limit(limit)
        if bench is not None:
            query = query.where(EventRow.bench == bench)
        if before is not None:
            query = query.where(EventRow.id < before)
        with self._sessions() as session:
            return session.scalars(query).all()
