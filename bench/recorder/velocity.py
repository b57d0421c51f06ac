"""Velocity for viewers, from displacement alone.

A parabola is fitted to each 20 ms of displacement (Savitzky-Golay) and its slope at the middle is the
velocity: no phase lag, noise down by an order of magnitude. It is for the eye; an identification makes its own
derivatives from the displacement.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_coeffs

WINDOW = 0.020
"""[s] of displacement behind each velocity; five samples where the rate is too low for that."""


def smooth_velocity(displacement: npt.NDArray[np.float64], rate: float) -> npt.NDArray[np.float64]:
    """Velocity of a smoothed displacement.

    Args:
        displacement: [m], shape (samples,), uniformly sampled.
        rate: [Hz].

    Returns:
        [m/s], shape (samples,).
    """
    samples = len(displacement)
    if samples < 2:
        return np.zeros(samples)
    half = max(2, round(WINDOW * rate / 2))
    window = min(2 * half + 1, samples - 1 + samples % 2)
    order = min(2, window - 1)
    if order < 1:
        return np.gradient(displacement, 1 / rate)
    slopes = _slopes(window, order) * rate
    middle = window // 2
    return np.concatenate([
        slopes[:middle] @ displacement[:window],
        np.correlate(displacement, slopes[middle], "valid"),
        slopes[middle + 1 :] @ displacement[-window:],
    ])  # fmt: skip


@lru_cache
def _slopes(window: int, order: int) -> npt.NDArray[np.float64]:
    """Slope at each place of a window by its samples: (places, samples). A live view asks ten times a second."""
    places = [savgol_coeffs(window, order, deriv=1, pos=place, use="dot") for place in range(window)]
    return np.asarray(places, dtype=np.float64)
