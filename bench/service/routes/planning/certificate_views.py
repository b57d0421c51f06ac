"""Requests and responses of calibration certificates, with units in the descriptions."""

from datetime import datetime
from typing import Annotated, Any, TypeAlias

from pydantic import Field, StringConstraints

from bench.calibration import CalibrationPoint, Certificate, CertificateState, Day, ShortText, Uncertainty
from bench.catalogue import StoredCertificate
from bench.service.views import View

Reason: TypeAlias = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=500)]


class Withdrawal(View):
    """Withdrawal of a certificate with all its versions."""

    withdrawn: datetime = Field(description="UTC")
    withdrawn_by: str = Field(description="user or token")
    reason: str


class CertificateView(View):
    """One version of a certificate; it never changes."""

    id: str = Field(description="the same for the same channel, laboratory and number")
    version: int = Field(description="[1] version; a correction adds one")
    state: CertificateState = Field(
        description="state of the newest version today, a day of UTC; due_soon: within 14 days; superseded: the "
        "channel has a newer calibration"
    )
    due_text: str = Field(
        description="in words, if this certificate applies and is overdue or due soon; else empty"
    )
    bench: str = Field(description="name of the bench that has the channel")
    document: Certificate = Field(description="document `mrbench.certificate/1`")
    gain_error: float = Field(description="[1] slope of the indication over the reference, less one")
    gain_standard_uncertainty: float = Field(description="[1] relative standard uncertainty of the gain")
    created: datetime = Field(description="UTC at which this version was stored")
    created_by: str = Field(description="user or token that stored this version")
    reason: str = Field(description="reason of the correction; empty for the first version")
    withdrawal: Withdrawal | None = Field(description="null unless the certificate was withdrawn")


class CertificateList(View):
    """Certificates in the order of their entry, or versions of one, the oldest first."""

    items: tuple[CertificateView, ...]


class CertificateCorrection(View):
    """Correction of a certificate; what is left out stays as it is."""

    reason: Reason = Field(description="reason of the correction, for people")
    date: Day | None = Field(default=None, description="day of the calibration")
    due: Day | None = Field(default=None, description="last day on which the calibration is valid")
    points: tuple[CalibrationPoint, ...] | None = Field(
        default=None, min_length=2, max_length=1000, description="one series, ordered by rising reference"
    )
    uncertainty: Uncertainty | None = Field(default=None, description="uncertainty of the indication")
    standard: ShortText | None = Field(default=None, description="standard that was used")
    note: str | None = Field(default=None, max_length=2000, description="text for people")

    @property
    def changes(self) -> dict[str, Any]:
        """Keys of the certificate that it replaces."""
        return self.model_dump(mode="json", exclude={"reason"}, exclude_none=True)


def make_certificate_view(stored: StoredCertificate, state: CertificateState, due_text: str) -> CertificateView:
    """Return the view of a version.

    Args:
        stored: the version.
        state: state of the certificate.
        due_text: in words, that it is overdue or due soon.
    """
    row, withdrawal, document = stored.row, stored.withdrawal, stored.issued.document
    return CertificateView(
        id=row.id,
        version=row.version,
        state=state,
        due_text=due_text,
        bench=row.bench,
        document=document,
        gain_error=document.gain_error,
        gain_standard_uncertainty=document.gain_uncertainty,
        created=row.created,
        created_by=row.created_by,
        reason=row.reason,
        withdrawal=None
        if withdrawal is None
        else Withdrawal(
            withdrawn=withdrawal.withdrawn, withdrawn_by=withdrawal.withdrawn_by, reason=withdrawal.reason
        ),
    )
