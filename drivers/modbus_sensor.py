"""An instrument on Modbus that only measures."""

from typing import ClassVar

from drivers.errors import OutOfRange
from drivers.instrument import Clock
from drivers.modbus_address import ModbusAddress
from drivers.modbus_instrument import ModbusInstrument


class ModbusSensor(ModbusInstrument):
    """One sensor on its wire."""

    kind: ClassVar[str]
    """Name of its wire file."""
    called: ClassVar[str]
    """For a person, with its article."""

    def __init__(
        self, name: str, address: ModbusAddress, clock: Clock, *, unit: int | None = None, timeout: float = 0.2
    ) -> None:
        """Prepare, as `ModbusInstrument` does; nothing is opened yet."""
        super().__init__(name, self.kind, address, clock, unit, timeout)

    def write(self, channel: str, value: float) -> None:
        """Nothing of it can be set.

        Raises:
            OutOfRange: always.
        """
        raise OutOfRange(f"{self.name}: {channel} cannot be set to {value:.6g}: {self.called} only measures")

    def make_safe(self) -> None:
        """Nothing to do: it moves nothing."""
