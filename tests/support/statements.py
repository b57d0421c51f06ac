"""Statements of a service about its bench while processes are killed, compared with which of them lived.

Each answer is kept with the times of its request, and judged afterwards by the stamp that it contains. A busy
machine makes answers late, but never untrue. Times are UTC [s] of one machine.
"""

import threading
import time
from collections import Counter
from typing import NamedTuple

from bench.service.agent_monitor import STATUS_LIFETIME

PERIOD = 0.5
"""Pause between two rounds of requests [s]."""
SILENCE = 5.0
"""Time [s] after which the agent must not show a dead rig as connected, or a run on it as running."""
CLOCK_STEP = 1.0
"""Error [s] of the start times that the operating system states."""


class Statement(NamedTuple):
    """One answer of the service."""

    path: str
    asked: float
    answered: float
    content: dict


class StatementWatch:
    """Requests of ``/bench`` and ``/health`` in a thread, while its block lasts."""

    def __init__(self, bench):
        self._bench, self.statements, self._stopping = bench, [], threading.Event()
        self._thread = threading.Thread(target=self._ask_periodically)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stopping.set()
        self._thread.join()

    def count(self):
        """Return the number of statements by path."""
        return Counter(one.path for one in self.statements)

    def find_untrue(self):
        """Return the statements that were not true, as texts."""
        return [f"{problem}: {one}" for one in self.statements if (problem := self._judge(one))]

    def _ask_periodically(self):
        while not self._stopping.wait(PERIOD):
            for path in ("/bench", "/health"):
                asked = time.time()
                content = self._bench.get(path)
                if content is not None:
                    self.statements.append(Statement(path, asked, time.time(), content))
            for name in ("agent", "worker"):
                self._bench.is_alive(name)  # which notes the end of one that ended by itself

    def _judge(self, one):
        return self._judge_status(one) if one.path == "/bench" else self._judge_health(one)

    def _judge_status(self, one):
        stamp = one.content["utc_s"]
        if stamp < one.asked - STATUS_LIFETIME:
            return f"status is {one.asked - stamp:.1f} s old"
        if not self._has_lived("agent", stamp, stamp):
            return "status of a dead agent"
        if self._has_lived("rig", stamp - SILENCE, stamp):
            return ""
        is_running = one.content["state"] == "running"
        is_whole = all(instrument["connected"] for instrument in one.content["instruments"])
        return "running without a rig" * is_running or "instruments of a dead rig" * is_whole

    def _judge_health(self, one):
        for name in ("agent", "worker"):
            if one.content[name] == "ok" and not self._has_lived(name, one.asked - STATUS_LIFETIME, one.answered):
                return f"health of a dead {name}"
        return ""

    def _has_lived(self, name, since, until):
        """Return whether a process of a part existed at some moment of an interval."""
        return any(
            one.begin - CLOCK_STEP <= until and (one.end is None or one.end >= since)
            for one in self._bench.lifetimes[name]
        )
