"""Execution of Modbus requests on a device, without frames and sockets.

Supported functions: 3, 4, 6, 8 (return query data), 16 and 23.
"""

import struct
from typing import Protocol

_ILLEGAL_VALUE = 3
"""Exception code for an illegal data value."""


class ModbusRequestError(Exception):
    """The request is refused: 2 no such register, 3 illegal value, 4 not in this state, 6 busy."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


class ModbusDevice(Protocol):
    """Registers of an instrument, without its wire."""

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Return words of holding (3) or input (4) registers.

        Raises:
            ModbusRequestError: they cannot be read.
        """

    def write(self, address: int, words: list[int]) -> None:
        """Set holding registers.

        Raises:
            ModbusRequestError: they cannot be set.
        """

    def advance(self) -> None:
        """Advance to the present instant."""


def handle_request(device: ModbusDevice, pdu: bytes) -> bytes:
    """Return a device's reply to a request, without frame."""
    function = pdu[0]
    try:
        return bytes([function]) + _execute(device, function, pdu[1:])
    except ModbusRequestError as refusal:
        return bytes([function | 0x80, refusal.code])
    except (struct.error, IndexError):  # the request is shorter than its function requires
        return bytes([function | 0x80, _ILLEGAL_VALUE])


def _execute(device: ModbusDevice, function: int, body: bytes) -> bytes:
    if function == 8 and body[:2] == b"\0\0":
        return body
    if function == 23:
        return _write_and_read(device, body)
    if function not in {3, 4, 6, 16}:
        raise ModbusRequestError(1)
    address, number = struct.unpack_from(">HH", body)
    if function in {3, 4}:
        if not 1 <= number <= 125:
            raise ModbusRequestError(3)
        return struct.pack(f">B{number}H", 2 * number, *device.read(function, address, number))
    if function == 16:
        if not (1 <= number <= 123 and body[4] == 2 * number == len(body) - 5):
            raise ModbusRequestError(3)
        device.write(address, list(struct.unpack_from(f">{number}H", body, 5)))
    else:
        device.write(address, [number])
    return body[:4]


def _write_and_read(device: ModbusDevice, body: bytes) -> bytes:
    """Write registers, then read others, in the order of function 23."""
    read_address, read_count, write_address, write_count, size = struct.unpack_from(">HHHHB", body)
    if not (1 <= read_count <= 125 and 1 <= write_count <= 121 and size == 2 * write_count == len(body) - 9):
        raise ModbusRequestError(3)
    device.write(write_address, list(struct.unpack_from(f">{write_count}H", body, 9)))
    return struct.pack(f">B{read_count}H", 2 * read_count, *device.read(3, read_address, read_count))
