"""Calibration of the runs of a campaign: certificates, overdue channels, failed checks, and wider intervals."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from bench.catalogue import Catalogue, RunRow, read_log_summary
from bench.errors import LogError, ReportError
from bench.jobs import FIT_FILE
from bench.report import Fit, read_fit
from bench.report.calibration import (
    CHECKS_RECORD,
    RECORD,
    CalibrationRow,
    CombinedRow,
    make_calibration_findings,
    make_calibration_rows,
    make_combined_rows,
)

Key = TypeVar("Key")


@dataclass(frozen=True)
class RunCalibration:
    """Calibration of one run, as its log has it."""

    is_known: bool = False
    """False if the log cannot be read; the warnings are then those of the catalogue."""
    certificates: tuple[CalibrationRow, ...] = ()
    """Certificates that applied at the start of the run."""
    warnings: tuple[str, ...] = ()
    """Channels whose calibration was overdue or whose check had failed at the start, in words."""
    intervals: Mapping[str, CombinedRow] = field(default_factory=dict)
    """Value with the uncertainty of fit and calibration, by parameter."""


def read_calibrations(catalogue: Catalogue, runs: Iterable[str]) -> dict[str, RunCalibration]:
    """Return the calibration of runs by their ids."""
    rows = {run: catalogue.get_run(run) for run in runs}
    return {run: RunCalibration() if row is None else _read_run(catalogue, row) for run, row in rows.items()}


def _read_run(catalogue: Catalogue, row: RunRow) -> RunCalibration:
    try:
        summary = read_log_summary(catalogue.resolve_path(row.log))
    except LogError:
        noted = (*(row.calibration_overdue or ()), *(row.failed_checks or ()))
        return RunCalibration(warnings=tuple(f"{text}." for text in noted))
    metadata = {RECORD: summary.calibration, CHECKS_RECORD: summary.checks}
    fit = _read_fit(catalogue, row.id)
    combined = [] if fit is None else make_combined_rows(metadata, fit, row.log_sha256 or "")
    return RunCalibration(
        is_known=True,
        certificates=tuple(make_calibration_rows(metadata)),
        warnings=tuple(finding.text for finding in make_calibration_findings(metadata)),
        intervals={one.name: one for one in combined},
    )


def _read_fit(catalogue: Catalogue, run: str) -> Fit | None:
    """Return the newest fit of a run; None without one, or if its file was removed or cannot be read."""
    job = catalogue.job_queue.find_newest_done(run, "identify")
    if job is None or not job.result:
        return None
    try:
        return read_fit(catalogue.resolve_path(job.result) / FIT_FILE)
    except ReportError:
        return None


def group_warnings(calibrations: Mapping[str, RunCalibration]) -> dict[str, list[str]]:
    """Return the ids of the runs by each warning."""
    return _group((text, run) for run, one in calibrations.items() for text in one.warnings)


def group_certificates(calibrations: Mapping[str, RunCalibration]) -> dict[CalibrationRow, list[str]]:
    """Return the ids of the runs by each certificate with its state."""
    return _group((row, run) for run, one in calibrations.items() for row in one.certificates)


def _group(pairs: Iterable[tuple[Key, str]]) -> dict[Key, list[str]]:
    groups: dict[Key, list[str]] = {}
    for key, run in pairs:
        groups.setdefault(key, []).append(run)
    return groups
