"""LVDT conditioner over Modbus: displacement from a ring of samples, read in blocks.

It makes a sample a millisecond by its own clock and keeps the newest few thousand; see `drivers.modbus_ring`. By
the time that a sample arrives it is tens of milliseconds old (`Lvdt.age` says how old): good for the record, too
late for limits that must act fast.
"""

from drivers.modbus_sensor import ModbusSensor


class Lvdt(ModbusSensor):
    """One conditioner on its wire."""

    kind, called = "lvdt", "an LVDT"
