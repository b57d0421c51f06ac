"""Users of the service: local ones, and those of a provider."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import JSON, Engine, Text, delete, select, update
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime
from bench.people import Right, Role

_NAME = re.compile(r"[a-z][a-z0-9._-]{1,39}")


class UserRow(Base):
    """One user."""

    __tablename__ = "users"

    name: Mapped[str] = mapped_column(Text, primary_key=True)
    full_name: Mapped[str] = mapped_column(Text, default="")
    role: Mapped[Role] = mapped_column(Text)
    extra_rights: Mapped[list[Right]] = mapped_column(JSON, default=list)
    """Rights beyond those of the role."""
    password_hash: Mapped[str | None] = mapped_column(Text, default=None)
    """Argon2id; None for a user who cannot sign in by a password."""
    external_id: Mapped[str | None] = mapped_column(Text, unique=True, default=None)
    """Issuer and subject of a person who signs in by a provider only; None for a local user."""
    disabled: Mapped[bool] = mapped_column(default=False)
    created: Mapped[datetime] = mapped_column(UtcTime)
    last_seen: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC of the latest sign-in."""
    revision: Mapped[int] = mapped_column(default=1)
    """Number of changes, the creation counted."""


def check_user_name(name: str) -> str:
    """Return the name of a new user unchanged if it may be used.

    Raises:
        ValueError: it has other characters than those allowed, or the wrong length.
    """
    if not _NAME.fullmatch(name):
        raise ValueError("a user name has 2 to 40 characters: small letters first, then also digits and . _ -")
    return name


class UserStore:
    """Users in the database of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def find(self, name: str) -> UserRow | None:
        """Return a user, or None."""
        with self._sessions() as session:
            return session.get(UserRow, name)

    def find_external(self, external_id: str) -> UserRow | None:
        """Return the user of a person of the provider, or None."""
        with self._sessions() as session:
            return session.scalar(select(UserRow).where(UserRow.external_id == external_id))

    def list_users(self) -> Sequence[UserRow]:
        """Return all users in the order of their names."""
        with self._sessions() as session:
            return session.scalars(select(UserRow).order_by(UserRow.name)).all()

    def add(self, row: UserRow) -> bool:
        """Add a user, and return False if the name is taken."""
        row.created, row.revision = datetime.now(UTC), 1
        with self._sessions.begin() as session:
            if session.get(UserRow, row.name) is not None:
                return False
            session.add(row)
            return True

    def change(self, name: str, values: dict[str, Any]) -> UserRow | None:
        """Set columns of a user, and return the user; None if there is none."""
        with self._sessions.begin() as session:
            row = session.get(UserRow, name, with_for_update=True)
            if row is not None:
                for column, value in values.items():
                    setattr(row, column, value)
                row.revision += 1
            return row

    def record_sign_in(self, name: str) -> None:
        """Store the time of a sign-in."""
        with self._sessions.begin() as session:
            session.execute(update(UserRow).where(UserRow.name == name).values(last_seen=datetime.now(UTC)))

    def remove(self, name: str) -> bool:
        """Remove a user, and return False if there was none."""
        with self._sessions.begin() as session:
            return bool(session.execute(delete(UserRow).where(UserRow.name == name)).rowcount)  # type: ignore[attr-defined]
