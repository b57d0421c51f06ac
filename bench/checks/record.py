"""Record of a check: what each channel indicated at rest, computed from the log of the run.

A check is an ordinary run. Its record depends on the log alone, so the same log always gives the same record.
"""

import tomllib
from collections.abc import Iterator
from datetime import datetime
from typing import Any, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from bench.checks.statistics import Array, RestStatistics, compute_statistics
from bench.config import CHANNEL_UNITS, ChannelName
from bench.log import Log, LoggedSegment, utc_at
from bench.validation import FrozenModel

CheckKind: TypeAlias = Literal["zero"]
"""zero: mean of each channel at rest, at the middle of the travel and without drive."""
CHECK_METHODS = {"coil_v": "zero_check", "coil_a": "zero_check_current"}
"""Method of the zero check by drive kind of the bench."""
CHECKED_CHANNELS: tuple[ChannelName, ...] = (
    "force",
    "displacement",
    "actuator_position",
    "coil_voltage",
    "coil_current",
)
"""Channels whose value at rest is known to be zero, or to be always the same."""
REST_SEGMENT = "rest"
"""Segment of the method whose samples count."""
_COLUMNS = {"force": ("force_raw", "force")}
"""Columns of a channel, the preferred one first: a tare would hide a shift of the zero."""
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
    check: CheckKind = Field(description="zero: mean at rest")
    channel: ChannelName
    unit: str = Field(description="unit of the values: the SI unit of the channel")
    value: float = Field(description="mean, in the unit; of the force without the tare of its instrument")
    standard_deviation: float = Field(ge=0, description="of the samples, in the unit")
    standard_uncertainty: float = Field(ge=0, description="of the mean, in the unit, for correlated samples")
    samples: int = Field(ge=2, description="[1] number of samples")
    independent_samples: float = Field(
        ge=1, description="[1] number of independent samples with the same uncertainty of the mean"
    )
    duration_s: float = Field(description="[s] time over which the mean was taken")
    measured: datetime = Field(description="UTC at the start of that time")
    specimen: str = Field(description="mounted damper; empty if the run names none")
    bench: str = Field(description="name of the bench; empty if the log has no configuration")
    instrument: str = Field(description="name of the instrument; empty if the log does not name it")
    serial: str = Field(description="serial number of the instrument; empty if it reports none")
    temperature_c: float | None = Field(description="[°C] mean temperature of the specimen; null without one")


def compute_records(log: Log) -> list[CheckRecord]:
    """Compute the record of each channel; empty if the log is not that of a completed check."""
    run = log.metadata.get("run", {})
    segment = next((one for one in log.segments if one.name == REST_SEGMENT), None)
    is_check = run.get("method") in CHECK_METHODS.values() and run.get("source", "run") == "run"
    if not is_check or log.outcome not in ("clean", "lossy"):
        return []
    if segment is None or not _is_at_rest(segment):
        return []
    return list(_make_records(log, segment))


def _is_at_rest(segment: LoggedSegment) -> bool:
    return segment.motion == "hold" and segment.drive_value == 0


def _make_records(log: Log, segment: LoggedSegment) -> Iterator[CheckRecord]:
    part, run = slice(segment.start, segment.stop), log.metadata["run"]
    times = log.samples["time_ns"][part]
    measured = utc_at(run.get("utc_offset", ""), int(times[0])) if times.size else None
    if measured is None:
        return
    temperature = _select(log, "temperature", part)
    for channel in CHECKED_CHANNELS:
        values = _select(log, channel, part)
        if len(values) < _SHORTEST:
            continue
        instrument, serial = _find_instrument(log, channel)
        yield CheckRecord(
            run=run["id"],
            check="zero",
            channel=channel,
            unit=CHANNEL_UNITS[channel],
            **_name_statistics(compute_statistics(values)),
            duration_s=float(times[-1] - times[0]) * 1e-9,
            measured=measured,
            specimen=run.get("specimen", ""),
            bench=_find_bench(log),
            instrument=instrument,
            serial=serial,
            temperature_c=float(np.mean(temperature)) if temperature.size else None,
        )


def _select(log: Log, channel: str, part: slice) -> Array:
    """Return the finite samples of a channel; empty if it was not recorded."""
    for column in _COLUMNS.get(channel, (channel,)):
        values = np.asarray(log.samples.get(column, np.empty(0)), dtype=np.float64)[part]
        if (finite := values[np.isfinite(values)]).size:
            return finite
    return np.empty(0)


def _name_statistics(statistics: RestStatistics) -> dict[str, Any]:
    return {
        "value": statistics.mean,
        "standard_deviation": statistics.standard_deviation,
        "standard_uncertainty": statistics.standard_uncertainty,
        "samples": statistics.samples,
        "independent_samples": statistics.independent_samples,
    }


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
