"""The load cell's frames, as ``wire/load_cell.toml`` lays them out: bytes to packets and back."""

import binascii
import struct
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

CONTRACT: dict[str, Any] = tomllib.loads((Path(__file__).parent / "wire" / "load_cell.toml").read_text("utf-8"))
"""``wire/load_cell.toml``, which says what every field means."""

_SYNC = bytes(CONTRACT["framing"]["sync"])
_CHECKSUM_START = int(CONTRACT["checksum"]["start"])


class Sample(NamedTuple):
    """One conversion, as on the wire."""

    sequence: int
    time: int
    """Instrument's clock [us], wraps."""
    counts: int
    """Never tared."""
    tare: int
    """[counts] that the instrument's tare takes off."""
    status: int


class Request(NamedTuple):
    """What the host asks."""

    token: int
    command: int
    argument: int


class Acknowledgement(NamedTuple):
    """Answer to a request."""

    token: int
    command: int
    code: int
    value: int


class Identity(NamedTuple):
    """Answer to ``identify``."""

    token: int
    command: int
    protocol: int
    serial: int
    counts_per_newton: int


Packet = Sample | Request | Acknowledgement | Identity
Answer = Acknowledgement | Identity


class _Form(NamedTuple):
    """How one type of frame is laid out."""

    code: int
    body: struct.Struct
    make: type[Packet]
    size: int
    """[bytes] of the whole frame."""


def _form(name: str, make: type[Packet]) -> _Form:
    fields = CONTRACT["frames"][name]["fields"]
    letters = {"u8": "B", "u16": "H", "u32": "I", "i32": "i"}
    body = struct.Struct("<" + "".join(letters[field["format"]] for field in fields))
    return _Form(CONTRACT["frames"][name]["type"], body, make, body.size + CONTRACT["framing"]["overhead"])


_FORMS: dict[int, _Form] = {
    form.code: form
    for form in (
        _form("sample", Sample),
        _form("request", Request),
        _form("acknowledgement", Acknowledgement),
        _form("identity", Identity),
    )
}


_HEADER_INSIDE = _SYNC + bytes((_form("sample", Sample).body.size, _form("sample", Sample).code))


def _checksum(covered: bytes | bytearray) -> int:
    return binascii.crc_hqx(covered, _CHECKSUM_START)


def encode(packet: Packet) -> bytes:
    """The frame of one packet."""
    form = next(form for form in _FORMS.values() if isinstance(packet, form.make))
    covered = bytes((form.body.size, form.code)) + form.body.pack(*packet)
    return _SYNC + covered + struct.pack("<H", _checksum(covered))


class Decoder:
    """Bytes in, frames out, however the bytes are cut.

    A frame counts only with sync word, the length that belongs to its type, and checksum. Where one of them is
    wrong, the search goes on one byte further, so that a good frame behind, or inside, a broken one is found. A
    frame with the header of a sample inside is refused, too: it is a cut one and the start of the next, which the
    checksum would let pass once in 65536 times. What is left of that chance belongs to every checksum of 16 bits.
    """

    def __init__(self) -> None:
        self.corrupted = 0
        """Sync words that began no good frame."""
        self.resynchronised = 0
        """Good frames that had to be searched for."""
        self._buffer = bytearray()
        self._astray = False

    @property
    def rest(self) -> bytes:
        """Bytes that are no whole frame yet."""
        return bytes(self._buffer)

    @rest.setter
    def rest(self, rest: bytes) -> None:
        self._buffer = bytearray(rest)

    def feed(self, data: bytes) -> list[Packet]:
        """The frames that are complete with ``data``, in order."""
        self._buffer += data
        return list(self._complete())

    def _complete(self) -> Iterator[Packet]:
        # Sync word, length and type: before these have come, nothing can be told.
        while len(self._buffer) > 3:
            form = _FORMS.get(self._buffer[3])
            if not self._buffer.startswith(_SYNC):
                self._skip()
            elif form is None or self._buffer[2] != form.body.size:
                self._reject()
            elif len(self._buffer) < form.size:
                return
            elif (packet := self._taken(form)) is not None:
                yield packet

    def _taken(self, form: _Form) -> Packet | None:
        frame = self._buffer[: form.size]
        two_pieces = frame.find(_HEADER_INSIDE, 1) > 0
        if two_pieces or _checksum(frame[2:-2]) != int.from_bytes(frame[-2:], "little"):
            self._reject()
            return None
        del self._buffer[: form.size]
        self.resynchronised += self._astray
        self._astray = False
        return form.make(*form.body.unpack(frame[4:-2]))

    def _reject(self) -> None:
        self.corrupted += 1
        self._skip()

    def _skip(self) -> None:
        """Drop everything before the next byte that may begin a frame."""
        self._astray = True
        place = self._buffer.find(_SYNC, 1)
        if place < 0:
            # The last byte may be the first of a sync word whose second has not come yet.
            place = len(self._buffer) - self._buffer.endswith(_SYNC[:1])
        del self._buffer[:place]
