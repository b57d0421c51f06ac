"""LVDT conditioner on Modbus.

A sample is tens of milliseconds old when it arrives (`ModbusInstrument.compute_age`): good enough for the record,
but too late for fast limits.
"""

from drivers.modbus.sensor import ModbusSensor


class Lvdt(ModbusSensor):
    """LVDT conditioner: displacement at the actuator, 1 kHz."""

    kind, display_name = "lvdt", "an LVDT"
