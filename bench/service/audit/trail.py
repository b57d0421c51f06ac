"""Audit trail in the data folder of a service."""

import asyncio
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import TimeoutError as FutureTimeoutError
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final

from bench.audit import AUDIT_FILE, Act, AuditEntry, AuditWriter, Head, verify_chain
from bench.errors import AuditError
from bench.service.audit.agent_import import AgentImport, SendFunction

WRITE_TIMEOUT: Final = 2.0
"""[s] Longest time for which an answer waits for the disk; the entry is written later then."""
UNKNOWN: Final = "unknown"
"""Actor of a request without a valid sign-in."""
_REFUSALS_PER_MINUTE = 60
"""Number of requests without sign-in that are recorded one by one; further ones are counted."""
_MINUTE = 60.0


class AuditTrail:
    """Audit trail of a service; as a context manager, it writes, imports and is verified once."""

    def __init__(
        self, folder: Path, agents: Mapping[str, SendFunction], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Use a data folder.

        Args:
            folder: data folder.
            agents: by bench the function that sends a command to its rig agent; each agent has a trail of its own.
            clock: time [s].
        """
        self.path = folder / AUDIT_FILE
        self._writer = AuditWriter(self.path)
        self._imports = {
            bench: AgentImport(self.path, send, self._writer.record) for bench, send in agents.items()
        }
        self._clock, self._minute, self._refusals = clock, float("-inf"), 0
        self._fault = ""
        self._verification = threading.Thread(target=self._verify, name="audit-verification", daemon=True)

    def __enter__(self) -> "AuditTrail":
        """Start to write and to import."""
        self._verification.start()
        self._writer.__enter__()
        self.record(Act(actor="service", action="service start", outcome="ok"))
        for one in self._imports.values():
            one.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the imports, and write what waits."""
        for one in self._imports.values():
            one.request_end()
        for one in self._imports.values():
            one.__exit__(kind, error, trace)
        self.record(Act(actor="service", action="service end", outcome="ok" if error is None else repr(error)))
        self._writer.__exit__(kind, error, trace)

    def record(self, act: Act) -> None:
        """Write an act as soon as possible; never waits."""
        if not self._is_one_too_many(act):
            self._writer.record(act)

    def write_now(self, act: Act) -> AuditEntry:
        """Write an act, and return its entry once it is on the disk; called in a thread.

        Raises:
            AuditError: it was not written within the time limit; it may be written later.
        """
        try:
            return self._writer.record(act).result(WRITE_TIMEOUT)
        except FutureTimeoutError:
            raise AuditError(
                f"{self.path}: the disk has not taken an entry of the audit trail within {WRITE_TIMEOUT:g} s; "
                "check the disk, and look there before you repeat the request"
            ) from None

    async def write(self, act: Act) -> None:
        """Write an act, and wait until it is on the disk, for a limited time."""
        if self._is_one_too_many(act):
            return
        written = asyncio.wrap_future(self._writer.record(act))
        with suppress(AuditError, TimeoutError, FutureTimeoutError):
            await asyncio.wait_for(asyncio.shield(written), WRITE_TIMEOUT)

    def find_obstacle(self) -> str:
        """Return why nothing can be recorded at present, for a person; empty if it can."""
        return self._writer.find_obstacle()

    def describe_state(self) -> str:
        """Return ``ok``, or what is wrong with the trail or with that of a rig agent, for a person."""
        return self.find_obstacle() or self._fault or self._describe_imports() or "ok"

    def _describe_imports(self) -> str:
        obstacles = {bench: one.obstacle for bench, one in self._imports.items() if one.obstacle}
        if len(self._imports) == 1:
            return "".join(obstacles.values())
        return "; ".join(f"{bench}: {obstacle}" for bench, obstacle in obstacles.items())

    def get_head(self) -> Head:
        """Return the last entry."""
        return self._writer.chain.get_head()

    def _verify(self) -> None:
        """Verify once what former services have written."""
        with suppress(AuditError):  # before the first entry there is no file
            if fault := verify_chain(self.path).fault:
                self._fault = f"the audit trail was altered: {fault}; run: mrbench audit verify"

    def _is_one_too_many(self, act: Act) -> bool:
        """Return whether an act is one of too many without sign-in; the first of the next minute counts them."""
        if act.actor != UNKNOWN:
            return False
        now = self._clock()
        if now - self._minute >= _MINUTE:
            if (more := self._refusals - _REFUSALS_PER_MINUTE) > 0:
                self._writer.record(Act(actor=UNKNOWN, origin="", action="further requests refused", new=more))
            self._minute, self._refusals = now, 0
        self._refusals += 1
        return self._refusals > _REFUSALS_PER_MINUTE
