"""Recovery of runs after a crash: a complete log counts, a truncated one is repaired and never trusted."""

import os
from pathlib import Path

from bench.campaigns.engine import ExecutionReport
from bench.catalogue import Catalogue, RunRow, catalogue_log, is_complete, read_plan
from bench.errors import LogError
from bench.log import salvage_log

CRASH_REASON = "the process that executed it ended"
NO_LOG_REASON = f"{CRASH_REASON} before it wrote a log"


def recover_execution(catalogue: Catalogue, log: str) -> ExecutionReport:
    """Return what became of a run whose process has ended, by its log.

    A truncated log is repaired and stays in the catalogue as incomplete. One that cannot be repaired is renamed,
    and the reason in the catalogue names the new file.
    """
    path = catalogue.folder / log
    if not path.is_file():
        return _report_loss(catalogue, path, NO_LOG_REASON)
    try:
        if is_complete(path):
            return make_end_report(catalogue, catalogue_log(catalogue, path), path)
        salvage_log(path)
        row = catalogue_log(catalogue, path)
    except LogError as error:
        kept = path.rename(path.with_name(f"{path.name}.{os.getpid()}.broken"))
        reason = f"{CRASH_REASON}; its log cannot be repaired and is kept as {kept.name}: {error}"
        return _report_loss(catalogue, path, reason)
    return _report_crash(catalogue, row, path)


def _report_loss(catalogue: Catalogue, path: Path, reason: str) -> ExecutionReport:
    """End a run of which no sample is left, if the catalogue has it, and return the report on it."""
    row = catalogue.find_run_by_log(path)
    if row is not None and row.state != "ended":
        catalogue.end_incomplete(row.id, reason)
    return ExecutionReport(kind="crashed", run=row.id if row else "", reason=reason, has_samples=False)


def _report_crash(catalogue: Catalogue, row: RunRow | None, path: Path) -> ExecutionReport:
    if row is None:
        return ExecutionReport(kind="crashed", reason=CRASH_REASON)
    reason = f"{CRASH_REASON} after {row.duration_s or 0:.1f} s"
    catalogue.end_incomplete(row.id, reason)
    checkpoint = find_checkpoint(path)
    return ExecutionReport(
        kind="crashed", run=row.id, reason=reason, checkpoint=checkpoint, duration_s=row.duration_s or 0.0
    )


def make_end_report(catalogue: Catalogue, row: RunRow | None, path: Path) -> ExecutionReport:
    """Return the report on a run whose log has its end."""
    if row is None:
        return ExecutionReport(kind="crashed", reason=f"{path.name} cannot be catalogued")
    is_whole = row.outcome in ("clean", "lossy")
    return ExecutionReport(
        kind="ended",
        run=row.id,
        outcome=row.outcome or "",
        ending=row.ending or "",
        reason=row.reason,
        duration_s=row.duration_s or 0.0,
        checkpoint="" if is_whole else find_checkpoint(path),
    )


def find_checkpoint(path: Path) -> str:
    """Return the last checkpoint that a run has passed; empty without one, or if the log cannot be read."""
    try:
        return read_plan(path).checkpoint
    except LogError:
        return ""
