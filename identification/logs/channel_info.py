"""Channels of a log: units, filters and delays, as its metadata state them."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from identification.errors import UnreadableLogError
from identification.logs.log_cache import RawLog

CHANNEL_UNITS = {"displacement": ("m",), "force": ("N",), "coil_drive": ("V", "A")}
"""Channels of every log, with the units that each may have."""


@dataclass(frozen=True)
class ChannelFilter:
    """Low-pass filter of a channel, as its device reports it."""

    kind: str
    """Kind of filter, such as butterworth."""
    order: int
    cutoff: float
    """Cutoff frequency [Hz]."""


class ChannelInfo(NamedTuple):
    """Properties of the channels."""

    filters: dict[str, ChannelFilter | None]
    delays: dict[str, float]
    """Delay of each channel [s]."""
    velocity_measured: bool
    interpolated: bool


def read_drive_unit(path: Path, raw: RawLog) -> str:
    """Check the units of all channels, and return that of the drive.

    Raises:
        UnreadableLogError: a unit or a channel is missing, or a unit is another one.
    """
    units = raw.metadata.get("units")
    if units is None:
        raise UnreadableLogError(f"{path}: no metadata record 'units'; record the log with mrbench, or import it")
    for name, allowed in CHANNEL_UNITS.items():
        if name not in raw.samples:
            raise UnreadableLogError(f"{path}: no channel '{name}' in the samples; record it")
        if units.get(name) not in allowed:
            given = units.get(name, "not given")
            raise UnreadableLogError(
                f"{path}: unit of '{name}' is {given}, must be {' or '.join(allowed)}; convert it"
            )
    return units["coil_drive"]


def check_not_empty(path: Path, raw: RawLog) -> None:
    """Check that every channel contains a number.

    Raises:
        UnreadableLogError: a channel contains only NaN.
    """
    for name in CHANNEL_UNITS:
        values = raw.samples[name]
        if not np.isfinite(values).any():
            raise UnreadableLogError(
                f"{path}: channel '{name}' contains only NaN ({len(values)} samples); check its sensor"
            )


def read_channel_info(path: Path, raw: RawLog) -> ChannelInfo:
    """Read the metadata `channels` and `units`; a channel without description has no filter and no delay.

    Raises:
        UnreadableLogError: a description lacks a field, or is not JSON.
    """
    units = raw.metadata["units"]
    channels = {name: _read_channel(path, raw, name) for name in CHANNEL_UNITS}
    filters = {name: channel_filter for name, (channel_filter, _) in channels.items()}
    delays = {name: delay for name, (_, delay) in channels.items()}
    # A velocity that was differentiated from the displacement is no second measurement of the motion.
    measured = units.get("velocity_from") == "measured" and "velocity" in raw.samples
    return ChannelInfo(filters, delays, measured, bool(units.get("resampled")))


def _read_channel(path: Path, raw: RawLog, name: str) -> tuple[ChannelFilter | None, float]:
    """Return filter and delay [s] of a channel."""
    text = raw.metadata.get("channels", {}).get(name, "{}")
    try:
        description = json.loads(text)
        low_pass = description.get("filter")
        channel_filter = low_pass and ChannelFilter(
            str(low_pass["kind"]), int(low_pass["order"]), float(low_pass["cutoff_hz"])
        )
        return channel_filter, float(description.get("delay_s") or 0.0)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UnreadableLogError(
            f"{path}: metadata 'channels' describes '{name}' as {text}; a filter needs kind, order and "
            "cutoff_hz, a delay needs delay_s"
        ) from error
