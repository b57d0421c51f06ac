"""Typed channels: what an instrument measures or takes, with unit, range and access."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.errors import OutOfRange

Access = Literal["read", "write", "read_write"]
Quality = Literal["good", "uncertain", "bad"]
"""good: checked on the wire and in range; uncertain: no checksum or clock vouches for it; bad: do not use."""

Numbers = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Channel:
    """One quantity of an instrument."""

    name: str
    """Name in logs and documents, such as ``force``."""
    unit: str
    """SI unit of every value that passes through this channel; the wire's own unit stays in the driver."""
    low: float
    """Least value that is meaningful, in ``unit``."""
    high: float
    """Largest value that is meaningful, in ``unit``."""
    access: Access
    meaning: str
    """One line for a person."""

    def checked(self, value: float) -> float:
        """The value, if it may be written.

        Raises:
            OutOfRange: it lies outside the channel's range, or is no number.
        """
        if not self.low <= value <= self.high:
            raise OutOfRange(
                f"{self.name}: {value:.6g} {self.unit} lies outside {self.low:.6g} to {self.high:.6g} "
                f"{self.unit}; nothing was sent"
            )
        return value


class Reading(NamedTuple):
    """One value that was asked for."""

    value: float
    """In the channel's unit."""
    received_ns: int
    """Bench clock when the answer was complete [ns]."""
    device_ns: int | None
    """The instrument's own clock at the conversion [ns]; none where it has none."""
    raw: float
    """What stood on the wire, in the wire's own unit."""
    quality: Quality


class Block(NamedTuple):
    """Samples of one channel that came together; arrays (samples,)."""

    channel: str
    first: int
    """Running number of the first sample since the stream began; a gap to the block before counts lost ones."""
    device_ns: Times | None
    """The instrument's own clock at each conversion [ns]; none where it has none."""
    received_ns: int
    """Bench clock when the last byte came [ns]."""
    values: Numbers
    """In the channel's unit."""
    raw: Numbers
    """What stood on the wire."""
    quality: Quality


class Stamp(NamedTuple):
    """The instrument's clock beside the bench's: it was read between the two."""

    device_ns: int
    """The instrument's clock, unwrapped [ns]."""
    sent_ns: int
    """Bench clock when the question went out [ns]."""
    received_ns: int
    """Bench clock when the answer was complete [ns]."""


class Frame(NamedTuple):
    """What passed on the wire, for the log and for replay."""

    received_ns: int
    """Bench clock [ns]."""
    sent: bool
    """True for what the driver sent."""
    data: bytes
