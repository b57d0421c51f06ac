"""Clock of one simulated instrument: the rig clock with an offset and a rate error."""

from typing import NamedTuple


class DeviceClock(NamedTuple):
    """A clock with an offset and a rate error against the rig's clock."""

    offset_ns: int = 0
    """Reading [ns] at zero of the rig's clock."""
    ppm: float = 0.0
    """Rate error [ppm], positive for a fast clock."""

    def read_ns(self, rig_ns: int) -> int:
        """Return its reading [ns] at ``rig_ns`` [ns] of the rig's clock."""
        return self.offset_ns + round(rig_ns * (1 + self.ppm * 1e-6))


TRUE_CLOCK = DeviceClock()
"""A device clock that shows the rig's own time."""
