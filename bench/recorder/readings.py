"""Readings and frames as messages of a log, and back: many in one message, as columns."""

from binascii import a2b_base64, b2a_base64
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import orjson

from bench.recorder.columns import SECOND
from drivers.channel import Block, Frame

Instants = npt.NDArray[np.int64]


class Clocks(Protocol):
    """Maps an instrument's clock onto the bench's; `bench.rig.clock_map.ClockMap` is one."""

    @property
    def known(self) -> bool:
        """Whether it can."""

    def bench_ns(self, device_ns: npt.ArrayLike) -> Instants:
        """The bench clock at instants of the device's [ns]."""


def frames_message(frames: Sequence[Frame]) -> tuple[int, bytes]:
    """Bench clock [ns] and JSON of a message `Frames`; at least one frame."""
    begin = frames[0].received_ns
    content = {
        "timestamp": _timestamp(begin),
        "at": [frame.received_ns - begin for frame in frames],
        "sent": [frame.sent for frame in frames],
        "data": [b2a_base64(frame.data, newline=False).decode() for frame in frames],
    }
    return begin, orjson.dumps(content)


def frames_of(message: dict[str, Any]) -> list[Frame]:
    """The frames of a message `Frames`."""
    begin = _nanoseconds(message)
    parts = zip(message["at"], message["sent"], message["data"], strict=True)
    return [Frame(begin + at, sent, a2b_base64(data)) for at, sent, data in parts]


def readings_messages(blocks: Sequence[Block], clock: Clocks | None) -> Iterator[tuple[int, bytes]]:
    """Bench clock [ns] and JSON of messages `Readings`: blocks that follow each other without a gap in one.

    Args:
        blocks: of one instrument, in the order they came.
        clock: of the instrument; its samples are stamped on receipt without.
    """
    for channel in dict.fromkeys(block.channel for block in blocks):
        own = [block for block in blocks if block.channel == channel]
        cuts = [0, *(place for place, (a, b) in enumerate(pairwise(own), 1) if not _joins(a, b)), len(own)]
        for start, stop in pairwise(cuts):
            yield _readings_message(own[start:stop], clock)


def _joins(one: Block, other: Block) -> bool:
    """Whether one block goes on where the other ends."""
    alike = one.quality == other.quality and (one.device_ns is None) == (other.device_ns is None)
    return alike and other.first == one.first + len(one.values)


def _readings_message(blocks: Sequence[Block], clock: Clocks | None) -> tuple[int, bytes]:
    values = np.concatenate([block.values for block in blocks])
    received = np.repeat([block.received_ns for block in blocks], [len(block.values) for block in blocks])
    stamps = [block.device_ns for block in blocks if block.device_ns is not None]
    device = np.concatenate(stamps) if stamps else np.empty(0, np.int64)
    mapped = clock.bench_ns(device) if clock is not None and clock.known and len(device) else received
    begin = max(int(mapped[0]), 0)
    known = np.isfinite(values)
    content = {
        "timestamp": _timestamp(begin),
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


def blocks_of(message: dict[str, Any]) -> list[Block]:
    """The blocks that a message `Readings` holds, one for each time that samples came."""
    begin, received = _nanoseconds(message), np.array(message["received"], dtype=np.int64)
    values, raw = np.array(message["values"], dtype=np.float64), np.array(message["raw"], dtype=np.float64)
    values[message["missing"]] = np.nan
    device = np.array(message["device"], dtype=np.int64) if message["device"] else None
    cuts = [0, *(np.flatnonzero(np.diff(received)) + 1).tolist(), len(received)]
    return [
        Block(
            channel=message["channel"],
            first=message["first"] + start,
            device_ns=None if device is None else device[start:stop],
            received_ns=begin + int(received[start]),
            values=values[start:stop],
            raw=raw[start:stop],
            quality=message["quality"],
        )
        for start, stop in pairwise(cuts)
    ]


def _timestamp(time_ns: int) -> dict[str, int]:
    seconds, rest = divmod(time_ns, SECOND)
    return {"sec": seconds, "nsec": rest}


def _nanoseconds(message: dict[str, Any]) -> int:
    return int(message["timestamp"]["sec"] * SECOND + message["timestamp"]["nsec"])
