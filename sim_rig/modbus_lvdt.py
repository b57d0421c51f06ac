"""The simulated LVDT conditioner: displacement in a ring of samples, on Modbus."""

from sim_rig.modbus_measuring import MeasuringDevice


class LvdtDevice(MeasuringDevice):
    """Its range ends on both sides; without a core there is no value."""

    kind, channel = "lvdt", "displacement"

    def beyond(self, value: float, limit: float) -> bool:
        """Whether a displacement [m] is at either end of the range."""
        return abs(value) >= limit
