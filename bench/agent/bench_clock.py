"""The clock that everything in a log is said by."""

import time


class BenchClock:
    """The bench clock [ns]: monotonic, zero when the agent starts."""

    def __init__(self) -> None:
        self._began = time.monotonic_ns()

    def __call__(self) -> int:
        """Now."""
        return time.monotonic_ns() - self._began
