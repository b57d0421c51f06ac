"""Motions of a method: their types in the document, and their periods, frequencies and end positions.

A motion is defined relative to its centre. *Oscillating* motions (sine, triangle, sweep, multisine, random) have
no rest at their ends: they are faded in before and out after their counted part. A hold, a ramp and a table begin
and end at rest. ``motion_samples.py`` computes the samples.
"""

import math
from fractions import Fraction
from itertools import pairwise
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, PositiveFloat, model_validator

from bench.validation import FrozenModel

Seed: TypeAlias = Annotated[
    int, Field(ge=0, lt=2**32, description="Seed of the random numbers; equal seeds give equal samples.")
]


class Hold(FrozenModel):
    """Rest at the centre."""

    kind: Literal["hold"]


class Ramp(FrozenModel):
    """Constant velocity from rest to rest, with the two corners rounded at constant acceleration."""

    kind: Literal["ramp"]
    start_m: float = Field(description="[m] first position, relative to the centre.")
    end_m: float = Field(description="[m] last position, relative to the centre.")
    corner_acceleration_mps2: PositiveFloat = Field(description="[m/s²] acceleration in the two corners.")


class Sine(FrozenModel):
    """Sine that begins at the centre in the direction of extension."""

    kind: Literal["sine"]
    amplitude_m: PositiveFloat = Field(description="[m] amplitude.")
    frequency_hz: PositiveFloat = Field(description="[Hz] frequency.")


class Triangle(FrozenModel):
    """Constant velocity in both directions from the centre, with corners rounded at constant acceleration."""

    kind: Literal["triangle"]
    amplitude_m: PositiveFloat = Field(description="[m] amplitude with the rounded corners.")
    frequency_hz: PositiveFloat = Field(description="[Hz] frequency.")
    corner_acceleration_mps2: PositiveFloat = Field(
        description="[m/s²] acceleration in the corners; at least 32 amplitude frequency²."
    )

    @model_validator(mode="after")
    def _check_corners(self) -> Self:
        # At this acceleration each corner takes a whole half cycle.
        # A product becomes infinite where a power would raise an OverflowError.
        needed = 32 * self.amplitude_m * self.frequency_hz * self.frequency_hz
        if self.corner_acceleration_mps2 < needed:
            raise ValueError(
                f"corner_acceleration_mps2 {self.corner_acceleration_mps2:g} m/s² leaves no straight part of the "
                f"triangle; this amplitude and frequency need at least {needed:.4g} m/s²"
            )
        return self


class Sweep(FrozenModel):
    """Sine whose frequency changes from one value to another."""

    kind: Literal["sweep"]
    amplitude_m: PositiveFloat = Field(description="[m] amplitude.")
    start_hz: PositiveFloat = Field(description="[Hz] frequency at the start.")
    end_hz: PositiveFloat = Field(description="[Hz] frequency at the end.")
    law: Literal["linear", "logarithmic"] = Field(
        default="linear", description="Course of the frequency over time."
    )


class MultisineLine(FrozenModel):
    """One sine of a multisine."""

    frequency_hz: PositiveFloat = Field(description="[Hz] frequency.")
    amplitude_m: PositiveFloat = Field(description="[m] amplitude.")


class Multisine(FrozenModel):
    """Sum of sines with random phases."""

    kind: Literal["multisine"]
    lines: tuple[MultisineLine, ...] = Field(min_length=1, description="Sines.")
    seed: Seed


class Spectrum(FrozenModel):
    """Flat spectrum in a band."""

    low_hz: PositiveFloat = Field(description="[Hz] lower edge of the band.")
    high_hz: PositiveFloat = Field(description="[Hz] upper edge of the band.")
    rms_m: PositiveFloat = Field(
        description="[m] root mean square of the displacement; peaks are 3 to 4 times as large."
    )

    @model_validator(mode="after")
    def _check_band(self) -> Self:
        if self.high_hz <= self.low_hz:
            raise ValueError(f"high_hz {self.high_hz:g} Hz must exceed low_hz {self.low_hz:g} Hz")
        return self


class Random(FrozenModel):
    """Noise with a flat displacement spectrum in a band, which does not repeat within its segment."""

    kind: Literal["random"]
    spectrum: Spectrum = Field(description="Band and root mean square.")
    seed: Seed


class MotionTable(FrozenModel):
    """Cubic spline through given points that begins and ends at rest."""

    kind: Literal["table"]
    time_s: tuple[float, ...] = Field(min_length=2, description="[s] times of the points; the first is 0.")
    displacement_m: tuple[float, ...] = Field(
        min_length=2, description="[m] displacement from the centre at each point."
    )

    @model_validator(mode="after")
    def _check_points(self) -> Self:
        check_table(self.time_s, self.displacement_m)
        return self


Motion: TypeAlias = Annotated[
    Hold | Ramp | Sine | Triangle | Sweep | Multisine | Random | MotionTable, Field(discriminator="kind")
]


def check_table(time: tuple[float, ...], values: tuple[float, ...]) -> None:
    """Check that a table is a function of time [s] from 0.

    Raises:
        ValueError: the lengths differ, or the times do not begin at 0 and increase.
    """
    if len(time) != len(values):
        raise ValueError(f"the table has {len(time)} times for {len(values)} values; give one value for each time")
    if time[0] != 0 or any(later <= earlier for earlier, later in pairwise(time)):
        raise ValueError("the times of a table must begin at 0 s and increase")


def is_oscillating(motion: Motion) -> bool:
    """Return whether the motion is not at rest at its ends and needs a soft start and stop."""
    return not isinstance(motion, Hold | Ramp | MotionTable)


def find_period(motion: Motion) -> float | None:
    """Return the length of one cycle [s], for a table its duration; None if the motion has no cycles."""
    match motion:
        case Sine() | Triangle():
            return 1 / motion.frequency_hz
        case Multisine():
            return 1 / _find_common_frequency([line.frequency_hz for line in motion.lines])
        case MotionTable():
            return motion.time_s[-1]
        case _:
            return None


def _find_common_frequency(frequencies: list[float]) -> float:
    """Return the largest frequency [Hz] of which all are multiples, to a thousandth of a hertz."""
    # The binary number nearest to 0.7 Hz would give an extremely long period, hence the rounding to fractions.
    fractions = [Fraction(frequency).limit_denominator(1000) for frequency in frequencies]
    denominator = math.lcm(*(fraction.denominator for fraction in fractions))
    return math.gcd(*(int(fraction * denominator) for fraction in fractions)) / denominator


def find_highest_frequency(motion: Motion) -> float:
    """Return the highest frequency [Hz] of a motion; 0 if the document does not define it."""
    match motion:
        case Sine() | Triangle():
            return motion.frequency_hz
        case Sweep():
            return max(motion.start_hz, motion.end_hz)
        case Multisine():
            return max(line.frequency_hz for line in motion.lines)
        case Random():
            return motion.spectrum.high_hz
        case _:
            return 0.0


def find_end_positions(motion: Motion) -> tuple[float, float]:
    """Return the first and the last displacement [m] from the centre, both at rest."""
    match motion:
        case Ramp():
            return motion.start_m, motion.end_m
        case MotionTable():
            return motion.displacement_m[0], motion.displacement_m[-1]
        case _:
            return 0.0, 0.0
