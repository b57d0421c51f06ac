"""Import of the rig agent's own audit trail into that of the service.

The position is the last entry that was imported from the same chain. It is read from the service's trail, so that
nothing is imported twice or left out, whichever process is killed when.
"""

import logging
from collections.abc import Callable
from concurrent.futures import Future, wait
from pathlib import Path
from typing import Final, TypeAlias

from bench.agent_protocol import AuditCommand, AuditPage, Message, Reply
from bench.audit import EMPTY_HEAD, Act, AuditEntry, Head, Source, find_entry, parse_entry
from bench.errors import AgentUnreachableError, BenchError
from bench.log_lines import RepeatedFailure
from bench.threads import BackgroundThread

PERIOD: Final = 5.0
"""[s] Time between two requests for new entries."""
_WRITE_TIMEOUT = 10.0
"""[s] Time for the disk to take a page."""
_LOG = logging.getLogger(__name__)
_BROKEN = "rig agent's audit trail broken"
"""Action of the entry about a trail that does not continue what was imported."""

SendFunction: TypeAlias = Callable[[Message], Reply]
RecordFunction: TypeAlias = "Callable[[Act], Future[AuditEntry]]"


class AgentImport(BackgroundThread):
    """Import of new entries, by a thread of its own while it is a context manager."""

    def __init__(self, path: Path, send: SendFunction, record: RecordFunction) -> None:
        """Prepare the import.

        Args:
            path: file of the service's trail.
            send: sends a command to the agent.
            record: writes an act to the service's trail.
        """
        super().__init__("audit-import")
        self._path, self._send, self._record = path, send, record
        self.obstacle = ""
        """Reason why nothing can be imported, for a person; empty while it can or no agent answers."""
        self._chain, self._broken = "", ""
        self._position: Head | None = None
        self._written: list[Future[AuditEntry]] = []
        self._failures = RepeatedFailure(_LOG, "audit_import_failed", "audit_import_continues")

    def import_new(self) -> int:
        """Import what the agent has recorded since the last import; return the number of entries.

        Raises:
            BenchError: a trail cannot be read.
        """
        count = 0
        while not self._stopping.is_set() and self._has_written():
            page = self._request()
            if page is None or not self._follows(page) or not page.lines:
                break
            count += self._take(page)
        return count

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self.import_new()
                self._failures.clear()
            except Exception as error:  # the thread must not end, or nothing more would be imported without a word
                self._failures.note(error)
                self.obstacle = f"the audit trail of the rig agent cannot be imported: {error}"
            self._stopping.wait(PERIOD)

    def _has_written(self) -> bool:
        """Return whether all that was imported is on the disk; only then is the position certain."""
        wait(self._written, _WRITE_TIMEOUT)
        if not all(one.done() for one in self._written):
            return False
        if any(one.exception() for one in self._written):
            self._position = None
        self._written = []
        return True

    def _request(self) -> AuditPage | None:
        """Return the entries after the last imported one; None if no agent answers."""
        page = self._send_request()
        if page is not None and page.chain != self._chain:
            self._chain, self._position = page.chain, None
            page = self._send_request()
        return page

    def _send_request(self) -> AuditPage | None:
        position = self._find_position() if self._chain else EMPTY_HEAD
        try:
            reply = self._send(AuditCommand(chain=self._chain, after=position.seq))
        except AgentUnreachableError:
            return None
        if not reply.ok or reply.audit is None:
            reason = reply.error or "it keeps none"
            raise BenchError(f"{reason}; an agent of an older version is replaced after: mrbench rig --end")
        return reply.audit

    def _find_position(self) -> Head:
        """Return the last entry of the agent's present chain that the service has."""
        if self._position is None:
            found = find_entry(self._path, lambda one: one.source is not None and one.source.chain == self._chain)
            source = found.source if found is not None else None
            self._position = EMPTY_HEAD if source is None else Head(source.seq, source.sha256)
        return self._position

    def _follows(self, page: AuditPage) -> bool:
        """Return whether a page continues what was imported; if not, record that once."""
        position = self._find_position()
        if position.seq == 0 or page.before == position.sha256:
            self.obstacle = ""
            return True
        self.obstacle = (
            f"the rig agent's own audit trail was altered: its entry {position.seq} is not the one that was "
            "imported; keep its file for an examination, and move it away: a new trail begins"
        )
        if self._broken != (state := f"{position} {page.before}"):
            self._broken = state
            new = f"{position.seq}:{page.before}" if page.before else "missing"
            self._record(Act(actor="service", action=_BROKEN, target=page.chain, old=str(position), new=new))
        return False

    def _take(self, page: AuditPage) -> int:
        entries = [entry for line in page.lines if (entry := parse_entry(line.encode())) is not None]
        for entry in entries:
            self._written.append(self._record(_copy(entry, page.chain)))
        if entries:
            self._position = entries[-1].get_head()
        return len(entries)


def _copy(entry: AuditEntry, chain: str) -> Act:
    """Return an entry of the agent as an act for the service's trail."""
    source = Source(chain=chain, seq=entry.seq, prev=entry.prev, sha256=entry.sha256)
    return Act(**entry.model_dump(include=set(Act.model_fields) - {"source"}), source=source)
