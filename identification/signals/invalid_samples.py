"""Samples that no damper produces: spikes, stuck values, clipped force.

Least squares would follow each of them, so they are excluded from a fit.
"""

import itertools

import numpy as np
from scipy.ndimage import median_filter, percentile_filter

from identification.arrays import Array, BoolArray
from identification.logs import Stretch
from identification.signals.noise import estimate_white_noise

STROKE_FRACTION = 0.02
"""Fraction of the whole stroke: a rod that travels more moves."""
_MEDIAN_WINDOW, _SPREAD_WINDOW = 11, 41
"""Samples around one from which its expected value and the local spread are estimated."""
_SPIKE_RATIO, _SPREAD_RATIO = 12.0, 4.0
"""Thresholds on a deviation over the noise, and over the local spread: above their sum, it is a spike."""
_STUCK_SAMPLES = 20
"""Smallest number of consecutive equal samples that counts as stuck while the rod moves."""
_CLIPPED_SAMPLES = 5
"""Smallest number of consecutive samples at an extreme of the force that counts as clipping."""
_RUN_RATIO = 5.0
"""Smallest length of a stuck or clipped run over the usual length of a run (its 99 % quantile)."""
_EXTREME_TOLERANCE = 1e-9
"""Distance from an extreme of the force, relative to its range, within which a sample counts as equal to it."""


def find_spikes(values: Array) -> BoolArray:
    """Return a mask (N,) of samples far off all others around them; steps and corners are not marked."""
    noise = estimate_white_noise(values, 4)
    deviation = np.abs(values - median_filter(values, _MEDIAN_WINDOW, mode="nearest"))
    changes = np.diff(values, prepend=values[:1])
    return _find_outliers(deviation, _SPIKE_RATIO * noise, values) | _find_outliers(
        _compute_heights(values), _SPIKE_RATIO * noise, changes
    )


def _compute_heights(values: Array) -> Array:
    """Return the height (N,) of each sample above or below both of its neighbours; 0 between them.

    The values around a single spike may change by more than it, but not from sample to sample.
    """
    changes, heights = np.diff(values), np.zeros(len(values))
    rise, fall = changes[:-1], -changes[1:]
    heights[1:-1] = np.where(rise * fall > 0.0, np.minimum(np.abs(rise), np.abs(fall)), 0.0)
    return heights


def find_jumps(values: Array) -> BoolArray:
    """Return a mask (N,) of displacements farther off the line between their neighbours than a mass can move."""
    offset = np.zeros(len(values))
    offset[1:-1] = values[1:-1] - 0.5 * (values[:-2] + values[2:])
    size = np.abs(offset)
    # A jump puts its neighbours off their lines by half as much: only the largest of the three is invalid.
    largest = size >= np.maximum(np.roll(size, 1), np.roll(size, -1))
    return _find_outliers(size, _SPIKE_RATIO * estimate_white_noise(values, 4), offset) & largest


def _find_outliers(deviation: Array, min_deviation: float, values: Array) -> BoolArray:
    """Return a mask of deviations above a minimum and above the local spread of the values."""
    # A coarse converter may show no noise: two of its steps are not a spike.
    steps = np.diff(np.unique(values[:5000]))
    min_deviation = max(min_deviation, 2.0 * float(np.min(steps, initial=np.inf, where=steps > 0)))
    if not np.isfinite(min_deviation) or not (deviation > min_deviation).any():
        return np.zeros(len(values), bool)
    # Quartiles, because the spike itself must not widen the spread.
    upper, lower = (percentile_filter(values, part, _SPREAD_WINDOW, mode="nearest") for part in (75, 25))
    return np.asarray(deviation > min_deviation + _SPREAD_RATIO * (upper - lower))


def find_stuck_force(stretch: Stretch) -> BoolArray:
    """Return a mask (N,) of a constant force while the rod moves; at its extremes the force is clipped instead."""
    force, stuck = stretch.force, np.zeros(len(stretch.force), bool)
    min_travel, extremes = STROKE_FRACTION * float(np.ptp(stretch.displacement)), (force.min(), force.max())
    for start, stop in _find_long_runs(force, _STUCK_SAMPLES):
        if force[start] not in extremes and np.ptp(stretch.displacement[start:stop]) > min_travel:
            stuck[start:stop] = True
    return stuck


def find_clipped_runs(force: Array) -> BoolArray:
    """Return a mask (N,) of samples at an extreme that the force keeps far longer than other values.

    Unlike `find_clipping`, it accepts the repeated values of a coarse converter.
    """
    clipped, extremes = np.zeros(len(force), bool), (force.min(), force.max())
    for start, _ in _find_long_runs(force, _CLIPPED_SAMPLES):
        if force[start] in extremes:
            # Once a run shows the limit, single samples at it are clipped as well.
            clipped |= force == force[start]
    return clipped


def find_clipping(force: Array) -> BoolArray:
    """Return a mask (N,) of samples at an extreme that the force keeps for several samples, up to rounding."""
    clipped = np.zeros(len(force), bool)
    for extreme in (force.max(), force.min()):
        at_extreme = np.abs(force - extreme) <= _EXTREME_TOLERANCE * float(np.ptp(force))
        edges = np.flatnonzero(np.diff(np.concatenate([[False], at_extreme, [False]]).astype(int)))
        for start, stop in edges.reshape(-1, 2):
            if stop - start >= _CLIPPED_SAMPLES:
                clipped |= at_extreme
                break
    return clipped if np.ptp(force) > 0 else np.zeros(len(force), bool)


def _find_long_runs(force: Array, min_samples: int) -> list[tuple[int, int]]:
    """Return runs of equal values that are longer than a minimum and far longer than usual runs."""
    if np.ptp(force) == 0.0:
        return []
    edges = np.concatenate([[0], np.flatnonzero(np.diff(force) != 0.0) + 1, [len(force)]])
    min_length = max(min_samples, _RUN_RATIO * float(np.quantile(np.diff(edges), 0.99)))
    return [(int(start), int(stop)) for start, stop in itertools.pairwise(edges) if stop - start >= min_length]


def interpolate_invalid(values: Array, invalid: BoolArray) -> Array:
    """Return a signal (N,) with straight lines over its invalid samples."""
    if not invalid.any():
        return values
    index = np.arange(len(values))
    return np.interp(index, index[~invalid], values[~invalid])
