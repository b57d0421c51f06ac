"""Idempotency keys of requests, with the stored answer of each."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import JSON, Engine, Text, delete, update
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime

LIFETIME = timedelta(days=1)
"""Time after which a key is forgotten."""


class IdempotencyRow(Base):
    """One key, and the answer of its request once it was handled."""

    __tablename__ = "idempotency_keys"

    key: Mapped[str] = mapped_column(Text, primary_key=True)
    operation: Mapped[str] = mapped_column(Text)
    """Verb and path of the request."""
    created: Mapped[datetime] = mapped_column(UtcTime, index=True)
    """UTC of the first request."""
    fingerprint: Mapped[str] = mapped_column(Text)
    """SHA-256 of the body."""
    status: Mapped[int | None] = mapped_column(default=None)
    """HTTP status of the answer; None while there is none."""
    headers: Mapped[dict[str, str]] = mapped_column(JSON, default=dict)
    answer: Mapped[str] = mapped_column(Text, default="")


@dataclass(frozen=True)
class ClaimedKey:
    """A key as it is stored; its fields are those of `IdempotencyRow`."""

    operation: str
    created: datetime
    fingerprint: str
    status: int | None
    headers: Mapping[str, str]
    answer: str


class IdempotencyKeys:
    """Keys in the database of a catalogue; safe from any thread. One service writes them."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def claim(self, key: str, operation: str, fingerprint: str, now: datetime) -> ClaimedKey:
        """Store a key that is new, and return what is stored of it; expired keys are deleted.

        Args:
            key: as the client has chosen it.
            operation: verb and path of the request, stored with a new key.
            fingerprint: SHA-256 of its body, stored with a new key.
            now: UTC.
        """
        with self._sessions.begin() as session:
            session.execute(delete(IdempotencyRow).where(IdempotencyRow.created < now - LIFETIME))
            row = session.get(IdempotencyRow, key)
            if row is None:
                row = IdempotencyRow(
                    key=key, operation=operation, fingerprint=fingerprint, created=now, headers={}, answer=""
                )
                session.add(row)
            return ClaimedKey(row.operation, row.created, row.fingerprint, row.status, row.headers, row.answer)

    def store(self, key: str, status: int, headers: Mapping[str, str], answer: str) -> None:
        """Store the answer of a request."""
        values = {"status": status, "headers": dict(headers), "answer": answer}
        with self._sessions.begin() as session:
            session.execute(update(IdempotencyRow).where(IdempotencyRow.key == key).values(**values))
