"""Calibration in a report: certificates that applied at the start of the run, intervals with their uncertainty."""

from bench.report.calibration.certificates import (
    CHECKS_RECORD,
    RECORD,
    CalibrationRow,
    make_calibration_findings,
    make_calibration_rows,
)
from bench.report.calibration.intervals import CombinedRow, make_combined_rows

__all__ = [
    "CHECKS_RECORD",
    "RECORD",
    "CalibrationRow",
    "CombinedRow",
    "make_calibration_findings",
    "make_calibration_rows",
    "make_combined_rows",
]
