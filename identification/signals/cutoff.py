"""Choice of the smoother's cutoff that minimises the estimated error of the velocity."""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, uniform_filter1d

from identification.arrays import Array, BoolArray
from identification.signals.noise import estimate_deviation
from identification.signals.smoother import compute_penalty, compute_step_covariance, smooth_signal

Indices = npt.NDArray[np.intp]

_CUTOFF_RATIO = 1.35
"""Ratio of successive trial cutoffs."""
LOWEST_CUTOFF, _MAX_CUTOFF = 0.003, 0.25
"""Range of the trial cutoffs in cycles a sample."""
_LENGTH_SLOPE = 0.25
"""Largest change of the smoothing length in one smoothing length [1]: the penalty then changes fourfold."""
_DISTORTION_DEVIATIONS = 5.0
"""Mean of the remainder that noise hardly reaches: once in a million [standard deviations]."""
_STROKE_BAND = 200.0
"""Frequency [Hz] above which no hydraulic or electric actuator moves: a sensor shows only noise there."""


def choose_cutoffs(
    values: Array,
    weights: Array,
    expected: Array,
    regions: Indices,
    rate: float,
    noise: float,
    *,
    twicing: bool = False,
) -> Array:
    """Return the cutoff [Hz] of each region by Mallows' Cp of the first differences.

    Args:
        values: (N,) displacement [m].
        weights: (N,) 1 where measured, 0 elsewhere.
        expected: (N-3,) expected third differences [m].
        regions: (N,) index of the region of each sample.
        rate: [Hz]
        noise: standard deviation of the displacement's noise [m].
        twicing: whether the smoother smooths its remainder again.
    """
    highest = max(min(_MAX_CUTOFF * rate, _STROKE_BAND), 2.0 * LOWEST_CUTOFF * rate)
    steps = int(np.log(highest / (LOWEST_CUTOFF * rate)) / np.log(_CUTOFF_RATIO)) + 1
    trials = np.geomspace(highest, LOWEST_CUTOFF * rate, steps + 1)[::-1]
    both_measured = weights[1:] * weights[:-1]
    count = int(regions.max()) + 1
    sizes = np.bincount(regions[1:], both_measured, count)
    costs = np.empty((len(trials), count))
    for cost, cutoff in zip(costs, trials, strict=True):
        penalty = np.full(len(expected), float(compute_penalty(cutoff, rate)))
        smooth = smooth_signal(values, weights, penalty, expected, twicing=twicing)
        cost[:] = np.bincount(regions[1:], both_measured * np.diff(values - smooth) ** 2, count)
        # A high cutoff has a small remainder because the smooth follows the noise. The second term adds that part.
        cost += 2.0 * noise**2 * sizes * compute_step_covariance(cutoff, rate, twicing=twicing)
    return np.asarray(trials[np.argmin(costs, axis=0)])


def find_distortions(values: Array, weights: Array, expected: Array, cutoff: Array, rate: float) -> BoolArray:
    """Return a mask (N,) of the samples where a cutoff distorts the motion, such as around a jump of acceleration.

    The remainder of a smooth motion is noise without its part below the cutoff. Its mean over a quarter of the
    smoothing length varies little. A distortion is larger there, and as long.

    Args:
        values: (N,) displacement [m].
        weights: (N,) 1 where measured, 0 elsewhere.
        expected: (N-3,) expected third differences [m].
        cutoff: (N,) cutoff of the smoother [Hz].
        rate: [Hz]
    """
    penalty = compute_penalty(cutoff[1:-2], rate)
    smooth = smooth_signal(values, weights, penalty, expected, twicing=True)
    remainder = np.where(weights > 0, values - smooth, 0.0)
    distorted = np.zeros(len(values), bool)
    for frequency in np.unique(cutoff):
        window, here = max(int(0.25 * rate / frequency), 2), cutoff == frequency
        mean = uniform_filter1d(remainder, window)
        found = here & (np.abs(mean) > _DISTORTION_DEVIATIONS * estimate_deviation(mean[here]))
        if found.any():
            distorted |= binary_dilation(found, iterations=2 * window)
    return distorted


def limit_length_slope(cutoff: Array, rate: float) -> Array:
    """Return the cutoff (N,) [Hz], raised where the smoothing length changes too fast along the signal.

    The smoothing length is one cycle of the cutoff. Where the penalty jumps, the smoother distorts a motion of
    which the third difference is not zero there, by far more than either penalty alone.
    """
    time, length = np.arange(len(cutoff)) / rate, 1.0 / cutoff
    rise = _LENGTH_SLOPE * time
    after = np.minimum.accumulate(length - rise) + rise
    before = np.minimum.accumulate((length + rise)[::-1])[::-1] - rise
    return np.asarray(1.0 / np.minimum(after, before))
