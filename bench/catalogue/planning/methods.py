"""Methods that people have stored: versions of a name, which never change."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import JSON, Engine, Text, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime

SHIPPED_VERSION = 1
"""Version of a method that comes with mrbench."""
MAX_VERSION = 2**31 - 1
"""Largest integer of a column."""
_ATTEMPTS = 20
"""Number of attempts to store a version while others store versions of the same name."""


class MethodRow(Base):
    """One version of a stored method."""

    __tablename__ = "methods"

    name: Mapped[str] = mapped_column(Text, primary_key=True)
    version: Mapped[int] = mapped_column(primary_key=True)
    sha256: Mapped[str] = mapped_column(Text)
    """Hash of the content."""
    document: Mapped[dict[str, Any]] = mapped_column(JSON)
    """`mrbench.method/1`."""
    created: Mapped[datetime] = mapped_column(UtcTime)


class MethodStore:
    """Stored methods in the database of a catalogue; safe from any thread."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add(self, row: MethodRow, least_version: int) -> tuple[MethodRow, bool]:
        """Store a method as the next version of its name, unless that name has a version of equal content.

        Args:
            row: method; its version is set here.
            least_version: version of the first stored one.

        Returns:
            The stored version, and whether it is new.
        """
        for _ in range(_ATTEMPTS - 1):
            try:
                return self._add_once(row, least_version)
            except IntegrityError:  # another request has stored this version meanwhile
                continue
        return self._add_once(row, least_version)

    def _add_once(self, row: MethodRow, least_version: int) -> tuple[MethodRow, bool]:
        with self._sessions.begin() as session:
            own = MethodRow.name == row.name
            equal = session.scalar(select(MethodRow).where(own, MethodRow.sha256 == row.sha256))
            if equal is not None:
                return equal, False
            newest = session.scalar(select(func.max(MethodRow.version)).where(own))
            stored = MethodRow(
                name=row.name,
                version=least_version if newest is None else newest + 1,
                sha256=row.sha256,
                document=row.document,
                created=row.created,
            )
            session.add(stored)
            session.flush()
            return stored, True

    def get(self, name: str, version: int | None = None) -> MethodRow | None:
        """Return a version of a stored method, or its newest one; None if there is none."""
        if version is not None and version > MAX_VERSION:
            return None
        query = select(MethodRow).where(MethodRow.name == name).order_by(MethodRow.version.desc())
        if version is not None:
            query = query.where(MethodRow.version == version)
        with self._sessions() as session:
            return session.scalars(query.limit(1)).first()

    def list_versions(self, name: str) -> Sequence[MethodRow]:
        """Return the stored versions of a name, the newest first."""
        query = select(MethodRow).where(MethodRow.name == name).order_by(MethodRow.version.desc())
        with self._sessions() as session:
            return session.scalars(query).all()

    def list_newest(self) -> Sequence[MethodRow]:
        """Return the newest version of each stored name, in the order of the names."""
        newest = select(MethodRow.name, func.max(MethodRow.version).label("version")).group_by(MethodRow.name)
        part = newest.subquery()
        same = (part.c.name == MethodRow.name) & (part.c.version == MethodRow.version)
        with self._sessions() as session:
            return session.scalars(select(MethodRow).join(part, same).order_by(MethodRow.name)).all()

    def find_version(self, name: str, sha256: str) -> int | None:
        """Return the version of a name with a content; None if it is not stored."""
        query = select(MethodRow.version).where(MethodRow.name == name, MethodRow.sha256 == sha256)
        with self._sessions() as session:
            return session.scalars(query).first()
