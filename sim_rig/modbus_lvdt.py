"""The simulated LVDT conditioner: displacement in a ring of samples, on Modbus."""

import math

from sim_rig.modbus_device import TRUE_CLOCK, DeviceClock, RegisterBank, SampleRing, wire_file
from sim_rig.signals import Signals

_OVER_RANGE, _NO_CORE = 1, 2


class LvdtDevice:
    """What its registers mean; knows no socket."""

    def __init__(self, signals: Signals, clock: DeviceClock = TRUE_CLOCK) -> None:
        """Begin.

        Args:
            signals: the rig's displacement.
            clock: its own.
        """
        document = wire_file("lvdt")
        self._limit = next(entry["high"] for entry in document["register"] if entry["name"] == "displacement")
        self.ring = SampleRing(document, signals, clock, self._status)
        self._bank = RegisterBank(
            document,
            {**self.ring.registers(), "status": self._status},
            {"wanted": self.ring.want},
            [self.ring.section()],
        )

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

    def advance(self) -> None:
        """Nothing happens between two questions."""

    def _status(self) -> int:
        value = self.ring.newest("displacement")[1]
        if math.isnan(value):
            return _NO_CORE
        return _OVER_RANGE if abs(value) >= self._limit else 0
