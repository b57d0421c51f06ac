"""An instrument's own clock beside the rig's."""

from typing import NamedTuple


class DeviceClock(NamedTuple):
    """A clock that begins elsewhere and is a little fast or slow."""

    offset_ns: int = 0
    """What it reads when the rig's clock reads zero [ns]."""
    ppm: float = 0.0
    """How much too fast it runs [ppm]."""

    def ns(self, rig_ns: int) -> int:
        """What it reads [ns] when the rig's clock reads ``rig_ns`` [ns]."""
        return self.offset_ns + round(rig_ns * (1 + self.ppm * 1e-6))


TRUE_CLOCK = DeviceClock()
"""One that shows the rig's own time."""
