"""Replies of a Modbus instrument in recorded frames, decoded as by the driver."""

import struct
from collections.abc import Mapping
from typing import Any

from drivers.channel import Frame, SampleBlock
from drivers.errors import DriverError
from drivers.modbus import ModbusDecoder, RingBufferLayout
from drivers.transport import load_register_map

_BLOCK_FUNCTIONS = (4, 23)
"""Function codes whose reply is a block: read only, and write its start and read."""


class ModbusReplyDecoder:
    """Decoder of the replies to requests for a block of the ring buffer; other replies are skipped."""

    def __init__(self, snapshot: Mapping[str, Any]) -> None:
        layout = RingBufferLayout(load_register_map(snapshot["instrument"]))
        self._decoder = ModbusDecoder(snapshot["instrument"], layout)
        self._decoder.restore(snapshot["state"])
        self._rtu = bool(snapshot["rtu"])
        self._block_requests = {
            struct.pack(">BHH", function, layout.address, layout.length) for function in _BLOCK_FUNCTIONS
        }
        self._length = 2 * layout.length
        self._request = b""

    def feed(self, frame: Frame) -> list[SampleBlock]:
        """Return the samples that are complete with a frame."""
        if frame.sent:
            self._request = frame.data
            return []
        words = self._extract_words(frame.data)
        if words is None:
            return []
        try:
            return self._decoder.decode_block(words, frame.received_ns).blocks
        except DriverError:  # the driver has refused it, too
            return []

    def _extract_words(self, received: bytes) -> tuple[int, ...] | None:
        """Return the words of a block if it was requested and is complete, whatever precedes it."""
        request, self._request = self._request, b""
        # Bytes before the function code, and of the checksum at the end.
        head, tail = (1, 2) if self._rtu else (7, 0)
        # On RTU a stale reply, or noise, may precede the reply that the driver took, which is always the last.
        size = head + 2 + self._length + tail
        reply = received[-size:]
        block_request = request[head : head + 5]
        header = bytes((block_request[0], self._length)) if block_request in self._block_requests else None
        # On TCP a reply may have ended early; the driver has refused it, too.
        if header is None or len(reply) < size or reply[head : head + 2] != header:
            return None
        is_valid = _is_valid_rtu(reply, request) if self._rtu else reply[:2] == request[:2]
        return struct.unpack_from(f">{self._length // 2}H", reply, head + 2) if is_valid else None


def _is_valid_rtu(reply: bytes, request: bytes) -> bool:
    return reply[0] == request[0] and _compute_crc(reply) == 0


def _compute_crc(frame: bytes) -> int:
    """Return the Modbus CRC-16 over a frame and its checksum: zero if they agree."""
    remainder = 0xFFFF
    for byte in frame:
        remainder ^= byte
        for _ in range(8):
            remainder = remainder >> 1 ^ (0xA001 if remainder & 1 else 0)
    return remainder
