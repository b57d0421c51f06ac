"""Drivers of the bench's instruments: load cells, Modbus instruments and the servo actuator."""

from drivers.channel import ClockReading, Frame, SampleBlock
from drivers.errors import DriverError
from drivers.instrument import Clock, Instrument
from drivers.wire_files import load_wire_file

__all__ = [
    "Clock",
    "ClockReading",
    "DriverError",
    "Frame",
    "Instrument",
    "SampleBlock",
    "load_wire_file",
]
