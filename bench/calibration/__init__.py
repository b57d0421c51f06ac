"""Calibration certificates of the channels: document, validity on a day, record in a log."""

from bench.calibration.certificate import (
    CalibrationPoint,
    Certificate,
    CertificateError,
    Day,
    ShortText,
    Uncertainty,
    parse_certificate,
    read_certificate,
)
from bench.calibration.log_record import list_overdue, make_attachment, make_log_text, read_entry
from bench.calibration.validity import (
    DUE_SOON,
    CertificateState,
    IssuedCertificate,
    choose_current,
    describe_due,
    find_state,
)

__all__ = [
    "DUE_SOON",
    "CalibrationPoint",
    "Certificate",
    "CertificateError",
    "CertificateState",
    "Day",
    "IssuedCertificate",
    "ShortText",
    "Uncertainty",
    "choose_current",
    "describe_due",
    "find_state",
    "list_overdue",
    "make_attachment",
    "make_log_text",
    "parse_certificate",
    "read_certificate",
    "read_entry",
]
