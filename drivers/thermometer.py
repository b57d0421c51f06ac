"""Thermometer over Modbus: the temperature of the damper's cylinder, ten times a second."""

from drivers.modbus_sensor import ModbusSensor


class Thermometer(ModbusSensor):
    """One thermometer on its wire."""

    kind, called = "thermometer", "a thermometer"
