"""Description of a run in its log: identity, and the metadata records written when the log is opened."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Literal

import orjson
from pydantic import BaseModel, ConfigDict, Field

from bench.log.messages import list_sample_units

_FROZEN = ConfigDict(frozen=True, extra="forbid")


@dataclass(frozen=True)
class Identity:
    """Specimen, operator and start of a run."""

    specimen: str
    """Damper under test; if empty, the name that the simulated rig reports."""
    operator: str
    started: datetime
    """UTC at zero of the bench clock."""

    def make_run_id(self, method: str) -> str:
        """Return the identifier of the run: its start and its method."""
        return f"{self.started:%Y%m%dT%H%M%S.%fZ}-{method}"


def utc_at(utc_offset: str, bench_ns: int) -> datetime | None:
    """Convert an instant of the bench clock to UTC.

    Args:
        utc_offset: UTC at zero of the bench clock, ISO 8601, as in the log's metadata.
        bench_ns: bench clock [ns].

    Returns:
        UTC, or None if the log does not hold a valid time.
    """
    try:
        zero = datetime.fromisoformat(utc_offset)
    except ValueError:
        return None
    aware = zero if zero.tzinfo else zero.replace(tzinfo=UTC)
    return (aware + timedelta(microseconds=bench_ns / 1e3)).astimezone(UTC)


class ChannelInfo(BaseModel):
    """Acquisition of one channel, as read back from its instrument."""

    model_config = _FROZEN

    unit: str = Field(description="unit of the channel in the log")
    rate_hz: float = Field(description="[Hz] sampling rate of the instrument")
    filter: dict[str, Any] | None = Field(default=None, description="filter of the instrument, null for none")
    delay_s: float = Field(default=0.0, description="[s] delay of the channel behind the measured quantity")


class RunHeader(BaseModel):
    """Metadata of a run that are known when its log is opened."""

    model_config = _FROZEN

    id: str = Field(description="identifier of the run")
    specimen: str = Field(description="damper under test, with its serial number")
    method: str = Field(description="name of the method; for an import, names of the files")
    method_sha256: str = Field(
        default="", description="hash of the content of the method; empty in logs of older versions and in imports"
    )
    drive_kind: str = Field(description="driver_command_v, coil_v or coil_a")
    drive_unit: Literal["V", "A"] = Field(description="unit of the drive")
    source: Literal["run", "import"] = Field(description="recorded by this bench, or imported")
    operator: str = Field(default="", description="name of the operator")
    versions: dict[str, str] = Field(
        default_factory=dict, description="versions of the programs that wrote the log"
    )
    seed: int | None = Field(default=None, description="seed of all random values in the run")
    utc_offset: str = Field(default="", description="UTC time at zero of the bench clock, ISO 8601, if known")
    continues: str = Field(default="", description="id of the run that this one continues; empty without one")
    resumed_after: str = Field(
        default="", description="checkpoint of the method after which the run begins; empty for a whole run"
    )
    velocity_from: Literal["smoothed displacement", "measured"] = Field(
        default="smoothed displacement", description="origin of the velocity in the samples"
    )
    resampled: str = Field(default="no", description="how channels were resampled to the bench's time base")
    calibration: dict[str, str] = Field(
        default_factory=dict, description="calibration by channel: JSON of its certificate, or text"
    )
    checks: dict[str, str] = Field(
        default_factory=dict, description="latest check by channel, as JSON; empty if none are known"
    )
    clocks: dict[str, str] = Field(default_factory=dict, description="clock by device, as text or JSON")
    channels: dict[str, ChannelInfo] = Field(default_factory=dict, description="acquisition by channel")

    def make_metadata(self) -> dict[str, dict[str, str]]:
        """Return the metadata records by name; MCAP stores strings only."""
        run = self.model_dump(
            exclude={"velocity_from", "resampled", "calibration", "checks", "clocks", "channels"}
        )
        units = list_sample_units(self.drive_unit)
        return {
            "run": serialise_values(run),
            "units": {**units, "velocity_from": self.velocity_from, "resampled": self.resampled},
            "calibration": self.calibration,
            **({"checks": self.checks} if self.checks else {}),
            "clocks": self.clocks,
            "channels": serialise_values({name: channel.model_dump() for name, channel in self.channels.items()}),
        }


def serialise_values(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the values as strings: text unchanged, None as an empty string, anything else as JSON."""
    return {key: _serialise_value(value) for key, value in values.items()}


def _serialise_value(value: object) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else orjson.dumps(value).decode()
