"""Log to arrays: the channels of a recording in SI units, on a uniform time base, cut into stretches.

A stretch is one continuous recording at one rate, the unit that is simulated at once. It ends where the time
step jumps or where the log says that another recording begins. What a device reports of itself (filter, delay)
comes along, and so does which samples were really measured.
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
from identification.errors import LogUnreadable
from identification.log_cache import RawLog
from identification.log_reader import read_cached

_FILLED = 5
"""As many lost samples in a row are interpolated; more cut the recording."""
_JUMP = 1.5
"""A step longer than this many usual ones lacks samples."""
_JITTER = 0.01
"""Of the usual step; more is resampled onto a uniform time base."""
_PAUSE = 0.5
"""[s] As long without samples as between two imported recordings."""
_FEWEST = 50
"""A stretch with fewer samples says nothing of a damper."""
_UNITS = {"displacement": ("m",), "force": ("N",), "coil_drive": ("V", "A")}


@dataclass(frozen=True)
class ChannelFilter:
    """The low-pass of a channel, as its device reports it."""

    kind: str
    """For example butterworth."""
    order: int
    cutoff: float
    """[Hz]"""


@dataclass(frozen=True)
class Segment:
    """A motion of the method, as far as it lies in one stretch."""

    index: int
    """Number in the log."""
    name: str
    start: int
    """First sample, counted in the stretch."""
    stop: int
    """One past the last sample."""
    motion: str
    """Kind of motion: hold, ramp, sine, triangle, sweep, multisine, random or table."""
    amplitude: float | None
    """[m]"""
    frequency: float | None
    """[Hz]"""
    drive_value: float | None
    """[V or A] where the drive is constant."""


@dataclass(frozen=True)
class Stretch:
    """One continuous recording at one rate; all arrays (N,)."""

    name: str
    time: Array
    """[s] on the log's clock, uniform."""
    rate: float
    """[Hz]"""
    displacement: Array
    """[m]"""
    force: Array
    """[N]"""
    drive: Array
    """Measured coil drive [V or A]."""
    velocity: Array | None
    """[m/s] where it was measured and not made from the displacement."""
    segments: tuple[Segment, ...]
    force_filter: ChannelFilter | None
    displacement_filter: ChannelFilter | None
    force_delay: float
    """[s] by which the recorded force is late, as the device reports it."""
    displacement_delay: float
    """[s]"""
    drive_delay: float
    """[s]"""
    measured: BoolArray
    """False where a lost sample was interpolated."""
    force_valid: BoolArray | None = None
    """False where the force alone is broken and was bridged; None where all of it counts."""
    interpolated: bool = False
    """Whether the displacement was brought here from other instants: its fastest noise was lost on the way."""

    @property
    def counts(self) -> BoolArray:
        """(N,) True where the sample may be fitted and scored."""
        return self.measured if self.force_valid is None else self.measured & self.force_valid


@dataclass(frozen=True)
class Recording:
    """A log, read."""

    path: Path
    sha256: str
    """Of the log's content."""
    drive_kind: str
    """driver_command_v, coil_v or coil_a."""
    drive_unit: str
    """V or A."""
    stretches: tuple[Stretch, ...]
    metadata: Mapping[str, Mapping[str, str]]
    """Records of the log's metadata by name."""


def load(path: Path) -> Recording:
    """Read a log.

    Args:
        path: an MCAP log with the profile mrbench.

    Returns:
        Its channels as arrays. From the second reading on they come from a cache by the log's content.

    Raises:
        LogUnreadable: no such file, no log of ours, truncated, or without units, channels or samples.
    """
    raw, sha256 = read_cached(Path(path))
    raw.metadata.setdefault("run", {})
    drive_unit = _checked_units(path, raw)
    said = _Said.of(path, raw)
    names, owner = _names(raw)
    stretches: list[Stretch] = []
    for k, name in enumerate(names):
        stretches += _continuous(raw, said, name, np.flatnonzero(owner == k))
    if not stretches:
        _some_numbers(path, raw)
        raise LogUnreadable(f"{path}: no {_FEWEST} samples without a break; record longer")
    kind = raw.metadata["run"].get("drive_kind") or f"coil_{drive_unit.lower()}"
    return Recording(Path(path), sha256, kind, drive_unit, tuple(stretches), raw.metadata)


def _checked_units(path: Path, raw: RawLog) -> str:
    """The drive's unit, once the others are what they must be."""
    units = raw.metadata.get("units")
    if units is None:
        raise LogUnreadable(f"{path}: no metadata record 'units'; a number without a unit is not read")
    for name, allowed in _UNITS.items():
        if name not in raw.samples:
            raise LogUnreadable(f"{path}: no channel '{name}' in the samples; record it")
        if units.get(name) not in allowed:
            given = units.get(name, "not given")
            raise LogUnreadable(f"{path}: unit of '{name}' is {given}, must be {' or '.join(allowed)}; convert it")
    return units["coil_drive"]


def _some_numbers(path: Path, raw: RawLog) -> None:
    """Refuse a log in which one channel holds no number at all, by its name."""
    for name in _UNITS:
        values = raw.samples[name]
        if not np.isfinite(values).any():
            raise LogUnreadable(
                f"{path}: channel '{name}' holds no number in any of its {len(values)} samples; check its sensor"
            )


class _Said(NamedTuple):
    """What the log says of its channels."""

    filters: dict[str, ChannelFilter | None]
    delays: dict[str, float]
    velocity_measured: bool
    interpolated: bool

    @staticmethod
    def of(path: Path, raw: RawLog) -> "_Said":
        """Read from the metadata `channels` and `units`; a channel not described has no filter and no delay."""
        filters: dict[str, ChannelFilter | None] = {}
        delays: dict[str, float] = {}
        for name in _UNITS:
            text = raw.metadata.get("channels", {}).get(name, "{}")
            try:
                channel = json.loads(text)
                given = channel.get("filter")
                filters[name] = given and ChannelFilter(
                    str(given["kind"]), int(given["order"]), float(given["cutoff_hz"])
                )
                delays[name] = float(channel.get("delay_s") or 0.0)
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                raise LogUnreadable(
                    f"{path}: metadata 'channels' describes '{name}' as {text}; "
                    "a filter needs kind, order and cutoff_hz, a delay delay_s"
                ) from error
        measured = raw.metadata["units"].get("velocity_from") == "measured" and "velocity" in raw.samples
        return _Said(filters, delays, measured, bool(raw.metadata["units"].get("resampled")))


def _names(raw: RawLog) -> tuple[list[str], npt.NDArray[np.int64]]:
    """Names of the recordings in the log, and which of them each sample belongs to (N,).

    A recording reaches from its first segment's start to the next recording's; an imported one may start
    before its first segment, after the pause that divides it from the one before.
    """
    time = raw.samples["time"]
    names: list[str] = []
    starts: list[int] = []
    for segment in raw.segments:
        if segment["phase"] == "start" and (not names or segment["stretch"] != names[-1]):
            names.append(str(segment["stretch"]))
            starts.append(_after_pause(time, int(np.searchsorted(time, segment["time"] - 1e-6))))
    if not names:
        return [raw.metadata["run"].get("method") or "recording"], np.zeros(len(time), np.int64)
    owner = np.zeros(len(time), np.int64)
    for k, start in enumerate(starts[1:], 1):
        owner[start:] = k
    return names, owner


def _after_pause(time: Array, index: int) -> int:
    """The first sample after the last pause of half a second or more before this one; itself if there is none."""
    pauses = np.flatnonzero(np.diff(time[: index + 1]) > _PAUSE)
    return int(pauses[-1]) + 1 if len(pauses) else index


def _continuous(raw: RawLog, said: _Said, name: str, rows: npt.NDArray[np.int64]) -> list[Stretch]:
    """The stretches of one recording: whole samples without a longer break."""
    whole = np.all([np.isfinite(raw.samples[channel][rows]) for channel in _UNITS], axis=0)
    rows = rows[whole]
    if len(rows) < _FEWEST:
        return []
    steps = np.diff(raw.samples["time"][rows])
    # The median: a break must not lengthen the usual step by which it is known.
    breaks = np.flatnonzero(steps > (_FILLED + _JUMP) * np.median(steps)) + 1
    pieces = [piece for piece in np.split(rows, breaks) if len(piece) >= _FEWEST]
    return [_stretch(raw, said, name, piece) for piece in pieces]


def _stretch(raw: RawLog, said: _Said, name: str, rows: npt.NDArray[np.int64]) -> Stretch:
    """One stretch, on a uniform time base."""
    time, nearest = _uniform(raw.samples["time"][rows])
    measured = np.zeros(len(time), bool)
    measured[nearest] = True

    def channel(field: str, order: int = 3) -> Array:
        return _onto(time, raw.samples["time"][rows], raw.samples[field][rows], order)

    return Stretch(
        name=name,
        time=time,
        rate=float((len(time) - 1) / (time[-1] - time[0])),
        displacement=channel("displacement"),
        force=channel("force"),
        # A drive steps; a cubic would overshoot there.
        drive=channel("coil_drive", order=1),
        velocity=channel("velocity") if said.velocity_measured else None,
        segments=_segments(raw, name, time),
        force_filter=said.filters["force"],
        displacement_filter=said.filters["displacement"],
        force_delay=said.delays["force"],
        displacement_delay=said.delays["displacement"],
        drive_delay=said.delays["coil_drive"],
        measured=measured,
        interpolated=said.interpolated,
    )


def _uniform(time: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """A uniform time base [s] from the first to the last instant, and the place of each instant in it."""
    steps = np.diff(time)
    # The mean: a median of coarse time stamps is off by their step, and that adds up over the recording.
    usual = float(np.mean(steps[steps < _JUMP * np.median(steps)]))
    count = round((time[-1] - time[0]) / usual) + 1
    uniform = np.linspace(time[0], time[-1], count)
    return uniform, np.rint((time - time[0]) * ((count - 1) / (time[-1] - time[0]))).astype(np.int64)


def _onto(uniform: Array, time: Array, values: Array, order: int) -> Array:
    """Values on the uniform time base: as they are where time is uniform already, else interpolated."""
    step = uniform[1] - uniform[0]
    if len(uniform) == len(time) and np.max(np.abs(time - uniform)) <= _JITTER * step:
        return values
    # Only the three channels that every log has are known to be whole; another may lack samples of its own.
    known = np.isfinite(values)
    return np.asarray(make_interp_spline(time[known], values[known], k=order)(uniform))


def _segments(raw: RawLog, name: str, time: Array) -> tuple[Segment, ...]:
    """The segments of a recording, as far as they lie in a stretch of it."""
    # The nearest sample counts: a segment begins at an instant of its own.
    half = 0.5 * (time[1] - time[0])
    ends = {said["index"]: said["time"] for said in raw.segments if said["phase"] == "end"}
    segments = []
    for said in raw.segments:
        if said["phase"] != "start" or said["stretch"] != name:
            continue
        start = int(np.searchsorted(time, said["time"] - half))
        stop = int(np.searchsorted(time, ends.get(said["index"], time[-1]) + half))
        if stop - start >= 2:
            known = {key: said.get(key) for key in ("amplitude", "frequency", "drive_value")}
            segments.append(Segment(said["index"], said["name"], start, stop, said["motion"], **known))
    return tuple(segments)
