"""Where a Modbus instrument is reached, and how much its wire carries."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class ModbusAddress:
    """Where an instrument is reached."""

    url: str
    """``tcp://host:port`` for Modbus TCP; a serial port, ``rfc2217://...`` or ``socket://...`` for Modbus RTU."""
    baud: int | None = None
    """[bit/s] of the serial line; none lets the instrument's wire file say."""
    parity: Literal["N", "E", "O"] = "N"
    stop_bits: int = 1

    @property
    def rtu(self) -> bool:
        """Whether its answers come without a number, at the pace of a serial line."""
        return not self.url.startswith("tcp://")

    @property
    def character(self) -> int:
        """[bit] on the line for a byte: start, eight of data, parity, stop."""
        return 9 + (self.parity != "N") + self.stop_bits

    def seconds(self, octets: float) -> float:
        """[s] that so many bytes take on the serial line; nothing over TCP."""
        return octets * self.character / self.baud if self.rtu and self.baud else 0.0

    @property
    def gap(self) -> float:
        """[s] of silence that the serial line keeps before each frame: 3.5 characters, 1.75 ms when it is fast."""
        if not self.rtu or not self.baud:
            return 0.0
        return 1.75e-3 if self.baud > 19200 else self.seconds(3.5)


def carried(address: ModbusAddress, exchanges: Sequence[tuple[int, int]], reply_delay: float) -> float:
    """[1/s] how often a wire carries these exchanges, one after the other; infinite over TCP.

    Args:
        address: of the wire.
        exchanges: [bytes] of each request and its answer, frame included.
        reply_delay: [s] that the instrument takes before each answer.
    """
    if not address.rtu:
        return math.inf
    octets = sum(request + answer for request, answer in exchanges)
    return 1 / (address.seconds(octets) + len(exchanges) * (2 * address.gap + reply_delay))
