"""Notes and tags of runs: an append-only layer beside the logs, which never change."""

from collections.abc import Sequence
from datetime import UTC, datetime

from sqlalchemy import Engine, select
from sqlalchemy.orm import Session, sessionmaker

from bench.catalogue.models import NoteKind, NoteRow, RunRow


class Notebook:
    """Notes on the runs of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add_note(self, run_id: str, author: str, text: str) -> NoteRow:
        """Add a note to a run and return it; a correction is a further note."""
        with self._sessions.begin() as session:
            return _add(session, run_id, author, "note", text)

    def list_notes(self, run_id: str, limit: int, after: int = 0) -> Sequence[NoteRow]:
        """Return the notes on a run in their order, those with a greater number than ``after``."""
        query = select(NoteRow).where(NoteRow.run_id == run_id, NoteRow.id > after)
        with self._sessions() as session:
            return session.scalars(query.order_by(NoteRow.id).limit(limit)).all()

    def change_tags(self, run_id: str, author: str, tags: Sequence[str], revision: int) -> RunRow | None:
        """Give a run other tags, and note the change.

        Args:
            run_id: the run.
            author: person who changes them.
            tags: all tags that the run has afterwards.
            revision: revision of the run that the person has seen.

        Returns:
            The changed run; None if another change came first.
        """
        with self._sessions.begin() as session:
            query = select(RunRow).where(RunRow.id == run_id, RunRow.revision == revision)
            row = session.scalar(query.with_for_update())
            if row is None:
                return None
            before, row.tags, row.revision = row.tags, sorted(set(tags)), revision + 1
            _add(session, run_id, author, "tags", f"Tags: {_join(row.tags)} (before: {_join(before)})")
            return row


def _add(session: Session, run_id: str, author: str, kind: NoteKind, text: str) -> NoteRow:
    note = NoteRow(run_id=run_id, at=datetime.now(UTC), author=author, kind=kind, text=text)
    session.add(note)
    return note


def _join(tags: Sequence[str]) -> str:
    return ", ".join(tags) or "none"
