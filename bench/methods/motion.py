"""The motions of a method: what a document may say of them.

A motion is told about its centre. The *oscillating* ones (sine, triangle, sweep, multisine, random) never rest
by themselves and are faded in before and out after their counted part; a hold, a ramp and a table begin and end
at rest. How a motion becomes samples stands in ``strokes.py``.
"""

import math
from fractions import Fraction
from itertools import pairwise
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, PositiveFloat, model_validator

from bench.methods.frozen import Frozen

Seed: TypeAlias = Annotated[
    int, Field(ge=0, lt=2**32, description="Seed of the random numbers: the same seed, the same samples.")
]


class Hold(Frozen):
    """The damper stands still at the centre."""

    kind: Literal["hold"]


class Ramp(Frozen):
    """From rest to rest at constant velocity, the two corners rounded at a constant acceleration."""

    kind: Literal["ramp"]
    start_m: float = Field(description="[m] where it starts, from the centre.")
    end_m: float = Field(description="[m] where it ends, from the centre.")
    corner_acceleration_mps2: PositiveFloat = Field(description="[m/s²] acceleration in the two corners.")


class Sine(Frozen):
    """A sine that begins at the centre, extending."""

    kind: Literal["sine"]
    amplitude_m: PositiveFloat = Field(description="[m] amplitude.")
    frequency_hz: PositiveFloat = Field(description="[Hz] frequency.")


class Triangle(Frozen):
    """Constant velocity to and fro, the corners rounded at a constant acceleration; begins at the centre."""

    kind: Literal["triangle"]
    amplitude_m: PositiveFloat = Field(description="[m] amplitude, reached in spite of the rounding.")
    frequency_hz: PositiveFloat = Field(description="[Hz] frequency.")
    corner_acceleration_mps2: PositiveFloat = Field(
        description="[m/s²] acceleration in the corners; at least 32 amplitude frequency²."
    )

    @model_validator(mode="after")
    def _corners_fit(self) -> Self:
        # With this much the corners take all of each quarter cycle.
        needed = 32 * self.amplitude_m * self.frequency_hz**2
        if self.corner_acceleration_mps2 < needed:
            raise ValueError(
                f"corner_acceleration_mps2 {self.corner_acceleration_mps2:g} m/s² rounds the whole triangle "
                f"away; this amplitude and frequency need at least {needed:.4g} m/s²"
            )
        return self


class Sweep(Frozen):
    """A sine whose frequency runs from one value to another."""

    kind: Literal["sweep"]
    amplitude_m: PositiveFloat = Field(description="[m] amplitude.")
    start_hz: PositiveFloat = Field(description="[Hz] frequency at the start.")
    end_hz: PositiveFloat = Field(description="[Hz] frequency at the end.")
    law: Literal["linear", "logarithmic"] = Field(
        default="linear", description="How the frequency runs over time."
    )


class Line(Frozen):
    """One sine of a multisine."""

    frequency_hz: PositiveFloat = Field(description="[Hz] frequency.")
    amplitude_m: PositiveFloat = Field(description="[m] amplitude.")


class Multisine(Frozen):
    """A sum of sines whose phases come from the seed."""

    kind: Literal["multisine"]
    lines: tuple[Line, ...] = Field(min_length=1, description="The sines.")
    seed: Seed


class Spectrum(Frozen):
    """A flat band."""

    low_hz: PositiveFloat = Field(description="[Hz] lower edge of the band.")
    high_hz: PositiveFloat = Field(description="[Hz] upper edge of the band.")
    rms_m: PositiveFloat = Field(description="[m] root mean square of the displacement; peaks reach 3 to 4 times.")

    @model_validator(mode="after")
    def _band_is_open(self) -> Self:
        if self.high_hz <= self.low_hz:
            raise ValueError(f"high_hz {self.high_hz:g} Hz must exceed low_hz {self.low_hz:g} Hz")
        return self


class Random(Frozen):
    """Noise with a flat displacement spectrum in a band, never repeating within its segment."""

    kind: Literal["random"]
    spectrum: Spectrum = Field(description="The band and its size.")
    seed: Seed


class MotionTable(Frozen):
    """A displacement given at points: a cubic spline through them that begins and ends at rest."""

    kind: Literal["table"]
    time_s: tuple[float, ...] = Field(min_length=2, description="[s] times of the points; the first is 0.")
    displacement_m: tuple[float, ...] = Field(
        min_length=2, description="[m] displacement from the centre at each point."
    )

    @model_validator(mode="after")
    def _points_in_order(self) -> Self:
        check_table(self.time_s, self.displacement_m)
        return self


Motion: TypeAlias = Annotated[
    Hold | Ramp | Sine | Triangle | Sweep | Multisine | Random | MotionTable, Field(discriminator="kind")
]


def check_table(time: tuple[float, ...], values: tuple[float, ...]) -> None:
    """Whether a table of a document can be read as a function of time [s] from 0.

    Raises:
        ValueError: lengths differ, or the times do not begin at 0 and increase.
    """
    if len(time) != len(values):
        raise ValueError(f"the table has {len(time)} times for {len(values)} values; give one value a time")
    if time[0] != 0 or any(later <= earlier for earlier, later in pairwise(time)):
        raise ValueError("the times of a table must begin at 0 s and increase")


def oscillates(motion: Motion) -> bool:
    """Whether the motion needs a soft start and stop, because it is not at rest at its ends."""
    return not isinstance(motion, Hold | Ramp | MotionTable)


def period(motion: Motion) -> float | None:
    """Length of one cycle [s]; of a table its own, None where nothing repeats."""
    match motion:
        case Sine() | Triangle():
            return 1 / motion.frequency_hz
        case Multisine():
            return 1 / _common_frequency([line.frequency_hz for line in motion.lines])
        case MotionTable():
            return motion.time_s[-1]
        case _:
            return None


def _common_frequency(frequencies: list[float]) -> float:
    """The largest frequency [Hz] of which all are multiples, to a part in a thousand of a hertz."""
    # A document says 0.7 Hz, and the binary number nearest to it has no period that anybody would wait for.
    parts = [Fraction(frequency).limit_denominator(1000) for frequency in frequencies]
    denominator = math.lcm(*(part.denominator for part in parts))
    return math.gcd(*(int(part * denominator) for part in parts)) / denominator


def highest_frequency(motion: Motion) -> float:
    """Fastest content [Hz] that the sampling rate has to carry; 0 where it is not told by the document."""
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


def ends(motion: Motion) -> tuple[float, float]:
    """Displacement [m] from the centre at which the motion starts and ends, both at rest."""
    match motion:
        case Ramp():
            return motion.start_m, motion.end_m
        case MotionTable():
            return motion.displacement_m[0], motion.displacement_m[-1]
        case _:
            return 0.0, 0.0
