"""Simulated LVDT conditioner and thermometer: one measured channel in a ring buffer of samples, on Modbus."""

import math
from typing import NamedTuple

from sim_rig.instruments.modbus_registers import RegisterBank, SampleRingBuffer
from sim_rig.instruments.wire_files import load_wire_file
from sim_rig.live import TRUE_CLOCK, DeviceClock, RigInterface

_OVER_RANGE, _NO_VALUE = 1, 2
"""Status bits: the value is at the end of the range; the sensor has no value (no core, an open wire)."""


class _SensorKind(NamedTuple):
    channel: str
    two_sided: bool
    """True if the range has its limit on both sides of zero."""


_KINDS = {"lvdt": _SensorKind("displacement", True), "thermometer": _SensorKind("temperature", False)}
"""By the name of the wire file."""


class SensorDevice:
    """Registers of one measuring instrument, without its wire."""

    def __init__(self, kind: str, signals: RigInterface, clock: DeviceClock = TRUE_CLOCK) -> None:
        """Switch the instrument on.

        Args:
            kind: ``lvdt`` or ``thermometer``.
            signals: the rig.
            clock: the instrument's clock.
        """
        document = load_wire_file(kind)
        self._channel, self._two_sided = _KINDS[kind]
        self._limit: float = next(
            entry["high"] for entry in document["register"] if entry["name"] == self._channel
        )
        self.ring_buffer = SampleRingBuffer(document, signals, clock, self._get_status)
        self._bank = RegisterBank(
            document,
            {**self.ring_buffer.make_getters(), "status": self._get_status},
            {"block_start": self.ring_buffer.set_start},
            [self.ring_buffer.make_section()],
        )

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Return words of its registers.

        Raises:
            ModbusRequestError: they do not exist.
        """
        return self._bank.read(function, address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Set its registers.

        Raises:
            ModbusRequestError: they do not exist, or cannot be set.
        """
        self._bank.write(address, words)

    def advance(self) -> None:
        """Do nothing: the instrument has no time-driven behaviour."""

    def _get_status(self) -> int:
        value = self.ring_buffer.read_newest(self._channel)[1]
        if math.isnan(value):
            return _NO_VALUE
        return _OVER_RANGE if (abs(value) if self._two_sided else value) >= self._limit else 0
