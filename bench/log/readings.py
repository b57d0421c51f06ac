"""Conversion of readings and frames to log messages and back; one message holds many of them as columns."""

from binascii import a2b_base64, b2a_base64
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import orjson

from bench.log.messages import make_timestamp, parse_timestamp
from drivers import Frame, SampleBlock

Instants = npt.NDArray[np.int64]

DECODERS_FILE = "decoders.json"
"""Attachment with the decoder snapshots by instrument, which are needed to decode the frames again."""


class ClockMapProtocol(Protocol):
    """Mapping from a device clock to the bench clock, such as `bench.rig.clock_map.ClockMap`."""

    @property
    def is_known(self) -> bool:
        """True if enough clock readings were taken for a mapping."""

    def map_instants(self, device_ns: npt.ArrayLike) -> Instants:
        """Return the bench clock [ns] at instants of the device clock [ns]."""


def make_frames_message(frames: Sequence[Frame]) -> tuple[int, bytes]:
    """Return bench clock [ns] and JSON of a message `Frames` with one or more frames."""
    begin = frames[0].received_ns
    content = {
        "timestamp": make_timestamp(begin),
        "at": [frame.received_ns - begin for frame in frames],
        "sent": [frame.sent for frame in frames],
        "data": [b2a_base64(frame.data, newline=False).decode() for frame in frames],
    }
    return begin, orjson.dumps(content)


def parse_frames(message: dict[str, Any]) -> list[Frame]:
    """Return the frames of a message `Frames`."""
    begin = parse_timestamp(message)
    rows = zip(message["at"], message["sent"], message["data"], strict=True)
    return [Frame(begin + at, sent, a2b_base64(data)) for at, sent, data in rows]


def make_readings_messages(
    blocks: Sequence[SampleBlock], clock: ClockMapProtocol | None
) -> Iterator[tuple[int, bytes]]:
    """Yield bench clock [ns] and JSON of messages `Readings`; contiguous blocks form one message.

    Args:
        blocks: blocks of one instrument, in the order of receipt.
        clock: clock map of the instrument; without one, the time of receipt counts.
    """
    for channel in dict.fromkeys(block.channel for block in blocks):
        sequence = [block for block in blocks if block.channel == channel]
        gaps = [i for i, (a, b) in enumerate(pairwise(sequence), 1) if not _is_contiguous(a, b)]
        for start, stop in pairwise([0, *gaps, len(sequence)]):
            yield _make_readings_message(sequence[start:stop], clock)


def _is_contiguous(first: SampleBlock, second: SampleBlock) -> bool:
    """Return whether the second block continues the first one."""
    alike = first.quality == second.quality and (first.device_ns is None) == (second.device_ns is None)
    return alike and second.first == first.first + len(first.values)


def _make_readings_message(blocks: Sequence[SampleBlock], clock: ClockMapProtocol | None) -> tuple[int, bytes]:
    values = np.concatenate([block.values for block in blocks])
    received, device, mapped = _collect_times(blocks, clock)
    begin = max(int(mapped[0]), 0)
    known = np.isfinite(values)
    content = {
        "timestamp": make_timestamp(begin),
        "channel": blocks[0].channel,
        "first": blocks[0].first,
        "quality": blocks[0].quality,
        "received": received - begin,
        "bench": mapped - begin,
        "device": device,
        "raw": np.concatenate([block.raw for block in blocks]),
        "values": np.where(known, values, 0.0),
        "missing": np.flatnonzero(~known),
    }
    return begin, orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)


def _collect_times(
    blocks: Sequence[SampleBlock], clock: ClockMapProtocol | None
) -> tuple[Instants, Instants, Instants]:
    """Return times of receipt, device times (empty if there are none) and bench times of all samples [ns]."""
    received = np.repeat([block.received_ns for block in blocks], [len(block.values) for block in blocks])
    device_times = [block.device_ns for block in blocks if block.device_ns is not None]
    device = np.concatenate(device_times) if device_times else np.empty(0, np.int64)
    # Without a known clock map, the time of receipt is the best estimate on the bench clock.
    mapped = clock.map_instants(device) if clock is not None and clock.is_known and len(device) else received
    return received, device, mapped


def parse_blocks(message: dict[str, Any]) -> list[SampleBlock]:
    """Return the blocks of a message `Readings`, one for each receipt of samples."""
    begin, received = parse_timestamp(message), np.array(message["received"], dtype=np.int64)
    values, raw = np.array(message["values"], dtype=np.float64), np.array(message["raw"], dtype=np.float64)
    values[message["missing"]] = np.nan
    device = np.array(message["device"], dtype=np.int64) if message["device"] else None
    edges = [0, *(np.flatnonzero(np.diff(received)) + 1).tolist(), len(received)]
    return [
        SampleBlock(
            channel=message["channel"],
            first=message["first"] + start,
            device_ns=None if device is None else device[start:stop],
            received_ns=begin + int(received[start]),
            values=values[start:stop],
            raw=raw[start:stop],
            quality=message["quality"],
        )
        for start, stop in pairwise(edges)
    ]
