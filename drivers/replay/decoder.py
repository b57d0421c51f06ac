"""Decoding of recorded frames, without a wire or an instrument, to the samples of the live run.

`snapshot_decoder` stores the state of an instrument's decoder at one instant. A decoder made from it decodes the
frames after that instant to the same samples as the driver.
"""

from collections.abc import Mapping
from typing import Any, Protocol

from drivers.actuator import METRES_PER_COUNT, ActuatorDecoder, CountScale
from drivers.channel import Frame, SampleBlock
from drivers.errors import InvalidReplyError
from drivers.load_cell import AsciiLoadCellDecoder, LoadCellDecoder, StreamDecoder
from drivers.replay.modbus_replies import ModbusReplyDecoder
from drivers.transport import PdoField, PdoMapping


class Decoder(Protocol):
    """Decoder of frames into samples."""

    def feed(self, frame: Frame) -> list[SampleBlock]:
        """Return the samples that are complete with a frame."""


def make_decoder(snapshot: Mapping[str, Any]) -> Decoder:
    """Make a decoder that continues from a snapshot.

    Raises:
        InvalidReplyError: there is no such decoder, or the snapshot is incomplete.
    """
    try:
        decoder = _DECODERS[snapshot["decoder"]](snapshot)
        return _ResumedDecoder(decoder, int(snapshot["state"]["at_ns"]))
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise InvalidReplyError(
            f"the decoder {snapshot.get('decoder')!r} cannot be made: {error!r}; the log's document "
            "instruments.json is incomplete, or of a later version"
        ) from error


class _ResumedDecoder:
    """Decoder that skips the frames that were decoded before the snapshot."""

    def __init__(self, decoder: Decoder, at_ns: int) -> None:
        self._decoder, self._at_ns = decoder, at_ns

    def feed(self, frame: Frame) -> list[SampleBlock]:
        return self._decoder.feed(frame) if frame.received_ns > self._at_ns else []


class _SerialDecoder:
    """Decoder of the received bytes of a serial line."""

    def __init__(self, decoder: StreamDecoder, state: Mapping[str, Any]) -> None:
        self._decoder = decoder
        decoder.restore(state)

    def feed(self, frame: Frame) -> list[SampleBlock]:
        return [] if frame.sent else self._decoder.feed(frame.received_ns, frame.data)


class _DriveDecoder:
    """Decoder of process data that SYNC requests."""

    def __init__(self, snapshot: Mapping[str, Any]) -> None:
        mappings = tuple(
            PdoMapping(**{**layout, "fields": tuple(PdoField(*field) for field in layout["fields"])})
            for layout in snapshot["layouts"]
        )
        scale = CountScale(METRES_PER_COUNT, METRES_PER_COUNT, snapshot["rated_torque"] / 1000)
        self._decoder = ActuatorDecoder(
            mappings, snapshot["node_id"], scale, snapshot["origin"], snapshot["cycle"]
        )
        self._decoder.restore(snapshot["state"])

    def feed(self, frame: Frame) -> list[SampleBlock]:
        self._decoder.add_frame(frame)
        return self._decoder.pop_blocks()


_DECODERS: dict[str, Any] = {
    "load_cell": lambda snapshot: _SerialDecoder(LoadCellDecoder(), snapshot["state"]),
    "ascii_load_cell": lambda snapshot: _SerialDecoder(AsciiLoadCellDecoder(), snapshot["state"]),
    "modbus_ring": ModbusReplyDecoder,
    "actuator": _DriveDecoder,
}
