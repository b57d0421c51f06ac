"""When threads that are woken again and again are woken: at fixed places of the bench clock.

To be woken costs a thread more than all that it then does, and most where two are woken at once and one has to
wait for the interpreter (decision 0011). Setpoints leave at multiples of their cycle; the drive has answered a
millisecond later; then each of those who take what has come has a place of its own.
"""

from typing import NamedTuple

_MILLISECOND = 1_000_000
"""[ns]"""


class Beat(NamedTuple):
    """Instants of the bench clock [ns]."""

    every_ns: int
    """From one to the next."""
    at_ns: int
    """The first of them."""

    def wait(self, now_ns: int) -> float:
        """[s] from an instant of the bench clock [ns] to the next beat."""
        return (self.every_ns - (now_ns - self.at_ns) % self.every_ns) * 1e-9


ACTUATOR = Beat(8 * _MILLISECOND, round(1.5 * _MILLISECOND))
"""The drive's frames are taken from the bus: those of two setpoints."""
FORCE = Beat(12 * _MILLISECOND, round(3.1 * _MILLISECOND))
"""The load cell's line is read."""
