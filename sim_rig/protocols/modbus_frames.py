"""Modbus frames on the instrument's side: bytes to requests, replies to bytes."""

import struct
from typing import NamedTuple, Protocol


class ModbusRequest(NamedTuple):
    """One request, or its reply."""

    unit: int
    pdu: bytes
    """Function code and data."""
    transaction: int = 0
    """Transaction number (Modbus TCP)."""


class Framing(Protocol):
    """Framing of requests and replies on a wire."""

    def extract(self, received: bytes) -> tuple[ModbusRequest | None, bytes]:
        """Return the first complete request, and the bytes after it."""

    def encode(self, reply: ModbusRequest) -> bytes:
        """Return a reply as bytes."""

    def corrupt(self, frame: bytes) -> bytes:
        """Return the frame with one flipped bit that its receiver can detect."""


class _Mbap:
    """Modbus TCP: transaction number, protocol (0), length, unit, request."""

    def extract(self, received: bytes) -> tuple[ModbusRequest | None, bytes]:
        if len(received) < 8:
            return None, received
        number, protocol, length, unit = struct.unpack_from(">HHHB", received)
        if protocol != 0 or not 2 <= length <= 254:  # out of step: all received bytes are discarded
            return None, b""
        if len(received) < 6 + length:
            return None, received
        return ModbusRequest(unit, received[7 : 6 + length], number), received[6 + length :]

    def encode(self, reply: ModbusRequest) -> bytes:
        return struct.pack(">HHHB", reply.transaction, 0, len(reply.pdu) + 1, reply.unit) + reply.pdu

    def corrupt(self, frame: bytes) -> bytes:
        # In the protocol number, as without a checksum no other flipped bit can be detected.
        return frame[:3] + bytes([frame[3] ^ 1]) + frame[4:]


class _Rtu:
    """Modbus RTU: unit, request, CRC-16. The length follows from the function code."""

    def extract(self, received: bytes) -> tuple[ModbusRequest | None, bytes]:
        if len(received) < 8:
            return None, received
        length = _compute_length(received)
        if len(received) < length:
            return None, received
        frame, remaining = received[:length], received[length:]
        if compute_crc(frame[:-2]) != frame[-2:]:
            return None, b""  # noise: all received bytes are discarded, the host will repeat its request
        return ModbusRequest(frame[0], frame[1:-2]), remaining

    def encode(self, reply: ModbusRequest) -> bytes:
        frame = bytes([reply.unit]) + reply.pdu
        return frame + compute_crc(frame)

    def corrupt(self, frame: bytes) -> bytes:
        return frame[:-1] + bytes([frame[-1] ^ 1])


def _compute_length(received: bytes) -> int:
    """Return the length [bytes] of a request from its first bytes, eight or more; 11 if still unknown."""
    if received[1] == 16:
        return 9 + received[6]
    if received[1] == 23:
        return 13 + received[10] if len(received) > 10 else 11
    return 8


def compute_crc(data: bytes) -> bytes:
    """Return the CRC-16 of Modbus (reflected polynomial A001h, start FFFFh), low byte first."""
    register = 0xFFFF
    for octet in data:
        register ^= octet
        for _ in range(8):
            register = (register >> 1) ^ (0xA001 if register & 1 else 0)
    return register.to_bytes(2, "little")


MBAP: Framing = _Mbap()
RTU: Framing = _Rtu()
