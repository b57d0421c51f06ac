"""Verification of an audit trail: the first entry that was altered, and why it is known to be.

Any change, insertion, removal or exchange of lines breaks a hash. A missing end breaks none: it is found by
comparison with a head that was exported earlier. A person who rewrites all entries after one, with new hashes, is
found in the same way only.
"""

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any, NamedTuple

from pydantic import ValidationError

from bench.audit.chain import TORN
from bench.audit.entry import EMPTY_HEAD, FIELDS, AuditEntry, Head, compute_sha256, encode_canonically
from bench.errors import AuditError

_MAX_LINE = 1 << 22
"""Largest size of a line [bytes]; a longer one was not written by mrbench."""
_COPIED = FIELDS - {"seq", "prev", "sha256", "source"}
"""Fields that an imported entry has as in its own chain."""


class Verification(NamedTuple):
    """Result of a verification."""

    entries: int
    """Number of entries before the first fault."""
    head: Head
    """Last entry before the first fault."""
    fault: str = ""
    """First fault, for a person; empty if there is none."""
    kept: int = 0
    """Number of incomplete lines that killed processes have left, each kept in an entry."""
    imported: Mapping[tuple[str, int], str] = {}
    """Hash of each imported entry, by its chain and its number there."""


def verify_chain(path: Path, known: Head | None = None) -> Verification:
    """Verify an audit trail; the file may be written meanwhile.

    Args:
        path: file of the trail.
        known: head that was exported earlier.

    Raises:
        AuditError: the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            return _Verifier(known).run(_read_lines(file))
    except OSError as error:
        raise AuditError(f"{path}: the audit trail cannot be read ({error.strerror})") from error


def compare_imports(verification: Verification, path: Path) -> str:
    """Return the first difference between imported entries and the chain that they come from; empty without one.

    Args:
        verification: result for the chain with the imported entries.
        path: file of the other chain, which was verified.
    """
    with path.open("rb") as file:
        lines = [json.loads(line) for line in _read_lines(file)]
    chain = str(lines[0]["new"]) if lines else ""
    own = {(chain, line["seq"]): line["sha256"] for line in lines}
    for place, sha256 in verification.imported.items():
        if place[0] == chain and own.get(place) != sha256:
            state = "is missing there" if place not in own else "is another one there"
            return f"entry {place[1]} of the rig agent was imported, but {state}: {path} was altered or cut"
    return ""


def _read_lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield the lines up to the present end, which no process is writing at this moment."""
    fcntl.flock(file, fcntl.LOCK_SH)
    rest = os.fstat(file.fileno()).st_size
    fcntl.flock(file, fcntl.LOCK_UN)
    while rest > 0 and (line := file.readline(min(rest, _MAX_LINE))):
        rest -= len(line)
        yield line


class _Verifier:
    """State of a verification that goes through the lines."""

    def __init__(self, known: Head | None) -> None:
        self._known, self._head, self._kept = known, EMPTY_HEAD, 0
        self._imported: dict[tuple[str, int], str] = {}
        self._last_imported: dict[str, Head] = {}

    def run(self, lines: Iterator[bytes]) -> Verification:
        """Return the result for all lines."""
        fault = next(filter(None, map(self._check, lines)), "") or self._find_missing_end()
        return Verification(self._head.seq, self._head, fault, self._kept, self._imported)

    def _check(self, line: bytes) -> str:
        """Return the fault of a line, empty without one, which then is the new head."""
        number = self._head.seq + 1
        reason, entry = _read_entry(line)
        if entry is None:
            return f"line {number}: {reason}"
        reason = self._compare(entry) or self._check_import(entry)
        if reason:
            return f"line {number} (entry {entry.seq}, {entry.utc}, {entry.actor}, {entry.action}): {reason}"
        self._head = entry.get_head()
        self._kept += entry.action == TORN
        return ""

    def _compare(self, entry: AuditEntry) -> str:
        if entry.seq != self._head.seq + 1:
            return f"entry {self._head.seq + 1} belongs here; entries were removed, inserted or exchanged"
        if entry.prev != self._head.sha256:
            return "it does not contain the hash of the entry before, so that this or the one before was replaced"
        if self._known is not None and entry.seq == self._known.seq and entry.sha256 != self._known.sha256:
            return "it is not the entry of the head exported earlier, so that this or one before was rewritten"
        return ""

    def _check_import(self, entry: AuditEntry) -> str:
        """Return the fault of an imported entry within its own chain, as far as it was imported."""
        source = entry.source
        if source is None:
            return ""
        own = {**entry.model_dump(include=set(_COPIED)), "source": None}
        if compute_sha256({**own, "seq": source.seq, "prev": source.prev}) != source.sha256:
            return f"its content is not that of entry {source.seq} of the rig agent"
        before = self._last_imported.get(source.chain)
        if before is not None and (source.seq != before.seq + 1 or source.prev != before.sha256):
            return (
                f"entry {source.seq} of the rig agent does not follow its entry {before.seq}, so that the "
                "rig agent's own trail was altered before the import"
            )
        self._last_imported[source.chain] = Head(source.seq, source.sha256)
        self._imported[source.chain, source.seq] = source.sha256
        return ""

    def _find_missing_end(self) -> str:
        if self._known is None or self._known.seq <= self._head.seq:
            return ""
        missing = self._known.seq - self._head.seq
        return f"the end is missing: {missing} entries, from {self._head.seq + 1} to {self._known.seq}"


def _read_entry(line: bytes) -> tuple[str, AuditEntry | None]:
    """Return an entry whose own hash is right; else the reason why there is none."""
    if not line.endswith(b"\n"):
        return "it is incomplete: its writer was killed, or it was altered; the next entry will keep it", None
    try:
        fields: dict[str, Any] = json.loads(line)
        canonical = encode_canonically(fields)
    except (ValueError, RecursionError):
        return "it is not an entry; it was altered or inserted", None
    if canonical + b"\n" != line or not isinstance(fields, dict) or set(fields) != FIELDS:
        return "it is not written as mrbench writes entries; it was altered or inserted", None
    if compute_sha256(fields) != fields["sha256"]:
        return f"its content does not have its hash; it was altered (seq {fields['seq']})", None
    try:
        return "", AuditEntry.model_validate(fields)
    except ValidationError:
        return "its fields have other types than mrbench writes; it was inserted", None
