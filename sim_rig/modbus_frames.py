"""Modbus frames from the instrument's side: bytes to requests, answers to bytes."""

import struct
from typing import NamedTuple, Protocol


class Request(NamedTuple):
    """One request, or its answer."""

    unit: int
    pdu: bytes
    """Function code and what follows it."""
    number: int = 0
    """Of the transaction, over TCP."""


class Framing(Protocol):
    """How requests stand on the wire."""

    def take(self, heard: bytes) -> tuple[Request | None, bytes]:
        """The first whole request, and the bytes after it."""

    def wrap(self, reply: Request) -> bytes:
        """An answer as bytes."""

    def corrupt(self, frame: bytes) -> bytes:
        """The frame with one bit turned, so that its receiver can tell."""


class _Mbap:
    """Modbus TCP: number, protocol (0), length, unit, then the request."""

    def take(self, heard: bytes) -> tuple[Request | None, bytes]:
        if len(heard) < 8:
            return None, heard
        number, protocol, length, unit = struct.unpack_from(">HHHB", heard)
        if protocol != 0 or not 2 <= length <= 254:  # out of step, and nothing in it can be trusted
            return None, b""
        if len(heard) < 6 + length:
            return None, heard
        return Request(unit, heard[7 : 6 + length], number), heard[6 + length :]

    def wrap(self, reply: Request) -> bytes:
        return struct.pack(">HHHB", reply.number, 0, len(reply.pdu) + 1, reply.unit) + reply.pdu

    def corrupt(self, frame: bytes) -> bytes:
        # In the protocol's number: there is no checksum that would tell it anywhere else.
        return frame[:3] + bytes([frame[3] ^ 1]) + frame[4:]


class _Rtu:
    """Modbus RTU: unit, request, CRC-16. The length follows from the function."""

    def take(self, heard: bytes) -> tuple[Request | None, bytes]:
        if len(heard) < 8:
            return None, heard
        length = _length(heard)
        if len(heard) < length:
            return None, heard
        frame, rest = heard[:length], heard[length:]
        if crc(frame[:-2]) != frame[-2:]:
            return None, b""  # noise: whatever else has come is unreliable, the host will ask again
        return Request(frame[0], frame[1:-2]), rest

    def wrap(self, reply: Request) -> bytes:
        frame = bytes([reply.unit]) + reply.pdu
        return frame + crc(frame)

    def corrupt(self, frame: bytes) -> bytes:
        return frame[:-1] + bytes([frame[-1] ^ 1])


def _length(heard: bytes) -> int:
    """[bytes] of a request of which eight or more have come; 11 where that is told by what has not come yet."""
    if heard[1] == 16:
        return 9 + heard[6]
    if heard[1] == 23:
        return 13 + heard[10] if len(heard) > 10 else 11
    return 8


def crc(data: bytes) -> bytes:
    """CRC-16 of Modbus (polynomial A001 mirrored, start FFFF), low byte first."""
    register = 0xFFFF
    for octet in data:
        register ^= octet
        for _ in range(8):
            register = (register >> 1) ^ (0xA001 if register & 1 else 0)
    return register.to_bytes(2, "little")


MBAP: Framing = _Mbap()
RTU: Framing = _Rtu()
