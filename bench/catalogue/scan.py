"""Scan of the data folder for logs that are new, were truncated or repaired while the service did not run."""

import logging
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

from bench.calibration import list_overdue, read_failed
from bench.catalogue.catalogue import Catalogue
from bench.catalogue.integrity import check_integrity, find_missing
from bench.catalogue.log_summary import LogSummary, compute_sha256, read_log_summary
from bench.catalogue.models import RunRow
from bench.catalogue.records import read_log_events
from bench.checks import CheckRecord, compute_records, find_check_kind
from bench.errors import LogError
from bench.log import read_log

TRUNCATED_MESSAGE = (
    "the log has no end, its recorder was killed; repair it with `mrbench salvage` or POST /runs/{id}/salvage"
)
NO_LOG_MESSAGE = "the rig agent ended before it wrote a log"
EMPTY_LOG_MESSAGE = "the rig agent ended before it described the run in its log; the file contains no recording"
_MAX_READ = 20
"""Number of older logs whose events are read in one scan."""
_LOG = logging.getLogger(__name__)

WriteCheck = Callable[[Path], bool]
"""Function that returns whether a log is being written at present."""


def scan_logs(catalogue: Catalogue, is_being_written: WriteCheck) -> list[RunRow]:
    """Catalogue every log that is new or has changed, and mark the runs whose log was deleted.

    Args:
        catalogue: the catalogue of the data folder.
        is_being_written: logs for which it returns True are skipped.

    Returns:
        New and changed runs.
    """
    paths = list(_list_logs(catalogue.folder))
    rows = (_scan_log(catalogue, path, is_being_written) for path in paths)
    changed = [row for row in rows if row]
    missing = find_missing(catalogue, set(paths))
    for row in catalogue.list_unread(_MAX_READ):  # of catalogues of older versions
        _read_content(catalogue, row)
    return [*changed, *missing, *_end_runs_without_log(catalogue, is_being_written)]


def catalogue_log(catalogue: Catalogue, path: Path) -> RunRow | None:
    """Catalogue one log that is no longer being written.

    Returns:
        Its run, or None if the file is not an mrbench log or duplicates a catalogued one.
    """
    known = catalogue.find_run_by_log(path)
    if known is not None and known.log_sha256 is not None:
        # A complete log does not change; if it has, its fits remain those of the recorded content.
        return check_integrity(catalogue, known)
    # Taken before the file is read: anything written meanwhile is then a change at the next scan.
    stat = path.stat()
    try:
        summary = read_log_summary(path)
        sha256 = compute_sha256(path) if summary.outcome is not None else None
    except LogError as error:
        _log_skipped(catalogue, path, str(error))
        return None
    values = {
        **_make_end_values(summary),
        "log_bytes": stat.st_size,
        "log_modified_ns": stat.st_mtime_ns,
        "log_sha256": sha256,
        "calibration_overdue": list_overdue(summary.calibration),
        "failed_checks": read_failed(summary.checks),
    }
    if known is not None:
        return _read_content(catalogue, catalogue.update_run(known.id, **values | _keep_report(known, summary)))
    if catalogue.get_run(summary.id) is not None:
        _log_skipped(catalogue, path, f"run {summary.id} has another log")
        return None
    row = RunRow(
        id=summary.id,
        method=summary.method,
        method_version=catalogue.find_method_version(summary.method, summary.method_sha256),
        method_sha256=summary.method_sha256 or None,
        specimen=summary.specimen,
        operator=summary.operator,
        source=summary.source,
        continues=summary.continues or None,
        started=summary.started or datetime.fromtimestamp(stat.st_mtime, UTC),
        log=catalogue.make_name(path),
        **values,
    )
    catalogue.add(row)
    return _read_content(catalogue, row)


def _read_content(catalogue: Catalogue, row: RunRow) -> RunRow:
    """Store losses, events and the records of a check of a complete log; a damaged one has none."""
    if row.log_sha256 is None:
        return row
    path = catalogue.resolve_path(row.log)
    try:
        lost, events = read_log_summary(path).lost, read_log_events(path)
    except LogError:
        lost, events = {}, []
    catalogue.event_journal.replace(row.id, events)
    if find_check_kind(row.method) is not None:
        catalogue.checks.replace(row.id, _compute_checks(path))
    return catalogue.update_run(row.id, lost=lost)


def _compute_checks(path: Path) -> list[CheckRecord]:
    try:
        return compute_records(read_log(path))
    except (LogError, ValueError) as error:  # an uploaded log may contain anything, and must not end the scan
        _LOG.warning("check_not_recorded", extra={"log": str(path), "why": str(error)})
        return []


def _log_skipped(catalogue: Catalogue, path: Path, why: str) -> None:
    """Log that a file is not catalogued; once for each reason, because every scan finds it again."""
    if catalogue.note_skipped(path, why):
        _LOG.warning("log_skipped", extra={"log": str(path), "why": why})


def _make_end_values(summary: LogSummary) -> dict[str, object]:
    """Return the columns that depend on the end of the log."""
    if summary.outcome is None:
        return {
            "state": "truncated",
            "outcome": None,
            "ending": None,
            "reason": TRUNCATED_MESSAGE,
            "duration_s": None,
        }
    return {
        "state": "ended",
        "outcome": summary.outcome,
        "ending": summary.ending,
        "reason": summary.reason,
        "duration_s": summary.duration_s,
    }


def _keep_report(known: RunRow, summary: LogSummary) -> dict[str, object]:
    """Return ending and reason that the agent has reported, if the log itself has no ending."""
    if summary.ending is not None or known.ending is None:
        return {}
    return {"ending": known.ending, "reason": known.reason or summary.reason}


def _list_logs(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.glob("*.mcap")) if path.is_file() and not path.name.startswith("."))


def _scan_log(catalogue: Catalogue, path: Path, is_being_written: WriteCheck) -> RunRow | None:
    try:
        stat = path.stat()
        known = catalogue.find_run_by_log(path)
        same = (
            known is not None
            and (known.log_bytes, known.log_modified_ns) == (stat.st_size, stat.st_mtime_ns)
            and known.integrity != "missing"
        )
        return None if same or is_being_written(path) else catalogue_log(catalogue, path)
    # Deleted after the folder was listed.
    except FileNotFoundError:
        return None


def _end_runs_without_log(catalogue: Catalogue, is_being_written: WriteCheck) -> Iterator[RunRow]:
    """End the runs in state `running` whose log is not being written, and does not exist or describes no run."""
    for row in catalogue.list_running():
        path = catalogue.resolve_path(row.log)
        exists = path.exists()
        if (not exists or catalogue.is_skipped(path)) and not is_being_written(path):
            reason = EMPTY_LOG_MESSAGE if exists else NO_LOG_MESSAGE
            yield catalogue.end_incomplete(row.id, reason)
