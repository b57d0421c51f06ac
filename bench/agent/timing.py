"""Clock of every recorded time, and waiting times that hardware and operation require; tests shorten them."""

import time
from typing import NamedTuple


class BenchClock:
    """Bench clock [ns]: monotonic, zero when the agent starts."""

    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()

    def __call__(self) -> int:
        """Return the time now [ns]."""
        return time.monotonic_ns() - self._start_ns


class AgentTiming(NamedTuple):
    """Waiting times of the agent, in seconds."""

    clock_settling: float = 4.0
    """Time [s] after the wires are opened until the clock maps are accurate enough for a log."""
    final_samples: float = 2.0
    """Longest wait [s] for the last samples of a run; those of the LVDT take tens of milliseconds."""
    setup_reply: float = 2.0
    """Longest wait [s] before `SetupExecutor.start` returns; enough for all steps without motion."""


OPERATION_TIMING = AgentTiming()
"""Waiting times in operation."""
