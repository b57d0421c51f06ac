"""What a Modbus request asks of a device, and how it is answered; no frame and no socket is known here.

Functions 3, 4, 6, 8 (return query data), 16 and 23.
"""

import struct
from typing import Protocol

_VALUE = 3
"""Code of the exception for what a request gives and cannot be taken."""


class Illegal(Exception):  # noqa: N818 - its name in the protocol is exception, too
    """The request cannot be done: 2 no such register, 3 no such value, 4 not in this state, 6 busy."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


class Device(Protocol):
    """The meaning of the registers; knows no socket."""

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Words of holding (3) or input (4) registers.

        Raises:
            Illegal: they cannot be read.
        """

    def write(self, address: int, words: list[int]) -> None:
        """Set holding registers.

        Raises:
            Illegal: they cannot be set.
        """

    def advance(self) -> None:
        """Time may have passed."""


def answer(device: Device, pdu: bytes) -> bytes:
    """What a device says to a request, without any frame."""
    function = pdu[0]
    try:
        return bytes([function]) + _content(device, function, pdu[1:])
    except Illegal as refusal:
        return bytes([function | 0x80, refusal.code])
    except (struct.error, IndexError):  # the request ends before all that its function needs
        return bytes([function | 0x80, _VALUE])


def _content(device: Device, function: int, body: bytes) -> bytes:
    if function == 8 and body[:2] == b"\0\0":
        return body
    if function == 23:
        return _written_and_read(device, body)
    if function not in {3, 4, 6, 16}:
        raise Illegal(1)
    address, number = struct.unpack_from(">HH", body)
    if function in {3, 4}:
        if not 1 <= number <= 125:
            raise Illegal(3)
        return struct.pack(f">B{number}H", 2 * number, *device.read(function, address, number))
    if function == 16:
        if not (1 <= number <= 123 and body[4] == 2 * number == len(body) - 5):
            raise Illegal(3)
        device.write(address, list(struct.unpack_from(f">{number}H", body, 5)))
    else:
        device.write(address, [number])
    return body[:4]


def _written_and_read(device: Device, body: bytes) -> bytes:
    """Write, then read: the order of function 23."""
    read_at, wanted, write_at, number, size = struct.unpack_from(">HHHHB", body)
    if not (1 <= wanted <= 125 and 1 <= number <= 121 and size == 2 * number == len(body) - 9):
        raise Illegal(3)
    device.write(write_at, list(struct.unpack_from(f">{number}H", body, 9)))
    return struct.pack(f">B{wanted}H", 2 * wanted, *device.read(3, read_at, wanted))
