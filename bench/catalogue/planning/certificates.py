"""Calibration certificates: versions of an id, which never change, and their withdrawal."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Any

import orjson
from sqlalchemy import JSON, Engine, Text, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Mapped, Session, mapped_column, sessionmaker

from bench.calibration import (
    Certificate,
    CertificateState,
    IssuedCertificate,
    choose_current,
    find_state,
)
from bench.catalogue.models import Base, UtcTime
from bench.config import DEFAULT_BENCH


class CertificateRow(Base):
    """One version of a certificate."""

    __tablename__ = "certificates"

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    version: Mapped[int] = mapped_column(primary_key=True)
    channel: Mapped[str] = mapped_column(Text, index=True)
    bench: Mapped[str] = mapped_column(Text, default=DEFAULT_BENCH)
    """Name of the bench that has the channel."""
    document: Mapped[dict[str, Any]] = mapped_column(JSON)
    """`mrbench.certificate/1`."""
    created: Mapped[datetime] = mapped_column(UtcTime)
    created_by: Mapped[str] = mapped_column(Text)
    """User or token that stored this version."""
    reason: Mapped[str] = mapped_column(Text, default="")
    """Reason of the correction; empty for the first version."""


class WithdrawalRow(Base):
    """Withdrawal of a certificate with all its versions."""

    __tablename__ = "certificate_withdrawals"

    certificate: Mapped[str] = mapped_column(Text, primary_key=True)
    withdrawn: Mapped[datetime] = mapped_column(UtcTime)
    withdrawn_by: Mapped[str] = mapped_column(Text)
    reason: Mapped[str] = mapped_column(Text)


@dataclass(frozen=True)
class StoredCertificate:
    """One version of a certificate, and the withdrawal of all its versions, if there is one."""

    row: CertificateRow
    withdrawal: WithdrawalRow | None

    @property
    def issued(self) -> IssuedCertificate:
        """Document with id and version."""
        document = Certificate.model_validate_json(orjson.dumps(self.row.document))
        return IssuedCertificate(id=self.row.id, version=self.row.version, document=document)


class CertificateStore:
    """Certificates in the database of a catalogue; safe from any thread."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add(self, certificate: Certificate, author: str, bench: str = DEFAULT_BENCH) -> StoredCertificate | None:
        """Store the first version of a certificate; None if the laboratory's number is known for its channel.

        Args:
            certificate: document.
            author: user or token.
            bench: name of the bench that has the channel.
        """
        row = CertificateRow(id=make_id(certificate), version=1, bench=bench, reason="")
        try:
            return self._store(row, certificate, author)
        except IntegrityError:
            return None

    def correct(self, version: StoredCertificate, certificate: Certificate, author: str, reason: str) -> bool:
        """Store a correction as the version after another one; False if somebody has stored that version."""
        before = version.row
        row = CertificateRow(id=before.id, version=before.version + 1, bench=before.bench, reason=reason)
        try:
            self._store(row, certificate, author)
        except IntegrityError:
            return False
        return True

    def withdraw(self, certificate_id: str, author: str, reason: str) -> bool:
        """Withdraw a certificate, which stays visible; False if it is withdrawn already."""
        row = WithdrawalRow(
            certificate=certificate_id, withdrawn=datetime.now(UTC), withdrawn_by=author, reason=reason
        )
        try:
            with self._sessions.begin() as session:
                session.add(row)
        except IntegrityError:
            return False
        return True

    def find(self, certificate_id: str, version: int | None = None) -> StoredCertificate | None:
        """Return a version of a certificate, or its newest one; None if there is none."""
        found = self.list_versions(certificate_id)
        chosen = found[-1:] if version is None else [one for one in found if one.row.version == version]
        return chosen[0] if chosen else None

    def list_versions(self, certificate_id: str) -> list[StoredCertificate]:
        """Return all versions of a certificate, the oldest first."""
        query = select(CertificateRow).where(CertificateRow.id == certificate_id).order_by(CertificateRow.version)
        with self._sessions() as session:
            return _add_withdrawals(session, session.scalars(query).all())

    def list_newest(self) -> list[StoredCertificate]:
        """Return the newest version of each certificate, withdrawn ones included, in the order of their entry."""
        newest = select(CertificateRow.id, func.max(CertificateRow.version).label("version"))
        part = newest.group_by(CertificateRow.id).subquery()
        same = (part.c.id == CertificateRow.id) & (part.c.version == CertificateRow.version)
        query = select(CertificateRow).join(part, same).order_by(CertificateRow.created, CertificateRow.id)
        with self._sessions() as session:
            return _add_withdrawals(session, session.scalars(query).all())

    def list_current(self, day: date, bench: str = DEFAULT_BENCH) -> dict[str, IssuedCertificate]:
        """Return by channel of a bench the certificate that applies on a day of UTC."""
        present = (one for one in self.list_newest() if one.withdrawal is None and one.row.bench == bench)
        return choose_current((one.issued for one in present), day)

    def _store(self, row: CertificateRow, certificate: Certificate, author: str) -> StoredCertificate:
        row.channel = certificate.channel
        row.document = certificate.model_dump(mode="json", by_alias=True)
        row.created, row.created_by = datetime.now(UTC), author
        with self._sessions.begin() as session:
            session.add(row)
        return StoredCertificate(row, None)


def make_id(certificate: Certificate) -> str:
    """Return the id of a certificate: the same for the same channel, laboratory and number."""
    names = orjson.dumps([certificate.channel, certificate.laboratory, certificate.number])
    return hashlib.sha256(names).hexdigest()[:12]


def find_stored_state(
    stored: StoredCertificate, current: dict[str, IssuedCertificate], day: date
) -> CertificateState:
    """Return the state of a certificate.

    Args:
        stored: its newest version.
        current: certificates of its bench that apply on the day, by channel.
        day: day of UTC.
    """
    certificate = stored.issued.document
    if stored.withdrawal is not None:
        return "withdrawn"
    state, applying = find_state(certificate, day), current.get(certificate.channel)
    is_superseded = state != "not_yet_valid" and applying is not None and applying.id != stored.row.id
    return "superseded" if is_superseded else state


def _add_withdrawals(session: Session, rows: Sequence[CertificateRow]) -> list[StoredCertificate]:
    query = select(WithdrawalRow).where(WithdrawalRow.certificate.in_({row.id for row in rows}))
    withdrawals = {one.certificate: one for one in session.scalars(query)}
    return [StoredCertificate(row, withdrawals.get(row.id)) for row in rows]
