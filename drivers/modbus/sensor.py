"""Modbus sensor: an instrument that only measures. Each sensor is a subclass: its wire file, its name in messages.

It samples by its own clock and keeps its latest samples in a ring buffer, see `drivers.modbus.ring_buffer_reader`.
"""

from typing import ClassVar

from drivers.errors import OutOfRangeError
from drivers.instrument import Clock
from drivers.modbus.instrument import ModbusInstrument
from drivers.transport import ModbusAddress


class ModbusSensor(ModbusInstrument):
    """One sensor on its wire."""

    kind: ClassVar[str]
    """Name of its wire file."""
    display_name: ClassVar[str]
    """Name in messages, with its article."""

    def __init__(
        self, name: str, address: ModbusAddress, clock: Clock, *, unit: int | None = None, timeout: float = 0.2
    ) -> None:
        """Prepare, as `ModbusInstrument` does; nothing is opened yet."""
        super().__init__(name, self.kind, address, clock, unit, timeout)

    def write(self, channel: str, value: float) -> None:
        """Refuse: a sensor has no writable channel.

        Raises:
            OutOfRangeError: always.
        """
        raise OutOfRangeError(
            f"{self.name}: {channel} cannot be set to {value:.6g}: {self.display_name} only measures"
        )

    def make_safe(self) -> str:
        """Do nothing: a sensor moves nothing."""
        return ""
