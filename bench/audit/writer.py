"""Thread that writes an audit trail, so that no stop and no reply waits for a disk without a limit."""

import threading
import time
from collections import deque
from concurrent.futures import Future
from pathlib import Path
from types import TracebackType

from bench.audit.chain import AuditChain
from bench.audit.entry import Act, AuditEntry, encode_canonically
from bench.disk import find_free_space
from bench.errors import AuditError, RunError

LEAST_SPACE = 1_000_000
"""[byte] Free space below which the trail counts as unwritable."""
MOST_WAITING = 10_000
"""Largest number of acts that wait for the disk; further ones are counted."""
STALL = 2.0
"""[s] Time for which an act may wait before the trail counts as unwritable."""
_RETRY_PERIOD = 1.0
"""[s] Time between two attempts."""
_END_TIMEOUT = 5.0
"""[s] Time in which the last acts are written at the end."""
_LOST = "entries lost"
"""Action of the entry that counts what could not be kept."""


class AuditWriter:
    """Writer of one audit trail, from any thread; as a context manager, it runs the thread that writes."""

    def __init__(self, path: Path) -> None:
        """Use a file; it is created with the first entry."""
        self.chain = AuditChain(path)
        self._waiting: deque[tuple[Act, Future[AuditEntry], float]] = deque()
        self._changed = threading.Condition()
        self._failure, self._lost = "", 0
        self._is_ending = False
        self._thread = threading.Thread(target=self._run, name="audit", daemon=True)

    def __enter__(self) -> "AuditWriter":
        """Start the thread."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what waits, within a time limit, and end the thread."""
        with self._changed:
            self._is_ending = True
            self._changed.notify()
        self._thread.join(_END_TIMEOUT)

    def record(self, act: Act) -> "Future[AuditEntry]":
        """Write an act as soon as possible; the result is there once it is on the disk. Never waits."""
        written: Future[AuditEntry] = Future()
        with self._changed:
            if len(self._waiting) >= MOST_WAITING:
                self._lost += 1
                written.set_exception(AuditError("too many entries wait for the disk"))
            else:
                self._waiting.append((_make_plain(act), written, time.monotonic()))
                self._changed.notify()
        return written

    def find_obstacle(self) -> str:
        """Return why nothing can be recorded at present, for a person; empty if it can."""
        with self._changed:
            oldest = self._waiting[0][2] if self._waiting else time.monotonic()
            failure = self._failure
        if failure:
            return failure
        path = self.chain.path
        if (age := time.monotonic() - oldest) > STALL:
            return f"{path}: entries of the audit trail have waited {age:.0f} s for the disk; check it"
        try:
            space = find_free_space(path.parent)
        except RunError as error:
            return str(error)
        if space.obstacle:
            return f"the audit trail cannot be written: {space.obstacle}"
        if space.free < LEAST_SPACE:
            return f"{path}: {space.free} bytes are free for the audit trail, needed {LEAST_SPACE}; free space"
        return ""

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._is_ending:
                    self._changed.wait()
                batch, is_last = list(self._waiting), self._is_ending
            if batch:
                self._write(batch)
            if is_last and (self._failure or not self._waiting):
                return

    def _write(self, batch: "list[tuple[Act, Future[AuditEntry], float]]") -> None:
        """Write acts with one sync, or leave them waiting."""
        lost = self._lost
        acts = [act for act, _, _ in batch]
        if lost:
            acts.append(Act(actor="mrbench", action=_LOST, new=lost, outcome="the disk could not be written"))
        try:
            entries = self.chain.append(*acts)
        except AuditError as error:
            self._failure = str(error)
            with self._changed:
                self._changed.wait_for(lambda: self._is_ending, _RETRY_PERIOD)
            return
        with self._changed:
            self._failure, self._lost = "", self._lost - lost
            for _ in batch:
                self._waiting.popleft()
        for (_, written, _), entry in zip(batch, entries, strict=False):
            written.set_result(entry)


def _make_plain(act: Act) -> Act:
    """Return an act that can be written: values that are not JSON as their text."""
    try:
        encode_canonically(act.model_dump())
    except (TypeError, ValueError, RecursionError):
        return act.model_copy(update={"old": repr(act.old), "new": repr(act.new)})
    return act
