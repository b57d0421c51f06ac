"""Logs on this machine: removed some days after their copy if this is wanted, and fetched when they are needed."""

import hashlib
import logging
import os
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Lock
from weakref import WeakValueDictionary

from bench.catalogue import Catalogue, RunRow
from bench.disk import sync_path
from bench.log import write_atomically
from bench.log_store.copying import check_object, make_content_error
from bench.log_store.errors import LogStoreError, LogStoreUnavailableError
from bench.log_store.objects import read_blocks

_LOG = logging.getLogger(__name__)


class LocalLogs:
    """Logs of one data folder; safe from any thread.

    A fetched log has its former place and time, so that everything that reads logs finds it as it was.
    """

    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._locks: WeakValueDictionary[str, Lock] = WeakValueDictionary()
        self._locks_lock = Lock()

    def locate(self, row: RunRow) -> Path:
        """Return the path of the log of a run; fetch the log from its copy if it is not here.

        Without a copy, the path is returned even if there is no file.

        Raises:
            LogError: the log cannot be written to the data folder.
            LogStoreError: the copy is missing, or has another content than the recorded log.
            LogStoreUnavailableError: the store cannot be reached.
        """
        path = self._catalogue.resolve_path(row.log)
        if row.copy_url is None or path.exists():
            return path
        with self._lock(row):
            if not path.exists():
                _fetch(row, row.copy_url, path)
                self._catalogue.update_run(row.id, removed=None, fetched=datetime.now(UTC))
                _LOG.info("log_fetched", extra={"run": row.id, "copy": row.copy_url})
        return path

    def remove_old(self, days: float) -> None:
        """Remove the logs that were copied, or last fetched, some days ago.

        Each copy is compared once more before; a log whose copy was lost or damaged stays, and is copied again.
        Logs of runs with unfinished jobs stay.

        Raises:
            LogStoreUnavailableError: the store cannot be reached.
        """
        for row in self._catalogue.log_copies.list_removable(datetime.now(UTC) - timedelta(days=days)):
            with self._lock(row):
                path = self._catalogue.resolve_path(row.log)
                if row.copy_url is None or row.id in self._find_busy() or not path.is_file():
                    continue
                if self._has_copy(row, row.copy_url):
                    # Recorded first: a scan would otherwise find the log missing.
                    self._catalogue.update_run(row.id, removed=datetime.now(UTC))
                    path.unlink(missing_ok=True)
                    _LOG.info("log_removed", extra={"run": row.id, "log": row.log, "copy": row.copy_url})

    def _has_copy(self, row: RunRow, url: str) -> bool:
        """Return whether the copy of a log is as it was; forget one that is not, so that it is made again."""
        try:
            check_object(url, row)
        except LogStoreUnavailableError:
            raise
        except LogStoreError as error:
            _LOG.warning("log_copy_lost", extra={"run": row.id, "why": str(error)})
            self._catalogue.update_run(row.id, copy_url=None, copied=None)
            return False
        return True

    def _lock(self, row: RunRow) -> Lock:
        with self._locks_lock:
            return self._locks.setdefault(row.id, Lock())

    def _find_busy(self) -> set[str]:
        """Return the ids of the runs that unfinished jobs read."""
        jobs = self._catalogue.job_queue.list_unfinished()
        return {run for job in jobs for run in (job.run_id, *job.settings.get("runs", ()))}


def _fetch(row: RunRow, url: str, path: Path) -> None:
    """Write a copy to the place of its log, compare it, and give it the time of the log."""
    digest, size = hashlib.sha256(), 0
    with write_atomically(path) as partial:
        with partial.open("wb") as file:
            for block in read_blocks(url):
                digest.update(block)
                size += file.write(block)
        if digest.hexdigest() != row.log_sha256:
            raise make_content_error(url, row, digest.hexdigest(), size)
        sync_path(partial)
        os.utime(partial, ns=(time.time_ns(), row.log_modified_ns or time.time_ns()))
