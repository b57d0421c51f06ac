"""A simulated instrument on Modbus that only measures: one channel in a ring of samples."""

import math
from abc import ABC, abstractmethod
from typing import ClassVar

from sim_rig.device_clock import TRUE_CLOCK, DeviceClock
from sim_rig.modbus_device import RegisterBank, SampleRing, wire_file
from sim_rig.signals import Signals

_OVER_RANGE, _NO_VALUE = 1, 2
"""Bits of the status: the value is at the end of the range; the sensor has none (no core, an open wire)."""


class MeasuringDevice(ABC):
    """What its registers mean; knows no socket."""

    kind: ClassVar[str]
    """Name of its wire file."""
    channel: ClassVar[str]
    """What it measures."""

    def __init__(self, signals: Signals, clock: DeviceClock = TRUE_CLOCK) -> None:
        """Begin.

        Args:
            signals: the rig's, with this channel.
            clock: its own.
        """
        document = wire_file(self.kind)
        self._limit: float = next(entry["high"] for entry in document["register"] if entry["name"] == self.channel)
        self.ring = SampleRing(document, signals, clock, self._status)
        self._bank = RegisterBank(
            document,
            {**self.ring.registers(), "status": self._status},
            {"wanted": self.ring.want},
            [self.ring.section()],
        )

    @abstractmethod
    def beyond(self, value: float, limit: float) -> bool:
        """Whether a value is at the end of the range, whose upper limit is ``limit``."""

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Words of its registers.

        Raises:
            Illegal: they do not exist.
        """
        return self._bank.read(function, address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Set its registers.

        Raises:
            Illegal: they do not exist, or cannot be set.
        """
        self._bank.write(address, words)

    def advance(self) -> None:  # noqa: B027
        """Nothing happens between two questions."""

    def _status(self) -> int:
        value = self.ring.newest(self.channel)[1]
        if math.isnan(value):
            return _NO_VALUE
        return _OVER_RANGE if self.beyond(value, self._limit) else 0
