"""Recording: the channels of a log in SI units, on a uniform time base, divided into stretches.

A stretch is one continuous part at one rate, which is simulated as a whole. It ends where the time step jumps or
where another recording begins in the log. It contains the filters and delays that the devices report, and marks
the samples that were measured.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from identification.arrays import Array, BoolArray
from identification.errors import UnreadableLogError
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
PERIODIC_MOTIONS = ("sine", "triangle")
"""Kinds of motion that repeat."""
_CHANNEL_UNITS = {"displacement": ("m",), "force": ("N",), "coil_drive": ("V", "A")}


@dataclass(frozen=True)
class ChannelFilter:
    """Low-pass filter of a channel, as its device reports it."""

    kind: str
    """Kind of filter, such as butterworth."""
    order: int
    cutoff: float
    """Cutoff frequency [Hz]."""


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
        UnreadableLogError: the file does not exist, is not an mrbench log, is truncated, or lacks units, channels
            or samples.
    """
    raw, sha256 = read_cached(Path(path))
    raw.metadata.setdefault("run", {})
    drive_unit = _read_drive_unit(path, raw)
    info = _ChannelInfo.from_log(path, raw)
    names, indices = _find_recordings(raw)
    stretches: list[Stretch] = []
    for k, name in enumerate(names):
        stretches += _split_stretches(raw, info, name, np.flatnonzero(indices == k))
    if not stretches:
        _check_not_empty(path, raw)
        raise UnreadableLogError(f"{path}: no {_MIN_SAMPLES} consecutive samples; record longer")
    kind = raw.metadata["run"].get("drive_kind") or f"coil_{drive_unit.lower()}"
    return Recording(Path(path), sha256, kind, drive_unit, tuple(stretches), raw.metadata)


def _read_drive_unit(path: Path, raw: RawLog) -> str:
    """Check the units of all channels, and return that of the drive."""
    units = raw.metadata.get("units")
    if units is None:
        raise UnreadableLogError(f"{path}: no metadata record 'units'; record the log with mrbench, or import it")
    for name, allowed in _CHANNEL_UNITS.items():
        if name not in raw.samples:
            raise UnreadableLogError(f"{path}: no channel '{name}' in the samples; record it")
        if units.get(name) not in allowed:
            given = units.get(name, "not given")
            raise UnreadableLogError(
                f"{path}: unit of '{name}' is {given}, must be {' or '.join(allowed)}; convert it"
            )
    return units["coil_drive"]


def _check_not_empty(path: Path, raw: RawLog) -> None:
    """Refuse a log with a channel that contains only NaN."""
    for name in _CHANNEL_UNITS:
        values = raw.samples[name]
        if not np.isfinite(values).any():
            raise UnreadableLogError(
                f"{path}: channel '{name}' contains only NaN ({len(values)} samples); check its sensor"
            )


class _ChannelInfo(NamedTuple):
    """Properties of the channels."""

    filters: dict[str, ChannelFilter | None]
    delays: dict[str, float]
    velocity_measured: bool
    interpolated: bool

    @staticmethod
    def from_log(path: Path, raw: RawLog) -> "_ChannelInfo":
        """Read the metadata `channels` and `units`; a channel without description has no filter and no delay."""
        filters: dict[str, ChannelFilter | None] = {}
        delays: dict[str, float] = {}
        for name in _CHANNEL_UNITS:
            text = raw.metadata.get("channels", {}).get(name, "{}")
            try:
                description = json.loads(text)
                low_pass = description.get("filter")
                filters[name] = low_pass and ChannelFilter(
                    str(low_pass["kind"]), int(low_pass["order"]), float(low_pass["cutoff_hz"])
                )
                delays[name] = float(description.get("delay_s") or 0.0)
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                raise UnreadableLogError(
                    f"{path}: metadata 'channels' describes '{name}' as {text}; a filter needs kind, order and "
                    "cutoff_hz, a delay needs delay_s"
                ) from error
        measured = raw.metadata["units"].get("velocity_from") == "measured" and "velocity" in raw.samples
        return _ChannelInfo(filters, delays, measured, bool(raw.metadata["units"].get("resampled")))


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


def _split_stretches(raw: RawLog, info: _ChannelInfo, name: str, rows: npt.NDArray[np.int64]) -> list[Stretch]:
    """Return the stretches of one recording: complete samples without a longer break."""
    complete = np.all([np.isfinite(raw.samples[channel][rows]) for channel in _CHANNEL_UNITS], axis=0)
    rows = rows[complete]
    if len(rows) < _MIN_SAMPLES:
        return []
    steps = np.diff(raw.samples["time"][rows])
    # The median, because a break must not lengthen the usual step.
    breaks = np.flatnonzero(steps > (_MAX_FILLED + _GAP_RATIO) * np.median(steps)) + 1
    pieces = [piece for piece in np.split(rows, breaks) if len(piece) >= _MIN_SAMPLES]
    return [_make_stretch(raw, info, name, piece) for piece in pieces]


def _make_stretch(raw: RawLog, info: _ChannelInfo, name: str, rows: npt.NDArray[np.int64]) -> Stretch:
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
        interpolated=info.interpolated,
    )


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
