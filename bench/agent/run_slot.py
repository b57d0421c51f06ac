"""Run slot: the run in progress, on a thread of its own, and the finished runs."""

import threading
from collections import deque
from collections.abc import Callable

from bench.agent.run import Run
from bench.agent.run_executor import PreparedRun
from bench.agent_protocol import RunStatus
from bench.recorder import LiveRecorder

_MAX_FINISHED = 100
"""Number of finished runs that are listed."""


class RunSlot:
    """Runs of an agent since it started, one at a time.

    Args:
        lock: lock of the agent's state, so that state and runs are read consistently.
        execute: plays and records a run to its end.
        on_ended: receives the result of each run, with the lock held.
    """

    def __init__(
        self,
        lock: threading.RLock,
        execute: Callable[[PreparedRun], None],
        on_ended: Callable[[RunStatus], None],
    ) -> None:
        self._lock, self._execute, self._on_ended = lock, execute, on_ended
        self._current: Run | None = None
        self._thread: threading.Thread | None = None
        self._finished: deque[RunStatus] = deque(maxlen=_MAX_FINISHED)

    @property
    def current(self) -> Run | None:
        """Run in progress; None between runs."""
        return self._current

    @property
    def log(self) -> LiveRecorder | None:
        """Open log of the run in progress."""
        run = self._current  # read once, because the run may end meanwhile
        return None if run is None else run.log

    @property
    def finished(self) -> tuple[RunStatus, ...]:
        """Results of the finished runs, newest last."""
        with self._lock:
            return tuple(self._finished)

    def get_status(self) -> RunStatus | None:
        """Return the status of the run in progress or of the latest run; None before the first."""
        with self._lock:
            run, last = self._current, self._finished[-1] if self._finished else None
        # Without the lock: a status takes the recording thread's lock, and that thread may wait for this one.
        return last if run is None else run.get_status()

    def start(self, prepared: PreparedRun) -> None:
        """Execute a run in a thread; return at once."""
        self._current = prepared.run
        self._thread = threading.Thread(target=self._execute_run, args=(prepared,), name="run", daemon=True)
        self._thread.start()

    def wait(self, timeout: float) -> bool:
        """Wait for the run to end, up to a timeout [s]; return whether there is none in progress."""
        thread = self._thread
        if thread is not None:
            thread.join(timeout)
        return thread is None or not thread.is_alive()

    def _execute_run(self, prepared: PreparedRun) -> None:
        try:
            self._execute(prepared)
        except Exception as error:  # a run without an outcome would seem to be in progress
            prepared.run.fail(f"the run failed: {error!r}; internal error, please report")
        finally:
            with self._lock:
                status = prepared.run.get_status()
                self._finished.append(status)
                self._current = None
                self._on_ended(status)
