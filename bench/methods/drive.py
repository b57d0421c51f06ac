"""The drive programmes of a method: what a document may say, and their exact values.

A programme runs on the time base of its segment, from 0 to the segment's duration; before and after it holds its
first and last value. Values are in volt or ampere, as the method's ``drive_kind`` says.
"""

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeAlias, assert_never

import numpy as np
import numpy.typing as npt
from pydantic import Field, PositiveFloat, model_validator

from bench.methods.frozen import Frozen
from bench.methods.kinematics import Array
from bench.methods.motion import Seed, check_table

EDGE = 1e-9
"""[s] a step that rounding puts this little after a sample still belongs to it."""


class Constant(Frozen):
    """One value throughout."""

    kind: Literal["constant"]
    value: float = Field(description="[V or A] the drive.")


class Staircase(Frozen):
    """Levels one after the other, each for the same share of the segment, the stroke going on through them.

    Every level becomes a segment of its own in programme and log, named ``SEGMENT_LEVEL`` with its unit.
    """

    kind: Literal["staircase"]
    levels: tuple[float, ...] = Field(min_length=1, description="[V or A] the drive of each level.")


class Steps(Frozen):
    """Steps at given times, or at given phases of the stroke."""

    kind: Literal["steps"]
    values: tuple[float, ...] = Field(min_length=1, description="[V or A] the drive from each step on.")
    time_s: tuple[float, ...] | None = Field(
        default=None, description="[s] when each value starts; the first is 0."
    )
    phase_cycles: tuple[float, ...] | None = Field(
        default=None,
        description="[cycles] of the stroke at which each value starts: 0.25 is the first extended end.",
    )

    @model_validator(mode="after")
    def _either_times_or_phases(self) -> Self:
        if (self.time_s is None) == (self.phase_cycles is None):
            raise ValueError("steps need either time_s or phase_cycles")
        check_table(self.time_s or self.phase_cycles or (), self.values)
        return self


class DriveRamp(Frozen):
    """A straight line over the whole segment."""

    kind: Literal["ramp"]
    start: float = Field(description="[V or A] drive at the start.")
    end: float = Field(description="[V or A] drive at the end.")


class Prbs(Frozen):
    """A pseudo-random binary sequence of 32767 bits, entered at a place that the seed chooses."""

    kind: Literal["prbs"]
    low: float = Field(description="[V or A] the drive of a zero.")
    high: float = Field(description="[V or A] the drive of a one.")
    bit_s: PositiveFloat = Field(description="[s] length of a bit.")
    seed: Seed


class DriveTable(Frozen):
    """Straight lines between points."""

    kind: Literal["table"]
    time_s: tuple[float, ...] = Field(min_length=2, description="[s] times of the points; the first is 0.")
    values: tuple[float, ...] = Field(min_length=2, description="[V or A] the drive at each point.")

    @model_validator(mode="after")
    def _points_in_order(self) -> Self:
        check_table(self.time_s, self.values)
        return self


Drive: TypeAlias = Annotated[
    Constant | Staircase | Steps | DriveRamp | Prbs | DriveTable, Field(discriminator="kind")
]


def drive_values(drive: Drive, time: Array, duration: float, cycle: float | None) -> Array:
    """The drive [V or A] at times of shape (samples,).

    Args:
        drive: what the document says.
        time: [s], zero where the segment begins.
        duration: length of the segment [s].
        cycle: length of one stroke cycle [s], which steps at phases need.
    """
    t = np.clip(time, 0.0, duration)
    match drive:
        case Constant():
            return np.full_like(t, drive.value)
        case Staircase():
            share = duration / len(drive.levels)
            return _steps([index * share for index in range(len(drive.levels))], drive.levels, t)
        case Steps():
            starts = drive.time_s or [phase * (cycle or 0.0) for phase in drive.phase_cycles or ()]
            return _steps(starts, drive.values, t)
        case DriveRamp():
            return drive.start + (drive.end - drive.start) * t / duration
        case Prbs():
            bits = _bits(drive.seed, int((duration + EDGE) / drive.bit_s) + 1)
            return np.where(bits[((t + EDGE) / drive.bit_s).astype(int)], drive.high, drive.low)
        case DriveTable():
            return np.interp(t, drive.time_s, drive.values)
        case _:
            assert_never(drive)


def _steps(starts: Sequence[float], values: tuple[float, ...], time: Array) -> Array:
    return np.asarray(values)[np.searchsorted(starts, time + EDGE, side="right") - 1]


def _bits(seed: int, count: int) -> npt.NDArray[np.bool_]:
    """Bits of the shift register x^15 + x^14 + 1."""
    register = int(np.random.default_rng(seed).integers(1, 2**15))
    bits = np.empty(count, dtype=bool)
    for index in range(count):
        # Both taps together make it run through all 32767 states but zero before it repeats.
        new = ((register >> 14) ^ (register >> 13)) & 1
        register = ((register << 1) & 0x7FFF) | new
        bits[index] = bool(new)
    return bits
