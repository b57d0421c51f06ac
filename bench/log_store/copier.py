"""Thread that copies the logs of finished runs to a log store, and repeats failed copies for ever.

Runs are recorded to the data folder only. So a store that is away delays copies, and never a run.
"""

import logging
import time
from collections.abc import Callable
from typing import NamedTuple

from bench.catalogue import Catalogue, RunRow
from bench.errors import LogError
from bench.log_lines import RepeatedFailure
from bench.log_store.copying import copy_log
from bench.log_store.errors import LogStoreUnavailableError
from bench.log_store.waits import GrowingWait
from bench.threads import BackgroundThread

PERIOD = 2.0
"""[s] Time between two looks for logs without a copy."""
_END_TIME = 2.0
"""[s] Time for a transfer in progress at the end of the service; it is repeated at the next start."""
_LOG = logging.getLogger(__name__)


class CopyCounts(NamedTuple):
    """Numbers of copies."""

    waiting: int
    """Logs without a verified copy."""
    copied: int
    """Copies since the start of the service."""
    failed: int
    """Failed attempts since the start of the service."""
    is_reachable: bool
    """False after an attempt at which the store did not answer."""


class LogCopier(BackgroundThread):
    """Thread that copies the logs of a catalogue to a log store.

    Args:
        catalogue: the catalogue of the data folder.
        store: address of the store.
        remove_old: removes logs whose copy is old enough; called after each look.
        clock: time [s].
    """

    def __init__(
        self,
        catalogue: Catalogue,
        store: str,
        remove_old: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__("log-copier", _END_TIME)
        self._remove_old = remove_old
        self._catalogue, self._store, self._clock = catalogue, store, clock
        self._outage, self._store_wait = "", GrowingWait()
        self._run_waits: dict[str, GrowingWait] = {}
        self._waiting = self._copied = self._failed = 0
        self._failures = RepeatedFailure(_LOG, "log_store_failed", "log_store_works_again")

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self.copy_due()
                self._remove_old()
            except Exception as error:  # the thread must not end, or later logs would not be copied
                self._failures.note(error)
            self._stopping.wait(PERIOD)

    def copy_due(self) -> None:
        """Copy the logs without a copy whose wait has passed, the oldest first.

        After a failure of the store no further log is tried: its wait is that of all logs.

        Raises:
            CatalogueUnavailableError: the catalogue cannot be used at present.
        """
        waiting = self._catalogue.log_copies.list_waiting(self._store)
        self._run_waits = {run_id: self._run_waits[run_id] for run_id in waiting if run_id in self._run_waits}
        self._waiting = len(waiting)
        for run_id in waiting:
            if self._stopping.is_set() or self._store_wait.find_rest(self._clock()):
                return
            wait = self._run_waits.get(run_id)
            if wait is None or not wait.find_rest(self._clock()):
                self._try(run_id)

    def _try(self, run_id: str) -> None:
        row = self._catalogue.get_run(run_id)
        if row is None:
            return
        try:
            copied = copy_log(self._catalogue, row, self._store)
        except LogStoreUnavailableError as error:
            self._failed += 1
            self._outage = str(error)
            self._store_wait.fail(self._clock())
            self._failures.note(error)
        except LogError as error:
            self._failed += 1
            self._run_waits.setdefault(run_id, GrowingWait()).fail(self._clock())
            _LOG.warning("log_not_copied", extra={"run": run_id, "why": str(error)})
        else:
            self._note_success(copied)

    def _note_success(self, row: RunRow) -> None:
        self._copied += 1
        self._waiting -= 1
        self._run_waits.pop(row.id, None)
        self._outage, self._store_wait = "", GrowingWait()
        self._failures.clear()
        _LOG.info("log_copied", extra={"run": row.id, "copy": row.copy_url})

    def count(self) -> CopyCounts:
        """Return the numbers of copies, as of the latest look."""
        return CopyCounts(self._waiting, self._copied, self._failed, not self._outage)

    def describe_state(self) -> str:
        """Return ``ok``, or how many logs wait for a copy and why.

        It contains no address, because health is public.
        """
        if not self._waiting:
            return "ok"
        text = f"{self._waiting} {'log waits' if self._waiting == 1 else 'logs wait'} for a copy"
        if self._outage:
            rest = self._store_wait.find_rest(self._clock())
            text += f"; {self._outage}; the next attempt follows within {rest + PERIOD:.0f} s"
        if self._run_waits:
            text += f"; copies of {len(self._run_waits)} logs fail, see log_not_copied in the log of the service"
        return text
