"""Drive programmes of a method: types in the document, and their exact values.

A drive programme has the time base of its segment, from 0 to the segment's duration. Before and after, the first
and the last value are held. Values are in volts or amperes, according to the method's ``drive_kind``.
"""

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeAlias, assert_never

import numpy as np
import numpy.typing as npt
from pydantic import Field, PositiveFloat, model_validator

from bench.methods.kinematics import Array
from bench.methods.motion import Seed, check_table
from bench.validation import FrozenModel

EDGE_TOLERANCE = 1e-9
"""Largest time [s] by which rounding may place a step after the sample that it belongs to."""


class Constant(FrozenModel):
    """One constant value."""

    kind: Literal["constant"]
    value: float = Field(description="[V or A] drive.")


class Staircase(FrozenModel):
    """Levels of equal duration during a continuous stroke.

    Every level becomes a separate segment in programme and log, named ``SEGMENT_LEVEL`` with its unit.
    """

    kind: Literal["staircase"]
    levels: tuple[float, ...] = Field(min_length=1, description="[V or A] drive of each level.")


class Steps(FrozenModel):
    """Steps at given times, or at given phases of the stroke."""

    kind: Literal["steps"]
    values: tuple[float, ...] = Field(min_length=1, description="[V or A] drive after each step.")
    time_s: tuple[float, ...] | None = Field(
        default=None, description="[s] start time of each value; the first is 0."
    )
    phase_cycles: tuple[float, ...] | None = Field(
        default=None,
        description="[cycles] phase of the stroke at which each value starts; 0.25 is the first extended end.",
    )

    @model_validator(mode="after")
    def _check_times(self) -> Self:
        if (self.time_s is None) == (self.phase_cycles is None):
            raise ValueError("steps need either time_s or phase_cycles")
        check_table(self.time_s or self.phase_cycles or (), self.values)
        return self


class DriveRamp(FrozenModel):
    """Linear change over the whole segment."""

    kind: Literal["ramp"]
    start: float = Field(description="[V or A] drive at the start.")
    end: float = Field(description="[V or A] drive at the end.")


class Prbs(FrozenModel):
    """Pseudo-random binary sequence of 32767 bits that starts at a bit chosen by the seed."""

    kind: Literal["prbs"]
    low: float = Field(description="[V or A] drive of a zero.")
    high: float = Field(description="[V or A] drive of a one.")
    bit_s: PositiveFloat = Field(description="[s] duration of a bit.")
    seed: Seed


class DriveTable(FrozenModel):
    """Linear interpolation between points."""

    kind: Literal["table"]
    time_s: tuple[float, ...] = Field(min_length=2, description="[s] times of the points; the first is 0.")
    values: tuple[float, ...] = Field(min_length=2, description="[V or A] drive at each point.")

    @model_validator(mode="after")
    def _check_points(self) -> Self:
        check_table(self.time_s, self.values)
        return self


Drive: TypeAlias = Annotated[
    Constant | Staircase | Steps | DriveRamp | Prbs | DriveTable, Field(discriminator="kind")
]


def sample_drive(drive: Drive, time: Array, duration: float, cycle: float | None) -> Array:
    """Compute the drive [V or A] at times of shape (samples,).

    Args:
        drive: drive programme.
        time: [s], zero at the start of the segment.
        duration: duration of the segment [s].
        cycle: length of one cycle of the stroke [s], needed for steps at phases.
    """
    t = np.clip(time, 0.0, duration)
    match drive:
        case Constant():
            return np.full_like(t, drive.value)
        case Staircase():
            share = duration / len(drive.levels)
            return _sample_steps([index * share for index in range(len(drive.levels))], drive.levels, t)
        case Steps():
            starts = drive.time_s or [phase * (cycle or 0.0) for phase in drive.phase_cycles or ()]
            return _sample_steps(starts, drive.values, t)
        case DriveRamp():
            return drive.start + (drive.end - drive.start) * t / duration
        case Prbs():
            bits = _make_prbs_bits(drive.seed, int((duration + EDGE_TOLERANCE) / drive.bit_s) + 1)
            return np.where(bits[((t + EDGE_TOLERANCE) / drive.bit_s).astype(int)], drive.high, drive.low)
        case DriveTable():
            return np.interp(t, drive.time_s, drive.values)
        case _:
            assert_never(drive)


def _sample_steps(starts: Sequence[float], values: tuple[float, ...], time: Array) -> Array:
    return np.asarray(values)[np.searchsorted(starts, time + EDGE_TOLERANCE, side="right") - 1]


def _make_prbs_bits(seed: int, count: int) -> npt.NDArray[np.bool_]:
    """Return bits of the shift register x^15 + x^14 + 1."""
    register = int(np.random.default_rng(seed).integers(1, 2**15))
    bits = np.empty(count, dtype=bool)
    for index in range(count):
        # With these two taps the register passes through all 32767 states except zero before it repeats.
        new = ((register >> 14) ^ (register >> 13)) & 1
        register = ((register << 1) & 0x7FFF) | new
        bits[index] = bool(new)
    return bits
