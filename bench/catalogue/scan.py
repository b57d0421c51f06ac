"""Brings the catalogue up to what lies in the data folder: logs that ended unseen, were cut off or were mended."""

import logging
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.log_facts import LogFacts, read_facts, sha256_of
from bench.catalogue.models import RunRow
from bench.errors import LogError

CUT_OFF = "the log has no end, its recorder was killed; mend it with `mrbench salvage` or POST /runs/{id}/salvage"
NO_LOG = "the rig agent ended before it wrote a log"
_LOG = logging.getLogger(__name__)

StillWritten = Callable[[Path], bool]
"""Whether somebody writes to a log at present."""


def scan(catalogue: Catalogue, still_written: StillWritten) -> list[RunRow]:
    """Catalogue every log that is new or has changed.

    Args:
        catalogue: what is brought up to date.
        still_written: logs that are left alone.

    Returns:
        Runs that are new or otherwise than before.
    """
    changed = [row for path in _logs(catalogue.folder) if (row := _look_at(catalogue, path, still_written))]
    return [*changed, *_without_log(catalogue, still_written)]


def catalogue_log(catalogue: Catalogue, path: Path) -> RunRow | None:
    """Catalogue one log that nobody writes to any more; none where it is no log of ours or another's double."""
    # Before it is read: what is written meanwhile shows as a change at the next look.
    stat = path.stat()
    try:
        facts = read_facts(path)
        sha256 = sha256_of(path) if facts.outcome is not None else None
    except LogError as error:
        _LOG.warning("log_passed_over", extra={"log": str(path), "why": str(error)})
        return None
    values = {
        **_values(facts),
        "log_bytes": stat.st_size,
        "log_modified_ns": stat.st_mtime_ns,
        "log_sha256": sha256,
    }
    known = catalogue.run_of_log(path)
    if known is not None:
        return catalogue.change_run(known.id, **values)
    if catalogue.run(facts.id) is not None:
        _LOG.warning("log_passed_over", extra={"log": str(path), "why": f"run {facts.id} has another log"})
        return None
    started = facts.started or datetime.fromtimestamp(stat.st_mtime, UTC)
    row = RunRow(
        id=facts.id,
        method=facts.method,
        specimen=facts.specimen,
        operator=facts.operator,
        source=facts.source,
        started=started,
        log=catalogue.name_of(path),
        **values,
    )
    catalogue.add(row)
    return row


def _values(facts: LogFacts) -> dict[str, object]:
    """What the end of a log decides."""
    if facts.outcome is None:
        return {"state": "cut_off", "outcome": None, "reason": CUT_OFF, "duration_s": None}
    return {
        "state": "ended",
        "outcome": facts.outcome,
        "reason": facts.reason,
        "duration_s": facts.duration_s,
    }


def _logs(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.glob("*.mcap")) if path.is_file() and not path.name.startswith("."))


def _look_at(catalogue: Catalogue, path: Path, still_written: StillWritten) -> RunRow | None:
    try:
        stat = path.stat()
        known = catalogue.run_of_log(path)
        same = known is not None and (known.log_bytes, known.log_modified_ns) == (stat.st_size, stat.st_mtime_ns)
        return None if same or still_written(path) else catalogue_log(catalogue, path)
    # Taken away between the listing and the look.
    except FileNotFoundError:
        return None


def _without_log(catalogue: Catalogue, still_written: StillWritten) -> Iterator[RunRow]:
    """Runs that are said to go on, while nobody writes and there is no log."""
    for row in catalogue.running():
        path = catalogue.path_of(row.log)
        if not path.exists() and not still_written(path):
            yield catalogue.change_run(row.id, state="ended", outcome="incomplete", reason=NO_LOG)
