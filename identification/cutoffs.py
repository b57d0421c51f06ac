"""How stiffly a motion is smoothed: the cutoff that makes the estimated error of its velocity least."""

import numpy as np
import numpy.typing as npt

from identification.arrays import Array
from identification.smoother import kept_noise, smoothed, stiffness

Indices = npt.NDArray[np.intp]

_CUTOFF_RATIO = 1.35
_LOWEST, _HIGHEST = 0.003, 0.25
"""Of the trial cutoffs, in cycles a sample."""
_STROKE_BAND = 200.0
"""[Hz] No hydraulic or electric stroke carries more; what a sensor shows above it is noise of any colour."""


def best_cutoffs(
    values: Array,
    weights: Array,
    expected: Array,
    regions: Indices,
    rate: float,
    noise: float,
    *,
    twice: bool = False,
) -> Array:
    """The cutoff [Hz] of each region by Mallows' Cp of the first differences.

    Args:
        values: (N,) displacement [m].
        weights: (N,) 1 where measured, 0 where not.
        expected: (N-3,) third differences [m] that are expected.
        regions: (N,) which region a sample belongs to.
        rate: [Hz]
        noise: standard deviation of the displacement's noise [m].
        twice: whether the smoother smooths twice.
    """
    highest = max(min(_HIGHEST * rate, _STROKE_BAND), 2.0 * _LOWEST * rate)
    steps = int(np.log(highest / (_LOWEST * rate)) / np.log(_CUTOFF_RATIO)) + 1
    trials = np.geomspace(highest, _LOWEST * rate, steps + 1)[::-1]
    both = weights[1:] * weights[:-1]
    count = int(regions.max()) + 1
    sizes = np.bincount(regions[1:], both, count)
    costs = np.empty((len(trials), count))
    for cost, cutoff in zip(costs, trials, strict=True):
        penalty = np.full(len(expected), float(stiffness(cutoff, rate)))
        left = np.diff(values - smoothed(values, weights, penalty, expected, twice=twice)) ** 2
        cost[:] = np.bincount(regions[1:], both * left, count)
        # A loose smoother leaves less because it follows the noise: what it follows is put on its bill.
        cost += 2.0 * noise**2 * sizes * kept_noise(cutoff, rate, twice=twice)
    return np.asarray(trials[np.argmin(costs, axis=0)])
