"""The run that goes on and those that have ended: one at a time, on a thread of its own."""

import threading
from collections import deque
from collections.abc import Callable

from bench.agent.header import LogFacts
from bench.agent.messages import RunStatus
from bench.agent.run import Run
from bench.recorder.live import LiveRecorder

_REMEMBERED = 100
"""Ended runs that are listed."""


class Runs:
    """The runs of an agent since it started.

    Args:
        lock: of the agent's state: whoever holds it sees state and runs that belong together.
        carry_out: plays and records a run to its end, whatever that is.
        ended: told how a run ended, with the lock held.
    """

    def __init__(
        self,
        lock: threading.RLock,
        carry_out: Callable[[Run, LogFacts], None],
        ended: Callable[[RunStatus], None],
    ) -> None:
        self._lock, self._carry_out, self._ended = lock, carry_out, ended
        self._current: Run | None = None
        self._thread: threading.Thread | None = None
        self._finished: deque[RunStatus] = deque(maxlen=_REMEMBERED)

    @property
    def current(self) -> Run | None:
        """The run that goes on; none between runs."""
        return self._current

    @property
    def log(self) -> LiveRecorder | None:
        """The log that is open."""
        run = self._current  # read once: the run may end meanwhile
        return None if run is None else run.log

    @property
    def finished(self) -> tuple[RunStatus, ...]:
        """Those that ended, newest last."""
        with self._lock:
            return tuple(self._finished)

    def status(self) -> RunStatus | None:
        """The run that goes on, or the last one; none before the first."""
        with self._lock:
            run, last = self._current, self._finished[-1] if self._finished else None
        # Without the lock: a run asks its bench what it has lost, and a bench whose log fails asks for the lock.
        return last if run is None else run.status()

    def begin(self, run: Run, facts: LogFacts) -> None:
        """Carry a run out from now on; returns at once."""
        self._current = run
        self._thread = threading.Thread(target=self._to_the_end, args=(run, facts), name="run", daemon=True)
        self._thread.start()

    def wait(self, timeout: float) -> bool:
        """Wait [s] for the run to end; whether it has, or there is none."""
        thread = self._thread
        if thread is not None:
            thread.join(timeout)
        return thread is None or not thread.is_alive()

    def _to_the_end(self, run: Run, facts: LogFacts) -> None:
        try:
            self._carry_out(run, facts)
        finally:
            with self._lock:
                status = run.status()
                self._finished.append(status)
                self._current = None
                self._ended(status)
