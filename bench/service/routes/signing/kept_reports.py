"""Reports that are kept as files, so that their hashes can be compared later; a report made again would differ.

They lie in ``reports/`` of the data folder, one folder for each run or campaign, and are named by their hash.
"""

import shutil
import time
from collections.abc import Callable, Container
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from bench.catalogue import LogIntegrity, ReportKind, compute_sha256
from bench.disk import sync_path
from bench.errors import LogError, ReportError
from bench.service.transfer import make_folder

FOLDER = "reports"
"""Folder in the data folder."""
UNSIGNED_LIFETIME = 86_400.0
"""Time for which a report without a signature is kept [s]."""


class Subject(NamedTuple):
    """Run or campaign that a report is about."""

    kind: ReportKind
    id: str
    """Id of the run or of the campaign."""


class KeptReport(NamedTuple):
    """One kept file."""

    path: Path
    sha256: str
    format: str
    made: datetime
    """UTC."""


def keep_report(
    data: Path, subject: Subject, report_format: str, write: Callable[[Path], None], signed: Container[str]
) -> KeptReport:
    """Make a report and keep its file; older ones without a signature are deleted.

    Args:
        data: data folder.
        subject: what the report is about.
        report_format: ending of the file.
        write: writes the report to a path.
        signed: hashes of the signed reports on the subject.

    Raises:
        ReportError: the report cannot be made or kept.
    """
    folder = _locate_folder(data, subject)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _remove_old(folder, signed)
        temporary = make_folder(data)
        try:
            made = temporary / f"report.{report_format}"
            write(made)
            target = folder / f"{compute_sha256(made)}.{report_format}"
            if target.stem not in signed or not target.exists():
                sync_path(made)
                made.replace(target)
                sync_path(folder)
            return _describe(target)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        raise ReportError(f"{folder}: the report cannot be kept ({error.strerror}); make space there") from error


def find_report(data: Path, subject: Subject, sha256: str) -> KeptReport | None:
    """Return the kept report with a hash; None if there is none, or its name is not a hash."""
    found = next(_locate_folder(data, subject).glob(f"{sha256}.*"), None) if sha256.isalnum() else None
    return None if found is None else _describe(found)


def check_file(data: Path, subject: Subject, sha256: str) -> LogIntegrity:
    """Compare a kept file with its hash."""
    found = find_report(data, subject, sha256)
    try:
        return "missing" if found is None else "intact" if compute_sha256(found.path) == sha256 else "changed"
    except LogError:
        return "missing"


def _locate_folder(data: Path, subject: Subject) -> Path:
    return data / FOLDER / f"{subject.kind}-{quote(subject.id, safe='')}"


def _describe(path: Path) -> KeptReport:
    made = datetime.fromtimestamp(path.stat().st_mtime, UTC)
    return KeptReport(path, path.stem, path.suffix.removeprefix("."), made)


def _remove_old(folder: Path, signed: Container[str]) -> None:
    oldest = time.time() - UNSIGNED_LIFETIME
    for path in folder.iterdir():
        if path.stem not in signed and path.stat().st_mtime < oldest:
            path.unlink(missing_ok=True)
