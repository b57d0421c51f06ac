"""Live batch: consecutive samples of all channels, and its binary form (little endian).

The header has 16 bytes: schema (u32), sequence number (u32), UTC of the first sample (f64). The number of samples
(u32) and their period (f32) follow, then the channels one after the other (f32).
"""

import struct
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from bench.errors import LiveDataError

SCHEMA: Final = 1
"""Version of the binary form."""
MAX_SEQUENCE: Final = 2**32 - 1
"""Largest sequence number; the next one is zero."""
_HEADER: Final = struct.Struct("<IIdIf")

Values = npt.NDArray[np.float32]


class Channel(NamedTuple):
    """Name and unit of a channel."""

    name: str
    unit: str


@dataclass(frozen=True)
class LiveBatch:
    """Samples at equal distances; a missing value is NaN."""

    sequence: int
    """Running number of the batch; a gap means lost batches."""
    utc_s: float
    """UTC of the first sample [s since 1970]."""
    period_s: float
    """Distance of two samples [s]."""
    channels: tuple[Channel, ...]
    values: Values
    """Shape (channels, samples), in the units of the channels."""

    @property
    def count(self) -> int:
        """Number of samples."""
        return int(self.values.shape[1])

    @property
    def end_utc_s(self) -> float:
        """UTC of the newest sample [s since 1970]."""
        return self.utc_s + (self.count - 1) * self.period_s

    def encode(self) -> bytes:
        """Return the binary form."""
        header = _HEADER.pack(SCHEMA, self.sequence, self.utc_s, self.count, self.period_s)
        return header + np.ascontiguousarray(self.values, dtype="<f4").tobytes()


def decode_batch(data: bytes, channels: tuple[Channel, ...]) -> LiveBatch:
    """Return the batch of a binary form.

    Args:
        data: binary form.
        channels: channels in their order.

    Raises:
        LiveDataError: another version, or a length that does not fit the channels.
    """
    if len(data) < _HEADER.size:
        raise LiveDataError(f"a live batch of {len(data)} bytes, at least {_HEADER.size} needed; reconnect")
    schema, sequence, utc_s, count, period_s = _HEADER.unpack_from(data)
    if schema != SCHEMA:
        raise LiveDataError(f"a live batch of version {schema}, known is {SCHEMA}; use the version of the service")
    expected = _HEADER.size + 4 * count * len(channels)
    if len(data) != expected:
        raise LiveDataError(
            f"a live batch of {len(data)} bytes, expected {expected} for {len(channels)} channels; reconnect"
        )
    values = np.frombuffer(data, "<f4", offset=_HEADER.size).reshape(len(channels), count)
    return LiveBatch(sequence, utc_s, period_s, channels, values)
