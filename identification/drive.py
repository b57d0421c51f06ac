"""The measured drive, with the noise of its measurement taken off where it stands still."""

import itertools

import numpy as np
import numpy.typing as npt

from identification.arrays import Array

Indices = npt.NDArray[np.intp]

_JUMP = 8.0
"""[1] deviations of the noise that make a step a step."""
_STILL = 1.5
"""[1] a level whose spread is below this many deviations of the noise is taken for constant."""
_SHORTEST = 5
"""[samples] shortest level that is averaged."""


def drive_noise(drive: Array) -> float:
    """Standard deviation [V or A] of the noise of a measured drive (N,), from its changes between samples.

    The median passes over the steps of a staircase, and the second difference over a ramp; a drive that curves
    as much within three samples as it is noisy looks noisier than it is.
    """
    changes = np.diff(drive, 2)
    # 0.6745: median of a Gaussian's magnitude; 6 = 1 + 4 + 1: variance of its second difference.
    return float(np.median(np.abs(changes))) / 0.6745 / np.sqrt(6.0) if len(changes) else 0.0


def drive_steps(drive: Array) -> Indices:
    """The first sample behind every step of a measured drive (N,) that stands out of its noise."""
    # A drive without noise, such as a command, steps wherever it changes at all.
    jumps = np.abs(np.diff(drive)) > max(_JUMP * drive_noise(drive), 1e-12)
    return np.asarray(np.flatnonzero(jumps) + 1)


def steady_levels(drive: Array) -> Array:
    """The drive (N,) [V or A] with every constant level replaced by its mean; anything that moves stays."""
    noise = drive_noise(drive)
    edges = np.concatenate([[0], drive_steps(drive), [len(drive)]])
    result = drive.copy()
    for start, stop in itertools.pairwise(edges):
        level = drive[start:stop]
        if stop - start >= _SHORTEST and level.std() <= _STILL * noise:
            result[start:stop] = level.mean()
    return result


def drive_bins(drive: Array, most: int = 8) -> list[tuple[float, Indices]]:
    """Samples by drive: constant levels by value, a varying drive in at most ``most`` bins of equal width.

    Returns:
        (value [V or A], indices of its samples), ascending.
    """
    span = float(np.ptp(drive))
    if span < 1e-9:
        return [(float(drive[0]), np.arange(len(drive)))]
    # A staircase keeps to few levels, noise within 2 % of its range; what passes between two goes to the nearest.
    coarse = np.round((drive - drive.min()) / (0.02 * span))
    levels, counts = np.unique(coarse, return_counts=True)
    frequent = levels[counts >= 0.01 * len(drive)]
    if len(frequent) <= 12 and counts[np.isin(levels, frequent)].sum() > 0.9 * len(drive):
        nearest = np.abs(coarse[:, None] - frequent[None, :]).argmin(axis=1)
        groups = [np.flatnonzero(nearest == k) for k in range(len(frequent))]
        return [(float(np.median(drive[g])), g) for g in groups]
    place = np.minimum((most * (drive - drive.min()) / span).astype(int), most - 1)
    width = span / most
    return [
        (float(drive.min() + (k + 0.5) * width), np.flatnonzero(place == k))
        for k in range(most)
        if (place == k).any()
    ]
