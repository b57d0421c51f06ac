"""Signatures of reports; the audit trail has an entry for each, and decides in case of doubt."""

from collections.abc import Sequence
from datetime import datetime
from typing import Literal, TypeAlias

from sqlalchemy import BigInteger, Engine, Index, Text, select
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, UtcTime

ReportKind: TypeAlias = Literal["run", "campaign"]
"""Kind of thing that a report is about."""
SignatureMeaning: TypeAlias = Literal["author", "reviewed", "approved"]
"""Why a person signs: as its author, after a review, or to approve it."""


class SignatureRow(Base):
    """One signature of one file."""

    __tablename__ = "report_signatures"
    __table_args__ = (Index("signatures_of_subject", "kind", "subject"),)

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    kind: Mapped[ReportKind] = mapped_column(Text)
    subject: Mapped[str] = mapped_column(Text)
    """Id of the run or of the campaign."""
    sha256: Mapped[str] = mapped_column(Text)
    """Hash of the signed file."""
    format: Mapped[str] = mapped_column(Text)
    """Ending of the signed file."""
    made: Mapped[datetime] = mapped_column(UtcTime)
    """UTC at which the signed file was made."""
    user: Mapped[str] = mapped_column(Text)
    """Name of the user."""
    full_name: Mapped[str] = mapped_column(Text)
    """Full name when the report was signed."""
    meaning: Mapped[SignatureMeaning] = mapped_column(Text)
    signed: Mapped[datetime] = mapped_column(UtcTime)
    audit_seq: Mapped[int] = mapped_column(BigInteger)
    """Number of the entry in the audit trail."""


class SignatureStore:
    """Signatures in the database of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add(self, row: SignatureRow) -> None:
        """Store a signature."""
        with self._sessions.begin() as session:
            session.add(row)

    def list_signatures(self, kind: ReportKind, subject: str) -> Sequence[SignatureRow]:
        """Return the signatures of the reports on a run or on a campaign, the oldest first."""
        own = (SignatureRow.kind == kind) & (SignatureRow.subject == subject)
        with self._sessions() as session:
            return session.scalars(select(SignatureRow).where(own).order_by(SignatureRow.audit_seq)).all()
