"""Repeated windows: parts of a segment in which cycles of motion and drive repeat."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.logs import PERIODIC_MOTIONS, Segment, Stretch
from identification.signals import (
    average_drive_levels,
    differentiate,
    estimate_drive_noise,
    find_steady_cycles,
    smooth_below,
)

_MAX_HARMONIC = 6.0
"""Multiple of the stroke's frequency up to which its motion may differ from cycle to cycle [1]."""
_DRIVE_DEVIATIONS = 6.0
"""Difference of the drives of two cycles up to which they are equal [standard deviations of its noise]."""
_DRIVE_SHARE = 2e-3
"""Difference of the drives of two cycles up to which they are equal, over the range of the drive [1]."""
_SETTLING_CYCLES, _SHORT_SETTLING_CYCLES = 1.0, 0.5
"""Part of a window that is left out while the damper settles [cycles]: of a long window, and of a short one."""
_LONG_WINDOW = 5.0
"""Length from which a window counts as long [cycles]."""
_MIN_MEASURED = 0.5
"""Smallest share of measured samples of a segment and of a window [1]."""
_SHORTEST_WINDOW = 1.25
"""Length below which too few samples of a window repeat [cycles]."""
MIN_CYCLES = 2
"""Smallest number of cycles that repeat, of which the second may be a part."""


class RepeatedWindow(NamedTuple):
    """Cycles with the same drive, whole ones where there are enough; all arrays (N,)."""

    start: int
    """First sample in the stretch."""
    period: float
    """Samples in a cycle."""
    cycles: int
    """Number of cycles; the last of two may be a part."""
    force: Array
    """Recorded force [N]."""
    motion: Array
    """(3, N) displacement [m], velocity [m/s] and acceleration [m/s²] of the first harmonics."""
    valid: BoolArray
    """True where the force was measured."""

    @property
    def stop(self) -> int:
        """One past the last sample in the stretch."""
        return self.start + len(self.force)

    @property
    def cycle(self) -> npt.NDArray[np.intp]:
        """(N,) index of the cycle of each sample."""
        return np.asarray(np.minimum(np.arange(len(self.force)) // self.period, self.cycles - 1), np.intp)


def find_repeated_windows(stretch: Stretch, displacement: Array, noise: float) -> list[RepeatedWindow]:
    """Return the repeated windows of a stretch.

    Args:
        stretch: the recording; ``measured`` marks the samples that are used.
        displacement: (N,) estimated displacement [m].
        noise: standard deviation of the noise of the recorded displacement [m].
    """
    periodic = [s for s in stretch.segments if s.motion in PERIODIC_MOTIONS and s.frequency]
    levels = _DriveLevels.from_drive(stretch.drive)
    return [w for s in periodic for w in _find_windows(stretch, displacement, noise, s, levels)]


class _DriveLevels(NamedTuple):
    """Drive of a stretch, averaged where it is constant: its noise would divide a window by chance."""

    values: Array
    """(N,) averaged drive [V or A]."""
    tolerance: float
    """Difference up to which two drives are equal [V or A]."""

    @classmethod
    def from_drive(cls, drive: Array) -> "_DriveLevels":
        tolerance = max(_DRIVE_DEVIATIONS * estimate_drive_noise(drive), _DRIVE_SHARE * float(np.ptp(drive)))
        return cls(average_drive_levels(drive), tolerance)


def _find_windows(
    stretch: Stretch, displacement: Array, noise: float, segment: Segment, levels: _DriveLevels
) -> Iterator[RepeatedWindow]:
    part = slice(segment.start, segment.stop)
    weights = stretch.measured[part].astype(float)
    if weights.mean() < _MIN_MEASURED:
        return
    cycles = find_steady_cycles(displacement[part], weights, stretch.rate, segment.frequency or 0.0, noise)
    if cycles is None:
        return
    steady = slice(segment.start + cycles.start, segment.start + cycles.stop)
    period = stretch.rate / cycles.frequency
    motion = _filter_motion(stretch, steady, cycles.frequency)
    for start, stop in _find_equal_drives(levels, steady, round(period)):
        length = _choose_length((stop - start) / period)
        if length < _SHORTEST_WINDOW:
            continue
        first, count = stop - math.floor(length * period), max(math.floor(length), MIN_CYCLES)
        if stretch.measured[first:stop].mean() < _MIN_MEASURED:
            continue
        window = slice(first - steady.start, stop - steady.start)
        yield RepeatedWindow(
            first, period, count, stretch.force[first:stop], motion[:, window], stretch.measured[first:stop]
        )


def _choose_length(available: float) -> float:
    """Return the length of a window [cycles] after the damper has settled: whole cycles if there are enough."""
    settled = available - (_SETTLING_CYCLES if available >= _LONG_WINDOW else _SHORT_SETTLING_CYCLES)
    # The period has an error of some millionths.
    whole = math.floor(settled + 1e-3)
    return min(whole, available) if whole >= MIN_CYCLES else settled


def _find_equal_drives(levels: _DriveLevels, steady: slice, period: int) -> Iterator[tuple[int, int]]:
    """Yield start and stop of each part of the steady cycles in which the drive equals that a cycle before."""
    values = levels.values[steady]
    equal = np.abs(values[period:] - values[:-period]) <= levels.tolerance
    edges = np.flatnonzero(np.diff(np.concatenate([[False], equal, [False]]).astype(int)))
    for first, last in edges.reshape(-1, 2):
        # The first comparison already needs the cycle before it.
        yield steady.start + int(first), steady.start + int(last) + period


def _filter_motion(stretch: Stretch, steady: slice, frequency: float) -> Array:
    """Return (3, N) displacement, velocity and acceleration up to some harmonics, from the displacement alone.

    The estimated motion may contain a trace of the force's own noise, which would explain itself here.
    """
    cutoff = min(_MAX_HARMONIC * frequency, 0.2 * stretch.rate)
    x = smooth_below(stretch.displacement[steady], stretch.measured[steady].astype(float), cutoff, stretch.rate)
    velocity = differentiate(x, stretch.rate)
    return np.stack([x, velocity, differentiate(velocity, stretch.rate)])
