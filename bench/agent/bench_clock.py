"""Bench clock: the clock of every recorded time."""

import time


class BenchClock:
    """Bench clock [ns]: monotonic, zero when the agent starts."""

    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()

    def __call__(self) -> int:
        """Return the time now [ns]."""
        return time.monotonic_ns() - self._start_ns
