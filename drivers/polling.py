"""Poll schedules: fixed instants of the bench clock at which threads read their wires.

Waking a thread costs more than the work it then does, most of all when two threads wake together and one waits
for the interpreter (decision 0011). Setpoints leave at multiples of their cycle, and the drive replies within a
millisecond. Each polling thread has an offset of its own after that.
"""

from typing import NamedTuple

_MILLISECOND = 1_000_000
"""[ns]"""


class PollSchedule(NamedTuple):
    """Period and offset of the instants on the bench clock at which a thread reads its wire."""

    period_ns: int
    """Time between two polls [ns]."""
    offset_ns: int
    """Bench clock at the first poll [ns]."""

    def compute_wait(self, now_ns: int) -> float:
        """Return the time [s] from an instant of the bench clock [ns] to the next poll."""
        return (self.period_ns - (now_ns - self.offset_ns) % self.period_ns) * 1e-9


ACTUATOR_SCHEDULE = PollSchedule(8 * _MILLISECOND, round(1.5 * _MILLISECOND))
"""Polls of the CAN bus. Each takes the drive's frames of two setpoints."""
LOAD_CELL_SCHEDULE = PollSchedule(12 * _MILLISECOND, round(3.1 * _MILLISECOND))
"""Polls of the load cell's serial line."""
