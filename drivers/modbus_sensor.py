"""An instrument on Modbus that only measures: its samples stand in a ring and are read in blocks."""

from typing import Any, ClassVar

from drivers.channel import Block, Channel, Reading, Stamp
from drivers.errors import OutOfRange
from drivers.instrument import Clock, Health, Tap
from drivers.modbus_address import ModbusAddress
from drivers.modbus_sampler import Sampler


class ModbusSensor:
    """One sensor on its wire."""

    kind: ClassVar[str]
    """Name of its wire file."""
    called: ClassVar[str]
    """For a person, with its article."""

    def __init__(
        self, name: str, address: ModbusAddress, clock: Clock, *, unit: int | None = None, timeout: float = 0.2
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: in configuration, logs and messages.
            address: of its wire; a baud rate that is left out is that of its wire file.
            clock: the bench clock.
            unit: its Modbus number; its wire file's if none.
            timeout: [s] of silence after which a request has failed.

        Raises:
            OutOfRange: the serial line does not carry the samples that it makes.
        """
        self._sampler = Sampler(name, self.kind, address, clock, unit, timeout)

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""
        return self._sampler.line.name

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What it measures."""
        return self._sampler.channels()

    @property
    def stamp(self) -> Stamp | None:
        """Its clock beside the bench's, from the newest block."""
        return self._sampler.ring.stamp

    def connect(self) -> None:
        """Open the wire, check who answers, and begin with the next sample.

        Raises:
            NotConnected: the wire cannot be opened.
            NoReply, BadReply, Refused: it opens, but the instrument does not answer as itself.
        """
        self._sampler.connect()

    def close(self) -> None:
        """Close the wire."""
        self._sampler.line.close()

    def acquire(self, timeout: float) -> list[Block]:
        """Samples since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Raises:
            NotConnected: the wire has gone, or the instrument has restarted.
        """
        return self._sampler.ring.acquire(timeout)

    def age(self) -> float | None:
        """[s] since the newest sample that came was made; none before the first."""
        return self._sampler.ring.age()

    def read(self, channel: str) -> Reading:
        """Its newest sample, asked for now.

        Raises:
            OutOfRange: it has no such channel.
            NotConnected, NoReply, BadReply, Refused: it did not come.
        """
        return self._sampler.read(channel)

    def write(self, channel: str, value: float) -> None:
        """Nothing of it can be set.

        Raises:
            OutOfRange: always.
        """
        raise OutOfRange(f"{self.name}: {channel} cannot be set to {value:.6g}: {self.called} only measures")

    def describe(self) -> dict[str, Any]:
        """What a replay needs beside the frames from now on, see `drivers.replay`."""
        return self._sampler.describe()

    def make_safe(self) -> None:
        """Nothing to do: it moves nothing."""

    def health(self) -> Health:
        """Counts and state."""
        return self._sampler.ring.health()

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of every frame from now on."""
        self._sampler.line.listen(tap)
