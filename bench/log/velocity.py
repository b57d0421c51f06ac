"""Velocity for viewers, computed from the displacement.

The velocity is the slope at the middle of a parabola that is fitted to 20 ms of displacement (Savitzky-Golay). It
has no phase lag, and its noise is ten times lower. An identification computes its own derivatives instead.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

SMOOTHING_WINDOW = 0.020
"""Length [s] of the window; at low sampling rates it is five samples."""


def smooth_velocity(displacement: npt.NDArray[np.float64], rate: float) -> npt.NDArray[np.float64]:
    """Compute the velocity of a smoothed displacement.

    Args:
        displacement: [m], shape (samples,), uniformly sampled.
        rate: sampling rate [Hz].

    Returns:
        Velocity [m/s], shape (samples,).
    """
    samples = len(displacement)
    if samples < 2:
        return np.zeros(samples)
    half = max(2, round(SMOOTHING_WINDOW * rate / 2))
    window = min(2 * half + 1, samples - 1 + samples % 2)
    order = min(2, window - 1)
    if order < 1:
        return np.gradient(displacement, 1 / rate)
    slopes = _compute_slope_weights(window, order) * rate
    middle = window // 2
    return np.concatenate([
        slopes[:middle] @ displacement[:window],
        np.correlate(displacement, slopes[middle], "valid"),
        slopes[middle + 1 :] @ displacement[-window:],
    ])  # fmt: skip


@lru_cache
def _compute_slope_weights(window: int, order: int) -> npt.NDArray[np.float64]:
    """Compute the weights of the samples for the slope at each position of a window, shape (positions, samples).

    They are cached because live views need them ten times a second.
    """
    # Not of scipy.signal, which takes a second to load in every process that records.
    place, powers = np.arange(window) - window // 2, np.arange(1, order + 1)
    fit = np.linalg.pinv(np.vander(place, order + 1, increasing=True).astype(np.float64))
    return np.asarray((powers * place[:, np.newaxis] ** (powers - 1)) @ fit[1:], dtype=np.float64)
