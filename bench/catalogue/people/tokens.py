"""Tokens of programs: each has a role and an end, and is stored as a hash."""

import secrets
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from sqlalchemy import Engine, Text, select, update
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime
from bench.people import Role

_USE_RESOLUTION = timedelta(minutes=5)
"""Resolution of the time of the latest use, so that a busy program does not write at every request."""


class TokenRow(Base):
    """One token of a program."""

    __tablename__ = "tokens"

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    sha256: Mapped[str] = mapped_column(Text, unique=True)
    """Hash of the token; 256 random bits need no slow one."""
    label: Mapped[str] = mapped_column(Text)
    role: Mapped[Role] = mapped_column(Text)
    created: Mapped[datetime] = mapped_column(UtcTime)
    created_by: Mapped[str] = mapped_column(Text)
    """Creator as in the audit trail, such as ``user:mcurie``."""
    expires: Mapped[datetime] = mapped_column(UtcTime)
    last_used: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC of the latest use, in steps of five minutes."""
    revoked: Mapped[datetime | None] = mapped_column(UtcTime, default=None)

    def is_valid(self, now: datetime) -> bool:
        """Return whether the token may be used at a time (UTC)."""
        return self.revoked is None and now < self.expires


class TokenStore:
    """Tokens in the database of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add(self, sha256: str, label: str, role: Role, created_by: str, lifetime: timedelta) -> TokenRow:
        """Store a token by its hash, and return its row."""
        now = datetime.now(UTC)
        row = TokenRow(
            id=secrets.token_hex(6),
            sha256=sha256,
            label=label,
            role=role,
            created=now,
            created_by=created_by,
            expires=now + lifetime,
        )
        with self._sessions.begin() as session:
            session.add(row)
        return row

    def get(self, token_id: str) -> TokenRow | None:
        """Return the token with an id, or None."""
        with self._sessions() as session:
            return session.get(TokenRow, token_id)

    def find(self, sha256: str) -> TokenRow | None:
        """Return the token with a hash, or None."""
        with self._sessions() as session:
            return session.scalar(select(TokenRow).where(TokenRow.sha256 == sha256))

    def list_tokens(self) -> Sequence[TokenRow]:
        """Return all tokens, newest first, those included that have ended."""
        with self._sessions() as session:
            return session.scalars(select(TokenRow).order_by(TokenRow.created.desc(), TokenRow.id)).all()

    def record_use(self, row: TokenRow) -> None:
        """Store the time of a use, unless a recent one is stored."""
        now = datetime.now(UTC)
        if row.last_used is None or now - row.last_used > _USE_RESOLUTION:
            with self._sessions.begin() as session:
                session.execute(update(TokenRow).where(TokenRow.id == row.id).values(last_used=now))

    def revoke(self, token_id: str) -> None:
        """End a token now; one that was revoked before keeps that time."""
        query = update(TokenRow).where(TokenRow.id == token_id, TokenRow.revoked.is_(None))
        with self._sessions.begin() as session:
            session.execute(query.values(revoked=datetime.now(UTC)))

    def revoke_all(self, created_by: str) -> None:
        """End all tokens of who has created them."""
        query = update(TokenRow).where(TokenRow.created_by == created_by, TokenRow.revoked.is_(None))
        with self._sessions.begin() as session:
            session.execute(query.values(revoked=datetime.now(UTC)))
