"""Address of a Modbus instrument, and the timing of its line."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class ModbusAddress:
    """URL of a Modbus line, and the settings of a serial one."""

    url: str
    """``tcp://host:port`` for Modbus TCP; a serial port, ``rfc2217://...`` or ``socket://...`` for Modbus RTU."""
    baud: int | None = None
    """[bit/s] of a serial line; by default that of the instrument's wire file."""
    parity: Literal["N", "E", "O"] = "N"
    stop_bits: int = 1

    @property
    def is_rtu(self) -> bool:
        """True if the line uses RTU framing, whose replies carry no request number."""
        return not self.url.startswith("tcp://")

    @property
    def bits_per_character(self) -> int:
        """[bit] on the line for a byte: start, eight data bits, parity, stop."""
        return 9 + (self.parity != "N") + self.stop_bits

    def compute_transfer_time(self, octets: float) -> float:
        """Return the time [s] of so many bytes on a serial line; zero over TCP."""
        return octets * self.bits_per_character / self.baud if self.is_rtu and self.baud else 0.0

    @property
    def silent_interval(self) -> float:
        """[s] of silence before each frame on a serial line: 3.5 characters, or 1.75 ms above 19200 Bd."""
        if not self.is_rtu or not self.baud:
            return 0.0
        return 1.75e-3 if self.baud > 19200 else self.compute_transfer_time(3.5)


def compute_line_capacity(
    address: ModbusAddress, exchanges: Sequence[tuple[int, int]], reply_delay: float
) -> float:
    """Return how many times per second [1/s] a line can transfer these exchanges; infinite over TCP.

    Args:
        address: address of the line.
        exchanges: [bytes] of each request and its reply, frame included.
        reply_delay: [s] from each request to its reply.
    """
    if not address.is_rtu:
        return math.inf
    octets = sum(request + reply for request, reply in exchanges)
    return 1 / (
        address.compute_transfer_time(octets) + len(exchanges) * (2 * address.silent_interval + reply_delay)
    )
