"""Record of a check, computed from the log of the run.

A zero check shows what each channel indicated at rest. A shunt check shows by how much the shunt of the load cell
changed the force. A check is an ordinary run. Its record depends on the log alone, so the same log always gives
the same record.
"""

import tomllib
from collections.abc import Iterator
from datetime import datetime
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from bench.checks.statistics import (
    Array,
    RestStatistics,
    TimedSamples,
    compute_difference,
    compute_statistics,
)
from bench.config import CHANNEL_UNITS, ChannelName
from bench.log import Log, LoggedSegment, utc_at
from bench.validation import FrozenModel

CheckKind: TypeAlias = Literal["zero", "shunt"]
"""zero: mean of each channel at rest, at the middle of the travel and without drive; shunt: change of the force by
the shunt of the load cell, at the same rest."""
CHECK_KINDS: tuple[CheckKind, ...] = get_args(CheckKind)
CHECK_METHODS: dict[CheckKind, dict[str, str]] = {
    "zero": {"coil_v": "zero_check", "coil_a": "zero_check_current"},
    "shunt": {"coil_v": "shunt_check", "coil_a": "shunt_check_current"},
}
"""Method of each check by drive kind of the bench."""
CHECKED_CHANNELS: tuple[ChannelName, ...] = (
    "force",
    "displacement",
    "actuator_position",
    "coil_voltage",
    "coil_current",
)
"""Channels of a zero check: their value at rest is known to be zero, or to be always the same."""
REST_SEGMENT = "rest"
"""Segment whose samples count in a zero check, and that before the shunt in a shunt check."""
SHUNT_SEGMENT, REST_AFTER_SEGMENT = "shunt", "rest_after"
"""Segments of a shunt check with the shunt, and after it."""
EDGE_MARGIN = 0.5
"""[s] Time at the begin and the end of each segment of a shunt check that does not count.

The shunt is switched between two segments, and the filter of the load cell needs milliseconds to settle."""
_COLUMNS = {"force": ("force_raw",)}
"""Columns that are preferred to that of the channel: a tare would hide a shift of the zero."""
_SHORTEST = 100
"""Smallest number of samples of a check."""


class _Channel(BaseModel):
    """Channel of an instrument, as a log describes it."""

    name: str


class _Instrument(BaseModel):
    """Instrument, as a log describes it; logs of older versions have no serial number."""

    serial: int | None = None
    channels: tuple[_Channel, ...] = ()


_INSTRUMENTS = TypeAdapter(dict[str, _Instrument])


class CheckRecord(FrozenModel):
    """Result of one check for one channel."""

    run: str = Field(description="id of the run")
    check: CheckKind = Field(description="zero: mean at rest; shunt: change of the force by the shunt")
    channel: ChannelName
    unit: str = Field(description="unit of the values: the SI unit of the channel")
    value: float = Field(
        description="mean, or change of the mean by the shunt, in the unit; of the force without the tare of its "
        "instrument"
    )
    standard_deviation: float = Field(ge=0, description="of the samples, in the unit")
    standard_uncertainty: float = Field(ge=0, description="of the value, in the unit, for correlated samples")
    samples: int = Field(ge=2, description="[1] number of samples; of a shunt check those with the shunt")
    independent_samples: float = Field(
        ge=1, description="[1] number of independent samples with the same uncertainty of their mean"
    )
    duration_s: float = Field(description="[s] time over which the mean of these samples was taken")
    measured: datetime = Field(description="UTC at the start of that time")
    specimen: str = Field(description="mounted damper; empty if the run names none")
    bench: str = Field(description="name of the bench; empty if the log has no configuration")
    instrument: str = Field(description="name of the instrument; empty if the log does not name it")
    serial: str = Field(description="serial number of the instrument; empty if it reports none")
    temperature_c: float | None = Field(description="[°C] mean temperature of the specimen; null without one")


class _Measurement(NamedTuple):
    """Result of a check for one channel, and the samples from which it follows."""

    check: CheckKind
    channel: ChannelName
    value: float
    standard_uncertainty: float
    statistics: RestStatistics
    time: Array
    """[s] since the first sample of the log."""


def find_check_kind(method: str) -> CheckKind | None:
    """Return the kind of check that a method of this name is; None if it is none."""
    return next((kind for kind, methods in CHECK_METHODS.items() if method in methods.values()), None)


def compute_records(log: Log) -> list[CheckRecord]:
    """Compute the record of each channel; empty if the log is not that of a completed check."""
    run = log.metadata.get("run", {})
    kind = find_check_kind(run.get("method", ""))
    if kind is None or run.get("source", "run") != "run" or log.outcome not in ("clean", "lossy"):
        return []
    measurements = _measure_zeros(log) if kind == "zero" else _measure_shunt(log)
    records = (_make_record(log, one) for one in measurements)
    return [one for one in records if one is not None]


def _measure_zeros(log: Log) -> Iterator[_Measurement]:
    segment = _find_rest(log, REST_SEGMENT)
    if segment is None:
        return
    for channel in CHECKED_CHANNELS:
        samples = _select(log, channel, slice(segment.start, segment.stop))
        if len(samples.values) >= _SHORTEST:
            statistics = compute_statistics(samples.values)
            uncertainty = statistics.standard_uncertainty
            yield _Measurement("zero", channel, statistics.mean, uncertainty, statistics, samples.time)


def _measure_shunt(log: Log) -> Iterator[_Measurement]:
    segments = [
        _find_rest(log, name, shunt=name == SHUNT_SEGMENT)
        for name in (REST_SEGMENT, SHUNT_SEGMENT, REST_AFTER_SEGMENT)
    ]
    parts = [_select_inner(log, "force", segment) for segment in segments if segment is not None]
    if len(parts) < len(segments) or any(len(part.values) < _SHORTEST for part in parts):
        return
    if not parts[0].time[-1] < parts[1].time[0] <= parts[1].time[-1] < parts[2].time[0]:
        return  # an uploaded log may have its segments in any order
    result = compute_difference(*parts)
    yield _Measurement(
        "shunt", "force", result.value, result.standard_uncertainty, result.statistics, parts[1].time
    )


def _find_rest(log: Log, name: str, shunt: bool = False) -> LoggedSegment | None:
    """Return the segment of a name if the rod rested in it without drive, and with the shunt only if demanded."""
    segment = next((one for one in log.segments if one.name == name), None)
    is_rest = segment is not None and segment.motion == "hold" and segment.drive_value == 0
    return segment if is_rest and segment is not None and segment.shunt == shunt else None


def _make_record(log: Log, measurement: _Measurement) -> CheckRecord | None:
    """Return the record of a channel; None if the log states no UTC."""
    one, run = measurement, log.metadata["run"]
    begin_ns = int(log.samples["time_ns"][0]) + round(float(one.time[0]) * 1e9)
    measured = utc_at(run.get("utc_offset", ""), begin_ns)
    if measured is None:
        return None
    begin, end = np.searchsorted(log.samples["time"], one.time[[0, -1]])
    temperature = _select(log, "temperature", slice(int(begin), int(end) + 1)).values
    instrument, serial = _find_instrument(log, one.channel)
    return CheckRecord(
        run=run["id"],
        check=one.check,
        channel=one.channel,
        unit=CHANNEL_UNITS[one.channel],
        value=one.value,
        standard_deviation=one.statistics.standard_deviation,
        standard_uncertainty=one.standard_uncertainty,
        samples=one.statistics.samples,
        independent_samples=one.statistics.independent_samples,
        duration_s=float(one.time[-1] - one.time[0]),
        measured=measured,
        specimen=run.get("specimen", ""),
        bench=_find_bench(log),
        instrument=instrument,
        serial=serial,
        temperature_c=float(np.mean(temperature)) if temperature.size else None,
    )


def _select_inner(log: Log, channel: str, segment: LoggedSegment) -> TimedSamples:
    """Return the finite samples of a segment without `EDGE_MARGIN` at its begin and end."""
    samples = _select(log, channel, slice(segment.start, segment.stop))
    if not samples.time.size:
        return samples
    low, high = samples.time[0] + EDGE_MARGIN, samples.time[-1] - EDGE_MARGIN
    inner = (samples.time >= low) & (samples.time <= high)
    return TimedSamples(samples.time[inner], samples.values[inner])


def _select(log: Log, channel: str, part: slice) -> TimedSamples:
    """Return the finite samples of a channel; empty if it was not recorded."""
    column = next((name for name in _COLUMNS.get(channel, ()) if _is_recorded(log, name)), channel)
    if column not in log.samples:
        return TimedSamples(np.empty(0), np.empty(0))
    values = np.asarray(log.samples[column], dtype=np.float64)[part]
    finite = np.isfinite(values)
    return TimedSamples(np.asarray(log.samples["time"], dtype=np.float64)[part][finite], values[finite])


def _is_recorded(log: Log, column: str) -> bool:
    """Return whether a column has a value at any sample of the log."""
    return column in log.samples and bool(np.isfinite(log.samples[column]).any())


def _find_bench(log: Log) -> str:
    """Return the name of the bench in the attached configuration."""
    try:
        document = tomllib.loads(log.attachments.get("bench.toml", b"").decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        return ""
    rig = document.get("rig")
    return str(rig.get("name", "")) if isinstance(rig, dict) else ""


def _find_instrument(log: Log, channel: str) -> tuple[str, str]:
    """Return name and serial number of the instrument that measures a channel."""
    try:
        instruments = _INSTRUMENTS.validate_json(log.attachments.get("instruments.json", b"{}"))
    except ValidationError:  # an uploaded log may contain anything
        return "", ""
    for name, one in instruments.items():
        if channel in (entry.name for entry in one.channels):
            return name, str(one.serial or "")
    return "", ""
