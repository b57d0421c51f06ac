"""Values that are derived from the samples of each segment, with the definition of each."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bench.log import Log, LoggedSegment

Array = npt.NDArray[np.float64]
_MIN_SAMPLES = 3
"""Smallest number of samples of a segment with derived values."""


class Quantity(NamedTuple):
    """A derived value: column, unit and definition."""

    title: str
    unit: str
    definition: str


QUANTITIES: dict[str, Quantity] = {
    "duration": Quantity("Duration", "s", "Time from the first to the last sample of the segment."),
    "cycles": Quantity("Cycles", "", "Duration times the frequency of the segment; 0 without a frequency."),
    "stroke": Quantity("Stroke amplitude", "m", "Half the range of the displacement."),
    "peak_velocity": Quantity("Peak velocity", "m/s", "Largest magnitude of the velocity."),
    "mean_drive": Quantity("Mean drive", "V or A", "Arithmetic mean of the drive."),
    "highest_force": Quantity("Highest force", "N", "Largest force; tension is positive."),
    "lowest_force": Quantity("Lowest force", "N", "Smallest force; compression is negative."),
    "energy": Quantity(
        "Dissipated energy", "J", "Integral of force times velocity over time by the trapezoidal rule."
    ),
    "cycle_energy": Quantity("Energy per cycle", "J", "Dissipated energy over the number of cycles."),
    "equivalent_damping": Quantity(
        "Equivalent damping",
        "N s/m",
        "Energy per cycle over pi times angular frequency times the square of the stroke amplitude.",
    ),
    "mean_temperature": Quantity("Mean temperature", "degC", "Arithmetic mean of the temperature."),
}
"""Derived values by name, in the order of the columns."""


@dataclass(frozen=True)
class StrokeValues:
    """Derived values of one segment."""

    segment: LoggedSegment
    values: dict[str, float | None]
    """Value by the name in `QUANTITIES`; None where it is not defined."""


def derive_strokes(log: Log) -> list[StrokeValues]:
    """Return the derived values of every segment with enough samples, in the order of the log."""
    return [
        StrokeValues(segment, _derive(log, segment))
        for segment in log.segments
        if segment.stop - segment.start >= _MIN_SAMPLES
    ]


def _derive(log: Log, segment: LoggedSegment) -> dict[str, float | None]:
    rows = slice(segment.start, segment.stop)
    time, displacement, velocity, force, drive = (
        np.asarray(log.samples[name][rows], float)
        for name in ("time", "displacement", "velocity", "force", "coil_drive")
    )
    duration = float(time[-1] - time[0])
    values: dict[str, float | None] = {
        "duration": duration,
        "stroke": float(np.ptp(displacement)) / 2.0,
        "peak_velocity": float(np.max(np.abs(velocity))),
        "mean_drive": float(np.mean(drive)),
        "highest_force": float(np.max(force)),
        "lowest_force": float(np.min(force)),
        "energy": float(np.trapezoid(force * velocity, time)),
        "mean_temperature": _average(log, rows),
    }
    values |= _derive_cycles(segment.frequency or 0.0, duration, values["energy"] or 0.0, values["stroke"] or 0.0)
    return {name: _check(values[name]) for name in QUANTITIES}


def _derive_cycles(frequency: float, duration: float, energy: float, stroke: float) -> dict[str, float | None]:
    """Return the values of one cycle; None for a segment without a complete one."""
    cycles = frequency * duration
    if cycles < 1.0 or stroke <= 0.0:
        return {"cycles": cycles, "cycle_energy": None, "equivalent_damping": None}
    damping = energy / cycles / (math.pi * 2.0 * math.pi * frequency * stroke**2)
    return {"cycles": cycles, "cycle_energy": energy / cycles, "equivalent_damping": damping}


def _average(log: Log, rows: slice) -> float | None:
    """Return the mean of the measured temperatures; None without any."""
    values = np.asarray(log.samples.get("temperature", np.empty(0))[rows], float)
    return float(np.nanmean(values)) if np.isfinite(values).any() else None


def _check(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
