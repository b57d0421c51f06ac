"""Output of the simulated coil amplifier over time: ramps, steps from a table, and shutdown.

The output is a function of the rig's time. It may be evaluated late with the same result, so the table runs as
exactly as the rig's clock.
"""

import bisect
from dataclasses import dataclass, field
from enum import IntEnum


class TableState(IntEnum):
    """State of the step table."""

    IDLE = 0
    ARMED = 1
    RUNNING = 2
    DONE = 3


@dataclass
class CoilOutput:
    """Levels in V or A, times on the rig's clock [ns]."""

    ramp: float = 100.0
    """Slope towards the target [V/s or A/s]."""
    target: float = 0.0
    table: TableState = TableState.IDLE
    started_ns: int = 0
    """Instant of the trigger [ns]."""
    _start_ns: int = 0
    _start_level: float = 0.0
    _steps: list[tuple[int, float]] = field(default_factory=list)

    def compute_level(self, now_ns: int) -> float:
        """Return the level of the output."""
        self.update(now_ns)
        if self.table is TableState.RUNNING:
            index = bisect.bisect_right(self._steps, now_ns - self.started_ns, key=lambda step: step[0])
            return self._steps[index - 1][1] if index else self._start_level
        return self._compute_ramp(now_ns)

    def set_target(self, target: float, now_ns: int) -> None:
        """Ramp from the present level to a target."""
        self._hold(now_ns)
        self.target = target

    def set_zero(self, now_ns: int) -> None:
        """Set the output to zero at once and stop the table."""
        self.table, self._start_level, self._start_ns, self.target = TableState.IDLE, 0.0, now_ns, 0.0

    def arm(self, steps: list[tuple[int, float]]) -> None:
        """Arm these steps for the next trigger: time after it [ns], level."""
        self._steps, self.table = steps, TableState.ARMED

    def trigger(self, now_ns: int) -> None:
        """Start the armed table, if there is one."""
        if self.table is TableState.ARMED:
            self._hold(now_ns)
            self.table, self.started_ns = TableState.RUNNING, now_ns

    def abort(self, now_ns: int) -> None:
        """Stop the table; the output keeps its level."""
        if self.table is TableState.RUNNING:
            self._hold(now_ns)
        self.table = TableState.IDLE

    def update(self, now_ns: int) -> None:
        """Complete the table if its last step is reached."""
        if self.table is TableState.RUNNING and now_ns - self.started_ns >= self._steps[-1][0]:
            self.table, (after, level) = TableState.DONE, self._steps[-1]
            self._start_level = self.target = level
            self._start_ns = self.started_ns + after  # instant of the last step, even if evaluated later

    def _hold(self, now_ns: int) -> None:
        self._start_level = self.compute_level(now_ns)
        self.target, self._start_ns = self._start_level, now_ns

    def _compute_ramp(self, now_ns: int) -> float:
        change = self.ramp * (now_ns - self._start_ns) * 1e-9
        difference = self.target - self._start_level
        if change >= abs(difference):
            return self.target
        return self._start_level + (change if difference > 0 else -change)
