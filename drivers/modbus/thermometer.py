"""Thermometer on Modbus."""

from drivers.modbus.sensor import ModbusSensor


class Thermometer(ModbusSensor):
    """Thermometer: temperature of the damper's cylinder, 10 Hz."""

    kind, display_name = "thermometer", "a thermometer"
