"""Integrity of the recorded logs: their content is compared with the hash that was stored at their recording.

A stored hash is never replaced, because fits and reports refer to it. A log with another content is marked as
changed, with both hashes; a log that does not exist is marked as missing.
"""

import logging
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.log_summary import compute_sha256
from bench.catalogue.models import LogIntegrity, RunRow
from bench.errors import LogError

_LOG = logging.getLogger(__name__)


def check_integrity(catalogue: Catalogue, row: RunRow, hash_copy: Callable[[str], str] | None = None) -> RunRow:
    """Compare the log of a run with its stored hash, and record the result.

    Args:
        catalogue: the catalogue of the data folder.
        row: run with a stored hash.
        hash_copy: returns the SHA-256 of a copy in a log store by its address; for a log that was removed from
            this machine after its copy. None to leave such a log unchecked.

    Returns:
        The run with the result.

    Raises:
        LogError: the run has no stored hash, or its log exists and cannot be read.
    """
    if row.log_sha256 is None:
        raise LogError(f"run {row.id} is {row.state} and has no complete log of which a hash was stored")
    path = catalogue.resolve_path(row.log)
    if not path.exists() and row.removed is not None and row.copy_url is not None:
        return row if hash_copy is None else _record_hash(catalogue, row, hash_copy(row.copy_url))
    if not path.exists():
        return _record(catalogue, row, "missing", None)
    # Taken before the file is read: anything written meanwhile is then a change at the next scan.
    stat = path.stat()
    sha256 = compute_sha256(path)
    known = {"log_bytes": stat.st_size, "log_modified_ns": stat.st_mtime_ns}
    return _record_hash(catalogue, row, sha256, **known)


def check_all(catalogue: Catalogue, hash_copy: Callable[[str], str] | None = None) -> Iterator[RunRow]:
    """Check the log of every run with a stored hash, oldest first, and yield the runs with their results.

    Args:
        catalogue: the catalogue of the data folder.
        hash_copy: as in `check_integrity`.

    Raises:
        LogError: a log exists and cannot be read.
    """
    for row in catalogue.list_hashed():
        yield check_integrity(catalogue, row, hash_copy)


def find_missing(catalogue: Catalogue, present: set[Path]) -> Iterator[RunRow]:
    """Mark runs whose log was deleted, and yield them.

    Args:
        catalogue: the catalogue of the data folder.
        present: logs that were found in the folder.
    """
    for run_id, log in catalogue.list_present_logs():
        path = catalogue.resolve_path(log)
        row = None if path in present or path.exists() else catalogue.get_run(run_id)
        if row is not None:
            yield check_integrity(catalogue, row)


def _record_hash(catalogue: Catalogue, row: RunRow, sha256: str, **values: int) -> RunRow:
    if sha256 == row.log_sha256:
        return _record(catalogue, row, "intact", None, **values)
    return _record(catalogue, row, "changed", sha256, **values)


def _record(
    catalogue: Catalogue, row: RunRow, integrity: LogIntegrity, found: str | None, **values: int
) -> RunRow:
    if integrity != "intact" and integrity != row.integrity:
        why = {"run": row.id, "log": row.log, "recorded": row.log_sha256, "found": found}
        _LOG.warning(f"log_{integrity}", extra=why)
    return catalogue.update_run(
        row.id, integrity=integrity, found_sha256=found, checked=datetime.now(UTC), **values
    )
