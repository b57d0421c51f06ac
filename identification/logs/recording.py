"""Recording: the channels of a log in SI units, on a uniform time base, divided into stretches.

A stretch is one continuous part at one rate, which is simulated as a whole. It ends where the time step jumps or
where another recording begins in the log. It contains the filters and delays that the devices report, and marks
the samples that were measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from identification.arrays import Array, BoolArray
from identification.errors import UnreadableLogError
from identification.logs.channel_info import (
    CHANNEL_UNITS,
    ChannelFilter,
    ChannelInfo,
    check_not_empty,
    read_channel_info,
    read_drive_unit,
)
from identification.logs.log_cache import RawLog
from identification.logs.log_reader import read_cached

_MAX_FILLED = 5
"""Largest number of successive lost samples that are interpolated; more divide the recording."""
_GAP_RATIO = 1.5
"""Threshold on a time step over the usual one: above it, samples are lost."""
_MAX_JITTER = 0.01
"""Threshold on jitter over the usual time step: above it, the recording is resampled."""
_MIN_PAUSE = 0.5
"""Shortest pause [s] between two imported recordings."""
_MIN_SAMPLES = 50
"""Smallest number of samples of a stretch; with fewer, it is dropped."""
_SHUNT_MARGIN = 0.5
"""Time [s] around a segment with the shunt of the load cell in which the force may contain its part."""
PERIODIC_MOTIONS = ("sine", "triangle")
"""Kinds of motion that repeat."""


@dataclass(frozen=True)
class Segment:
    """Part of a method's segment within one stretch."""

    index: int
    """Number in the log."""
    name: str
    start: int
    """First sample in the stretch."""
    stop: int
    """One past the last sample."""
    motion: str
    """Kind of motion: hold, ramp, sine, triangle, sweep, multisine, random or table."""
    amplitude: float | None
    """Amplitude [m]."""
    frequency: float | None
    """Frequency [Hz]."""
    drive_value: float | None
    """Drive if it is constant [V or A]; None if it changes."""


@dataclass(frozen=True)
class Stretch:
    """One continuous part of a recording at one rate; all arrays (N,)."""

    name: str
    time: Array
    """Uniform time on the log's clock [s]."""
    rate: float
    """Sampling rate [Hz]."""
    displacement: Array
    """Displacement [m]."""
    force: Array
    """Recorded force [N]."""
    drive: Array
    """Measured coil drive [V or A]."""
    velocity: Array | None
    """Measured velocity [m/s]; None if it was derived from the displacement."""
    segments: tuple[Segment, ...]
    force_filter: ChannelFilter | None
    displacement_filter: ChannelFilter | None
    force_delay: float
    """Delay of the recorded force, as the device reports it [s]."""
    displacement_delay: float
    """Delay of the recorded displacement, as the device reports it [s]."""
    drive_delay: float
    """Delay of the recorded drive, as the device reports it [s]."""
    measured: BoolArray
    """False where a lost sample was interpolated."""
    force_valid: BoolArray | None = None
    """False where only the force is invalid; None if all of it is valid."""
    interpolated: bool = False
    """True if the displacement was resampled from other instants, which removes its fastest noise."""

    @property
    def valid_mask(self) -> BoolArray:
        """(N,) True where the sample may be fitted and scored."""
        return self.measured if self.force_valid is None else self.measured & self.force_valid


@dataclass(frozen=True)
class Recording:
    """Content of a log."""

    path: Path
    sha256: str
    """SHA-256 of the log's content."""
    drive_kind: str
    """driver_command_v, coil_v or coil_a."""
    drive_unit: str
    """V or A."""
    stretches: tuple[Stretch, ...]
    metadata: Mapping[str, Mapping[str, str]]
    """Metadata records of the log by name."""


def load(path: Path) -> Recording:
    """Read an MCAP log with the profile mrbench; from the second reading on, its channels come from a cache.

    Raises:
        UnreadableLogError: the file is missing, no mrbench log, truncated, or lacks units, channels or samples.
    """
    raw, sha256 = read_cached(Path(path))
    raw.metadata.setdefault("run", {})
    drive_unit = read_drive_unit(path, raw)
    info = read_channel_info(path, raw)
    names, indices = _find_recordings(raw)
    stretches = [
        s for k, name in enumerate(names) for s in _split_stretches(raw, info, name, np.flatnonzero(indices == k))
    ]
    if not stretches:
        check_not_empty(path, raw)
        raise UnreadableLogError(f"{path}: no {_MIN_SAMPLES} consecutive samples; record longer")
    kind = raw.metadata["run"].get("drive_kind") or f"coil_{drive_unit.lower()}"
    return Recording(Path(path), sha256, kind, drive_unit, tuple(stretches), raw.metadata)


def _find_recordings(raw: RawLog) -> tuple[list[str], npt.NDArray[np.int64]]:
    """Return the names of the recordings in the log, and the index (N,) of the recording of each sample.

    A recording extends from the start of its first segment to that of the next recording. An imported recording
    may start before its first segment, after the pause that separates it from the previous one.
    """
    time = raw.samples["time"]
    names: list[str] = []
    starts: list[int] = []
    for segment in raw.segments:
        if segment["phase"] == "start" and (not names or segment["stretch"] != names[-1]):
            names.append(str(segment["stretch"]))
            starts.append(_skip_pause(time, int(np.searchsorted(time, segment["time"] - 1e-6))))
    if not names:
        return [raw.metadata["run"].get("method") or "recording"], np.zeros(len(time), np.int64)
    indices = np.zeros(len(time), np.int64)
    for k, start in enumerate(starts[1:], 1):
        indices[start:] = k
    return names, indices


def _skip_pause(time: Array, index: int) -> int:
    """Return the first sample after the last pause of half a second or more before this one, or this one."""
    pauses = np.flatnonzero(np.diff(time[: index + 1]) > _MIN_PAUSE)
    return int(pauses[-1]) + 1 if len(pauses) else index


def _split_stretches(raw: RawLog, info: ChannelInfo, name: str, rows: npt.NDArray[np.int64]) -> list[Stretch]:
    """Return the stretches of one recording: complete samples without a longer break."""
    complete = np.all([np.isfinite(raw.samples[channel][rows]) for channel in CHANNEL_UNITS], axis=0)
    rows = rows[complete]
    if len(rows) < _MIN_SAMPLES:
        return []
    steps = np.diff(raw.samples["time"][rows])
    # The median, because a break must not lengthen the usual step.
    breaks = np.flatnonzero(steps > (_MAX_FILLED + _GAP_RATIO) * np.median(steps)) + 1
    pieces = [piece for piece in np.split(rows, breaks) if len(piece) >= _MIN_SAMPLES]
    return [_make_stretch(raw, info, name, piece) for piece in pieces]


def _make_stretch(raw: RawLog, info: ChannelInfo, name: str, rows: npt.NDArray[np.int64]) -> Stretch:
    """Return one stretch on a uniform time base."""
    time, nearest = _make_time_base(raw.samples["time"][rows])
    measured = np.zeros(len(time), bool)
    measured[nearest] = True

    def resample(field: str, order: int = 3) -> Array:
        return _resample(time, raw.samples["time"][rows], raw.samples[field][rows], order)

    return Stretch(
        name=name,
        time=time,
        rate=float((len(time) - 1) / (time[-1] - time[0])),
        displacement=resample("displacement"),
        force=resample("force"),
        # A cubic would overshoot at the steps of a drive.
        drive=resample("coil_drive", order=1),
        velocity=resample("velocity") if info.velocity_measured else None,
        segments=_make_segments(raw, name, time),
        force_filter=info.filters["force"],
        displacement_filter=info.filters["displacement"],
        force_delay=info.delays["force"],
        displacement_delay=info.delays["displacement"],
        drive_delay=info.delays["coil_drive"],
        measured=measured,
        force_valid=_find_valid_force(raw, time),
        interpolated=info.interpolated,
    )


def _find_valid_force(raw: RawLog, time: Array) -> BoolArray | None:
    """Return (N,) False where the shunt of the load cell adds to the force; None if it never does."""
    shunted = [mark for mark in raw.segments if mark["phase"] == "start" and mark.get("shunt")]
    if not shunted:
        return None
    ends = {mark["index"]: mark["time"] for mark in raw.segments if mark["phase"] == "end"}
    valid = np.ones(len(time), bool)
    for mark in shunted:
        end = ends.get(mark["index"], time[-1])
        valid &= (time < mark["time"] - _SHUNT_MARGIN) | (time > end + _SHUNT_MARGIN)
    return valid


def _make_time_base(time: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return a uniform time base [s] from the first to the last instant, and the index of each instant in it."""
    steps = np.diff(time)
    # The mean, because the median of coarse time stamps is off by their step, which adds up over the recording.
    usual = float(np.mean(steps[steps < _GAP_RATIO * np.median(steps)]))
    count = round((time[-1] - time[0]) / usual) + 1
    uniform = np.linspace(time[0], time[-1], count)
    return uniform, np.rint((time - time[0]) * ((count - 1) / (time[-1] - time[0]))).astype(np.int64)


def _resample(uniform: Array, time: Array, values: Array, order: int) -> Array:
    """Return values on the uniform time base, interpolated unless time is uniform already."""
    step = uniform[1] - uniform[0]
    if len(uniform) == len(time) and np.max(np.abs(time - uniform)) <= _MAX_JITTER * step:
        return values
    # Only the three channels of every log are known to be complete; others may lack samples.
    known = np.isfinite(values)
    return np.asarray(make_interp_spline(time[known], values[known], k=order)(uniform))


def _make_segments(raw: RawLog, name: str, time: Array) -> tuple[Segment, ...]:
    """Return the parts of a recording's segments within a stretch."""
    # The nearest sample counts, because segments begin between samples.
    half = 0.5 * (time[1] - time[0])
    ends = {mark["index"]: mark["time"] for mark in raw.segments if mark["phase"] == "end"}
    segments = []
    for mark in raw.segments:
        if mark["phase"] != "start" or mark["stretch"] != name:
            continue
        start = int(np.searchsorted(time, mark["time"] - half))
        stop = int(np.searchsorted(time, ends.get(mark["index"], time[-1]) + half))
        if stop - start >= 2:
            values = {key: mark.get(key) for key in ("amplitude", "frequency", "drive_value")}
            segments.append(Segment(mark["index"], mark["name"], start, stop, mark["motion"], **values))
    return tuple(segments)
