"""The simulated thermometer: ten temperatures a second, on Modbus."""

from sim_rig.modbus_measuring import MeasuringDevice


class ThermometerDevice(MeasuringDevice):
    """Its range ends above; an open wire has no value."""

    kind, channel = "thermometer", "temperature"

    def beyond(self, value: float, limit: float) -> bool:
        """Whether a temperature [degC] is at the upper end of the range."""
        return value >= limit
