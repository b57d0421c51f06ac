"""Samples as binary batches, little endian, in the format of the live stream.

A batch begins with `u32` schema 1, `u32` sequence number, `f64` UTC stamp of its first sample [s], `u32` number of
samples and `f32` period [s]. The channels follow one after the other as `f32`. The first channel of a recorded run
is the time since the first sample of the batch, because recorded samples may have gaps.
"""

import struct
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.samples.table import Column, Time

BATCH_SIZE = 8192
"""Largest number of samples in a batch. The time in it then stays exact to a microsecond as `f32`, at 1 kHz."""
_SCHEMA = 1
_HEAD = struct.Struct("<IIdIf")


def encode_batches(time: Time, columns: Sequence[Column], started_utc_s: float) -> Iterator[bytes]:
    """Yield the batches of some samples.

    Args:
        time: time since the start [s], shape (N,).
        columns: channels, each of shape (N,).
        started_utc_s: UTC of the start [s since 1970]; 0 if it is not known.
    """
    for number, first in enumerate(range(0, len(time), BATCH_SIZE)):
        part = slice(first, first + BATCH_SIZE)
        offset = time[part] - time[first]
        period = float(offset[-1] / (len(offset) - 1)) if len(offset) > 1 else 0.0
        head = _HEAD.pack(_SCHEMA, number, started_utc_s + float(time[first]), len(offset), period)
        yield head + b"".join(column.astype("<f4").tobytes() for column in [offset, *(c[part] for c in columns)])


def decode_batches(content: bytes, channels: int) -> tuple[Time, list[Column]]:
    """Return time [s since 1970, or since the start if that is not known] and channels of all batches.

    Args:
        content: batches one after the other.
        channels: number of channels, the time included.

    Raises:
        ValueError: the content is not a sequence of complete batches.
    """
    parts = list(_iterate_batches(content, channels))
    if not parts:
        return np.empty(0), [np.empty(0, np.float32) for _ in range(channels - 1)]
    time = np.concatenate([stamp + values[0].astype(np.float64) for stamp, values in parts])
    return time, [_join(values[number] for _, values in parts) for number in range(1, channels)]


def _join(parts: Iterable[Column]) -> Column:
    return np.concatenate(list(parts))


def _iterate_batches(content: bytes, channels: int) -> Iterator[tuple[float, Column]]:
    position = 0
    while position < len(content):
        if len(content) - position < _HEAD.size:
            raise ValueError("the last batch is incomplete")
        schema, _, stamp, count, _ = _HEAD.unpack_from(content, position)
        position += _HEAD.size
        if schema != _SCHEMA or position + 4 * count * channels > len(content):
            raise ValueError(f"a batch of schema {schema} with {count} samples is unknown or incomplete")
        values = np.frombuffer(content, "<f4", count * channels, position).reshape(channels, count)
        position += 4 * count * channels
        yield stamp, values.astype(np.float32)
