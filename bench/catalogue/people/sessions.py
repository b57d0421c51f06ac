"""Sessions of browsers, stored as hashes of the secret in their cookie."""

from datetime import UTC, datetime, timedelta

from sqlalchemy import Engine, Text, delete
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime

SESSION_LIFETIME = timedelta(hours=12)
"""Time after which a person signs in again: a long shift."""


class SessionRow(Base):
    """One session."""

    __tablename__ = "sessions"

    sha256: Mapped[str] = mapped_column(Text, primary_key=True)
    """Hash of the secret in the cookie."""
    kind: Mapped[str] = mapped_column(Text)
    """``user``, ``token`` or ``bench``: who signed in."""
    subject: Mapped[str] = mapped_column(Text, index=True)
    """Name of the user, or hash of the token, whose end is also the end of the session."""
    created: Mapped[datetime] = mapped_column(UtcTime)
    expires: Mapped[datetime] = mapped_column(UtcTime)


class SessionStore:
    """Sessions in the database of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add(self, sha256: str, kind: str, subject: str) -> SessionRow:
        """Store a new session, and delete those that have expired."""
        now = datetime.now(UTC)
        row = SessionRow(sha256=sha256, kind=kind, subject=subject, created=now, expires=now + SESSION_LIFETIME)
        with self._sessions.begin() as session:
            session.execute(delete(SessionRow).where(SessionRow.expires < now))
            session.add(row)
        return row

    def find(self, sha256: str) -> SessionRow | None:
        """Return the session with a hash, or None."""
        with self._sessions() as session:
            return session.get(SessionRow, sha256)

    def end(self, sha256: str) -> None:
        """End one session."""
        with self._sessions.begin() as session:
            session.execute(delete(SessionRow).where(SessionRow.sha256 == sha256))

    def end_all(self, kind: str, subject: str, but: str = "") -> None:
        """End all sessions of a user or of a token, but the one with the given hash."""
        mine = (SessionRow.kind == kind) & (SessionRow.subject == subject) & (SessionRow.sha256 != but)
        with self._sessions.begin() as session:
            session.execute(delete(SessionRow).where(mine))
