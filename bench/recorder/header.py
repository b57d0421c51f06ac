"""What a log says of itself before its first sample: the metadata records written when it is opened."""

from collections.abc import Mapping
from typing import Any, Literal

import orjson
from pydantic import BaseModel, ConfigDict, Field

from bench.recorder.messages import sample_units

_FROZEN = ConfigDict(frozen=True, extra="forbid")


class Channel(BaseModel):
    """How one channel was taken, as read back from its instrument."""

    model_config = _FROZEN

    unit: str = Field(description="unit of the channel in the log")
    rate_hz: float = Field(description="[Hz] rate at which the instrument samples")
    filter: dict[str, Any] | None = Field(default=None, description="the instrument's filter, null for none")
    delay_s: float = Field(default=0.0, description="[s] how far the channel lags what it measures")


class RunHeader(BaseModel):
    """Everything known of a run when its log is opened."""

    model_config = _FROZEN

    id: str = Field(description="identifier of the run")
    specimen: str = Field(description="the damper under test, with its serial number")
    method: str = Field(description="name of the method; for an import, of the files")
    drive_kind: str = Field(description="driver_command_v, coil_v or coil_a")
    drive_unit: Literal["V", "A"] = Field(description="unit of the drive")
    source: Literal["run", "import"] = Field(description="recorded here, or taken in from elsewhere")
    operator: str = Field(default="", description="who ran it")
    versions: dict[str, str] = Field(default_factory=dict, description="versions of what made the log")
    seed: int | None = Field(default=None, description="seed of everything random in the run")
    utc_offset: str = Field(default="", description="UTC time at zero of the bench clock, ISO 8601, if known")
    velocity_from: Literal["smoothed displacement", "measured"] = Field(
        default="smoothed displacement", description="how the velocity in the samples was made"
    )
    resampled: str = Field(default="no", description="how channels came onto the bench's time base")
    calibration: dict[str, str] = Field(default_factory=dict, description="calibration by channel, in words")
    clocks: dict[str, str] = Field(default_factory=dict, description="clock by device, in words or JSON")
    channels: dict[str, Channel] = Field(default_factory=dict, description="how each channel was taken")

    def records(self) -> dict[str, dict[str, str]]:
        """The metadata records, by name; MCAP keeps strings only."""
        run = self.model_dump(exclude={"velocity_from", "resampled", "calibration", "clocks", "channels"})
        units = sample_units(self.drive_unit)
        return {
            "run": text_values(run),
            "units": {**units, "velocity_from": self.velocity_from, "resampled": self.resampled},
            "calibration": self.calibration,
            "clocks": self.clocks,
            "channels": text_values({name: channel.model_dump() for name, channel in self.channels.items()}),
        }


def text_values(values: Mapping[str, Any]) -> dict[str, str]:
    """The values as strings: text as it is, nothing as an empty string, all else as JSON."""
    return {key: _text(value) for key, value in values.items()}


def _text(value: object) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else orjson.dumps(value).decode()
