"""Validity of certificates on a day; days are those of UTC."""

from collections.abc import Iterable
from datetime import date, timedelta
from typing import Literal, TypeAlias

from pydantic import Field

from bench.calibration.certificate import Certificate
from bench.validation import FrozenModel

DUE_SOON = timedelta(days=14)
"""Time before the due date from which a certificate is due soon."""
CertificateState: TypeAlias = Literal["valid", "due_soon", "overdue", "not_yet_valid", "superseded", "withdrawn"]
"""superseded: the channel has a newer calibration; withdrawn: a person has withdrawn the certificate."""


class IssuedCertificate(FrozenModel):
    """One version of a certificate under its id; it never changes."""

    id: str = Field(description="id of the certificate")
    version: int = Field(ge=1, description="[1] version; a correction adds one")
    document: Certificate = Field(description="document `mrbench.certificate/1`")


def find_state(certificate: Certificate, day: date) -> Literal["valid", "due_soon", "overdue", "not_yet_valid"]:
    """Return the state of a certificate that is neither superseded nor withdrawn."""
    if day < certificate.date:
        return "not_yet_valid"
    if day > certificate.due:
        return "overdue"
    return "due_soon" if certificate.due - day <= DUE_SOON else "valid"


def choose_current(certificates: Iterable[IssuedCertificate], day: date) -> dict[str, IssuedCertificate]:
    """Return the certificate of each channel that applies on a day: that of the newest calibration until then.

    Args:
        certificates: newest versions, without withdrawn ones; of two with the same date, the later one applies.
        day: day of UTC.
    """
    begun = [one for one in certificates if one.document.date <= day]
    return {one.document.channel: one for one in sorted(begun, key=lambda one: one.document.date)}


def describe_due(certificate: Certificate, day: date) -> str:
    """Return in words since when a channel is overdue, or how soon it is due; empty if neither."""
    remaining, of = (certificate.due - day).days, f"certificate {certificate.number} of {certificate.laboratory}"
    match find_state(certificate, day):
        case "overdue":
            return f"{certificate.channel}: calibration overdue since {certificate.due} ({of})"
        case "due_soon":
            when = "today" if remaining == 0 else f"in {remaining} day{'s' if remaining > 1 else ''}"
            return f"{certificate.channel}: calibration due on {certificate.due}, {when} ({of})"
        case _:
            return ""
