"""Approvals of methods, by the hash of their content, so that a changed method is not approved."""

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime

from sqlalchemy import Engine, Text, delete, select
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime


class ApprovalRow(Base):
    """Approval of one content of a method."""

    __tablename__ = "method_approvals"

    sha256: Mapped[str] = mapped_column(Text, primary_key=True)
    """Hash of the content of the method."""
    approved: Mapped[datetime] = mapped_column(UtcTime)
    approved_by: Mapped[str] = mapped_column(Text)
    """Full name of the person."""


class ApprovalStore:
    """Approvals in the database of a catalogue; safe from any thread."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def approve(self, sha256: str, by: str) -> None:
        """Approve a content; an earlier approval stays as it is."""
        with self._sessions.begin() as session:
            if session.get(ApprovalRow, sha256) is None:
                session.add(ApprovalRow(sha256=sha256, approved=datetime.now(UTC), approved_by=by))

    def withdraw(self, sha256: str) -> None:
        """Withdraw an approval, if there is one."""
        with self._sessions.begin() as session:
            session.execute(delete(ApprovalRow).where(ApprovalRow.sha256 == sha256))

    def find(self, hashes: Iterable[str]) -> Mapping[str, ApprovalRow]:
        """Return the approvals of those contents that have one, by hash."""
        with self._sessions() as session:
            rows = session.scalars(select(ApprovalRow).where(ApprovalRow.sha256.in_(list(hashes))))
            return {row.sha256: row for row in rows}
