"""Certificates that applied at the start of a run; warnings for overdue channels and failed checks."""

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

from bench.calibration import list_overdue, read_entry, read_failed
from bench.report.summary import Finding
from bench.report.values import format_percent, format_significant

Metadata: TypeAlias = Mapping[str, Mapping[str, str]]
"""Metadata of a log by record."""
RECORD = "calibration"
"""Metadata record with the calibration by channel."""
CHECKS_RECORD = "checks"
"""Metadata record with the latest check by channel."""


class CalibrationRow(NamedTuple):
    """Certificate of one channel."""

    channel: str
    certificate: str
    date: str
    due: str
    uncertainty: str
    gain_error: str
    state: str


def make_calibration_findings(metadata: Metadata) -> list[Finding]:
    """Return a warning for each channel whose calibration was overdue or whose check had failed at the start."""
    overdue, failed = list_overdue(metadata.get(RECORD, {})), read_failed(metadata.get(CHECKS_RECORD, {}))
    return [Finding("warning", f"{text}.") for text in (*overdue, *failed)]


def make_calibration_rows(metadata: Metadata) -> list[CalibrationRow]:
    """Make the rows of the channels with a certificate."""
    entries = {name: read_entry(text) for name, text in metadata.get(RECORD, {}).items()}
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
