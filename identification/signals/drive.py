"""Levels, steps and noise of a measured drive."""

import itertools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array
from identification.signals.noise import estimate_white_noise

Indices = npt.NDArray[np.intp]

_STEP_RATIO = 8.0
"""Threshold on a change over the drive's noise: above it, the drive steps."""
_CONSTANT_RATIO = 1.5
"""Threshold on the standard deviation of a level over the noise: below it, the level is constant."""
_MIN_LEVEL_SAMPLES = 5
"""Smallest number of samples in a level that is averaged."""


def estimate_drive_noise(drive: Array) -> float:
    """Return the standard deviation [V or A] of the noise of a measured drive (N,).

    Second differences remove ramps, and their median ignores the steps of a staircase. The result is too large for
    a drive that curves within three samples as much as its noise.
    """
    return estimate_white_noise(drive, 2)


def find_drive_steps(drive: Array) -> Indices:
    """Return the index of the first sample after each step of a measured drive (N,)."""
    # A drive without noise, such as a command, steps wherever it changes.
    jumps = np.abs(np.diff(drive)) > max(_STEP_RATIO * estimate_drive_noise(drive), 1e-12)
    return np.asarray(np.flatnonzero(jumps) + 1)


def average_drive_levels(drive: Array) -> Array:
    """Return the drive (N,) [V or A] with every constant level replaced by its mean."""
    noise = estimate_drive_noise(drive)
    edges = np.concatenate([[0], find_drive_steps(drive), [len(drive)]])
    result = drive.copy()
    for start, stop in itertools.pairwise(edges):
        level = drive[start:stop]
        if stop - start >= _MIN_LEVEL_SAMPLES and level.std() <= _CONSTANT_RATIO * noise:
            result[start:stop] = level.mean()
    return result


class StepShifts(NamedTuple):
    """Steps of a drive, each with the part of a sample by which it is earlier than the first recorded sample."""

    places: Indices
    """(K,) first sample of each new level."""
    advances: Array
    """(K,) between 0 and 1 [samples]."""

    def apply(self, drive: Array) -> Array:
        """Return a drive (N,) [V or A] that is held between samples; one with a step has the mean."""
        shifted = drive.copy()
        shifted[self.places - 1] += self.advances * (drive[self.places] - drive[self.places - 1])
        return shifted


def find_level_changes(drive: Array) -> Indices:
    """Return the first sample of each new level of a drive (N,) that is constant on both sides of the step."""
    before, change, after = (np.diff(drive)[k : len(drive) - 3 + k] for k in range(3))
    return np.asarray(np.flatnonzero((change != 0.0) & (before == 0.0) & (after == 0.0)) + 2)


def bin_drive(drive: Array, max_bins: int = 8) -> list[tuple[float, Indices]]:
    """Group samples by drive: constant levels by value, a varying drive in bins of equal width.

    Returns:
        Pairs of a value [V or A] and the indices of its samples, ascending.
    """
    span = float(np.ptp(drive))
    if span < 1e-9:
        return [(float(drive[0]), np.arange(len(drive)))]
    # A staircase has few levels, with noise below 2 % of its range. Samples between two belong to the nearest.
    coarse = np.round((drive - drive.min()) / (0.02 * span))
    levels, counts = np.unique(coarse, return_counts=True)
    frequent = levels[counts >= 0.01 * len(drive)]
    if len(frequent) > 12 or counts[np.isin(levels, frequent)].sum() <= 0.9 * len(drive):
        return _bin_evenly(drive, span, max_bins)
    nearest = np.abs(coarse[:, None] - frequent[None, :]).argmin(axis=1)
    groups = [np.flatnonzero(nearest == k) for k in range(len(frequent))]
    return [(float(np.median(drive[g])), g) for g in groups]


def _bin_evenly(drive: Array, span: float, max_bins: int) -> list[tuple[float, Indices]]:
    bins = np.minimum((max_bins * (drive - drive.min()) / span).astype(int), max_bins - 1)
    width = span / max_bins
    return [
        (float(drive.min() + (k + 0.5) * width), np.flatnonzero(bins == k))
        for k in range(max_bins)
        if (bins == k).any()
    ]
