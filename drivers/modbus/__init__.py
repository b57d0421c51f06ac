"""Drivers of the Modbus instruments: LVDT, thermometer, coil amplifier."""

from drivers.modbus.coil_amplifier import DRIVE_UNITS, CoilAmplifier
from drivers.modbus.lvdt import Lvdt
from drivers.modbus.sample_decoder import ModbusDecoder, RingBufferLayout
from drivers.modbus.step_table import TableState
from drivers.modbus.thermometer import Thermometer

__all__ = [
    "DRIVE_UNITS",
    "CoilAmplifier",
    "Lvdt",
    "ModbusDecoder",
    "RingBufferLayout",
    "TableState",
    "Thermometer",
]
