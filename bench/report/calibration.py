"""Calibration in a report: certificates that applied at the start of the run, intervals with their uncertainty."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from bench.calibration import CombinedInterval, combine_estimates, list_overdue, read_entry
from bench.log import Log
from bench.report.documents import Fit
from bench.report.summary import Finding
from bench.report.values import format_percent, format_quantity, format_significant, format_unit

_RECORD = "calibration"


class CalibrationRow(NamedTuple):
    """Certificate of one channel."""

    channel: str
    certificate: str
    date: str
    due: str
    uncertainty: str
    gain_error: str
    state: str


class CombinedRow(NamedTuple):
    """Interval of one parameter with the calibration."""

    name: str
    value: str
    unit: str
    calibration: str


def make_calibration_findings(log: Log) -> list[Finding]:
    """Return a warning for each channel whose calibration was overdue at the start of the run."""
    return [Finding("warning", f"{text}.") for text in list_overdue(log.metadata.get(_RECORD, {}))]


def make_calibration_rows(log: Log) -> list[CalibrationRow]:
    """Make the rows of the channels with a certificate."""
    entries = {name: read_entry(text) for name, text in log.metadata.get(_RECORD, {}).items()}
    return [_make_row(name, entry) for name, entry in entries.items() if "certificate" in entry]


def _make_row(channel: str, entry: Mapping[str, Any]) -> CalibrationRow:
    return CalibrationRow(
        channel,
        f"{entry['number']}, {entry['laboratory']} (version {entry['version']})",
        entry["date"],
        entry["due"],
        f"{format_percent(entry['gain_standard_uncertainty'])} (k = 1)",
        f"{format_significant(100 * entry['gain_error'], 2)} %",
        str(entry["state"]).replace("_", " "),
    )


def make_combined_rows(log: Log, fit: Fit, sha256: str) -> list[CombinedRow]:
    """Make the rows of the parameters with the calibration; none unless the fit used this log alone.

    Args:
        log: recording.
        fit: identified damper.
        sha256: hash of the log.
    """
    record, sharpness = log.metadata.get(_RECORD, {}), fit.parameters.get("n")
    is_only_log = list(fit.provenance.logs.values()) == [sha256]
    if sharpness is None or not is_only_log or not any(read_entry(text) for text in record.values()):
        return []
    estimates = {name: one.model_dump() for name, one in {**fit.coordinates, **fit.parameters}.items()}
    combined = combine_estimates(estimates, sharpness.value, record)
    return [_make_combined_row(name, fit, one) for name, one in combined.items() if one.missing or one.calibration]


def _make_combined_row(name: str, fit: Fit, combined: CombinedInterval) -> CombinedRow:
    estimate = fit.coordinates.get(name) or fit.parameters[name]
    if combined.missing or combined.ci95 is None:
        reason = f"no certificate of {' and '.join(combined.missing)}" if combined.missing else "not determined"
        return CombinedRow(name, "–", format_unit(estimate.unit), reason)
    quantity = format_quantity(estimate.value, combined.ci95, estimate.unit)
    return CombinedRow(name, quantity.value, quantity.unit, format_percent(combined.calibration or 0.0))
