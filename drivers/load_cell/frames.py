"""Frames of the load cell, as laid out in ``wire/load_cell.toml``: packets to bytes and back."""

import binascii
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from drivers.wire_files import load_wire_file

CONTRACT: dict[str, Any] = load_wire_file("load_cell")
"""``wire/load_cell.toml``: fields, commands, codes and deadlines."""

_SYNC = bytes(CONTRACT["framing"]["sync"])
_CHECKSUM_START = int(CONTRACT["checksum"]["start"])


class Sample(NamedTuple):
    """One conversion, as on the wire."""

    sequence: int
    time: int
    """Device clock [us]; wraps."""
    counts: int
    """Converter value without tare."""
    tare: int
    """[counts] that the instrument's tare subtracts."""
    status: int


class Request(NamedTuple):
    """Request of the host."""

    token: int
    command: int
    argument: int


class Acknowledgement(NamedTuple):
    """Reply to a request."""

    token: int
    command: int
    code: int
    value: int


class Identity(NamedTuple):
    """Reply to ``identify``."""

    token: int
    command: int
    protocol: int
    serial: int
    counts_per_newton: int


Packet = Sample | Request | Acknowledgement | Identity
Reply = Acknowledgement | Identity


class _FrameFormat(NamedTuple):
    """Layout of one type of frame."""

    code: int
    body: struct.Struct
    packet_type: type[Packet]
    size: int
    """[bytes] of the complete frame."""


def _make_format(name: str, packet_type: type[Packet]) -> _FrameFormat:
    frame = CONTRACT["frames"][name]
    letters = {"u8": "B", "u16": "H", "u32": "I", "i32": "i"}
    body = struct.Struct("<" + "".join(letters[field["format"]] for field in frame["fields"]))
    return _FrameFormat(frame["type"], body, packet_type, body.size + CONTRACT["framing"]["overhead"])


_SAMPLE_FORMAT = _make_format("sample", Sample)
_FORMATS: dict[int, _FrameFormat] = {
    format_.code: format_
    for format_ in (
        _SAMPLE_FORMAT,
        _make_format("request", Request),
        _make_format("acknowledgement", Acknowledgement),
        _make_format("identity", Identity),
    )
}
_SAMPLE_HEADER = _SYNC + bytes((_SAMPLE_FORMAT.body.size, _SAMPLE_FORMAT.code))


def _compute_checksum(covered: bytes | bytearray) -> int:
    return binascii.crc_hqx(covered, _CHECKSUM_START)


def encode_frame(packet: Packet) -> bytes:
    """Return the frame of a packet."""
    format_ = next(format_ for format_ in _FORMATS.values() if isinstance(packet, format_.packet_type))
    covered = bytes((format_.body.size, format_.code)) + format_.body.pack(*packet)
    return _SYNC + covered + struct.pack("<H", _compute_checksum(covered))


class FrameDecoder:
    """Decoder of a byte stream into frames, independent of how the stream is split.

    A frame counts only with sync word, the length of its type, and checksum. If one of them is wrong, the search
    continues one byte further, so that a good frame after or inside a broken one is found. A frame that contains
    the header of a sample is refused, too: it is a truncated frame joined to the next, which the checksum would
    accept once in 65536 times. Other coincidences of that probability remain, as with every 16-bit checksum.
    """

    def __init__(self) -> None:
        self.corrupted = 0
        """Sync words without a good frame."""
        self.resynchronised = 0
        """Good frames that had to be searched for."""
        self._buffer = bytearray()
        self._out_of_sync = False

    @property
    def pending_bytes(self) -> bytes:
        """Received bytes that are not a complete frame yet."""
        return bytes(self._buffer)

    @pending_bytes.setter
    def pending_bytes(self, pending_bytes: bytes) -> None:
        self._buffer = bytearray(pending_bytes)

    def feed(self, data: bytes) -> list[Packet]:
        """Return the packets whose frames are complete with ``data``, in order."""
        self._buffer += data
        return list(self._extract_packets())

    def _extract_packets(self) -> Iterator[Packet]:
        # A decision needs sync word, length and type.
        while len(self._buffer) > 3:
            format_ = _FORMATS.get(self._buffer[3])
            if not self._buffer.startswith(_SYNC):
                self._skip()
            elif format_ is None or self._buffer[2] != format_.body.size:
                self._reject()
            elif len(self._buffer) < format_.size:
                return
            elif (packet := self._extract_packet(format_)) is not None:
                yield packet

    def _extract_packet(self, format_: _FrameFormat) -> Packet | None:
        frame = self._buffer[: format_.size]
        is_joined = frame.find(_SAMPLE_HEADER, 1) > 0
        if is_joined or _compute_checksum(frame[2:-2]) != int.from_bytes(frame[-2:], "little"):
            self._reject()
            return None
        del self._buffer[: format_.size]
        self.resynchronised += self._out_of_sync
        self._out_of_sync = False
        return format_.packet_type(*format_.body.unpack(frame[4:-2]))

    def _reject(self) -> None:
        self.corrupted += 1
        self._skip()

    def _skip(self) -> None:
        """Drop all bytes before the next one that may begin a frame."""
        self._out_of_sync = True
        start = self._buffer.find(_SYNC, 1)
        if start < 0:
            # The last byte may be the first half of a sync word.
            start = len(self._buffer) - self._buffer.endswith(_SYNC[:1])
        del self._buffer[:start]
