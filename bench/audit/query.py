"""Search in an audit trail: pages of entries that meet all conditions."""

import json
import os
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from bench.audit.entry import AuditEntry
from bench.audit.lines import parse_entry, read_backwards
from bench.errors import AuditError
from bench.validation import FrozenModel


class AuditFilter(FrozenModel):
    """Conditions on entries; empty ones hold for all."""

    actor: str = ""
    """Whole actor."""
    action: str = ""
    """Part of the action, in any case of letters."""
    target: str = ""
    """Whole target, or one of its ids."""
    text: str = ""
    """Part of the entry as JSON, in any case of letters."""
    since: str = ""
    """Earliest time, UTC, ISO 8601 as in the entries."""
    until: str = ""
    """Time before which entries are listed."""

    def accepts(self, entry: AuditEntry) -> bool:
        """Return whether an entry meets all conditions."""
        return (
            self.actor in ("", entry.actor)
            and self.action.lower() in entry.action.lower()
            and (not self.target or self.target == entry.target or self.target in entry.target.split("/"))
            and self.since <= entry.utc
            and (not self.until or entry.utc < self.until)
            and (not self.text or self.text.lower() in entry.model_dump_json().lower())
        )


def list_newest(
    path: Path, limit: int, before: int | None = None, wanted: AuditFilter | None = None
) -> list[AuditEntry]:
    """Return entries that meet the conditions, the newest first; lines that are no entries are left out.

    Args:
        path: file of the trail; one that does not exist has no entries.
        limit: largest number of entries.
        before: number of the entry before which they are listed.
        wanted: conditions.

    Raises:
        AuditError: the file cannot be read.
    """
    condition = wanted or AuditFilter()
    entries = (one for one in _read_newest(path) if before is None or one.seq < before)
    return list(islice(filter(condition.accepts, entries), limit))


def read_after(path: Path, after: int, limit: int) -> list[str]:
    """Return the lines of the entries with a greater number, the oldest first; arguments as `list_newest`.

    Only lines from the end up to that number are read, and only their numbers are looked at.
    """
    found: list[str] = []
    for line in _read_lines(path):
        try:
            seq = json.loads(line)["seq"]
        except (ValueError, KeyError, TypeError):
            continue
        if seq <= after:
            break
        found.append(line.decode("ascii", "replace"))
    return found[: -limit - 1 : -1]


def read_chain_id(path: Path) -> str:
    """Return the id of a chain, from its first entry; empty before it.

    Raises:
        AuditError: the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            first = parse_entry(file.readline())
    except FileNotFoundError:
        return ""
    except OSError as error:
        raise AuditError(f"{path}: the audit trail cannot be read ({error.strerror})") from error
    return "" if first is None else str(first.new)


def find_entry(path: Path, condition: Callable[[AuditEntry], bool]) -> AuditEntry | None:
    """Return the newest entry that meets a condition; None without one.

    Raises:
        AuditError: the file cannot be read.
    """
    return next(find_entries(path, condition), None)


def find_entries(path: Path, condition: Callable[[AuditEntry], bool]) -> Iterator[AuditEntry]:
    """Yield the entries that meet a condition, the newest first.

    Raises:
        AuditError: the file cannot be read.
    """
    return filter(condition, _read_newest(path))


def _read_newest(path: Path) -> Iterator[AuditEntry]:
    return (entry for line in _read_lines(path) if (entry := parse_entry(line)) is not None)


def _read_lines(path: Path) -> Iterator[bytes]:
    try:
        file = path.open("rb")
    except FileNotFoundError:
        return
    except OSError as error:
        raise AuditError(f"{path}: the audit trail cannot be read ({error.strerror})") from error
    with file:
        lines = read_backwards(file.fileno(), os.fstat(file.fileno()).st_size)
        next(lines)  # incomplete, or empty
        yield from lines
