"""Intervals of a fit with the uncertainty of the calibration."""

from typing import NamedTuple

from bench.calibration import CombinedInterval, combine_estimates, read_entry
from bench.report.calibration.certificates import RECORD, Metadata
from bench.report.documents import Fit
from bench.report.values import format_percent, format_quantity, format_unit


class CombinedRow(NamedTuple):
    """Interval of one parameter with the calibration."""

    name: str
    value: str
    unit: str
    calibration: str


def make_combined_rows(metadata: Metadata, fit: Fit, sha256: str) -> list[CombinedRow]:
    """Make the rows of the parameters with the calibration; none unless the fit used this log alone.

    Args:
        metadata: metadata of the log by record.
        fit: identified damper.
        sha256: hash of the log.
    """
    record, sharpness = metadata.get(RECORD, {}), fit.parameters.get("n")
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
