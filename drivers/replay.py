"""The drivers' own decoders on recorded frames: no wire, no instrument, the same samples.

`describe` says where an instrument's decoder stands at a moment; a decoder made from that takes the frames that
came later, and gives the samples that the driver gave.
"""

import struct
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from drivers.actuator_samples import ActuatorSamples, Scale
from drivers.ascii_load_cell_stream import ReadingStream
from drivers.canopen_layout import Field, PdoLayout
from drivers.channel import Block, Frame
from drivers.errors import BadReply, DriverError
from drivers.load_cell_stream import SampleStream
from drivers.modbus_registers import load_map
from drivers.modbus_samples import Layout, RingDecoder
from drivers.servo_drive import COUNT


class Decoder(Protocol):
    """Frames in, samples out."""

    def feed(self, frame: Frame) -> list[Block]:
        """The samples that are complete with a frame."""


@runtime_checkable
class Described(Protocol):
    """An instrument whose frames can be replayed."""

    def describe(self) -> dict[str, Any]:
        """What its decoder needs beside the frames from now on; JSON."""


def describe(instrument: object) -> dict[str, Any] | None:
    """What an instrument's decoder needs beside the frames from now on; none where it has no way to say so."""
    return instrument.describe() if isinstance(instrument, Described) else None


def decoder(description: Mapping[str, Any]) -> Decoder:
    """A decoder that stands where the described one stood.

    Raises:
        BadReply: there is no such decoder, or the description is not whole.
    """
    try:
        made = _DECODERS[description["decoder"]](description)
        return _Later(made, int(description["state"]["at_ns"]))
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise BadReply(
            f"the decoder {description.get('decoder')!r} cannot be made: {error!r}; the log's document "
            "instruments.json is not whole, or of a later version"
        ) from error


class _Later:
    """Leaves out the frames that the described decoder had taken already."""

    def __init__(self, made: Decoder, at_ns: int) -> None:
        self._made, self._at_ns = made, at_ns

    def feed(self, frame: Frame) -> list[Block]:
        return self._made.feed(frame) if frame.received_ns > self._at_ns else []


class _Bytes:
    """A stream of bytes: what was received is all that counts."""

    def __init__(self, stream: SampleStream | ReadingStream, state: Mapping[str, Any]) -> None:
        self._stream = stream
        stream.resume(state)

    def feed(self, frame: Frame) -> list[Block]:
        return [] if frame.sent else self._stream.feed(frame.received_ns, frame.data)


class _Drive:
    """Process data, asked for by SYNC."""

    def __init__(self, description: Mapping[str, Any]) -> None:
        layouts = tuple(
            PdoLayout(**{**layout, "fields": tuple(Field(*field) for field in layout["fields"])})
            for layout in description["layouts"]
        )
        scale = Scale(COUNT, COUNT, description["rated_torque"] / 1000)
        self._samples = ActuatorSamples(
            layouts, description["node_id"], scale, description["origin"], description["cycle"]
        )
        self._samples.resume(description["state"])

    def feed(self, frame: Frame) -> list[Block]:
        self._samples.take(frame)
        return self._samples.blocks()


_BLOCK = (4, 23)
"""Functions whose answer is the block: reading alone, and saying where it begins at the same time."""


class _Ring:
    """Answers to the question for a block of the ring; all other questions are passed over."""

    def __init__(self, description: Mapping[str, Any]) -> None:
        map_ = load_map(description["instrument"])
        layout = Layout(map_)
        self._decoder = RingDecoder(description["instrument"], layout)
        self._decoder.resume(description["state"])
        self._rtu = bool(description["rtu"])
        self._asked = {struct.pack(">BHH", function, layout.address, layout.length) for function in _BLOCK}
        self._length = 2 * layout.length
        self._question = b""

    def feed(self, frame: Frame) -> list[Block]:
        if frame.sent:
            self._question = frame.data
            return []
        words = self._words(frame.data)
        if words is None:
            return []
        try:
            return self._decoder.take(words, frame.received_ns).blocks
        except DriverError:  # the driver has refused it, too
            return []

    def _words(self, heard: bytes) -> tuple[int, ...] | None:
        """The block's words, if it was asked for and came whole, whatever stood before it."""
        question, self._question = self._question, b""
        # Bytes before the function's code, and of the checksum behind.
        head, tail = (1, 2) if self._rtu else (7, 0)
        # On RTU an old answer, or noise, may stand before the one that the driver took: that is always the last.
        answer = heard[-(head + 2 + self._length + tail) :]
        asked = question[head : head + 5]
        if asked not in self._asked or answer[head : head + 2] != bytes((asked[0], self._length)):
            return None
        same = answer[0] == question[0] and _crc(answer) == 0 if self._rtu else answer[:2] == question[:2]
        return struct.unpack_from(f">{self._length // 2}H", answer, head + 2) if same else None


def _crc(frame: bytes) -> int:
    """CRC-16 of Modbus over a frame with its checksum: zero where they agree."""
    remainder = 0xFFFF
    for byte in frame:
        remainder ^= byte
        for _ in range(8):
            remainder = remainder >> 1 ^ (0xA001 if remainder & 1 else 0)
    return remainder


_DECODERS: dict[str, Any] = {
    "load_cell": lambda description: _Bytes(SampleStream(), description["state"]),
    "ascii_load_cell": lambda description: _Bytes(ReadingStream(), description["state"]),
    "modbus_ring": _Ring,
    "actuator": _Drive,
}
