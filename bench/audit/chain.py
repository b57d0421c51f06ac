"""File of an audit trail: entries are only ever appended, and are on the disk when `append` returns.

Every append locks the file, so that service and commands may write to it at the same time. A line that a killed
process has left incomplete is never dropped: it is completed, or kept as the old value of an entry of its own.
"""

import contextlib
import fcntl
import os
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from bench.audit.entry import EMPTY_HEAD, Act, AuditEntry, Head, chain_act
from bench.audit.lines import find_last_entry, parse_entry, read_fragment
from bench.audit.redaction import shorten_text
from bench.disk import sync_path
from bench.errors import AuditError

AUDIT_FILE: Final = "audit.jsonl"
"""Name of the file in a data folder."""
BEGIN: Final = "chain begun"
"""Action of the first entry; its new value is the id of the chain."""
TORN: Final = "incomplete line kept"
"""Action of the entry that keeps an incomplete line as its old value."""
_MAX_FRAGMENT = 100_000
"""Largest number of characters of an incomplete line that are kept; of the rest, size and hash."""
_OWN = "mrbench"
"""Actor of entries about the chain itself."""


class _End(NamedTuple):
    """End of a file: its identity, its size [bytes], and the last entry."""

    inode: int
    size: int
    head: Head


class AuditChain:
    """Audit trail in a file, from any thread and any process."""

    def __init__(self, path: Path) -> None:
        """Use a file; it is created with the first entry."""
        self.path = path
        self._end: _End | None = None

    def append(self, *acts: Act) -> list[AuditEntry]:
        """Write acts as the next entries, and return these once they are on the disk.

        Raises:
            AuditError: the file cannot be written; nothing was added.
        """
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self._open_locked() as file:
                return self._append(file, acts)
        except OSError as error:
            self._end = None
            raise AuditError(
                f"{self.path}: the audit trail cannot be written ({error.strerror or error}); "
                "free space, or make the file writable"
            ) from error

    def get_head(self) -> Head:
        """Return the last complete entry; that of an empty chain without a file.

        Raises:
            AuditError: the file cannot be read.
        """
        try:
            with self.path.open("rb") as file:
                return find_last_entry(file.fileno(), os.fstat(file.fileno()).st_size)
        except FileNotFoundError:
            return EMPTY_HEAD
        except OSError as error:
            raise AuditError(f"{self.path}: cannot be read ({error.strerror})") from error

    @contextlib.contextmanager
    def _open_locked(self) -> Iterator[int]:
        is_new = not self.path.exists()
        file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(file, fcntl.LOCK_EX)
            if is_new:
                sync_path(self.path.parent)
            yield file
        finally:
            os.close(file)

    def _append(self, file: int, acts: tuple[Act, ...]) -> list[AuditEntry]:
        state = os.fstat(file)
        end = self._end
        if end is None or (end.inode, end.size) != (state.st_ino, state.st_size):
            end = _End(state.st_ino, *_repair_end(file, state.st_size))
        pending = (_begin(), *acts) if end.size == 0 else acts
        entries, head = [], end.head
        for act in pending:
            entries.append(chain_act(act, head))
            head = entries[-1].get_head()
        written = _write(file, end.size, b"".join(entry.to_line() for entry in entries))
        self._end = _End(end.inode, written, head)
        return entries[len(pending) - len(acts) :]


def _begin() -> Act:
    return Act(actor=_OWN, action=BEGIN, new=uuid.uuid4().hex, outcome="ok")


def _write(file: int, at: int, content: bytes) -> int:
    """Write at the end of a file and pass it to the disk; return the new size [bytes].

    After an error, the part that was written is removed again, so that the next attempt finds a complete line.
    """
    try:
        done = 0
        while done < len(content):
            done += os.pwrite(file, content[done:], at + done)
        os.fsync(file)
    except OSError:
        with contextlib.suppress(OSError):
            os.ftruncate(file, at)
        raise
    return at + len(content)


def _repair_end(file: int, size: int) -> tuple[int, Head]:
    """Make a file end with a complete line; return its size [bytes] and its last entry."""
    fragment = read_fragment(file, size)
    at = size - len(fragment)
    head = find_last_entry(file, at)
    if not fragment:
        return size, head
    complete = parse_entry(fragment)
    if complete is not None and (complete.seq, complete.prev) == (head.seq + 1, head.sha256):
        return _write(file, size, b"\n"), complete.get_head()
    entry = chain_act(_keep(fragment), head)
    _replace(file, at, size, entry.to_line())
    return at + len(entry.to_line()), entry.get_head()


def _replace(file: int, at: int, size: int, line: bytes) -> None:
    """Write a line over the incomplete one that it contains.

    The file grows first: if the disk is full, the incomplete line stays as it is.
    """
    _write(file, size, b" " * (at + len(line) - size))
    os.pwrite(file, line, at)
    os.ftruncate(file, at + len(line))  # a very long incomplete line is kept in part
    os.fsync(file)


def _keep(fragment: bytes) -> Act:
    text = shorten_text(fragment.decode("latin-1"), _MAX_FRAGMENT)
    return Act(actor=_OWN, action=TORN, old=text, outcome=f"{len(fragment)} bytes without an end of the line")
