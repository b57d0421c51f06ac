"""Calibration certificates of the channels: document, validity on a day, record in a log; latest checks."""

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
from bench.calibration.gain_errors import (
    GAIN_CHANNELS,
    GAIN_FORMULA,
    CombinedInterval,
    combine_estimates,
    combine_interval,
    find_exponents,
)
from bench.calibration.latest_check import LatestCheck, list_failed, make_check_record, read_failed
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
    "GAIN_CHANNELS",
    "GAIN_FORMULA",
    "CalibrationPoint",
    "Certificate",
    "CertificateError",
    "CertificateState",
    "CombinedInterval",
    "Day",
    "IssuedCertificate",
    "LatestCheck",
    "ShortText",
    "Uncertainty",
    "choose_current",
    "combine_estimates",
    "combine_interval",
    "describe_due",
    "find_exponents",
    "find_state",
    "list_failed",
    "list_overdue",
    "make_attachment",
    "make_check_record",
    "make_log_text",
    "parse_certificate",
    "read_certificate",
    "read_entry",
    "read_failed",
]
