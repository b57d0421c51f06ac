"""Typed channels, and the readings, sample blocks and frames that instruments exchange with the bench."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.errors import OutOfRangeError

Access = Literal["read", "write", "read_write"]
Quality = Literal["good", "uncertain", "bad"]
"""good: checked on the wire and in range; uncertain: without checksum or clock, doubted, or shifted by a shunt;
bad: unusable."""

Array = npt.NDArray[np.float64]
TimeArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Channel:
    """One quantity that an instrument measures or sets."""

    name: str
    """Name in logs and documents, such as ``force``."""
    unit: str
    """SI unit of every value of this channel. The unit on the wire stays inside the driver."""
    low: float
    """Smallest meaningful value, in ``unit``."""
    high: float
    """Largest meaningful value, in ``unit``."""
    access: Access
    meaning: str
    """Description in one line."""

    def validate(self, value: float) -> float:
        """Return the value if it may be written.

        Raises:
            OutOfRangeError: the value is outside the channel's range, or NaN.
        """
        if not self.low <= value <= self.high:
            raise OutOfRangeError(
                f"{self.name}: {value:.6g} {self.unit} is outside {self.low:.6g} to {self.high:.6g} "
                f"{self.unit}; nothing was sent"
            )
        return value


class Reading(NamedTuple):
    """One value that was requested."""

    value: float
    """Value in the channel's unit."""
    received_ns: int
    """Bench clock when the reply was complete [ns]."""
    device_ns: int | None
    """Device clock at the conversion [ns]; None if the instrument has no clock."""
    raw: float
    """Number on the wire, in the unit of the wire."""
    quality: Quality


class SampleBlock(NamedTuple):
    """Consecutive samples of one channel that arrived together; arrays (samples,)."""

    channel: str
    first: int
    """Running number of the first sample since the stream began; a gap between blocks counts lost samples."""
    device_ns: TimeArray | None
    """Device clock at each conversion [ns]; None if the instrument has no clock."""
    received_ns: int
    """Bench clock when the last byte arrived [ns]."""
    values: Array
    """Values in the channel's unit."""
    raw: Array
    """Numbers on the wire."""
    quality: Quality


class ClockReading(NamedTuple):
    """Device clock, read between two instants of the bench clock."""

    device_ns: int
    """Device clock without its wraps [ns]."""
    sent_ns: int
    """Bench clock when the request was sent [ns]."""
    received_ns: int
    """Bench clock when the reply was complete [ns]."""


class Frame(NamedTuple):
    """Bytes that passed on the wire, for the log and for replay."""

    received_ns: int
    """Bench clock [ns]."""
    sent: bool
    """True if the driver sent the frame; otherwise it received it."""
    data: bytes
