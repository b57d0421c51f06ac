"""The output of the simulated coil amplifier over time: ramps, steps from a table, and what takes it to zero.

A function of time: it is asked with the rig's clock and may be asked late, and the answer is the same. So the
table runs as exactly as the rig's clock does, whoever looks.
"""

import bisect
from dataclasses import dataclass, field
from enum import IntEnum


class Table(IntEnum):
    """What the step table is doing."""

    IDLE = 0
    ARMED = 1
    RUNNING = 2
    DONE = 3


@dataclass
class CoilOutput:
    """Levels in V or A, times on the rig's clock [ns]."""

    ramp: float = 100.0
    """Towards the target [V/s or A/s]."""
    target: float = 0.0
    table: Table = Table.IDLE
    started_ns: int = 0
    """Of the trigger."""
    _since_ns: int = 0
    _from: float = 0.0
    _steps: list[tuple[int, float]] = field(default_factory=list)

    def level(self, now_ns: int) -> float:
        """What the output is set to."""
        self.settle(now_ns)
        if self.table is Table.RUNNING:
            place = bisect.bisect_right(self._steps, now_ns - self.started_ns, key=lambda step: step[0])
            return self._steps[place - 1][1] if place else self._from
        return self._ramped(now_ns)

    def go(self, target: float, now_ns: int) -> None:
        """Ramp to a target from where it is."""
        self._hold(now_ns)
        self.target = target

    def cut(self, now_ns: int) -> None:
        """Zero at once; the table is stopped."""
        self.table, self._from, self._since_ns, self.target = Table.IDLE, 0.0, now_ns, 0.0

    def arm(self, steps: list[tuple[int, float]]) -> None:
        """Let the next trigger start these steps: time after it [ns], level."""
        self._steps, self.table = steps, Table.ARMED

    def trigger(self, now_ns: int) -> None:
        """Start the armed table; without one, nothing happens."""
        if self.table is Table.ARMED:
            self._hold(now_ns)
            self.table, self.started_ns = Table.RUNNING, now_ns

    def abort(self, now_ns: int) -> None:
        """Stop the table; the output stays where it is."""
        if self.table is Table.RUNNING:
            self._hold(now_ns)
        self.table = Table.IDLE

    def settle(self, now_ns: int) -> None:
        """Note that the table has come to its end, if it has."""
        if self.table is Table.RUNNING and now_ns - self.started_ns >= self._steps[-1][0]:
            self.table, (after, level) = Table.DONE, self._steps[-1]
            self._from = self.target = level
            self._since_ns = self.started_ns + after  # when it came there, however late this is looked at

    def _hold(self, now_ns: int) -> None:
        self._from = self.level(now_ns)
        self.target, self._since_ns = self._from, now_ns

    def _ramped(self, now_ns: int) -> float:
        way = self.ramp * (now_ns - self._since_ns) * 1e-9
        gap = self.target - self._from
        return self.target if way >= abs(gap) else self._from + (way if gap > 0 else -way)
