"""Times of the agent that hardware and operation require, and that tests shorten."""

from typing import NamedTuple


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
