"""Table of the samples of one run: columns by channel, with units and segments."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from pydantic import Field

from bench.log import Log, utc_at
from bench.validation import FrozenModel

Column: TypeAlias = npt.NDArray[np.float32]
Time: TypeAlias = npt.NDArray[np.float64]
Rows: TypeAlias = npt.NDArray[np.int64]


class Channel(FrozenModel):
    """Name and unit of a channel."""

    name: str = Field(description="name, as in `/bench/sample` of the log")
    unit: str = Field(description="SI unit; 1 for a number without unit")


class SegmentRange(FrozenModel):
    """One segment of a run, and the place of its samples."""

    index: int = Field(description="number of the segment, as in the channel `segment`")
    name: str
    stretch: str = Field(description="recording without interruption that the segment belongs to")
    motion: str = Field(description="kind of motion, such as sine")
    drive: str = Field(description="kind of drive programme, such as constant")
    amplitude_m: float | None = Field(description="[m]; null for a motion without amplitude")
    frequency_hz: float | None = Field(description="[Hz]; null for a motion without frequency")
    drive_value: float | None = Field(description="[V or A]; null if the drive varies")
    start_s: float = Field(description="time of the first sample since that of the run [s]")
    stop_s: float = Field(description="time of the last sample since the first one of the run [s]")
    first: int = Field(description="number of the first sample")
    samples: int = Field(description="number of samples")

    @property
    def rows(self) -> slice:
        """Samples of the segment."""
        return slice(self.first, self.first + self.samples)


@dataclass(frozen=True)
class SampleTable:
    """Samples of a run as columns; arrays (N,), a missing value is NaN and a missing segment is -1."""

    time: Time
    """Time since the first sample [s]."""
    columns: dict[str, Column]
    units: dict[str, str]
    """SI unit by channel, in the order of the columns."""
    segments: tuple[SegmentRange, ...]
    drive_unit: str
    started_utc_s: float | None
    """UTC of the first sample [s since 1970]; None if the log does not contain it."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels in the order of the columns."""
        return tuple(Channel(name=name, unit=unit) for name, unit in self.units.items())

    def find_rows(self, start_s: float | None, stop_s: float | None) -> slice:
        """Return the samples from one time to another, both included [s]."""
        first = 0 if start_s is None else int(np.searchsorted(self.time, start_s))
        last = len(self.time) if stop_s is None else int(np.searchsorted(self.time, stop_s, side="right"))
        return slice(first, max(first, last))


def make_table(log: Log) -> SampleTable:
    """Return the samples of a log as a table."""
    time = np.asarray(log.samples["time"], dtype=np.float64)
    names = [name for name in log.samples if name not in ("time", "time_ns")]
    run = log.metadata["run"]
    started = utc_at(run.get("utc_offset", ""), int(log.samples["time_ns"][0]))
    return SampleTable(
        time=time,
        columns={name: log.samples[name].astype(np.float32) for name in names},
        units={name: log.metadata["units"].get(name, "1") for name in names},
        segments=tuple(_make_range(log, number, time) for number in range(len(log.segments))),
        drive_unit=run["drive_unit"],
        started_utc_s=None if started is None else started.timestamp(),
    )


def _make_range(log: Log, number: int, time: Time) -> SegmentRange:
    one = log.segments[number]
    last = max(one.start, one.stop - 1)
    return SegmentRange(
        index=one.index,
        name=one.name,
        stretch=one.stretch,
        motion=one.motion,
        drive=one.drive,
        amplitude_m=one.amplitude,
        frequency_hz=one.frequency,
        drive_value=one.drive_value,
        start_s=float(time[min(one.start, len(time) - 1)]),
        stop_s=float(time[min(last, len(time) - 1)]),
        first=one.start,
        samples=max(0, one.stop - one.start),
    )
